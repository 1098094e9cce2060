//! Appearance of series: colours, dashes, markers.

use super::{Panel, Series, Style};
use crate::colour::{BLUE, INK, VERMILION};
use crate::drawing::{Colour, Drawing, Pencil, Place};
use std::f32::consts::{PI, TAU};

/// Series with more points are lines without markers.
pub(super) const MARKED: usize = 60;
/// Radius of a marker (pixels).
pub(super) const RADIUS: f32 = 9.5;

/// Colours that colour-blind readers tell apart (after Okabe and Ito), neighbours of different lightness.
const COLOURS: [Colour; 8] =
    [BLUE, VERMILION, [0, 158, 115], INK, [204, 121, 167], [230, 159, 0], [86, 180, 233], [120, 80, 20]];
/// Tones of lines that belong to no colour.
const TONES: [Colour; 2] = [INK, [140, 140, 140]];
/// Pale tones of references below everything.
const PALE: [Colour; 3] = [[190, 205, 170], [200, 195, 215], [225, 205, 175]];
/// Dashes of laws that are lines, one after another.
const LINES: [&[f32]; 4] = [&[], &[8.0, 2.5, 1.5, 2.5], &[1.4, 2.2], &[14.0, 3.0]];
/// Dashes of laws that are dashed.
const DASHES: [&[f32]; 4] = [&[5.0, 3.0], &[2.5, 2.5], &[6.0, 2.5, 1.5, 2.5, 1.5, 2.5], &[9.0, 5.0]];

/// Number of outlines of markers.
const OUTLINES: usize = 8;

/// A marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Marker {
    /// Number of its outline; after all outlines were used once, a dot of the other colour is added.
    number: usize,
    filled: bool,
}

/// Appearance of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) style: Style,
    pub(super) colour: Colour,
    pub(super) marker: Option<Marker>,
    /// Its line, if it has one.
    pub(super) pencil: Option<Pencil>,
}

/// Appearance of the series of a chart, by style and name.
pub(super) struct Looks {
    known: Vec<(Style, String, Look)>,
}

/// A series that is drawn with markers if it has few points.
fn is_marked(style: Style) -> bool {
    matches!(style, Style::Measured | Style::Points | Style::Overlaid)
}

impl Looks {
    pub(super) fn of(panels: &[Panel]) -> Self {
        // Names in order of appearance, with the largest number of points.
        let mut names: Vec<(Style, &str, usize)> = Vec::new();
        for Series { style, label, points, .. } in panels.iter().flat_map(|panel| &panel.series) {
            match names.iter_mut().find(|name| (name.0, name.1) == (*style, label)) {
                Some(name) => name.2 = name.2.max(points.len()),
                None => names.push((*style, label, points.len())),
            }
        }
        let count = |style: Style| names.iter().filter(|name| name.0 == style).count();
        let marked = names.iter().filter(|name| is_marked(name.0)).count();
        // As many laws as measured series belong to them one by one, if they are named after them.
        let is_paired = |style: Style| {
            let measured = || names.iter().filter(|name| name.0 == Style::Measured);
            let mut laws = names.iter().filter(|name| name.0 == style);
            let own = |law: &(Style, &str, usize)| measured().any(|name| law.1.ends_with(name.1));
            marked > 1 && count(style) == count(Style::Measured) && laws.all(own)
        };
        let paired = [Style::Line, Style::Dashed].map(|style| (style, is_paired(style)));
        let mut used = [0; 6];
        let mut colours = 0;
        let mut known: Vec<(Style, String, Look)> = Vec::new();
        for &(style, label, points) in &names {
            let is_paired = paired.contains(&(style, true));
            let index = used[style as usize];
            let look = if let Some(look) = owner(&known, style, label) {
                look
            } else {
                used[style as usize] += 1;
                let colour = if style == Style::Reference {
                    PALE[index % PALE.len()]
                } else if is_paired {
                    COLOURS[index % COLOURS.len()]
                } else if !is_marked(style) && marked > 0 {
                    TONES[index % TONES.len()]
                } else {
                    colours += 1;
                    // Outlines that come again have other colours.
                    let turn = (colours - 1) / COLOURS.len();
                    COLOURS[(colours - 1 + 3 * turn) % COLOURS.len()]
                };
                let dense = points > MARKED && style != Style::Points;
                let marker = (is_marked(style) && !dense).then(|| Marker {
                    number: (colours - 1) % (2 * OUTLINES),
                    filled: style == Style::Measured,
                });
                let dashes = match style {
                    Style::Line if !is_paired => LINES[index % LINES.len()],
                    Style::Dashed if !is_paired => DASHES[index % DASHES.len()],
                    Style::Dashed | Style::Overlaid => DASHES[0],
                    _ => &[],
                };
                let pencil = match style {
                    Style::Reference => Some(Pencil::new(colour, 12.0)),
                    Style::Measured if !dense => Some(Pencil::new(pale(colour), 2.0)),
                    _ if marker.is_some() => None,
                    _ => Some(Pencil::dashed(colour, 3.0, dashes)),
                };
                Look { style, colour, marker, pencil }
            };
            known.push((style, label.to_string(), look));
        }
        Self { known }
    }

