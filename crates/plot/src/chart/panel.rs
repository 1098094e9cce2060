//! One panel: axes, curves, markers, and the labels of its levels beside the frame.

use super::layout::{Layout, NUMBER, PANEL_TITLE};
use super::looks::{Look, Looks, RADIUS, draw_marker};
use super::{Chart, Mark, Panel, Series};
use crate::colour::{GREY, GRID, INK, VERMILION};
use crate::drawing::{Align, Area, DASHES, Drawing, Position, Stroke};
use crate::scale::Side;
use crate::text::{widest, width};

/// Points closer to the last one than this are not drawn (pixels).
const RESOLUTION: f32 = 0.25;
/// Half the width of the end of an error bar.
const CAP: f32 = 7.0;

/// Height of a line of the labels.
const LABEL_STEP: f32 = 32.0;
/// Space between two labels.
const LABEL_GAP: f32 = 10.0;
/// Space between the frame and the labels, for the leaders.
const LEADER: f32 = 36.0;

pub(super) fn draw(drawing: &mut Drawing, chart: &Chart, layout: &Layout, index: usize, looks: &Looks) {
    let (area, none) = (layout.panels[index], Panel::default());
    let panel = chart.panels.get(index).unwrap_or(&none);
    draw_axes(drawing, layout, index);
    draw_marks(drawing, layout, area, panel);
    let mut ordered: Vec<&Series> = panel.series.iter().collect();
    ordered.sort_by_key(|series| series.style);
    for series in &ordered {
        draw_line(drawing, layout, area, series, looks.find(series));
    }
    drawing.frame(area, Stroke::new(INK, 2.0));
    for series in &ordered {
        draw_points(drawing, layout, area, series, looks.find(series));
    }
    draw_labels(drawing, layout, area, panel);
    let mut points = panel.series.iter().flat_map(|series| &series.points);
    if panel.marks.is_empty() && !points.any(|p| layout.at(area, p.x, p.y).is_some()) {
        let at = (0.5 * (area.0 + area.2), 0.5 * (area.1 + area.3));
        drawing.text("no data", PANEL_TITLE, at, Align::Middle, GREY);
    }
    let letter = match chart.panels.len() {
        0 | 1 => String::new(),
        _ => format!("({}) ", char::from(b'a' + (index % 26) as u8)),
    };
    let title = format!("{letter}{}", panel.title);
    let at = (area.0, area.1 - 0.5 * PANEL_TITLE);
    drawing.text(&title, PANEL_TITLE, at, Align::Start, INK);
}

/// Grid, ticks and lines at zero.
fn draw_axes(drawing: &mut Drawing, layout: &Layout, index: usize) {
    let area @ (l, t, r, b) = layout.panels[index];
    let across = |part: f32| [(l, b - part * (b - t)), (r, b - part * (b - t))];
    let up = |part: f32| [(l + part * (r - l), t), (l + part * (r - l), b)];
    let grid =
        layout.x.major().map(|tick| up(tick.part)).chain(layout.y.major().map(|tick| across(tick.part)));
    for line in grid {
        drawing.line(&line, Stroke::new(GRID, 1.5));
    }
    layout.x.draw(drawing, Side::Below, area, NUMBER);
    let numbers = if layout.is_leftmost(index) { NUMBER } else { 0.0 };
    layout.y.draw(drawing, Side::Left, area, numbers);
    let zeros = [layout.y.zero().map(across), layout.x.zero().map(up)];
    for line in zeros.into_iter().flatten() {
        drawing.line(&line, Stroke::new(GREY, 1.5));
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
                let dashed = Stroke { dashes: DASHES, ..Stroke::new(INK, 2.0) };
                drawing.line(&[(x, t), (x, b)], dashed);
                // Right of the line if there is space.
                let (x, align) = if x + 24.0 + width(label, NUMBER) < r {
                    (x + 12.0, Align::Start)
                } else {
                    (x - 12.0, Align::End)
                };
                drawing.text(label, NUMBER, (x, b - 18.0), align, INK);
            }
            Mark::Level { value, error, between, dashed, colour, .. } => {
                let [from, to] = between.map_or([Some(l), Some(r)], |ends| ends.map(across));
                let (Some(from), Some(to), Some(y)) = (from, to, down(*value)) else {
                    continue;
                };
                let band = error.and_then(|error| Some((down(value + error)?, down(value - error)?)));
                if let Some((top, bottom)) = band {
                    drawing.rectangle((from, top.max(t), to, bottom.min(b)), *colour, 0.25);
                }
                let dashes = if *dashed { DASHES } else { &[] };
                drawing.line(&[(from, y), (to, y)], Stroke { dashes, ..Stroke::new(*colour, 2.5) });
            }
        }
    }
}

fn draw_line(drawing: &mut Drawing, layout: &Layout, area: Area, series: &Series, look: Look) {
    let Some(stroke) = look.stroke else { return };
    // Measured points of several runs at one place, or in no order, are not joined.
    let ascends = series.points.windows(2).all(|pair| pair[0].x < pair[1].x);
    if look.marker.is_some() && !ascends {
        return;
    }
    let mut run: Vec<Position> = Vec::new();
    // A point without a position interrupts the line; the one after the last ends it.
    let places = series.points.iter().map(|p| layout.at(area, p.x, p.y));
    for place in places.chain([None]) {
        match (place, run.last()) {
            (Some((x, y)), Some(last)) if (x - last.0).abs().max((y - last.1).abs()) < RESOLUTION => {}
            (Some(place), _) => run.push(place),
            (None, _) => {
                drawing.line(&run, stroke);
                run.clear();
            }
        }
    }
}

