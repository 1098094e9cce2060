//! Claims about what is seen on a chart.

use super::layout::name_lines;
use super::looks::Look;
use super::*;
use crate::output::picture::canvas::Canvas;
use crate::output::picture::text::{Span, width};

fn point(x: f64, y: f64) -> ChartPoint {
    ChartPoint { x, y, error: None }
}

fn series(label: &str, style: ChartStyle, points: &[(f64, f64)]) -> ChartSeries {
    ChartSeries {
        label: label.into(),
        style,
        points: points.iter().map(|&(x, y)| point(x, y)).collect(),
    }
}

fn chart(panels: Vec<Vec<ChartSeries>>) -> Chart {
    let panels = panels.into_iter().map(|series| ChartPanel {
        title: String::new(),
        series,
    });
    Chart {
        panels: panels.collect(),
        ..Chart::default()
    }
}

/// The look of every series, and where its points are.
fn layout(chart: &Chart) -> (Looks, Layout) {
    let looks = Looks::of(&chart.panels);
    let legend = Legend::new(chart, &looks);
    let layout = Layout::new(chart, &legend);
    (looks, layout)
}

fn colour_at(canvas: &Canvas, (x, y): (f32, f32)) -> [u8; 3] {
    let first = 3 * (y as usize * canvas.width() as usize + x as usize);
    canvas.rgb()[first..first + 3].try_into().unwrap()
}

#[test]
fn every_point_has_its_marker_at_its_place_in_its_panel() {
    let a = series("a", ChartStyle::Measured, &[(0.1, 1.0), (0.2, 3.0)]);
    let b = series("b", ChartStyle::Measured, &[(0.1, 2.0)]);
    let chart = chart(vec![vec![a.clone()], vec![a.clone(), b.clone()]]);
    let (looks, layout) = layout(&chart);
    let canvas = chart.figure().canvas();
    for (panel, series, place) in [(0, &a, 0), (0, &a, 1), (1, &a, 1), (1, &b, 0)] {
        let ChartPoint { x, y, .. } = series.points[place];
        let at = layout.at(layout.panels[panel], x, y).unwrap();
        assert_eq!(
            colour_at(&canvas, at),
            looks.find(series).colour,
            "{panel} {place}"
        );
    }
}

#[test]
fn fourteen_series_differ_in_marker_or_dashes_and_not_by_colour_alone() {
    let all = |style| -> Vec<Look> {
        let series: Vec<ChartSeries> = (0..14)
            .map(|i| series(&i.to_string(), style, &[(0.0, 0.0)]))
            .collect();
        let looks = Looks::of(&[ChartPanel {
            title: String::new(),
            series: series.clone(),
        }]);
        series.iter().map(|series| looks.find(series)).collect()
    };
    let mut looks = all(ChartStyle::Measured);
    looks.extend(&all(ChartStyle::Line)[..4]);
    looks.extend(&all(ChartStyle::Dashed)[..4]);
    for (i, a) in looks.iter().enumerate() {
        for b in &looks[..i] {
            let form = |look: &Look| (look.marker, look.pencil.map(|pencil| pencil.dashes));
            assert_ne!(form(a), form(b));
        }
    }
}

#[test]
fn points_of_a_reference_have_the_colour_of_the_measured_series_that_they_are_named_after() {
    let line = [(0.1, 1.0), (0.2, 2.0)];
    let names = [("spheres", ChartStyle::Measured), ("cubes", ChartStyle::Measured)];
    let references = ["Table 1, cubes", "Table 1, spheres", "Table 1 of other cubes"];
    let measured = names.map(|(name, style)| series(name, style, &line));
    let points = references.map(|name| series(name, ChartStyle::Points, &line));
    let looks = Looks::of(&chart(vec![measured.iter().chain(&points).cloned().collect()]).panels);
    let [spheres, cubes] = measured.each_ref().map(|series| looks.find(series));
    let [of_cubes, of_spheres, other] = points.each_ref().map(|series| looks.find(series));
    assert_eq!(
        (of_cubes.colour, of_spheres.colour),
        (cubes.colour, spheres.colour)
    );
    assert!(of_cubes.marker != cubes.marker && of_spheres.marker != of_cubes.marker);
    assert!(other.colour != cubes.colour && other.colour != spheres.colour);
}

#[test]
fn an_error_bar_is_as_long_as_its_error_and_within_the_axis() {
    let mut measured = series("a", ChartStyle::Points, &[(1.0, 10.0)]);
    measured.points[0].error = Some(4.0);
    let chart = chart(vec![vec![measured]]);
    let (looks, layout) = layout(&chart);
    let canvas = chart.figure().canvas();
    let area = layout.panels[0];
    let colour = looks.find(&chart.panels[0].series[0]).colour;
    let at = |y: f64| layout.at(area, 1.0, y).unwrap();
    for y in [6.1, 8.0, 12.0, 13.9] {
        assert_eq!(colour_at(&canvas, at(y)), colour, "{y}");
    }
    let beyond = at(14.5);
    assert!(beyond.1 > area.1 && colour_at(&canvas, beyond) != colour);
}

