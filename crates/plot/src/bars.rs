//! Horizontal bars, each between its name and its number.

use crate::colour::{BLUE, INK};
use crate::drawing::{Align, Drawing, Figure, Readings, Stroke};
use crate::text::widest;

/// Contents of a figure of bars.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bars {
    /// Heading.
    pub title: String,
    /// From the top: name, length (of any unit, none below zero), and the text right of the bar.
    pub rows: Vec<(String, f64, String)>,
}

const PAGE: f32 = 1500.0;
const MARGIN: f32 = 36.0;
const TITLE: f32 = 32.0;
const TEXT: f32 = 27.0;
/// Height of a row, and of the bar in it.
const ROW: (f32, f32) = (58.0, 34.0);

impl Bars {
    /// Draws the bars.
    pub fn figure(&self) -> Figure {
        let names = widest(self.rows.iter().map(|row| &*row.0), TEXT);
        let numbers = widest(self.rows.iter().map(|row| &*row.2), TEXT);
        let left = MARGIN + names.min(0.4 * PAGE) + 20.0;
        let space = PAGE - left - numbers.min(0.4 * PAGE) - 16.0 - MARGIN;
        let length = |value: f64| if value.is_finite() { value.max(0.0) } else { 0.0 };
        let longest = self.rows.iter().map(|row| length(row.1)).fold(f64::MIN_POSITIVE, f64::max);
        let mut drawing = Drawing::default();
        drawing.text(&self.title, TITLE, (MARGIN, MARGIN + TITLE), Align::Start, INK);
        let top = MARGIN + 1.9 * TITLE;
        let bottom = top + self.rows.len() as f32 * ROW.0;
        for (i, (name, value, text)) in self.rows.iter().enumerate() {
            let middle = top + (i as f32 + 0.5) * ROW.0;
            let baseline = middle + 0.36 * TEXT;
            let right = left + (length(*value) / longest) as f32 * space;
            let half = 0.5 * ROW.1;
            drawing.rectangle((left, middle - half, right, middle + half), BLUE, 1.0);
            drawing.text(name, TEXT, (left - 16.0, baseline), Align::End, INK);
            drawing.text(text, TEXT, (right + 16.0, baseline), Align::Start, INK);
        }
        drawing.line(&[(left, top), (left, bottom)], Stroke::new(INK, 2.0));
        let size = (PAGE, 2.0 * (0.5 * (bottom + MARGIN)).ceil());
        Figure { size, title: self.title.clone(), drawing, readings: Readings::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_values() {
        let row = |value: f64| (String::new(), value, String::new());
        let bars = Bars { title: String::new(), rows: vec![row(1.0), row(4.0), row(f64::NAN)] };
        let image = bars.figure().image();
        let blue = |row: usize| {
            let y = (MARGIN + 1.9 * TITLE + (row as f32 + 0.5) * ROW.0) as u32;
            (0..image.width()).filter(|&x| image.colour(x, y) == BLUE).count()
        };
        assert!(blue(0) > 200 && (blue(1) as f64 / blue(0) as f64 - 4.0).abs() < 0.05);
        assert_eq!(blue(2), 0);
    }
}