    pub(super) fn find(&self, series: &Series) -> Look {
        let found = (self.known.iter()).find(|known| (known.0, &known.1) == (series.style, &series.label));
        found.expect("every series of the chart was looked at").2
    }
}

/// The look of reference points that belong to a measured series, whose name theirs ends with: its colour, open markers.
fn owner(known: &[(Style, String, Look)], style: Style, label: &str) -> Option<Look> {
    let (.., look) = known.iter().find(|(of, name, _)| {
        let rest = label.strip_suffix(name.as_str());
        *of == Style::Measured && rest.is_some_and(|rest| rest.ends_with(", "))
    })?;
    let marker = look.marker.map(|marker| Marker { filled: false, ..marker });
    (style == Style::Points).then_some(Look { style, marker, pencil: None, ..*look })
}

/// Half way to white.
fn pale(colour: Colour) -> Colour {
    colour.map(|c| c / 2 + 127)
}

/// Draws the marker of a series.
pub(super) fn draw_marker(drawing: &mut Drawing, look: Look, at: Place) {
    let (Some(Marker { number, filled }), white) = (look.marker, [255; 3]) else {
        return;
    };
    // A white rim keeps markers apart that lie on each other.
    let (size, rim) = if filled { (RADIUS, 2.5) } else { (1.15 * RADIUS, 5.0) };
    let corners = outline(number % OUTLINES, at, size);
    drawing.outline(corners.clone(), Pencil::new(white, rim));
    if filled {
        drawing.fill(corners, look.colour, 1.0);
    } else {
        drawing.outline(corners, Pencil::new(look.colour, 2.6));
    }
    if number >= OUTLINES {
        let colour = if filled { white } else { look.colour };
        drawing.fill(outline(0, at, 0.36 * RADIUS), colour, 1.0);
    }
}

/// Corners of a marker.
fn outline(which: usize, (x, y): Place, size: f32) -> Vec<Place> {
    let turned = |(a, b): Place, angle: f32| {
        let (sine, cosine) = angle.sin_cos();
        (x + a * cosine - b * sine, y + a * sine + b * cosine)
    };
    let regular = |corners: usize, radius: f32, first: f32| -> Vec<Place> {
        let angles = (0..corners).map(|i| first + i as f32 * TAU / corners as f32);
        angles.map(|angle| turned((radius, 0.0), angle)).collect()
    };
    let crossed = |first: f32| -> Vec<Place> {
        let (long, short) = (1.25 * size, 0.45 * size);
        let arm = [(long, -short), (long, short), (short, short)];
        let quarters = (0..4).map(|quarter| first + 0.25 * TAU * quarter as f32);
        quarters.flat_map(|angle| arm.map(|corner| turned(corner, angle))).collect()
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