#[test]
fn a_logarithmic_error_bar_that_crosses_zero_reaches_the_frame() {
    let mut measured = series("a", ChartStyle::Measured, &[(1.0, 1.0), (2.0, 0.01)]);
    measured.points[1].error = Some(0.02);
    let mut chart = chart(vec![vec![measured]]);
    chart.y.logarithmic = true;
    let (looks, layout) = layout(&chart);
    let canvas = chart.figure().canvas();
    let (x, _) = layout.at(layout.panels[0], 2.0, 0.01).unwrap();
    let colour = looks.find(&chart.panels[0].series[0]).colour;
    assert_eq!(colour_at(&canvas, (x, layout.panels[0].3 - 3.0)), colour);
}

#[test]
fn the_legend_lies_above_all_panels_and_no_panel_on_another() {
    for panels in 1..=7 {
        let entries = (0..12).map(|i| {
            series(
                &format!("a rather long name of series {i}"),
                ChartStyle::Measured,
                &[(1.0, 1.0)],
            )
        });
        let entries: Vec<ChartSeries> = entries.collect();
        let chart = chart(vec![entries; panels]);
        let looks = Looks::of(&chart.panels);
        let legend = Legend::new(&chart, &looks);
        let layout = Layout::new(&chart, &legend);
        for (i, a) in layout.panels.iter().enumerate() {
            assert!(a.1 > layout.legend + legend.height(), "{panels}");
            assert!(a.2 < layout.size.0 && a.3 < layout.size.1 && a.2 - a.0 > 300.0);
            for b in &layout.panels[..i] {
                let apart = a.0 > b.2 || b.0 > a.2 || a.1 > b.3 || b.1 > a.3;
                assert!(apart, "{panels}");
            }
        }
    }
}

#[test]
fn whatever_the_data_are_there_is_a_chart_and_its_svg_is_well_formed() {
    let awkward: [&[(f64, f64)]; 7] = [
        &[],
        &[(1.0, 1.0)],
        &[(0.0, 0.0)],
        &[(f64::NAN, 1.0), (1.0, f64::INFINITY)],
        &[(-1.0, -5.0), (2.0, 7.0)],
        &[(1e-300, 1e300), (1e300, 1e-300)],
        &[(5.0, -1e-9), (5.0, 1e9), (4.0, 0.0)],
    ];
    for points in awkward {
        for style in [
            ChartStyle::Measured,
            ChartStyle::Points,
            ChartStyle::Line,
            ChartStyle::Dashed,
        ] {
            for logarithmic in [false, true] {
                let mut chart = chart(vec![vec![series("<a & b>", style, points)], vec![]]);
                chart.title = "<&>".into();
                (chart.x.logarithmic, chart.y.logarithmic) = (logarithmic, logarithmic);
                let figure = chart.figure();
                let svg = figure.drawing.svg(figure.size, &figure.title);
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
                assert!(svg.contains("<title>&lt;&amp;&gt;</title>"));
            }
        }
    }
    chart(vec![]).figure().canvas();
}

#[test]
fn a_long_name_of_an_axis_breaks_between_words_and_keeps_its_unit_and_power_of_ten_together() {
    let text = |spans: &Vec<Span>| spans.iter().map(|span| span.parts().0).collect::<String>();
    let lines = |label: &str, exponent| -> Vec<String> {
        let lines = name_lines(label, exponent, 400.0);
        assert!(lines.iter().all(|line| width(line, 29.0) <= 400.0), "{label}");
        lines.iter().map(text).collect()
    };
    assert_eq!(lines("momentum (kg m/s)", 0), ["momentum (kg m/s)"]);
    assert_eq!(
        lines("momentum of all particles together (kg m/s)", -9),
        ["momentum of all particles", "together (10\u{2212}9 kg m/s)"]
    );
    assert_eq!(
        lines("velocity of the particles (um)", 0),
        ["velocity of the", "particles (\u{b5}m)"]
    );
    assert_eq!(lines("quotient of velocities (-)", 0), ["quotient of velocities"]);
    assert_eq!(lines("", -3), [" (10\u{2212}3)"]);
}

#[test]
fn long_titles_and_notes_break_and_nothing_leaves_the_page() {
    let mut chart = chart(vec![vec![series(
        &"long ".repeat(80),
        ChartStyle::Line,
        &[(0.0, 1.0), (1.0, 2.0)],
    )]]);
    chart.title = "a title of many words ".repeat(12);
    chart.note = "a note of many words ".repeat(30);
    chart.y.label = "a name of many words ".repeat(6) + "(m/s)";
    let canvas = chart.figure().canvas();
    let pixels = canvas.rgb();
    let width = canvas.width() as usize;
    let white = |pixels: &[u8]| pixels.iter().all(|channel| *channel == 255);
    for row in pixels.chunks_exact(3 * width) {
        assert!(white(&row[3 * (width - 8)..]) && white(&row[..3 * 8]));
    }
    let edge = 8 * 3 * width;
    assert!(white(&pixels[..edge]) && white(&pixels[pixels.len() - edge..]));
}
