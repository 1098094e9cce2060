//! The page round a picture of the box: title, axes, colour bar, closed faces.

use super::axis::rounded_range;
use super::canvas::{Align, Canvas, Pencil};
use super::colour::{INK, WALL};
use super::plane::Plane;
use super::scales::{Axes, unit_prefix};
use super::scene::Scene;
use super::text::{Span, roman, width};

/// Height of the picture in pixels unless it is very wide.
const PANEL: f64 = 1000.0;
/// Largest width of the picture in pixels.
const WIDEST: f64 = 2200.0;
pub(super) const TOP: u32 = 90;
const BOTTOM: u32 = 110;
/// Smallest height of a page in pixels.
const LOWEST: u32 = 900;
const TITLE: f32 = 30.0;
/// Width of the line that stands for a closed face of the box, in pixels.
const CLOSED: f32 = 10.0;

/// How large a picture of the box is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    /// Width and height in pixels.
    pub(super) pixels: (u32, u32),
    /// Pixels per metre.
    pub(super) scale: f64,
}

impl Panel {
    pub(super) fn of(plane: &Plane) -> Self {
        let scale = (PANEL / plane.size.1).min(WIDEST / plane.size.0);
        Self {
            pixels: (
                (plane.size.0 * scale).round().max(1.0) as u32,
                (plane.size.1 * scale).round().max(1.0) as u32,
            ),
            scale,
        }
    }
}

/// The colours of speeds.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedScale {
    /// Prefix of m/s in the numbers, and the factor to it.
    prefix: (&'static str, f64),
    /// Number at the upper end.
    top: f64,
}

impl SpeedScale {
    /// From zero to a round number above `largest` (m/s).
    pub(super) fn up_to(largest: f64) -> Self {
        let prefix = unit_prefix(largest);
        // A fluid at rest but for rounding gets a scale on which that vanishes.
        let top = if largest > 1e-9 && largest.is_finite() {
            rounded_range(0.0, largest * prefix.1, 10.0).1
        } else {
            1.0
        };
        Self { prefix, top }
    }

    /// Where a speed (m/s) lies between both ends, 0 to 1 and beyond.
    pub(super) fn part(&self, speed: f64) -> f64 {
        speed * self.prefix.1 / self.top
    }
}

/// The page with a finished picture on it; `what` says what it shows, and `speed` whose speed.
pub(super) fn page(
    scene: &Scene,
    plane: &Plane,
    panel: &Canvas,
    scale: SpeedScale,
    what: &[Span],
    speed: &[Span],
) -> Canvas {
    let diameter = scene.templates.first().map(|t| t.shape.equivalent_diameter());
    let pixels = (panel.width(), panel.height());
    let axes = Axes::new(diameter, plane, pixels, scale.top);
    let time = scene.clock.text();
    let mut right_title = what.to_vec();
    right_title.push(roman("     "));
    right_title.extend(scene.clock.spans(&time));
    let title = [roman(scene.case)];
    let title_width = width(&title, TITLE) + width(&right_title, TITLE) + 2.0 * TITLE;
    let (left, right) = axes.margins();
    let size = (
        left + right + pixels.0.max(title_width as u32),
        (TOP + pixels.1 + BOTTOM).max(LOWEST),
    );
    let mut canvas = Canvas::new(size.0, size.1);
    let corner = (
        left + (size.0 - left - right - pixels.0) / 2,
        TOP + (size.1 - TOP - BOTTOM - pixels.1) / 2,
    );
    canvas.paste(panel, corner.0, corner.1);
    let (l, t) = (corner.0 as f32, corner.1 as f32);
    let area = (l, t, l + pixels.0 as f32, t + pixels.1 as f32);
    draw_closed_faces(&mut canvas, scene, plane, area);
    canvas.frame(area, Pencil::new(INK, 2.0));

    let inset = 0.5 * (title_width - pixels.0 as f32).max(0.0);
    canvas.text(&title, TITLE, (l - inset, t - 26.0), Align::Start, INK);
    let place = (area.2 + inset, t - 26.0);
    canvas.text(&right_title, TITLE, place, Align::End, INK);
    axes.draw_axes(&mut canvas, plane, area);
    axes.draw_bar(&mut canvas, area, scale.prefix.0, speed);
    canvas
}

/// Thick lines outside of the faces that are not periodic.
fn draw_closed_faces(canvas: &mut Canvas, scene: &Scene, plane: &Plane, (l, t, r, b): (f32, f32, f32, f32)) {
    let periodic = scene.plane.domain.periodic;
    if !periodic[plane.across] {
        for (from, to) in [(l - CLOSED, l), (r, r + CLOSED)] {
            canvas.rectangle((from, t, to, b), WALL, 1.0);
        }
    }
    if !periodic[plane.up] {
        // Corners belong to a line only where both faces are closed.
        let more = if periodic[plane.across] { 0.0 } else { CLOSED };
        for (from, to) in [(t - CLOSED, t), (b, b + CLOSED)] {
            canvas.rectangle((l - more, from, r + more, to), WALL, 1.0);
        }
    }
}
