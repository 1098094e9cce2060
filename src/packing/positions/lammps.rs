//! Files of LAMMPS and LIGGGHTS: dumps (`ITEM: ...`) and data files. Of a dump the last frame counts; positions are shifted so that the
//! box of the file begins at the origin, and wrapped into it where it is periodic.

use super::columns::{Alias, Columns, Dialect, KIND, Layout};
use super::table::{self, TextLine, words};
use super::{Found, MOST, Placement};
use crate::input;
use crate::math::Vec3;
use std::collections::BTreeMap;

const DUMP: &str = "expected a dump of LAMMPS or LIGGGHTS: ITEM: TIMESTEP, NUMBER OF ATOMS, BOX BOUNDS and ATOMS with x, y, z or xs, ys, zs";
const DATA: &str =
    "expected a data file of LAMMPS or LIGGGHTS with the atom style sphere, granular, ellipsoid or atomic";

/// Most columns of a dump.
const MOST_COLUMNS: usize = 1_000;

/// Columns that a note names.
const MOST_NAMED: usize = 20;

#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: [f64; 3],
    size: [f64; 3],
    periodic: [bool; 3],
}

impl Bounds {
    /// The names of columns, where `units` are those of length (m) and time (s).
    fn dialect(&self, units: [f64; 2], several: bool) -> Dialect {
        let [scale, _] = units;
        let alias = |name, target, factor, constant| Alias { name, target, factor, constant };
        let mut aliases = Vec::new();
        for (axis, [plain, scaled, unwrapped]) in
            [["x", "xs", "xu"], ["y", "ys", "yu"], ["z", "zs", "zu"]].into_iter().enumerate()
        {
            let (low, size) = (self.low[axis] * scale, self.size[axis] * scale);
            aliases.push(alias(plain, axis, scale, -low));
            aliases.push(alias(scaled, axis, size, 0.0));
            aliases.push(alias(unwrapped, axis, scale, -low));
        }
        if several {
            aliases.push(alias("type", KIND, 1.0, -1.0));
        }
        Dialect { lenient: true, aliases, no_position: false, units: Some(units) }
    }

    /// Brings a position back through periodic faces.
    fn wrap(&self, position: &mut Vec3, scale: f64) {
        for axis in 0..3 {
            let size = self.size[axis] * scale;
            if self.periodic[axis] && !(0.0..=size).contains(&position[axis]) {
                position[axis] -= size * (position[axis] / size).floor();
            }
        }
    }

    fn note(&self, scale: f64, columns: &Columns) -> Option<String> {
        let [x, y, z] = self.low.map(|low| low * scale);
        let shifted = !columns.map_positions() && self.low.iter().any(|low| *low != 0.0);
        shifted.then(|| {
            format!("positions are relative to the lower corner of the box in the file, ({x}, {y}, {z}) m")
        })
    }
}

/// Two numbers, the first below the second.
fn interval(line: &str) -> Option<[f64; 2]> {
    let mut numbers = line.split_whitespace().map(str::parse::<f64>);
    let (low, high) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    (low.is_finite() && high.is_finite() && low < high && (high - low).is_finite()).then_some([low, high])
}

/// Units of length (m) and time (s) of a style of units; a file that names none is in SI units.
fn units_of(style: &str) -> Result<[f64; 2], String> {
    match style {
        "" | "si" => Ok([1.0, 1.0]),
        "cgs" => Ok([1e-2, 1.0]),
        "micro" => Ok([1e-6, 1e-6]),
        "nano" => Ok([1e-9, 1e-9]),
        _ => Err(format!("the units are `{}`, known here: si, cgs, micro, nano", input::word(style))),
    }
}

/// The columns that nothing here is made of, for a note.
fn left_out(header: &[&str], layout: &Layout) -> Option<String> {
    let used: Vec<usize> = layout.sources().collect();
    let left = header.iter().enumerate().filter(|(n, _)| !used.contains(n)).take(MOST_NAMED);
    let left: Vec<String> = left.map(|(_, name)| input::word(name)).collect();
    (!left.is_empty()).then(|| format!("columns that are not read: {}", left.join(", ")))
}

