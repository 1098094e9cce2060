//! Appearance of series: colours, dashes, markers; and the legend, a grid of names above the panels.

use super::layout::{MARGIN, grid};
use super::{Chart, Panel, Series, Style};
use crate::colour::{BLUE, INK, VERMILION};
use crate::drawing::{Align, Colour, DASHES, Drawing, Position, Stroke};
use crate::text::{widest, wrapped};
use std::f32::consts::{PI, TAU};

/// Series with more points are lines without markers.
pub(super) const MARKED: usize = 60;
/// Radius of a marker (pixels).
pub(super) const RADIUS: f32 = 9.5;

/// Colours that colour-blind readers tell apart (after Okabe and Ito), neighbours of different lightness.
const COLOURS: [Colour; 8] =
    [BLUE, VERMILION, [0, 158, 115], INK, [204, 121, 167], [230, 159, 0], [86, 180, 233], [120, 80, 20]];
/// Tones of lines that belong to no colour.
const TONES: [Colour; 2] = [INK, [140, 140, 140]];
/// Pale tones of references below everything.
const PALE: [Colour; 3] = [[190, 205, 170], [200, 195, 215], [225, 205, 175]];
/// Dashes of laws that are lines, one after another.
const LINES: [&[f32]; 4] = [&[], &[8.0, 2.5, 1.5, 2.5], &[1.4, 2.2], &[14.0, 3.0]];
/// Dashes of laws that are dashed.
const DASHED: [&[f32]; 4] = [DASHES, &[2.5, 2.5], &[6.0, 2.5, 1.5, 2.5, 1.5, 2.5], &[9.0, 5.0]];

const SIZE: f32 = 25.0;
/// Height of a line.
const LINE: f32 = 40.0;
/// Length of the piece of curve before a name, and the space after it.
const SAMPLE: (f32, f32) = (76.0, 14.0);
/// Space between columns.
const GAP: f32 = 44.0;

const OUTLINES: usize = 8;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) style: Style,
    pub(super) colour: Colour,
    /// Number of the outline of its markers, if it has markers; after all outlines were used once, a dot is added.
    pub(super) marker: Option<usize>,
    pub(super) stroke: Option<Stroke>,
}

/// Appearance of the series of a chart, by style and name, in the order in which they first appear.
pub(super) struct Looks(Vec<(Style, String, Look)>);

/// A series that is drawn with markers if it has few points.
fn is_marked(style: Style) -> bool {
    matches!(style, Style::Measured | Style::Points | Style::Overlaid)
}

impl Looks {
    pub(super) fn of(panels: &[Panel]) -> Self {
        // Names in order of appearance, with the largest number of points.
        let mut names: Vec<(Style, &str, usize)> = Vec::new();
        for Series { style, label, points, .. } in panels.iter().flat_map(|panel| &panel.series) {
            match names.iter_mut().find(|name| (name.0, name.1) == (*style, label)) {
                Some(name) => name.2 = name.2.max(points.len()),
                None => names.push((*style, label, points.len())),
            }
        }
        let with = |style: Style| names.iter().filter(move |name| name.0 == style);
        let marked = names.iter().filter(|name| is_marked(name.0)).count();
        // As many laws as measured series belong to them one by one, if they are named after them.
        let is_paired = |style: Style| {
            let measured = || with(Style::Measured);
            let is_law = matches!(style, Style::Line | Style::Dashed);
            let has_own = |law: &(Style, &str, usize)| measured().any(|name| law.1.ends_with(name.1));
            is_law && marked > 1 && with(style).count() == measured().count() && with(style).all(has_own)
        };
        let mut colours = 0;
        let mut looks = Self(Vec::new());
        for &(style, label, points) in &names {
            let is_paired = is_paired(style);
            let index = looks.0.iter().filter(|known| known.0 == style).count();
            let look = looks.owner(style, label).unwrap_or_else(|| {
                let colour = if style == Style::Reference {
                    PALE[index % PALE.len()]
                } else if is_paired {
                    COLOURS[index % COLOURS.len()]
                } else if !is_marked(style) && marked > 0 {
                    TONES[index % TONES.len()]
                } else {
                    colours += 1;
                    // Outlines that come again have other colours.
                    let turn = (colours - 1) / COLOURS.len();
                    COLOURS[(colours - 1 + 3 * turn) % COLOURS.len()]
                };
                let dense = points > MARKED && style != Style::Points;
                let marker = (is_marked(style) && !dense).then(|| (colours - 1) % (2 * OUTLINES));
                let dashes = match style {
                    Style::Line if !is_paired => LINES[index % LINES.len()],
                    Style::Dashed if !is_paired => DASHED[index % DASHED.len()],
                    Style::Dashed | Style::Overlaid => DASHES,
                    _ => &[],
                };
                let stroke = match style {
                    Style::Reference => Some(Stroke::new(colour, 12.0)),
                    // Half way to white.
                    Style::Measured if !dense => Some(Stroke::new(colour.map(|c| c / 2 + 127), 2.0)),
                    _ if marker.is_some() => None,
                    _ => Some(Stroke { dashes, ..Stroke::new(colour, 3.0) }),
                };
                Look { style, colour, marker, stroke }
            });
            looks.0.push((style, label.to_string(), look));
        }
        looks
    }

