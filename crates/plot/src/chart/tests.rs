//! Claims about what is seen on a chart.

use super::looks::Look;
use super::*;
use crate::drawing::{Colour, Format, Position};
use crate::image::Image;
use crate::markup::axis_label;
use crate::text::{width, wrapped};

fn point(x: f64, y: f64) -> Point {
    Point { x, y, error: None }
}

fn series(label: &str, style: Style, points: &[(f64, f64)]) -> Series {
    Series { label: label.into(), style, points: points.iter().map(|&(x, y)| point(x, y)).collect() }
}

fn chart(panels: Vec<Vec<Series>>) -> Chart {
    let panels = panels.into_iter().map(|series| Panel { series, ..Panel::default() });
    Chart { panels: panels.collect(), ..Chart::default() }
}

/// The look of every series, and where its points are.
fn layout(chart: &Chart) -> (Looks, Layout) {
    let looks = Looks::of(&chart.panels);
    let legend = Legend::new(chart, &looks);
    let layout = Layout::new(chart, &legend);
    (looks, layout)
}

fn colour_at(image: &Image, (x, y): Position) -> Colour {
    image.colour(x as u32, y as u32)
}

#[test]
fn every_point_has_its_marker_at_its_place_in_its_panel() {
    let a = series("a", Style::Measured, &[(0.1, 1.0), (0.2, 3.0)]);
    let b = series("b", Style::Measured, &[(0.1, 2.0)]);
    let chart = chart(vec![vec![a.clone()], vec![a.clone(), b.clone()]]);
    let (looks, layout) = layout(&chart);
    let image = chart.figure().image();
    for (panel, series, place) in [(0, &a, 0), (0, &a, 1), (1, &a, 1), (1, &b, 0)] {
        let Point { x, y, .. } = series.points[place];
        let at = layout.at(layout.panels[panel], x, y).unwrap();
        assert_eq!(colour_at(&image, at), looks.find(series).colour, "{panel} {place}");
    }
}

#[test]
fn the_values_of_every_point_stand_where_its_marker_is_and_long_series_are_thinned() {
    let few = series("a", Style::Measured, &[(0.1, 1.0), (0.2, 3.0)]);
    let many: Vec<(f64, f64)> = (0..100_000).map(|i| (1e-5 * f64::from(i), 2.0)).collect();
    let chart = chart(vec![vec![few.clone()], vec![few.clone(), series("b", Style::Line, &many)]]);
    let (looks, layout) = layout(&chart);
    let figure = chart.figure();
    let curves = &figure.readings().curves;
    let labels: Vec<&str> = curves.iter().map(|curve| &*curve.label).collect();
    assert_eq!(labels, ["a", "a", "b"]);
    for (panel, curve) in [(0, &curves[0]), (1, &curves[1])] {
        assert_eq!((curve.points.len(), curve.colour), (2, looks.find(&few).colour));
        for &(left, top, x, y, _) in &curve.points {
            let at = layout.at(layout.panels[panel], x, y).unwrap();
            assert!((left - at.0).abs() < 0.06 && (top - at.1).abs() < 0.06, "{panel} {x} {y}");
        }
    }
    assert!((100..1000).contains(&curves[2].points.len()), "{}", curves[2].points.len());
}

#[test]
fn fourteen_series_differ_in_marker_or_dashes_and_not_by_colour_alone() {
    let all = |style| -> Vec<Look> {
        let series: Vec<Series> = (0..14).map(|i| series(&i.to_string(), style, &[(0.0, 0.0)])).collect();
        let looks = Looks::of(&[Panel { series: series.clone(), ..Panel::default() }]);
        series.iter().map(|series| looks.find(series)).collect()
    };
    let mut looks = all(Style::Measured);
    looks.extend(&all(Style::Line)[..4]);
    looks.extend(&all(Style::Dashed)[..4]);
    for (i, a) in looks.iter().enumerate() {
        for b in &looks[..i] {
            let form = |look: &Look| (look.marker, look.stroke.map(|stroke| stroke.dashes));
            assert_ne!(form(a), form(b));
        }
    }
}