/// Reads the last frame of a dump.
pub(super) fn dump(text: &str, name: &str, columns: &Columns, several: bool) -> Result<Found, String> {
    let bad = |line: usize, what: &str| format!("{name}:{line}: {what}; {DUMP}");
    let mut lines = text.lines().map(str::trim).zip(1..);
    let mut frames = 0;
    let (mut step, mut units, mut count, mut bounds, mut last) = ("", [1.0, 1.0], None, None, None);
    while let Some((line, number)) = lines.next() {
        let Some(item) = line.strip_prefix("ITEM:").map(str::trim) else {
            if line.is_empty() {
                continue;
            }
            return Err(bad(number, &format!("`{}` stands where an ITEM begins", input::word(line))));
        };
        if let Some(header) = item.strip_prefix("ATOMS") {
            let (Some(count), Some(bounds)) = (count.take(), bounds.take()) else {
                return Err(bad(number, "ATOMS without NUMBER OF ATOMS and BOX BOUNDS above it"));
            };
            let rows = lines.clone().take(count);
            let has = lines.by_ref().take(count).count();
            if has < count {
                return Err(bad(number, &format!("{count} particles, but only {has} lines of them")));
            }
            last = Some((number, header, bounds, rows, step));
            frames += 1;
            continue;
        }
        let mut next = || lines.next().unwrap_or(("", number + 1));
        if item == "NUMBER OF ATOMS" {
            let (has, number) = next();
            count = has.parse().ok().filter(|count: &usize| *count <= MOST);
            if count.is_none() {
                let has = input::word(has);
                return Err(bad(
                    number,
                    &format!("the number of particles is `{has}`, at most {MOST} are read"),
                ));
            }
        } else if let Some(kinds) = item.strip_prefix("BOX BOUNDS") {
            if kinds.contains("xy") || kinds.contains("abc") {
                return Err(bad(number, "the box is skewed, which no box here is"));
            }
            let mut found = Bounds { low: [0.0; 3], size: [0.0; 3], periodic: [false; 3] };
            let mut kinds = kinds.split_whitespace();
            for axis in 0..3 {
                let (line, number) = next();
                let [low, high] = interval(line)
                    .ok_or_else(|| bad(number, "expected the lower and the upper end of the box"))?;
                (found.low[axis], found.size[axis]) = (low, high - low);
                found.periodic[axis] = kinds.next().is_some_and(|kind| kind.starts_with('p'));
            }
            bounds = Some(found);
        } else {
            let (line, _) = next();
            match item {
                "TIMESTEP" => step = line,
                "UNITS" => units = units_of(line).map_err(|e| bad(number + 1, &e))?,
                _ => {}
            }
        }
    }
    let Some((number, header, bounds, rows, step)) = last else {
        return Err(format!("{name}: holds no particles; {DUMP}"));
    };
    let [scale, _] = units;
    let header: Vec<&str> = header.split_whitespace().take(MOST_COLUMNS).collect();
    let layout =
        Layout::new(&header, columns, &bounds.dialect(units, several)).map_err(|e| bad(number, &e))?;
    let left = left_out(&header, &layout);
    let mut placements = Vec::new();
    for (row, line) in rows {
        let line = TextLine { line, fields: &words(row) };
        let mut placement = table::placement(&layout, &line, (name, DUMP))?;
        if !columns.map_positions() {
            bounds.wrap(&mut placement.position, scale);
        }
        placements.push(placement);
    }
    if placements.is_empty() {
        return Err(format!("{name}: holds no particles; {DUMP}"));
    }
    let several = (frames > 1)
        .then(|| format!("of {frames} frames the last one is read, that of time step {}", input::word(step)));
    Ok(Found {
        placements,
        notes: several.into_iter().chain(bounds.note(scale, columns)).chain(left).collect(),
    })
}

