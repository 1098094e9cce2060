//! Colours of figures.

/// Text, frames and axes.
pub const INK: [u8; 3] = [38, 38, 38];
/// Walls in pictures.
pub const WALL: [u8; 3] = [96, 92, 88];
/// Behind particles that nothing surrounds.
pub const BACKGROUND: [u8; 3] = [246, 246, 248];
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

/// Colour of a value between 0 and 1; values outside take the colour of the nearer end, NaN that of 0.
pub fn viridis(value: f64) -> [u8; 3] {
    let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
    let position = value * (VIRIDIS.len() - 1) as f64;
    let below = (position as usize).min(VIRIDIS.len() - 2);
    let part = position - below as f64;
    std::array::from_fn(|i| {
        let (a, b) = (f64::from(VIRIDIS[below][i]), f64::from(VIRIDIS[below + 1][i]));
        (a + part * (b - a)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_gets_steadily_lighter_and_holds_at_its_ends() {
        let lightness = |v: f64| {
            let [r, g, b] = viridis(v).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..200 {
            let v = f64::from(i) / 200.0;
            assert!(lightness(v + 0.005) >= lightness(v) - 0.5, "at {v}");
        }
        assert_eq!(viridis(-1.0), VIRIDIS[0]);
        assert_eq!(viridis(7.0), VIRIDIS[32]);
        assert_eq!(viridis(f64::NAN), VIRIDIS[0]);
    }
}