#[test]
fn points_of_a_reference_have_the_colour_of_the_measured_series_that_they_are_named_after() {
    let line = [(0.1, 1.0), (0.2, 2.0)];
    let names = [("spheres", Style::Measured), ("cubes", Style::Measured)];
    let references = ["Table 1, cubes", "Table 1, spheres", "Table 1 of other cubes"];
    let measured = names.map(|(name, style)| series(name, style, &line));
    let points = references.map(|name| series(name, Style::Points, &line));
    let looks = Looks::of(&chart(vec![measured.iter().chain(&points).cloned().collect()]).panels);
    let [spheres, cubes] = measured.each_ref().map(|series| looks.find(series));
    let [of_cubes, of_spheres, other] = points.each_ref().map(|series| looks.find(series));
    assert_eq!((of_cubes.colour, of_spheres.colour), (cubes.colour, spheres.colour));
    assert!(of_cubes.marker == cubes.marker && of_spheres.marker != of_cubes.marker);
    assert!(other.colour != cubes.colour && other.colour != spheres.colour);
}

#[test]
fn an_error_bar_is_as_long_as_its_error_and_within_the_axis() {
    let mut measured = series("a", Style::Points, &[(1.0, 10.0)]);
    measured.points[0].error = Some(4.0);
    let chart = chart(vec![vec![measured]]);
    let (looks, layout) = layout(&chart);
    let image = chart.figure().image();
    let area = layout.panels[0];
    let colour = looks.find(&chart.panels[0].series[0]).colour;
    let at = |y: f64| layout.at(area, 1.0, y).unwrap();
    for y in [6.1, 8.0, 12.0, 13.9] {
        assert_eq!(colour_at(&image, at(y)), colour, "{y}");
    }
    let beyond = at(14.5);
    assert!(beyond.1 > area.1 && colour_at(&image, beyond) != colour);
}

#[test]
fn a_logarithmic_error_bar_that_crosses_zero_reaches_the_frame() {
    let mut measured = series("a", Style::Measured, &[(1.0, 1.0), (2.0, 0.01)]);
    measured.points[1].error = Some(0.02);
    let mut chart = chart(vec![vec![measured]]);
    chart.y.log = true;
    let (looks, layout) = layout(&chart);
    let image = chart.figure().image();
    let (x, _) = layout.at(layout.panels[0], 2.0, 0.01).unwrap();
    let colour = looks.find(&chart.panels[0].series[0]).colour;
    assert_eq!(colour_at(&image, (x, layout.panels[0].3 - 3.0)), colour);
}

#[test]
fn the_legend_lies_above_all_panels_and_no_panel_on_another() {
    for panels in 1..=7 {
        let entries = (0..12)
            .map(|i| series(&format!("a rather long name of series {i}"), Style::Measured, &[(1.0, 1.0)]));
        let entries: Vec<Series> = entries.collect();
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
        for style in
            [Style::Measured, Style::Points, Style::Line, Style::Dashed, Style::Reference, Style::Overlaid]
        {
            for logarithmic in [false, true] {
                let mut chart = chart(vec![vec![series("<a & b>", style, points)], vec![]]);
                chart.title = "<&>".into();
                (chart.x.log, chart.y.log) = (logarithmic, logarithmic);
                let figure = chart.figure();
                let svg = String::from_utf8(figure.encode(Format::Svg)).unwrap();
                assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
                assert!(svg.contains("<title>&lt;&amp;&gt;</title>"));
            }
        }
    }
    chart(vec![]).figure().image();
}

