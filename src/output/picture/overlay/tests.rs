//! Claims about what is seen on a plot.

use super::*;
use crate::output::picture::canvas::Canvas;

fn painted(plot: &OverlayPlot) -> Canvas {
    let mut canvas = Canvas::new(PAGE.0 as u32, PAGE.1 as u32);
    draw(plot).paint(&mut canvas);
    canvas
}

fn colour_at(canvas: &Canvas, (x, y): (f32, f32)) -> [u8; 3] {
    let first = 3 * (y as usize * canvas.width() as usize + x as usize);
    canvas.rgb()[first..first + 3].try_into().unwrap()
}

fn frame(plot: &OverlayPlot) -> Frame {
    Frame::new(plot, Legend::new(plot.curves).lines())
}

fn curve<'a>(name: &'a str, style: CurveStyle, points: &'a [[f64; 2]]) -> Curve<'a> {
    Curve {
        name,
        style,
        label: "",
        points,
    }
}

#[test]
fn three_curves_over_each_other_are_all_seen() {
    let points: Vec<[f64; 2]> = (0..=1000).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
    let curves = [
        curve("native", CurveStyle::Dashed, &points),
        curve("LIGGGHTS", CurveStyle::Solid, &points),
        curve("analytic", CurveStyle::Pale, &points),
    ];
    let plot = OverlayPlot {
        title: "test",
        axes: ["t (s)", "x (m)"],
        logarithmic: [false; 2],
        curves: &curves,
    };
    let (canvas, frame) = (painted(&plot), frame(&plot));
    let mut counts = [0; 2];
    for i in 100..900 {
        let (x, y) = frame.at([f64::from(i), 2.0 * f64::from(i)]).unwrap();
        for (count, colour) in counts.iter_mut().zip([BLUE, VERMILION]) {
            *count += usize::from(colour_at(&canvas, (x, y)) == colour);
        }
        assert_eq!(
            colour_at(&canvas, (x, y + 4.5)),
            PALE,
            "the reference lies below both"
        );
    }
    assert!(
        counts[0] > 350 && counts[1] > 150,
        "dashes and what is between them: {counts:?}"
    );
}

#[test]
fn a_power_law_is_straight_on_logarithmic_axes_and_values_that_are_not_positive_are_left_out() {
    let points: Vec<[f64; 2]> = (0..=100)
        .map(|i| 10_f64.powf(-8.0 + 0.07 * f64::from(i)))
        .map(|x| [x, x.powf(1.5)])
        .collect();
    let with_gap = [&[[0.0, 1.0], [1e-4, -1.0]][..], &points].concat();
    let curves = [curve("law", CurveStyle::Solid, &with_gap)];
    let plot = OverlayPlot {
        title: "",
        axes: ["d / R (-)", "F (N)"],
        logarithmic: [true; 2],
        curves: &curves,
    };
    let (canvas, frame) = (painted(&plot), frame(&plot));
    let (first, last) = (frame.at(points[0]).unwrap(), frame.at(points[100]).unwrap());
    for part in [0.2, 0.5, 0.8] {
        let between = |a: f32, b: f32| a + part * (b - a);
        let place = (between(first.0, last.0), between(first.1, last.1));
        assert_eq!(colour_at(&canvas, place), VERMILION);
    }
    assert_eq!(frame.at([0.0, 1.0]), None);
}

#[test]
fn few_points_are_marked_by_rings_round_dots() {
    let points = [[0.5, 0.501], [0.7, 0.7], [0.9, 0.9]];
    let curves = [
        curve("native", CurveStyle::Dashed, &points),
        curve("LIGGGHTS", CurveStyle::Solid, &points),
    ];
    let plot = OverlayPlot {
        title: "",
        axes: ["set", "found"],
        logarithmic: [false; 2],
        curves: &curves,
    };
    let (canvas, frame) = (painted(&plot), frame(&plot));
    let (x, y) = frame.at(points[1]).unwrap();
    assert_eq!(colour_at(&canvas, (x + 7.8, y + 7.8)), BLUE, "the ring");
    assert_eq!(
        colour_at(&canvas, (x + 2.5, y + 2.5)),
        VERMILION,
        "the dot, beside the line"
    );
}

#[test]
fn nothing_to_show_still_makes_a_plot_and_its_svg_is_well_formed() {
    for points in [&[][..], &[[f64::NAN, 1.0]], &[[0.0, 0.0]]] {
        let curves = [curve("a < b & c", CurveStyle::Other(7), points)];
        for logarithmic in [[false; 2], [true; 2]] {
            let plot = OverlayPlot {
                title: "<>&\"",
                axes: ["", "()"],
                logarithmic,
                curves: &curves,
            };
            painted(&plot);
            let svg = draw(&plot).svg(PAGE, plot.title);
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
            assert!(!svg.contains("NaN") && svg.contains("<title>&lt;&gt;&amp;&quot;</title>"));
        }
    }
}