pub(super) fn data(text: &str, name: &str, columns: &Columns, several: bool) -> Result<Found, String> {
    let bad = |line: usize, what: &str| format!("{name}:{line}: {what}; {DATA}");
    let mut bounds = Bounds { low: [0.0; 3], size: [0.0; 3], periodic: [false; 3] };
    let (mut count, mut section, mut style, mut ellipsoids) = (0, "", "", false);
    let mut layout: Option<Layout> = None;
    let mut placements: Vec<Placement> = Vec::new();
    let mut motions: BTreeMap<u64, [Vec3; 2]> = BTreeMap::new();
    for (line, number) in text.lines().zip(1..).skip(1) {
        let (words_of, comment) = line.split_once('#').unwrap_or((line, ""));
        let fields = words(words_of);
        let Some((_, first)) = fields.first() else {
            continue;
        };
        if first.starts_with(|c: char| c.is_ascii_alphabetic()) {
            (section, layout) = (words_of.trim(), None);
            if section == "Atoms" {
                style = comment.trim();
            }
            continue;
        }
        match section {
            "" => {
                let keys: Vec<&str> = fields.iter().map(|(_, word)| *word).collect();
                match keys[..] {
                    [n, "atoms"] => {
                        count = (n.parse().ok().filter(|count| *count <= MOST)).ok_or_else(|| {
                            bad(number, &format!("`{}` atoms, at most {MOST} are read", input::word(n)))
                        })?;
                    }
                    [_, _, low, _] => {
                        if let Some(axis) = ["xlo", "ylo", "zlo"].iter().position(|name| *name == low) {
                            let [low, high] = interval(words_of).ok_or_else(|| {
                                bad(number, "the lower end of the box must be below the upper")
                            })?;
                            (bounds.low[axis], bounds.size[axis]) = (low, high - low);
                        }
                    }
                    [_, _, _, "xy", ..] => {
                        return Err(bad(number, "the box is skewed, which no box here is"));
                    }
                    _ => {}
                }
            }
            "Atoms" | "Velocities" => {
                let of_atoms = section == "Atoms";
                if layout.is_none() {
                    let made = if of_atoms {
                        let names = atom_columns(style, fields.len());
                        let names = names.ok_or_else(|| {
                            let style = input::word(style);
                            bad(
                                number,
                                &format!("atoms of the style `{style}` with {} numbers", fields.len()),
                            )
                        })?;
                        Layout::new(&names, columns, &bounds.dialect([1.0, 1.0], several))
                    } else {
                        let names = ["id", "vx", "vy", "vz", "wx", "wy", "wz"];
                        let names = &names[..if fields.len() == 4 { 4 } else { names.len() }];
                        let dialect = Dialect { no_position: true, ..Dialect::default() };
                        Layout::new(names, &Columns::default(), &dialect)
                    };
                    layout = Some(made.map_err(|e| bad(number, &e))?);
                }
                let layout = layout.as_ref().expect("made above");
                let line = TextLine { line: number, fields: &fields };
                let placement = table::placement(layout, &line, (name, DATA))?;
                if of_atoms {
                    placements.push(placement);
                } else {
                    motions.extend(placement.id.zip(placement.motion));
                }
                if placements.len().max(motions.len()) > count {
                    let rows = if of_atoms { "atoms" } else { "velocities" };
                    return Err(bad(number, &format!("more {rows} than the {count} atoms of the head")));
                }
            }
            "Ellipsoids" => ellipsoids = true,
            _ => {}
        }
    }
    if placements.is_empty() || placements.len() < count {
        let has = placements.len();
        return Err(format!("{name}: {count} atoms in its head, but {has} in its section Atoms; {DATA}"));
    }
    if !motions.is_empty() {
        for placement in &mut placements {
            let motion = placement.id.and_then(|id| motions.get(&id).copied());
            placement.motion = Some(motion.unwrap_or_default());
        }
    }
    let left = ellipsoids.then(|| "axes and orientations of its section Ellipsoids are not read".to_owned());
    Ok(Found { placements, notes: bounds.note(1.0, columns).into_iter().chain(left).collect() })
}

/// The names of the numbers of an atom; images through periodic faces may follow.
fn atom_columns(style: &str, count: usize) -> Option<Vec<&'static str>> {
    let names: &[&str] = match (style.split_whitespace().next().unwrap_or_default(), count) {
        ("atomic" | "", 5 | 8) => &["id", "type", "x", "y", "z"],
        ("sphere" | "granular" | "", 7 | 10) => &["id", "type", "diameter", "density", "x", "y", "z"],
        ("ellipsoid", 7 | 10) => &["id", "type", "flag", "density", "x", "y", "z"],
        _ => return None,
    };
    Some(names.iter().copied().chain(["ix", "iy", "iz"]).take(count).collect())
}
