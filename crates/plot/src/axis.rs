//! Ticks of an axis beside a frame, for charts and pictures.

use crate::colour::INK;
use crate::drawing::{Align, Area, Drawing, Pencil, Place};
use crate::scale::Scale;
use crate::text::{widest, width};

/// Side of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Below,
    Left,
    Right,
}

/// Length of a tick with a number.
const TICK: f32 = 10.0;

impl Scale {
    /// Width of the widest number.
    pub(crate) fn widest(&self, size: f32) -> f32 {
        widest(self.ticks.iter().map(|tick| &tick.text), size)
    }

    /// Draws the ticks at a side of a frame, with numbers of this size where they do not overlap, or none for size zero.
    pub(crate) fn draw(&self, drawing: &mut Drawing, side: Side, (l, t, r, b): Area, size: f32) {
        // Middle of the last number, and half the space that it takes.
        let mut last = (f32::NEG_INFINITY, 0.0);
        for tick in &self.ticks {
            let (x, y) = (l + tick.part * (r - l), b - tick.part * (b - t));
            let length = if tick.is_major() { TICK } else { 0.6 * TICK };
            let baseline = y + 0.36 * size;
            let (line, at, align, number): ([Place; 2], Place, Align, (f32, f32)) = match side {
                Side::Below => {
                    let number = (x, 0.5 * width(&tick.text, size) + 6.0);
                    ([(x, b + 2.0), (x, b + 2.0 + length)], (x, b + 40.0), Align::Middle, number)
                }
                Side::Left => {
                    let line = [(l - 2.0, y), (l - 2.0 - length, y)];
                    (line, (l - 20.0, baseline), Align::End, (y, 0.5 * size))
                }
                Side::Right => {
                    let line = [(r + 2.0, y), (r + 2.0 + length, y)];
                    (line, (r + 20.0, baseline), Align::Start, (y, 0.5 * size))
                }
            };
            drawing.line(line.to_vec(), Pencil::new(INK, 2.0));
            if tick.is_major() && size > 0.0 && (number.0 - last.0).abs() > number.1 + last.1 {
                drawing.text(tick.text.clone(), size, at, align, INK);
                last = number;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Mark;

    #[test]
    fn numbers_are_drawn_from_both_ends_and_left_out_where_they_would_overlap() {
        let scale = Scale::new(&[0.0, 1.0], false, true, 10.0);
        let numbers = |side, area, size| {
            let mut drawing = Drawing::default();
            scale.draw(&mut drawing, side, area, size);
            drawing.marks.iter().filter(|mark| matches!(mark, Mark::Text(..))).count()
        };
        for side in [Side::Below, Side::Left, Side::Right] {
            let [area, downwards] = [(0.0, 0.0, 800.0, 800.0), (0.0, 800.0, 800.0, 0.0)];
            assert_eq!([numbers(side, area, 20.0), numbers(side, downwards, 20.0)], [11; 2]);
            assert!((3..9).contains(&numbers(side, (0.0, 0.0, 200.0, 100.0), 20.0)));
            assert_eq!(numbers(side, area, 0.0), 0);
        }
    }
}
