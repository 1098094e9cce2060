//! How series look: colours, dashes, markers.

use super::{ChartPanel, ChartSeries, ChartStyle};
use crate::output::picture::canvas::Pencil;
use crate::output::picture::colour::{BLUE, INK, VERMILION};
use crate::output::picture::drawing::Drawing;
use std::f32::consts::{PI, TAU};

/// Measured series with more points are lines without markers.
pub(super) const MARKED: usize = 60;
/// Radius of a marker (pixels).
pub(super) const RADIUS: f32 = 9.5;

/// Colours that colour-blind readers tell apart (after Okabe and Ito), neighbours of different lightness.
const COLOURS: [[u8; 3]; 8] = [
    BLUE,
    VERMILION,
    [0, 158, 115],
    INK,
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [120, 80, 20],
];
/// Tones of lines that belong to no colour.
const TONES: [[u8; 3]; 2] = [INK, [140, 140, 140]];
/// Dashes of laws that are lines, one after another.
const LINES: [&[f32]; 4] = [&[], &[8.0, 2.5, 1.5, 2.5], &[1.4, 2.2], &[14.0, 3.0]];
/// Dashes of laws that are dashed.
const DASHES: [&[f32]; 4] = [
    &[5.0, 3.0],
    &[2.5, 2.5],
    &[6.0, 2.5, 1.5, 2.5, 1.5, 2.5],
    &[9.0, 5.0],
];

/// How many outlines of markers there are.
const OUTLINES: usize = 8;

/// A marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Marker {
    /// Which outline, from 0.
    outline: usize,
    filled: bool,
    /// Whether there is a dot within, of the other colour: after all outlines were used once.
    dotted: bool,
}

/// How one series looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) style: ChartStyle,
    pub(super) colour: [u8; 3],
    pub(super) marker: Option<Marker>,
    /// Its line, if it has one.
    pub(super) pencil: Option<Pencil>,
}

/// How the series of a chart look, by style and name.
pub(super) struct Looks {
    known: Vec<(ChartStyle, String, Look)>,
}

impl Looks {
    pub(super) fn of(panels: &[ChartPanel]) -> Self {
        // Names in order of appearance, with the largest number of points.
        let mut names: Vec<(ChartStyle, &str, usize)> = Vec::new();
        for series in panels.iter().flat_map(|panel| &panel.series) {
            let same =
                |name: &&mut (ChartStyle, &str, usize)| (name.0, name.1) == (series.style, &series.label);
            match names.iter_mut().find(same) {
                Some(name) => name.2 = name.2.max(series.points.len()),
                None => names.push((series.style, &series.label, series.points.len())),
            }
        }
        let count = |style: ChartStyle| names.iter().filter(|name| name.0 == style).count();
        let measured = count(ChartStyle::Measured) + count(ChartStyle::Points);
        let mut used = [0; 4];
        let mut colours = 0;
        let mut known: Vec<(ChartStyle, String, Look)> = Vec::new();
        for &(style, label, points) in &names {
            // Points of a reference belong to the measured series whose name theirs ends with.
            let owner = known.iter().find(|(of, name, _)| {
                let own = label
                    .strip_suffix(name.as_str())
                    .is_some_and(|rest| rest.ends_with(", "));
                (style, *of) == (ChartStyle::Points, ChartStyle::Measured) && own
            });
            if let Some(&(_, _, look)) = owner {
                let marker = look.marker.map(|marker| Marker {
                    filled: false,
                    ..marker
                });
                let pencil = None;
                known.push((
                    style,
                    label.to_string(),
                    Look {
                        style,
                        marker,
                        pencil,
                        ..look
                    },
                ));
                continue;
            }
            let place = used[style as usize];
            used[style as usize] += 1;
            let marked = matches!(style, ChartStyle::Measured | ChartStyle::Points);
            let dense = points > MARKED;
            // As many laws as measured series belong to them one by one.
            let paired = !marked && measured > 1 && count(style) == count(ChartStyle::Measured);
            let colour = if paired {
                COLOURS[place % COLOURS.len()]
            } else if !marked && measured > 0 {
                TONES[place % TONES.len()]
            } else {
                colours += 1;
                // Outlines that come again have other colours.
                let turn = (colours - 1) / COLOURS.len();
                COLOURS[(colours - 1 + 3 * turn) % COLOURS.len()]
            };
            let dashes = match style {
                ChartStyle::Line if paired => &[],
                ChartStyle::Line => LINES[place % LINES.len()],
                ChartStyle::Dashed if paired => DASHES[0],
                ChartStyle::Dashed => DASHES[place % DASHES.len()],
                _ => &[],
            };
            let marker = (marked && !(dense && style == ChartStyle::Measured)).then(|| Marker {
                outline: (colours - 1) % OUTLINES,
                filled: style == ChartStyle::Measured,
                dotted: (colours - 1) / OUTLINES % 2 == 1,
            });
            let pencil = match style {
                ChartStyle::Points => None,
                ChartStyle::Measured if marker.is_some() => Some(Pencil::new(pale(colour), 2.0)),
                _ => Some(Pencil {
                    dashes,
                    ..Pencil::new(colour, 3.0)
                }),
            };
            let look = Look {
                style,
                colour,
                marker,
                pencil,
            };
            known.push((style, label.to_string(), look));
        }
        Self { known }
    }