#[test]
fn a_long_label_of_an_axis_breaks_between_words_and_keeps_its_unit_and_power_of_ten_together() {
    let lines = |label: &str, exponent| -> Vec<String> {
        let lines = wrapped(&axis_label(label, exponent), 29.0, 400.0);
        assert!(lines.iter().all(|line| width(line, 29.0) <= 400.0), "{label}");
        lines.iter().map(|line| line.replace('\u{a0}', " ")).collect()
    };
    assert_eq!(lines("momentum (kg m/s)", 0), ["momentum (kg m/s)"]);
    assert_eq!(
        lines("momentum of all particles together (kg m/s)", -9),
        ["momentum of all particles", "together (10^-9 kg m/s)"]
    );
    assert_eq!(lines("velocity of the particles (um)", 0), ["velocity of the", "particles (\u{b5}m)"]);
    assert_eq!(lines("quotient of velocities (-)", 0), ["quotient of velocities"]);
    assert_eq!(lines("", -3), [" (10^-3)"]);
}

#[test]
fn long_titles_and_notes_break_and_nothing_leaves_the_page() {
    let mut chart = chart(vec![vec![series(&"long ".repeat(80), Style::Line, &[(0.0, 1.0), (1.0, 2.0)])]]);
    chart.title = "a title of many words ".repeat(12);
    chart.note = "a note of many words ".repeat(30);
    chart.y.label = "a name of many words ".repeat(6) + "(m/s)";
    let image = chart.figure().image();
    let (width, height) = (image.width(), image.height());
    let white = |x: u32, y: u32| image.colour(x, y) == [255; 3];
    for y in 0..height {
        assert!((0..8).chain(width - 8..width).all(|x| white(x, y)), "row {y}");
    }
    for x in 0..width {
        assert!((0..8).chain(height - 8..height).all(|y| white(x, y)), "column {x}");
    }
}

fn dense(of: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..=1000).map(f64::from).map(|x| (x, of(x))).collect()
}

#[test]
fn three_curves_on_each_other_are_all_seen() {
    let points = dense(|x| 2.0 * x);
    let styles = [Style::Overlaid, Style::Measured, Style::Reference];
    let chart = chart(vec![styles.map(|style| series("a", style, &points)).into()]);
    let (looks, layout) = layout(&chart);
    let image = chart.figure().image();
    let colours = styles.map(|style| looks.find(&series("a", style, &[])).colour);
    let mut counts = [0; 2];
    for i in 100..900 {
        let (x, y) = layout.at(layout.panels[0], f64::from(i), 2.0 * f64::from(i)).unwrap();
        for (count, colour) in counts.iter_mut().zip(colours) {
            *count += usize::from(colour_at(&image, (x, y)) == colour);
        }
        let beside = colour_at(&image, (x, y + 4.5));
        assert_eq!(beside, colours[2], "the reference lies below both");
    }
    assert!(counts[0] > 350 && counts[1] > 150, "dashes and what is between them: {counts:?}");
}

#[test]
fn few_points_of_coinciding_series_are_marked_by_open_markers_round_filled_ones() {
    let points = [(0.5, 0.501), (0.7, 0.7), (0.9, 0.9)];
    let chart = chart(vec![vec![
        series("native", Style::Overlaid, &points),
        series("other", Style::Measured, &points),
    ]]);
    let (looks, layout) = layout(&chart);
    let image = chart.figure().image();
    let colour = |index: usize| looks.find(&chart.panels[0].series[index]).colour;
    let (x, y) = layout.at(layout.panels[0], 0.7, 0.7).unwrap();
    assert_eq!(colour_at(&image, (x + 10.9, y)), colour(0), "the ring");
    assert_eq!(colour_at(&image, (x + 2.5, y + 2.5)), colour(1), "the filled marker");
}

