//! One panel: axes, curves, markers.

use super::layout::{Layout, NUMBER, PANEL_TITLE};
use super::looks::{Look, Looks, RADIUS, draw_marker};
use super::{Chart, Mark, Panel, Point, Series, Style, labels};
use crate::colour::{GREY, GRID, INK, VERMILION};
use crate::drawing::{Align, Area, Drawing, Pencil, Place};
use crate::markup::spans;
use crate::scale::Tick;
use crate::text::width;

const TICK: f32 = 10.0;
/// Points closer to the last one than this are not drawn (pixels).
const RESOLUTION: f32 = 0.25;
/// Half the width of the end of an error bar.
const CAP: f32 = 7.0;

/// The order in which lines are drawn, and that of markers: filled ones first, as open ones let them be seen.
const ORDER: [Style; 6] = [
    Style::Reference,
    Style::Line,
    Style::Dashed,
    Style::Measured,
    Style::Points,
    Style::Overlaid,
];

/// Draws a panel of the chart.
pub(super) fn draw(drawing: &mut Drawing, chart: &Chart, layout: &Layout, index: usize, looks: &Looks) {
    let area = layout.panels[index];
    draw_axes(drawing, layout, index);
    let none = Panel::default();
    let panel = chart.panels.get(index).unwrap_or(&none);
    draw_marks(drawing, layout, area, panel);
    let ordered = || {
        ORDER
            .iter()
            .flat_map(|style| panel.series.iter().filter(move |s| s.style == *style))
    };
    for series in ordered() {
        draw_line(drawing, layout, area, series, looks.find(series));
    }
    drawing.frame(area, Pencil::new(INK, 2.0));
    for series in ordered() {
        draw_points(drawing, layout, area, series, looks.find(series));
    }
    labels::draw(drawing, layout, area, panel);
    let mut points = panel.series.iter().flat_map(|series| &series.points);
    if panel.marks.is_empty() && !points.any(|p| layout.at(area, p.x, p.y).is_some()) {
        let at = (0.5 * (area.0 + area.2), 0.5 * (area.1 + area.3));
        drawing.text(spans("no data"), PANEL_TITLE, at, Align::Middle, GREY);
    }
    let letter = match chart.panels.len() {
        0 | 1 => String::new(),
        _ => format!("({}) ", char::from(b'a' + (index % 26) as u8)),
    };
    let title = spans(&format!("{letter}{}", panel.title));
    let at = (area.0, area.1 - 0.5 * PANEL_TITLE);
    drawing.text(title, PANEL_TITLE, at, Align::Start, INK);
}

fn draw_axes(drawing: &mut Drawing, layout: &Layout, index: usize) {
    let (l, t, r, b) = layout.panels[index];
    let ink = Pencil::new(INK, 2.0);
    let grid = Pencil::new(GRID, 1.5);
    let length = |tick: &Tick| if tick.is_major() { TICK } else { 0.6 * TICK };
    // End of the last number.
    let mut used = f32::NEG_INFINITY;
    for tick in &layout.x.ticks {
        let at = l + tick.part * (r - l);
        if tick.is_major() {
            drawing.line(vec![(at, t), (at, b)], grid);
        }
        drawing.line(vec![(at, b + 2.0), (at, b + 2.0 + length(tick))], ink);
        let half = 0.5 * width(&tick.text, NUMBER);
        if tick.is_major() && at - half > used + 12.0 {
            drawing.text(tick.text.clone(), NUMBER, (at, b + 40.0), Align::Middle, INK);
            used = at + half;
        }
    }
    let mut used = f32::INFINITY;
    for tick in &layout.y.ticks {
        let at = b - tick.part * (b - t);
        if tick.is_major() {
            drawing.line(vec![(l, at), (r, at)], grid);
        }
        drawing.line(vec![(l - 2.0, at), (l - 2.0 - length(tick), at)], ink);
        if layout.is_leftmost(index) && tick.is_major() && at + NUMBER < used {
            let beside = (l - 20.0, at + 0.36 * NUMBER);
            drawing.text(tick.text.clone(), NUMBER, beside, Align::End, INK);
            used = at;
        }
    }
    if let Some(zero) = layout.y.zero() {
        let at = b - zero * (b - t);
        drawing.line(vec![(l, at), (r, at)], Pencil::new(GREY, 1.5));
    }
    if let Some(zero) = layout.x.zero() {
        let at = l + zero * (r - l);
        drawing.line(vec![(at, t), (at, b)], Pencil::new(GREY, 1.5));
    }
}

