//! Names of levels beside the right edge of the frame, without overlap.

use super::layout::{Layout, NUMBER};
use super::{Chart, Mark, Panel};
use crate::drawing::{Align, Area, Drawing, Stroke};
use crate::text::widest;

/// Height of a line of the labels.
const STEP: f32 = 32.0;
/// Space between two labels.
const GAP: f32 = 10.0;
/// Space between the frame and the labels, for the leaders.
const LEADER: f32 = 36.0;

/// Space that the labels of a chart take right of its frame.
pub(super) fn margin(chart: &Chart) -> f32 {
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
pub(super) fn draw(drawing: &mut Drawing, layout: &Layout, (_, t, r, b): Area, panel: &Panel) {
    let mut labels: Vec<(f32, f32, &str, [u8; 3])> = levels(panel)
        .filter_map(|(label, value, colour)| {
            let height = label.lines().count() as f32 * STEP;
            Some((b - layout.y.part(value)? * (b - t), height, label, colour))
        })
        .collect();
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted: Vec<_> = labels.iter().map(|&(y, height, ..)| (y - 0.5 * height, height)).collect();
    let tops = spread(&wanted, GAP, (t - 20.0, b + 60.0));
    for (top, (y, height, label, colour)) in tops.into_iter().zip(labels) {
        let leader = [(r + 3.0, y), (r + 12.0, y), (r + LEADER - 8.0, top + 0.5 * height)];
        drawing.line(&leader, Stroke::new(colour, 2.0));
        for (i, line) in label.lines().enumerate() {
            let at = (r + LEADER, top + (i as f32 + 0.72) * STEP);
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
