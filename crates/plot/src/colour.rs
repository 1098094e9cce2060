//! Colours of figures.

/// Text, frames and axes.
pub const INK: [u8; 3] = [38, 38, 38];
/// Walls in pictures.
pub const WALL: [u8; 3] = [96, 92, 88];
pub(crate) const GREY: [u8; 3] = [110, 110, 110];
pub(crate) const GRID: [u8; 3] = [230, 230, 230];
/// The first colour of curves.
pub const BLUE: [u8; 3] = [0, 90, 156];
/// The second colour of curves.
pub const VERMILION: [u8; 3] = [213, 94, 0];
/// Colours of reference lines, told apart by colour-blind readers too (Okabe and Ito).
pub const REFERENCES: [[u8; 3]; 4] = [[0, 128, 96], [170, 80, 140], [190, 130, 0], [90, 90, 90]];

/// The perceptually uniform map "viridis" (S. van der Walt and N. Smith, public domain), every eighth entry.
#[rustfmt::skip]
const VIRIDIS: [[u8; 3]; 33] = [
    [68, 1, 84], [71, 13, 96], [72, 24, 106], [72, 35, 116], [71, 45, 123], [69, 55, 129], [66, 64, 134],
    [62, 73, 137], [59, 82, 139], [55, 91, 141], [51, 99, 141], [47, 107, 142], [44, 114, 142], [41, 122, 142],
    [38, 130, 142], [35, 137, 142], [33, 145, 140], [31, 152, 139], [31, 160, 136], [34, 167, 133],
    [40, 174, 128], [50, 182, 122], [63, 188, 115], [78, 195, 107], [94, 201, 98], [112, 207, 87], [132, 212, 75],
    [152, 216, 62], [173, 220, 48], [194, 223, 35], [216, 226, 25], [236, 229, 27], [253, 231, 37],
];

/// The map `RdBu` of `ColorBrewer` (C. Brewer, Apache-2.0) from blue to red; grey is in the middle.
#[rustfmt::skip]
const DIVERGING: [[u8; 3]; 11] = [
    [5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [209, 229, 240], [240, 240, 240],
    [253, 219, 199], [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31],
];

/// The map `YlOrRd` of `ColorBrewer`, light at its lower end, so that bodies show light and shade.
#[rustfmt::skip]
const WARM: [[u8; 3]; 8] = [
    [250, 244, 222], [255, 237, 160], [254, 217, 118], [254, 178, 76], [253, 141, 60], [252, 78, 42], [227, 26, 28],
    [177, 0, 38],
];

/// Colours of kinds, told apart by colour-blind readers too (Okabe and Ito), lighter.
pub const KINDS: [[u8; 3]; 6] =
    [[240, 228, 205], [120, 180, 215], [230, 170, 80], [100, 180, 155], [210, 140, 175], [170, 170, 170]];

/// A map of colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    /// Ever lighter, from violet to yellow: "viridis".
    Viridis,
    /// Ever darker, from ivory to red.
    Warm,
    /// From blue over grey at zero to red: for values with a sign.
    Diverging,
}

impl Colours {
    /// Colour of a value of a range; values outside take the colour of the nearer end, NaN that of the lower one.
    pub fn of(self, value: f64, (lo, hi): (f64, f64)) -> [u8; 3] {
        let (map, position) = match self {
            Self::Viridis => (&VIRIDIS[..], (value - lo) / (hi - lo)),
            Self::Warm => (&WARM[..], (value - lo) / (hi - lo)),
            Self::Diverging => (&DIVERGING[..], 0.5 + 0.5 * value.clamp(lo, hi) / lo.abs().max(hi.abs())),
        };
        let position = if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) };
        let position = position * (map.len() - 1) as f64;
        let below = (position as usize).min(map.len() - 2);
        let part = position - below as f64;
        std::array::from_fn(|i| {
            let (a, b) = (f64::from(map[below][i]), f64::from(map[below + 1][i]));
            (a + part * (b - a)).round() as u8
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_gets_steadily_lighter_or_darker_and_stays_at_its_ends() {
        for (map, sign) in [(Colours::Viridis, 1.0), (Colours::Warm, -1.0)] {
            let of = |value| map.of(value, (0.0, 2.0));
            let lightness = |v: f64| {
                let [r, g, b] = of(v).map(f64::from);
                sign * (0.2126 * r + 0.7152 * g + 0.0722 * b)
            };
            for i in 0..200 {
                let v = f64::from(i) / 100.0;
                assert!(lightness(v + 0.01) >= lightness(v) - 0.5, "at {v}");
            }
            assert_eq!((of(-1.0), of(7.0), of(f64::NAN)), (of(0.0), of(2.0), of(0.0)));
        }
    }

    #[test]
    fn zero_is_grey_in_every_range_of_values_with_a_sign() {
        for range in [(-1.0, 1.0), (-1.0, 3.0), (0.0, 2.0), (-5.0, -1.0)] {
            let end = f64::max(-range.0, range.1);
            assert_eq!(Colours::Diverging.of(0.0_f64.clamp(range.0, range.1), range), {
                let nearest = 0.0_f64.clamp(range.0, range.1) / end;
                Colours::Diverging.of(nearest, (-1.0, 1.0))
            });
            let [r, _, b] = Colours::Diverging.of(range.1, range);
            assert_eq!(r > b, range.1 > 0.0, "red above zero, blue below");
        }
        assert_eq!(Colours::Diverging.of(0.0, (-1.0, 3.0)), [240; 3]);
    }
}
