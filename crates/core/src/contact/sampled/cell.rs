//! The part of one cell in which a function, given at the centres of the cell and its neighbours, is positive.
//!
//! The cell is the square `|x|, |y| <= 1/2`. The function is taken as linear, `g + gx x + gy y`, and integrated
//! exactly over the polygon in which it is positive. Where it is positive everywhere and given on both sides, the
//! mean over the cell is `g + (second differences) / 24`.

/// Integrals over a cell, in its units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// Area of the positive part.
    pub area: f64,
    /// Integral of the function over it.
    pub volume: f64,
    /// Centre of that area.
    pub middle: [f64; 2],
    /// Centre weighted with the function.
    pub centre: [f64; 2],
}

const NOTHING: Cell = Cell { area: 0.0, volume: 0.0, middle: [0.0; 2], centre: [0.0; 2] };

impl Cell {
    /// A constant, all over the cell.
    pub(super) fn whole(value: f64) -> Self {
        Self { area: 1.0, volume: value, ..NOTHING }
    }
}

/// The positive part of a function with the value `here` and the values `beside` it below and above, in x and y; NaN
/// where it is not known.
pub(super) fn positive_part(here: f64, beside: [[f64; 2]; 2]) -> Cell {
    let slope = beside.map(|[below, above]| match (below.is_nan(), above.is_nan()) {
        (false, false) => 0.5 * (above - below),
        (false, true) => here - below,
        (true, false) => above - here,
        (true, true) => 0.0,
    });
    let spread = 0.5 * (slope[0].abs() + slope[1].abs());
    if here >= spread {
        let bend = |[below, above]: [f64; 2]| {
            let second = below - 2.0 * here + above;
            if second.is_nan() { 0.0 } else { second / 24.0 }
        };
        let value = here + bend(beside[0]) + bend(beside[1]);
        return if value > 0.0 {
            Cell { centre: slope.map(|s| s / (12.0 * value)), ..Cell::whole(value) }
        } else {
            NOTHING
        };
    }
    if here <= -spread {
        return NOTHING;
    }
    clipped(here, slope)
}

/// Integrals over the polygon in the square where `here + slope . x > 0`, by the triangles of its fan.
fn clipped(here: f64, slope: [f64; 2]) -> Cell {
    let square = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let value = |x: [f64; 2]| here + slope[0] * x[0] + slope[1] * x[1];
    let mut corners = [[0.0; 3]; 6];
    let mut count = 0;
    let mut push = |x: [f64; 2], f: f64| {
        corners[count] = [x[0], x[1], f];
        count += 1;
    };
    for n in 0..4 {
        let (a, b) = (square[n], square[(n + 1) % 4]);
        let (fa, fb) = (value(a), value(b));
        if fa > 0.0 {
            push(a, fa);
        }
        if (fa > 0.0) != (fb > 0.0) {
            let t = fa / (fa - fb);
            push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])], 0.0);
        }
    }
    let mut cell = NOTHING;
    for n in 2..count {
        let [a, b, c] = [corners[0], corners[n - 1], corners[n]];
        let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
        let sum = a[2] + b[2] + c[2];
        cell.area += area;
        cell.volume += area * sum / 3.0;
        for k in 0..2 {
            let total = a[k] + b[k] + c[k];
            cell.middle[k] += area * total / 3.0;
            let products = a[k] * a[2] + b[k] * b[2] + c[k] * c[2];
            cell.centre[k] += area * (products + total * sum) / 12.0;
        }
    }
    if cell.area <= 0.0 || cell.volume <= 0.0 {
        return NOTHING;
    }
    cell.middle = cell.middle.map(|x| x / cell.area);
    cell.centre = cell.centre.map(|x| x / cell.volume);
    cell
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_positive_part_of_a_linear_function_agrees_with_points() {
        for (here, x, y) in
            [(0.3, 1.0, 0.2), (-0.1, -0.5, 0.9), (0.02, 0.0, 1.0), (0.5, 0.3, 0.3), (0.1, -1.0, 1.0)]
        {
            let cell = positive_part(here, [[here - x, here + x], [here - y, here + y]]);
            let n = 1000;
            let (mut area, mut volume, mut middle, mut centre) = (0.0, 0.0, [0.0; 2], [0.0; 2]);
            for i in 0..n * n {
                let p = [i % n, i / n].map(|i| (f64::from(i) + 0.5) / f64::from(n) - 0.5);
                let f: f64 = here + x * p[0] + y * p[1];
                if f > 0.0 {
                    area += 1e-6;
                    volume += 1e-6 * f;
                    for k in 0..2 {
                        middle[k] += 1e-6 * p[k];
                        centre[k] += 1e-6 * f * p[k];
                    }
                }
            }
            assert!((cell.area - area).abs() < 1e-3 && (cell.volume - volume).abs() < 1e-5);
            for k in 0..2 {
                assert!((cell.middle[k] * cell.area - middle[k]).abs() < 1e-3);
                assert!((cell.centre[k] * cell.volume - centre[k]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_parabola_that_is_positive_all_over_has_its_exact_mean() {
        let f = |x: f64, y: f64| 2.0 - x * x - 0.5 * y * y + 0.3 * x;
        let cell = positive_part(f(0.0, 0.0), [[f(-1.0, 0.0), f(1.0, 0.0)], [f(0.0, -1.0), f(0.0, 1.0)]]);
        assert!((cell.volume - (2.0 - 1.0 / 12.0 - 0.5 / 12.0)).abs() < 1e-15);
    }
}