    pub(super) fn find(&self, series: &Series) -> Look {
        let found = self.0.iter().find(|known| (known.0, &known.1) == (series.style, &series.label));
        found.expect("every series of the chart was looked at").2
    }

    /// The look of reference points that belong to a measured series, whose name theirs ends with: its colour, open markers.
    fn owner(&self, style: Style, label: &str) -> Option<Look> {
        let is_owner = |name: &str| label.strip_suffix(name).is_some_and(|rest| rest.ends_with(", "));
        let (.., look) = self.0.iter().find(|(of, name, _)| *of == Style::Measured && is_owner(name))?;
        (style == Style::Points).then_some(Look { style, stroke: None, ..*look })
    }
}

/// Draws the marker of a series, filled if it is a measured one.
pub(super) fn draw_marker(drawing: &mut Drawing, look: Look, at: Position) {
    let (Some(number), filled, white) = (look.marker, look.style == Style::Measured, [255; 3]) else {
        return;
    };
    // A white rim keeps markers apart that lie on each other.
    let (size, rim) = if filled { (RADIUS, 2.5) } else { (1.15 * RADIUS, 5.0) };
    let corners = outline(number % OUTLINES, at, size);
    drawing.outline(&corners, Stroke::new(white, rim));
    if filled {
        drawing.fill(&corners, look.colour, 1.0);
    } else {
        drawing.outline(&corners, Stroke::new(look.colour, 2.6));
    }
    if number >= OUTLINES {
        let colour = if filled { white } else { look.colour };
        drawing.fill(&outline(0, at, 0.36 * RADIUS), colour, 1.0);
    }
}

/// Corners of a marker.
fn outline(which: usize, (x, y): Position, size: f32) -> Vec<Position> {
    let turned = |(a, b): Position, angle: f32| {
        let (sine, cosine) = angle.sin_cos();
        (x + a * cosine - b * sine, y + a * sine + b * cosine)
    };
    let regular = |corners: usize, radius: f32, first: f32| -> Vec<Position> {
        let angles = (0..corners).map(|i| first + i as f32 * TAU / corners as f32);
        angles.map(|angle| turned((radius, 0.0), angle)).collect()
    };
    let crossed = |first: f32| -> Vec<Position> {
        let (long, short) = (1.25 * size, 0.45 * size);
        let arm = [(long, -short), (long, short), (short, short)];
        let quarters = (0..4).map(|quarter| first + 0.25 * TAU * quarter as f32);
        quarters.flat_map(|angle| arm.map(|corner| turned(corner, angle))).collect()
    };
    // Radii for areas that look alike.
    match which {
        0 => regular(28, size, 0.0),
        1 => regular(4, 1.3 * size, 0.25 * PI),
        2 => regular(3, 1.45 * size, -0.5 * PI),
        3 => regular(4, 1.35 * size, 0.0),
        4 => regular(3, 1.45 * size, 0.5 * PI),
        5 => crossed(0.25 * PI),
        6 => crossed(0.0),
        _ => regular(5, 1.2 * size, -0.5 * PI),
    }
}

/// Names beside pieces of their curves.
pub(super) struct Legend {
    entries: Vec<(Look, String)>,
    lines: usize,
    column_width: f32,
}

impl Legend {
    pub(super) fn new(chart: &Chart, looks: &Looks) -> Self {
        let space = grid(chart).1 - 2.0 * MARGIN;
        let named = looks.0.iter().filter(|(_, label, _)| !label.is_empty());
        let entries = named.map(|(_, label, look)| {
            // An ellipsis stands where a label was cut.
            let label = match &wrapped(label, SIZE, space - SAMPLE.0 - SAMPLE.1 - SIZE)[..] {
                [line, _, ..] => format!("{line}\u{2026}"),
                _ => label.clone(),
            };
            (*look, label)
        });
        let entries: Vec<(Look, String)> = entries.collect();
        let widest = widest(entries.iter().map(|(_, label)| &**label), SIZE);
        let column_width = SAMPLE.0 + SAMPLE.1 + widest + GAP;
        let columns = ((space + GAP) / column_width).floor().max(1.0) as usize;
        Self { lines: entries.len().div_ceil(columns), entries, column_width }
    }

    pub(super) fn height(&self) -> f32 {
        self.lines as f32 * LINE
    }

    /// Draws it below `top`, column by column.
    pub(super) fn draw(&self, drawing: &mut Drawing, top: f32) {
        for (i, (look, label)) in self.entries.iter().enumerate() {
            let (column, line) = (i / self.lines, i % self.lines);
            let x = MARGIN + column as f32 * self.column_width;
            let middle = top + (line as f32 + 0.5) * LINE;
            if let Some(stroke) = look.stroke {
                drawing.line(&[(x, middle), (x + SAMPLE.0, middle)], stroke);
            }
            draw_marker(drawing, *look, (x + 0.5 * SAMPLE.0, middle));
            let at = (x + SAMPLE.0 + SAMPLE.1, middle + 0.36 * SIZE);
            drawing.text(label, SIZE, at, Align::Start, INK);
        }
    }
}
