//! Labels beside the lines of a plot, without overlap.

use super::canvas::{Align, Pencil};
use super::drawing::Drawing;
use super::text::roman;

/// Height of a line of the labels at the right.
const LABEL_STEP: f32 = 32.0;
/// Space between two of these labels.
const LABEL_GAP: f32 = 10.0;

/// A label at the right of the frame.
pub(super) struct SideLabel {
    pub(super) value: f64,
    pub(super) lines: Vec<String>,
    pub(super) colour: [u8; 3],
}

/// Draws labels right of `right`, pushed apart where they would overlap, each with a leader to its line.
///
/// `size` is that of the text, `height_of` gives the place of a value from the top; labels are sorted from the top.
pub(super) fn draw_labels(
    drawing: &mut Drawing,
    labels: &[SideLabel],
    (right, size): (f32, f32),
    within: (f32, f32),
    height_of: impl Fn(f64) -> f32,
) {
    let height = |label: &SideLabel| label.lines.len() as f32 * LABEL_STEP;
    let wanted: Vec<(f32, f32)> = labels
        .iter()
        .map(|label| (height_of(label.value) - 0.5 * height(label), height(label)))
        .collect();
    let places = spread(&wanted, LABEL_GAP, within);
    for (top, label) in places.into_iter().zip(labels) {
        let y = height_of(label.value);
        let middle = top + 0.5 * height(label);
        let leader = [(right + 3.0, y), (right + 12.0, y), (right + 28.0, middle)];
        drawing.polyline(leader.to_vec(), Pencil::new(label.colour, 2.0));
        for (i, line) in label.lines.iter().enumerate() {
            let baseline = top + (i as f32 + 0.72) * LABEL_STEP;
            let place = (right + 36.0, baseline);
            drawing.text(vec![roman(line.clone())], size, place, Align::Start, label.colour);
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
            pool = (
                (mean * count as f32 + pool.0 * pool.1 as f32) / total as f32,
                total,
            );
        }
        pools.push(pool);
    }
    pools
        .iter()
        .flat_map(|&(place, count)| std::iter::repeat_n(place.min(hi - used + gap).max(lo), count))
        .zip(offsets)
        .map(|(place, offset)| place + offset)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_that_would_overlap_move_apart_evenly_and_others_stay() {
        assert_eq!(
            spread(&[(10.0, 20.0), (100.0, 20.0)], 5.0, (0.0, 200.0)),
            [10.0, 100.0]
        );
        assert_eq!(
            spread(&[(50.0, 20.0), (55.0, 20.0), (150.0, 20.0)], 5.0, (0.0, 200.0)),
            [40.0, 65.0, 150.0]
        );
        assert_eq!(
            spread(&[(190.0, 20.0), (195.0, 20.0)], 0.0, (0.0, 200.0)),
            [160.0, 180.0]
        );
        assert!(spread(&[], 5.0, (0.0, 1.0)).is_empty());
    }
}