    pub(super) fn find(&self, series: &ChartSeries) -> Look {
        let found = (self.known.iter()).find(|known| (known.0, &known.1) == (series.style, &series.label));
        found.expect("every series of the chart was looked at").2
    }
}

/// Half way to white.
fn pale(colour: [u8; 3]) -> [u8; 3] {
    colour.map(|c| c / 2 + 127)
}

/// Draws the marker of a series.
pub(super) fn draw_marker(drawing: &mut Drawing, look: Look, at: (f32, f32)) {
    let Some(marker) = look.marker else { return };
    if marker.filled {
        let outline = outline(marker.outline, at, RADIUS);
        // A white rim keeps markers apart that lie on each other.
        drawing.polygon(outline.clone(), Pencil::new([255; 3], 2.5));
        drawing.fill(outline, look.colour);
    } else {
        let outline = outline(marker.outline, at, 1.15 * RADIUS);
        drawing.polygon(outline.clone(), Pencil::new([255; 3], 5.0));
        drawing.polygon(outline, Pencil::new(look.colour, 2.6));
    }
    if marker.dotted {
        let colour = if marker.filled { [255; 3] } else { look.colour };
        drawing.fill(outline(0, at, 0.36 * RADIUS), colour);
    }
}

/// Corners of a marker.
fn outline(which: usize, (x, y): (f32, f32), size: f32) -> Vec<(f32, f32)> {
    let regular = |corners: usize, radius: f32, first: f32| -> Vec<(f32, f32)> {
        (0..corners)
            .map(|i| {
                let (sine, cosine) = (first + i as f32 * TAU / corners as f32).sin_cos();
                (x + radius * cosine, y + radius * sine)
            })
            .collect()
    };
    let crossed = |turn: f32| -> Vec<(f32, f32)> {
        let (long, short) = (1.25 * size, 0.45 * size);
        let arm = [(long, -short), (long, short), (short, short)];
        let (sine, cosine) = turn.sin_cos();
        (0..4)
            .flat_map(|quarter| {
                arm.map(|(a, b)| match quarter {
                    0 => (a, b),
                    1 => (-b, a),
                    2 => (-a, -b),
                    _ => (b, -a),
                })
            })
            .map(|(a, b)| (x + a * cosine - b * sine, y + a * sine + b * cosine))
            .collect()
    };
    // Radii for areas that look alike.
    match which {
        0 => regular(28, size, 0.0),
        1 => regular(4, 1.3 * size, 0.25 * PI),
        2 => regular(3, 1.45 * size, -0.5 * PI),
        3 => regular(4, 1.35 * size, 0.0),
        4 => regular(3, 1.45 * size, 0.5 * PI),
        5 => crossed(0.25 * PI),
        6 => crossed(0.0),
        _ => regular(5, 1.2 * size, -0.5 * PI),
    }
}