#[test]
fn a_power_law_is_straight_on_logarithmic_axes_and_values_that_are_not_positive_are_left_out() {
    let law = (0..=100).map(|i| 10_f64.powf(-8.0 + 0.07 * f64::from(i)));
    let mut points = vec![(0.0, 1.0), (1e-4, -1.0)];
    points.extend(law.map(|x| (x, x.powf(1.5))));
    let mut chart = chart(vec![vec![series("law", Style::Measured, &points)]]);
    (chart.x.log, chart.y.log) = (true, true);
    let (_, layout) = layout(&chart);
    let image = chart.figure().image();
    let at = |index: usize| layout.at(layout.panels[0], points[index].0, points[index].1);
    let (first, last) = (at(2).unwrap(), at(102).unwrap());
    for part in [0.2, 0.5, 0.8] {
        let between = |a: f32, b: f32| a + part * (b - a);
        let place = (between(first.0, last.0), between(first.1, last.1));
        assert_eq!(colour_at(&image, place), crate::BLUE);
    }
    assert_eq!(at(0), None);
}

/// A course with its mean, the end of its transient, and a value to compare with.
fn course(values: &[(f64, f64)]) -> Chart {
    let level = |label: &str, value, error, between, dashed, colour| Mark::Level {
        label: label.into(),
        value,
        error,
        between,
        dashed,
        colour,
    };
    let mut chart = chart(vec![vec![series("", Style::Measured, values)]]);
    chart.panels[0].marks = vec![
        Mark::Interval([500.0, 1000.0]),
        level("mean\n0.3 \u{b1} 0.02", 0.3, Some(0.02), Some([500.0, 1000.0]), false, crate::VERMILION),
        level("reference", 0.5, None, None, true, crate::REFERENCES[0]),
        level("unknown", f64::NAN, None, None, true, crate::REFERENCES[1]),
        Mark::Event { label: "transient ends at t* = 200".into(), at: 200.0 },
    ];
    chart
}

#[test]
fn levels_bands_and_events_are_drawn_where_their_values_are() {
    let chart = course(&dense(|_| 0.2));
    let (_, layout) = layout(&chart);
    let image = chart.figure().image();
    let at = |x, y| layout.at(layout.panels[0], x, y).unwrap();
    assert_eq!(colour_at(&image, at(300.0, 0.2)), crate::BLUE);
    assert_eq!(colour_at(&image, at(750.0, 0.3)), crate::VERMILION);
    assert_eq!(colour_at(&image, at(5.0, 0.5)), crate::REFERENCES[0]);
    let [r, g, b] = colour_at(&image, at(755.0, 0.315));
    assert!(r > g && g > b, "the band is a light vermilion");
    assert_eq!(colour_at(&image, at(255.0, 0.315)), [255; 3], "it does not begin earlier");
    let event = at(200.0, 0.4);
    let dark = |dy: u8| colour_at(&image, (event.0, event.1 + f32::from(dy))) == crate::INK;
    assert!((0..40).any(dark));
}

#[test]
fn labels_stand_beside_the_frame_within_the_page() {
    let chart = course(&dense(|_| 0.2));
    let (_, layout) = layout(&chart);
    let (image, (_, t, r, b)) = (chart.figure().image(), layout.panels[0]);
    assert!(r + 150.0 < layout.size.0);
    let inked = |x: u32| (t as u32..b as u32).any(|y| image.colour(x, y) != [255; 3]);
    assert!((r as u32 + 40..r as u32 + 140).filter(|&x| inked(x)).count() > 50);
    assert!(!(image.width() - 20..image.width()).any(inked));
}

#[test]
fn a_chart_survives_being_written_and_read_and_old_ones_without_marks_are_read() {
    let chart = course(&[(0.0, 1.0)]);
    let text = serde_json::to_string(&chart).unwrap().replace("\"value\":null", "\"value\":1.0");
    let read: Chart = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
    let old = r#"{"title":"","x":{"label":"","log":true},"y":{"label":"","log":false},"note":"",
        "panels":[{"title":"","series":[{"label":"a","style":"dashed","points":[{"x":1,"y":2,"error":null}]}]}]}"#;
    let read: Chart = serde_json::from_str(old).unwrap();
    assert_eq!(read.panels[0].series[0].style, Style::Dashed);
    assert!(!serde_json::to_string(&read).unwrap().contains("marks"));
}