/// Error bars, and markers over them.
fn draw_points(drawing: &mut Drawing, layout: &Layout, area: Area, series: &Series, look: Look) {
    if look.marker.is_none() {
        return;
    }
    let stroke = Stroke::new(look.colour, 2.2);
    for point in &series.points {
        let error = point.error.filter(|error| *error > 0.0 && error.is_finite());
        let (Some(error), Some((x, y))) = (error, layout.at(area, point.x, point.y)) else { continue };
        let end = |value: f64| layout.at(area, point.x, value).map(|position| position.1);
        // On a logarithmic axis an error as large as its value reaches down to the frame.
        let (low, high) = (end(point.y - error), end(point.y + error).unwrap_or(y));
        // A bar within the marker would only blur it.
        if low.is_some_and(|low| (low - y).abs() < RADIUS && (high - y).abs() < RADIUS) {
            continue;
        }
        drawing.line(&[(x, low.unwrap_or(area.3)), (x, high)], stroke);
        for at in [low, Some(high)].into_iter().flatten() {
            drawing.line(&[(x - CAP, at), (x + CAP, at)], stroke);
        }
    }
    for position in series.points.iter().filter_map(|point| layout.at(area, point.x, point.y)) {
        draw_marker(drawing, look, position);
    }
}

/// Space that the labels of a chart take right of its frame.
pub(super) fn label_margin(chart: &Chart) -> f32 {
    let names = chart.panels.iter().flat_map(levels).flat_map(|level| level.0.lines());
    match widest(names, NUMBER) {
        0.0 => 0.0,
        width => LEADER + width,
    }
}

/// Name, value and colour of the levels of a panel.
fn levels(panel: &Panel) -> impl Iterator<Item = (&str, f64, [u8; 3])> {
    panel.marks.iter().filter_map(|mark| match mark {
        Mark::Level { label, value, colour, .. } => Some((&**label, *value, *colour)),
        _ => None,
    })
}

/// Draws the labels of a panel, pushed apart where they would overlap, each with a leader to its line.
fn draw_labels(drawing: &mut Drawing, layout: &Layout, (_, t, r, b): Area, panel: &Panel) {
    let mut labels: Vec<(f32, f32, &str, [u8; 3])> = levels(panel)
        .filter_map(|(label, value, colour)| {
            let height = label.lines().count() as f32 * LABEL_STEP;
            Some((b - layout.y.part(value)? * (b - t), height, label, colour))
        })
        .collect();
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted: Vec<_> = labels.iter().map(|&(y, height, ..)| (y - 0.5 * height, height)).collect();
    let tops = spread(&wanted, LABEL_GAP, (t - 20.0, b + 60.0));
    for (top, (y, height, label, colour)) in tops.into_iter().zip(labels) {
        let leader = [(r + 3.0, y), (r + 12.0, y), (r + LEADER - 8.0, top + 0.5 * height)];
        drawing.line(&leader, Stroke::new(colour, 2.0));
        for (i, line) in label.lines().enumerate() {
            let at = (r + LEADER, top + (i as f32 + 0.72) * LABEL_STEP);
            drawing.text(line, NUMBER, at, Align::Start, colour);
        }
    }
}

/// Moves intervals of given first places and lengths, in ascending order, as little as possible so that none
/// overlap: least squares under an order, solved by pooling neighbours that are in conflict.
fn spread(wanted: &[(f32, f32)], gap: f32, (lo, hi): (f32, f32)) -> Vec<f32> {
    // Without their lengths the intervals are points that may coincide but not change order.
    let mut used = 0.0;
    let mut offsets = Vec::new();
    let mut pools: Vec<(f32, usize)> = Vec::new();
    for &(place, length) in wanted {
        offsets.push(used);
        let mut pool = (place - used, 1);
        used += length + gap;
        while let Some(&(mean, count)) = pools.last().filter(|last| last.0 > pool.0) {
            pools.pop();
            let total = count + pool.1;
            pool = ((mean * count as f32 + pool.0 * pool.1 as f32) / total as f32, total);
        }
        pools.push(pool);
    }
    let places = pools.iter().flat_map(|&(place, count)| vec![place.min(hi - used + gap).max(lo); count]);
    places.zip(offsets).map(|(place, offset)| place + offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_that_would_overlap_move_apart_evenly_and_others_stay() {
        assert_eq!(spread(&[(10.0, 20.0), (100.0, 20.0)], 5.0, (0.0, 200.0)), [10.0, 100.0]);
        assert_eq!(
            spread(&[(50.0, 20.0), (55.0, 20.0), (150.0, 20.0)], 5.0, (0.0, 200.0)),
            [40.0, 65.0, 150.0]
        );
        assert_eq!(spread(&[(190.0, 20.0), (195.0, 20.0)], 0.0, (0.0, 200.0)), [160.0, 180.0]);
        assert!(spread(&[], 5.0, (0.0, 1.0)).is_empty());
    }
}
