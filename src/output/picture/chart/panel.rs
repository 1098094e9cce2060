//! One panel: axes, curves, markers.

use super::layout::{Area, Layout, NUMBER, PANEL_TITLE};
use super::looks::{Look, Looks, RADIUS, draw_marker};
use super::{Chart, ChartPoint, ChartSeries, ChartStyle};
use crate::output::picture::canvas::{Align, Pencil};
use crate::output::picture::colour::{GREY, GRID, INK};
use crate::output::picture::drawing::Drawing;
use crate::output::picture::markup::spans;
use crate::output::picture::plot_axis::Tick;
use crate::output::picture::text::width;

const TICK: f32 = 10.0;
/// Points closer to the last one than this are not drawn (pixels).
const RESOLUTION: f32 = 0.25;
/// Half the width of the end of an error bar.
const CAP: f32 = 7.0;

/// Draws the panel at `place` of the chart.
pub(super) fn draw(drawing: &mut Drawing, chart: &Chart, layout: &Layout, place: usize, looks: &Looks) {
    let area = layout.panels[place];
    draw_axes(drawing, layout, place);
    let Some(panel) = chart.panels.get(place) else {
        no_data(drawing, area);
        return;
    };
    let there = |series: &ChartSeries| series.points.iter().any(|p| layout.at(area, p.x, p.y).is_some());
    if !panel.series.iter().any(there) {
        no_data(drawing, area);
    }
    // Laws below, then what joins measured points, then the points.
    let is_law = |series: &&ChartSeries| matches!(series.style, ChartStyle::Line | ChartStyle::Dashed);
    let laws = panel.series.iter().filter(is_law);
    let measured = panel.series.iter().filter(|series| !is_law(series));
    for series in laws.chain(measured.clone()) {
        draw_line(drawing, layout, area, series, looks.find(series));
    }
    drawing.frame(area, Pencil::new(INK, 2.0));
    // Filled markers first: open ones let them be seen.
    for style in [ChartStyle::Measured, ChartStyle::Points] {
        for series in measured.clone().filter(|series| series.style == style) {
            draw_points(drawing, layout, area, series, looks.find(series));
        }
    }
    let letter = match chart.panels.len() {
        1 => String::new(),
        _ => format!("({}) ", char::from(b'a' + (place % 26) as u8)),
    };
    let title = spans(&format!("{letter}{}", panel.title));
    let at = (area.0, area.1 - 0.5 * PANEL_TITLE);
    drawing.text(title, PANEL_TITLE, at, Align::Start, INK);
}

fn no_data(drawing: &mut Drawing, area: Area) {
    let (l, t, r, b) = area;
    drawing.frame(area, Pencil::new(INK, 2.0));
    let at = (0.5 * (l + r), 0.5 * (t + b));
    drawing.text(spans("no data"), PANEL_TITLE, at, Align::Middle, GREY);
}

fn draw_axes(drawing: &mut Drawing, layout: &Layout, place: usize) {
    let (l, t, r, b) = layout.panels[place];
    let ink = Pencil::new(INK, 2.0);
    let grid = Pencil::new(GRID, 1.5);
    let length = |tick: &Tick| if tick.is_major() { TICK } else { 0.6 * TICK };
    // Where the last number ended.
    let mut used = f32::NEG_INFINITY;
    for tick in &layout.x.ticks {
        let at = l + tick.part * (r - l);
        if tick.is_major() {
            drawing.polyline(vec![(at, t), (at, b)], grid);
        }
        drawing.polyline(vec![(at, b + 2.0), (at, b + 2.0 + length(tick))], ink);
        let half = 0.5 * width(&tick.spans(), NUMBER);
        if tick.is_major() && at - half > used + 12.0 {
            drawing.text(tick.spans(), NUMBER, (at, b + 40.0), Align::Middle, INK);
            used = at + half;
        }
    }
    let mut used = f32::INFINITY;
    for tick in &layout.y.ticks {
        let at = b - tick.part * (b - t);
        if tick.is_major() {
            drawing.polyline(vec![(l, at), (r, at)], grid);
        }
        drawing.polyline(vec![(l - 2.0, at), (l - 2.0 - length(tick), at)], ink);
        if layout.is_leftmost(place) && tick.is_major() && at + NUMBER < used {
            let beside = (l - 20.0, at + 0.36 * NUMBER);
            drawing.text(tick.spans(), NUMBER, beside, Align::End, INK);
            used = at;
        }
    }
    if let Some(zero) = layout.y.zero() {
        let at = b - zero * (b - t);
        drawing.polyline(vec![(l, at), (r, at)], Pencil::new(GREY, 1.5));
    }
    if let Some(zero) = layout.x.zero() {
        let at = l + zero * (r - l);
        drawing.polyline(vec![(at, t), (at, b)], Pencil::new(GREY, 1.5));
    }
}

fn draw_line(drawing: &mut Drawing, layout: &Layout, area: Area, series: &ChartSeries, look: Look) {
    let Some(pencil) = look.pencil else { return };
    // Measured points of several runs at one place, or in no order, are not joined.
    let ascends = series.points.windows(2).all(|pair| pair[0].x < pair[1].x);
    if look.marker.is_some() && !ascends {
        return;
    }
    let mut run: Vec<(f32, f32)> = Vec::new();
    // A point that is nowhere interrupts the line; the one behind the end ends it.
    let places = series.points.iter().map(|p| layout.at(area, p.x, p.y));
    for place in places.chain([None]) {
        match (place, run.last()) {
            (Some((x, y)), Some(last)) if (x - last.0).abs().max((y - last.1).abs()) < RESOLUTION => {}
            (Some(place), _) => run.push(place),
            (None, _) => drawing.polyline(std::mem::take(&mut run), pencil),
        }
    }
}

fn draw_points(drawing: &mut Drawing, layout: &Layout, area: Area, series: &ChartSeries, look: Look) {
    if look.marker.is_none() {
        // A curve of one point would not be seen.
        return;
    }
    for point in &series.points {
        draw_error(drawing, layout, area, point, look);
    }
    for place in (series.points.iter()).filter_map(|p| layout.at(area, p.x, p.y)) {
        draw_marker(drawing, look, place);
    }
}

fn draw_error(drawing: &mut Drawing, layout: &Layout, area: Area, point: &ChartPoint, look: Look) {
    let Some(error) = point.error.filter(|error| *error > 0.0 && error.is_finite()) else {
        return;
    };
    let Some((x, y)) = layout.at(area, point.x, point.y) else {
        return;
    };
    let end = |value: f64| layout.at(area, point.x, value).map(|place| place.1);
    // On a logarithmic axis an error as large as its value reaches down to the frame.
    let (low, high) = (end(point.y - error), end(point.y + error).unwrap_or(y));
    // What is within the marker would only blur it.
    if [low, Some(high)]
        .iter()
        .flatten()
        .all(|end| (end - y).abs() < RADIUS)
        && low.is_some()
    {
        return;
    }
    let pencil = Pencil::new(look.colour, 2.2);
    drawing.polyline(vec![(x, low.unwrap_or(area.3)), (x, high)], pencil);
    for at in [low, Some(high)].into_iter().flatten() {
        drawing.polyline(vec![(x - CAP, at), (x + CAP, at)], pencil);
    }
}