fn draw_marks(drawing: &mut Drawing, layout: &Layout, (l, t, r, b): Area, panel: &Panel) {
    let across = |x: f64| Some(l + layout.x.part(x)?.clamp(0.0, 1.0) * (r - l));
    let down = |y: f64| Some(b - layout.y.part(y)? * (b - t));
    for mark in &panel.marks {
        match mark {
            Mark::Interval(ends) => {
                if let [Some(from), Some(to)] = ends.map(across) {
                    drawing.rectangle((from, t, to, b), VERMILION, 0.05);
                }
            }
            Mark::Event { label, at } => {
                let Some(x) = across(*at) else { continue };
                drawing.line(vec![(x, t), (x, b)], Pencil::new(INK, 2.0).dashed());
                let text = spans(label);
                // Right of the line if there is space.
                let (x, align) = if x + 24.0 + width(&text, NUMBER) < r {
                    (x + 12.0, Align::Start)
                } else {
                    (x - 12.0, Align::End)
                };
                drawing.text(text, NUMBER, (x, b - 18.0), align, INK);
            }
            Mark::Level {
                value,
                error,
                between,
                dashed,
                colour,
                ..
            } => {
                let [from, to] = between.map_or([Some(l), Some(r)], |ends| ends.map(across));
                let (Some(from), Some(to), Some(y)) = (from, to, down(*value)) else {
                    continue;
                };
                let band = error.and_then(|error| Some((down(value + error)?, down(value - error)?)));
                if let Some((top, bottom)) = band {
                    drawing.rectangle((from, top.max(t), to, bottom.min(b)), *colour, 0.25);
                }
                let pencil = Pencil::new(*colour, if *dashed { 2.5 } else { 3.0 });
                let pencil = if *dashed { pencil.dashed() } else { pencil };
                drawing.line(vec![(from, y), (to, y)], pencil);
            }
        }
    }
}

fn draw_line(drawing: &mut Drawing, layout: &Layout, area: Area, series: &Series, look: Look) {
    let Some(pencil) = look.pencil else { return };
    // Measured points of several runs at one place, or in no order, are not joined.
    let ascends = series.points.windows(2).all(|pair| pair[0].x < pair[1].x);
    if look.marker.is_some() && !ascends {
        return;
    }
    let mut run: Vec<Place> = Vec::new();
    // A point without a position interrupts the line; the one behind the end ends it.
    let places = series.points.iter().map(|p| layout.at(area, p.x, p.y));
    for place in places.chain([None]) {
        match (place, run.last()) {
            (Some((x, y)), Some(last)) if (x - last.0).abs().max((y - last.1).abs()) < RESOLUTION => {}
            (Some(place), _) => run.push(place),
            (None, _) => drawing.line(std::mem::take(&mut run), pencil),
        }
    }
}

fn draw_points(drawing: &mut Drawing, layout: &Layout, area: Area, series: &Series, look: Look) {
    if look.marker.is_none() {
        return;
    }
    for point in &series.points {
        draw_error(drawing, layout, area, point, look);
    }
    for place in (series.points.iter()).filter_map(|p| layout.at(area, p.x, p.y)) {
        draw_marker(drawing, look, place);
    }
}

fn draw_error(drawing: &mut Drawing, layout: &Layout, area: Area, point: &Point, look: Look) {
    let Some(error) = point.error.filter(|error| *error > 0.0 && error.is_finite()) else {
        return;
    };
    let Some((x, y)) = layout.at(area, point.x, point.y) else {
        return;
    };
    let end = |value: f64| layout.at(area, point.x, value).map(|place| place.1);
    // On a logarithmic axis an error as large as its value reaches down to the frame.
    let (low, high) = (end(point.y - error), end(point.y + error).unwrap_or(y));
    // A bar within the marker would only blur it.
    if low.is_some_and(|low| (low - y).abs() < RADIUS && (high - y).abs() < RADIUS) {
        return;
    }
    let pencil = Pencil::new(look.colour, 2.2);
    drawing.line(vec![(x, low.unwrap_or(area.3)), (x, high)], pencil);
    for at in [low, Some(high)].into_iter().flatten() {
        drawing.line(vec![(x - CAP, at), (x + CAP, at)], pencil);
    }
}
