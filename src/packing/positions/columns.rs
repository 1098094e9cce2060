//! Columns of files of positions: their names, units and factors, and the particle that a line of numbers is.

use super::Placement;
use crate::input;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use std::collections::BTreeMap;
use std::ops::Range;

/// Physical quantity of a column, which has its units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Length,
    Angle,
    Velocity,
    AngularVelocity,
    Plain,
}

/// Names of all columns, what they are, and names by which other programs know them.
const COLUMNS: [(&str, Quantity, &[&str]); 20] = [
    ("x", Quantity::Length, &["points:0"]),
    ("y", Quantity::Length, &["points:1"]),
    ("z", Quantity::Length, &["points:2"]),
    ("rx", Quantity::Angle, &[]),
    ("ry", Quantity::Angle, &[]),
    ("rz", Quantity::Angle, &[]),
    ("id", Quantity::Plain, &[]),
    ("kind", Quantity::Plain, &[]),
    ("diameter", Quantity::Length, &["equivalent_diameter"]),
    ("qx", Quantity::Plain, &["orientation:1"]),
    ("qy", Quantity::Plain, &["orientation:2"]),
    ("qz", Quantity::Plain, &["orientation:3"]),
    ("qw", Quantity::Plain, &["orientation:0"]),
    ("vx", Quantity::Velocity, &["velocity:0", "v:0"]),
    ("vy", Quantity::Velocity, &["velocity:1", "v:1"]),
    ("vz", Quantity::Velocity, &["velocity:2", "v:2"]),
    ("wx", Quantity::AngularVelocity, &["angular_velocity:0", "omega:0", "omegax"]),
    ("wy", Quantity::AngularVelocity, &["angular_velocity:1", "omega:1", "omegay"]),
    ("wz", Quantity::AngularVelocity, &["angular_velocity:2", "omega:2", "omegaz"]),
    ("radius", Quantity::Length, &[]),
];
const ANGLES: Range<usize> = 3..6;
const ID: usize = 6;
pub(super) const KIND: usize = 7;
const DIAMETER: usize = 8;
const QUATERNION: Range<usize> = 9..13;
const MOTION: Range<usize> = 13..19;
const RADIUS: usize = 19;

/// Numbers of particles stay below this, so that programs that read them as floating point keep them apart.
pub(super) const MAX_ID: u64 = 1 << 53;

/// Largest deviation of the squared length of a quaternion from 1 if it was written with few digits.
const FEW_DIGITS: f64 = 1e-5;
/// Largest deviation that is taken as rounding.
const ROUNDING: f64 = 1e-12;

/// Columns that an error lists.
const LISTED: usize = 12;

const MAP: &str = "in the case `columns` says where each number is, e.g. columns = { x = \"Points:0\", diameter = \"2*radius\" }";

/// Names and units of the columns that [`Columns`] may map.
pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    COLUMNS.iter().map(|(name, quantity, _)| {
        let unit = match quantity {
            Quantity::Length => "m",
            Quantity::Angle => "degrees",
            Quantity::Velocity => "m/s",
            Quantity::AngularVelocity => "1/s",
            Quantity::Plain => "-",
        };
        (*name, unit)
    })
}

/// Columns that the case maps: by column, the text `[factor *] name [unit] [+ constant]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns(pub(super) Vec<(usize, Term)>);

/// A column of a file, times a factor, plus a constant (SI units).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Term {
    factor: f64,
    name: String,
    unit: Option<String>,
    constant: f64,
}

impl Columns {
    /// From the texts of a case; the error names the key and says what is wrong with its text.
    pub fn new(texts: &BTreeMap<String, String>) -> Result<Self, (String, String)> {
        let mut columns = Vec::new();
        for (key, text) in texts {
            let bad = |what: String| (key.clone(), what);
            let Some(target) = COLUMNS.iter().position(|(name, ..)| name == key) else {
                let known: Vec<&str> = names().map(|(name, _)| name).collect();
                return Err(bad(format!("is none of {}", known.join(", "))));
            };
            columns.push((target, term(text).map_err(bad)?));
        }
        Ok(Self(columns))
    }

    /// True if the case maps a coordinate.
    pub(super) fn map_positions(&self) -> bool {
        (0..3).any(|target| self.map(target))
    }

    fn map(&self, target: usize) -> bool {
        self.0.iter().any(|(mapped, _)| *mapped == target)
    }
}

fn term(text: &str) -> Result<Term, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let (factor, rest) = match text.split_once('*') {
        Some((factor, rest)) => match number(factor) {
            Some(factor) if factor != 0.0 => (factor, rest),
            _ => return Err(format!("is \"{}\": before `*` stands a number but 0", input::word(text))),
        },
        None => (1.0, text),
    };
    let constant = [(" + ", 1.0), (" - ", -1.0)].into_iter().find_map(|(sign, of)| {
        let (rest, constant) = rest.rsplit_once(sign)?;
        Some((rest, of * number(constant)?))
    });
    let (rest, constant) = constant.unwrap_or((rest, 0.0));
    let (name, unit) = split_unit(rest);
    if name.is_empty() {
        return Err(format!("is \"{}\", which names no column", input::word(text)));
    }
    Ok(Term { factor, name, unit: unit.map(str::to_owned), constant })
}

/// The name in a header in lower case, without quotes, and the unit in brackets behind it, or before the number of a component:
/// `velocity (m/s):0` is `velocity:0`.
fn split_unit(field: &str) -> (String, Option<&str>) {
    let field = unquoted(field);
    let component = field.rsplit_once(':').filter(|(_, number)| number.parse::<u32>().is_ok());
    let (rest, component) = component.map_or((field, None), |(rest, number)| (rest, Some(number)));
    for (open, close) in [('[', ']'), ('(', ')')] {
        let parts = rest.strip_suffix(close).and_then(|rest| rest.rsplit_once(open));
        // A number is that of a component, as in `c_quat[1]`.
        if let Some((name, unit)) = parts.filter(|(_, unit)| unit.trim().parse::<u32>().is_err()) {
            let component = component.map_or_else(String::new, |number| format!(":{number}"));
            return (name.trim().to_lowercase() + &component, Some(unit.trim()));
        }
    }
    (field.to_lowercase(), None)
}

/// A field without blanks and quotes around it.
pub(super) fn unquoted(field: &str) -> &str {
    let field = field.trim();
    let inside = |quote| field.strip_prefix(quote)?.strip_suffix(quote);
    inside('"').or_else(|| inside('\'')).map_or(field, str::trim)
}

/// SI units (angles: degrees) in one unit of a quantity.
fn unit_factor(quantity: Quantity, unit: &str) -> Result<f64, String> {
    const LENGTHS: [(&str, f64); 9] = [
        ("m", 1.0),
        ("cm", 1e-2),
        ("mm", 1e-3),
        ("um", 1e-6),
        ("\u{b5}m", 1e-6),
        ("\u{3bc}m", 1e-6),
        ("nm", 1e-9),
        ("in", 0.0254),
        ("inch", 0.0254),
    ];
    const ANGLES: [(&str, f64); 5] = [
        ("deg", 1.0),
        ("degree", 1.0),
        ("degrees", 1.0),
        ("\u{b0}", 1.0),
        ("rad", 180.0 / std::f64::consts::PI),
    ];
    const ANGULAR_VELOCITIES: [(&str, f64); 3] =
        [("1/s", 1.0), ("rad/s", 1.0), ("deg/s", std::f64::consts::PI / 180.0)];
    let of = |units: &[(&str, f64)], unit: &str| {
        units.iter().find(|(name, _)| *name == unit).map(|(_, factor)| *factor)
    };
    let (factor, known) = match quantity {
        Quantity::Length => (of(&LENGTHS, unit), "m, cm, mm, um, nm, in"),
        Quantity::Velocity => {
            (unit.strip_suffix("/s").and_then(|unit| of(&LENGTHS, unit)), "m/s, cm/s, mm/s, um/s")
        }
        Quantity::Angle => (of(&ANGLES, unit), "deg, rad"),
        Quantity::AngularVelocity => (of(&ANGULAR_VELOCITIES, unit), "1/s, rad/s, deg/s"),
        Quantity::Plain => (of(&[("-", 1.0), ("", 1.0)], unit), "none, or -"),
    };
    factor.ok_or_else(|| format!("has the unit `{}`; known here: {known}", input::word(unit)))
}

/// A column of a kind of files that stands for one of ours.
#[derive(Clone, Debug)]
pub(super) struct Alias {
    pub(super) name: &'static str,
    pub(super) target: usize,
    pub(super) factor: f64,
    pub(super) constant: f64,
}

/// Conventions of a kind of files.
#[derive(Clone, Debug, Default)]
pub(super) struct Dialect {
    /// Columns that are unknown are left out, also without a map.
    pub(super) lenient: bool,
    /// Names of its own.
    pub(super) aliases: Vec<Alias>,
    /// Rows have no position: velocities apart.
    pub(super) no_position: bool,
    /// Units of length (m) and time (s) of numbers without a unit of their own; SI units if there are none.
    pub(super) units: Option<[f64; 2]>,
}

impl Dialect {
    /// SI units in one unit of a quantity, with the unit that the file or the case gives for it.
    fn factor(&self, quantity: Quantity, unit: Option<&str>) -> Result<f64, String> {
        match (unit, self.units, quantity) {
            (Some(unit), ..) => unit_factor(quantity, unit),
            (None, Some([length, _]), Quantity::Length) => Ok(length),
            (None, Some([length, time]), Quantity::Velocity) => Ok(length / time),
            (None, Some([_, time]), Quantity::AngularVelocity) => Ok(1.0 / time),
            _ => Ok(1.0),
        }
    }
}

/// Positions of the numbers of a particle among those of a line.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    wanted: Vec<Wanted>,
    /// Numbers in a line.
    pub(super) fields: usize,
}

#[derive(Clone, Copy, Debug)]
struct Wanted {
    target: usize,
    source: usize,
    factor: f64,
    constant: f64,
}

pub(super) trait Line {
    /// The number in a column; `None` if there is none.
    fn number(&self, column: usize) -> Option<f64>;
    /// The text in the column, for a message.
    fn word(&self, column: usize) -> String;
    /// Position of the column in the line, from 1.
    fn column(&self, column: usize) -> usize;
    /// Number of the line, from 1.
    fn line(&self) -> usize;
}

impl Layout {
    /// The first columns of all, `fields` of them.
    pub(super) fn first(fields: usize) -> Self {
        let wanted = (0..fields).map(|n| Wanted { target: n, source: n, factor: 1.0, constant: 0.0 });
        Self { wanted: wanted.collect(), fields }
    }

    /// From the names of all columns.
    pub(super) fn new<S: AsRef<str>>(
        header: &[S],
        columns: &Columns,
        dialect: &Dialect,
    ) -> Result<Self, String> {
        let fields: Vec<(String, Option<&str>)> =
            header.iter().map(|field| split_unit(field.as_ref())).collect();
        let mut wanted: Vec<Wanted> = Vec::new();
        for (target, term) in &columns.0 {
            let (key, quantity, _) = COLUMNS[*target];
            let Some(source) = fields.iter().position(|(name, _)| *name == term.name) else {
                let named = input::word(&term.name);
                let all: Vec<String> =
                    (fields.iter().take(LISTED).map(|(name, _)| input::word(name))).collect();
                let more = if fields.len() > LISTED { ", ..." } else { "" };
                return Err(format!(
                    "no column `{named}`, which `columns.{key}` of the case names; the columns are {}{more}",
                    all.join(", ")
                ));
            };
            let unit = term.unit.as_deref().or(fields[source].1);
            let unit = (dialect.factor(quantity, unit))
                .map_err(|what| format!("`{}`, for `{key}`, {what}", input::word(&term.name)))?;
            let factor = term.factor * unit;
            wanted.push(Wanted { target: *target, source, factor, constant: term.constant });
        }
        let lenient = dialect.lenient || !columns.0.is_empty();
        for (source, (name, unit)) in fields.iter().enumerate() {
            let is = |(known, _, others): &(&str, Quantity, &[&str])| {
                known == name || others.contains(&name.as_str())
            };
            let of_ours = |target: usize| (target, dialect.factor(COLUMNS[target].1, *unit), 0.0);
            let alias = dialect.aliases.iter().find(|alias| alias.name == name);
            let known = alias.map(|alias| (alias.target, Ok(alias.factor), alias.constant));
            let (target, factor, constant) = match known.or_else(|| COLUMNS.iter().position(is).map(of_ours))
            {
                Some(known) => known,
                None if lenient => continue,
                None => {
                    let name = input::word(name);
                    return Err(format!("unknown column `{name}`; {MAP}, and others are left out"));
                }
            };
            if columns.map(target) {
                continue;
            }
            let factor = factor.map_err(|what| format!("column `{name}` {what}"))?;
            let is_known = wanted.iter().any(|other| other.target == target);
            if is_known && !lenient {
                return Err(format!("column `{name}` appears twice"));
            }
            if !is_known {
                wanted.push(Wanted { target, source, factor, constant });
            }
        }
        let layout = Self { wanted, fields: fields.len() };
        layout.check(columns, lenient, dialect.no_position)
    }

    /// Checks that a particle has all that it needs, and nothing twice.
    fn check(mut self, columns: &Columns, lenient: bool, no_position: bool) -> Result<Self, String> {
        if let Some(missing) = (0..3).find(|target| !no_position && !self.has(*target)) {
            return Err(format!("no column `{}`; {MAP}", COLUMNS[missing].0));
        }
        if self.has(DIAMETER) && self.has(RADIUS) {
            if !lenient || (columns.map(DIAMETER) && columns.map(RADIUS)) {
                return Err("a size is given twice, by `diameter` and by `radius`".to_owned());
            }
            let dropped = if columns.map(RADIUS) { DIAMETER } else { RADIUS };
            self.wanted.retain(|wanted| wanted.target != dropped);
        }
        if QUATERNION.clone().any(|c| self.has(c)) {
            if let Some(missing) = QUATERNION.clone().find(|c| !self.has(*c)) {
                return Err(format!(
                    "a quaternion needs all of qx, qy, qz, qw, and there is no column `{}`",
                    COLUMNS[missing].0
                ));
            }
            if let Some(angle) = ANGLES.clone().find(|c| self.has(*c)) {
                return Err(format!(
                    "an orientation is given twice, by a quaternion and by `{}`",
                    COLUMNS[angle].0
                ));
            }
        }
        Ok(self)
    }

    fn has(&self, target: usize) -> bool {
        self.wanted.iter().any(|wanted| wanted.target == target)
    }

    /// The columns of a line that are read.
    pub(super) fn sources(&self) -> impl Iterator<Item = usize> {
        self.wanted.iter().map(|wanted| wanted.source)
    }

    /// The particle of a line; the error has position, name, word, and what was expected.
    pub(super) fn placement(&self, line: &impl Line) -> Result<Placement, (usize, String)> {
        let mut values = [0.0; COLUMNS.len()];
        let (mut id, mut kind, mut diameter) = (None, None, None);
        for &Wanted { target, source, factor, constant } in &self.wanted {
            let column = line.column(source);
            let bad = |wanted: &str| {
                let (key, has) = (COLUMNS[target].0, line.word(source));
                let comma = has.contains(',') && has.replacen(',', ".", 1).parse::<f64>().is_ok();
                let comma = if comma { "; decimal commas must be points" } else { "" };
                (column, format!("`{key}` is `{has}`, expected {wanted}{comma}"))
            };
            let number = line.number(source).map(|x| {
                let x = x * factor;
                // Adding zero turns -0 into 0.
                if constant == 0.0 { x } else { x + constant }
            });
            let number = number.filter(|x| x.is_finite());
            let whole = || match number {
                Some(x) if x.fract() == 0.0 && (0.0..MAX_ID as f64).contains(&x) => Ok(x as u64),
                _ => Err(bad("a whole number from 0 to 2^53")),
            };
            let finite = || number.ok_or_else(|| bad("a finite number"));
            match target {
                ID => id = Some(whole()?),
                KIND => kind = Some((whole()?, column)),
                DIAMETER | RADIUS => {
                    let length = finite()?;
                    if length <= 0.0 {
                        return Err(bad("a number above 0"));
                    }
                    diameter = Some((if target == RADIUS { 2.0 * length } else { length }, column));
                }
                _ => values[target] = finite()?,
            }
        }
        let three = |first: usize| Vec3::from_row_slice(&values[first..first + 3]);
        let orientation = if self.has(QUATERNION.start) {
            let [x, y, z, w] = values[QUATERNION] else { unreachable!("four columns") };
            from_quaternion(Quaternion::new(w, x, y, z))
                .map_err(|e| (0, format!("the quaternion qx, qy, qz, qw {e}")))?
        } else {
            from_angles(three(ANGLES.start).into())
        };
        let moves = self.wanted.iter().any(|wanted| MOTION.contains(&wanted.target));
        Ok(Placement {
            line: line.line(),
            position: three(0),
            orientation,
            id,
            kind,
            diameter,
            motion: moves.then(|| [three(MOTION.start), three(MOTION.start + 3)]),
        })
    }
}

/// Orientation from a quaternion of unit length up to rounding.
fn from_quaternion(given: Quaternion<f64>) -> Result<Quat, String> {
    let off = (given.norm_squared() - 1.0).abs();
    match off {
        _ if off <= ROUNDING => Ok(Quat::new_unchecked(given)),
        _ if off <= FEW_DIGITS => Ok(Quat::new_normalize(given)),
        _ => Err(format!("has the length {}, but must have 1", given.norm())),
    }
}

/// Orientation from angles about x, then y, then z (degrees).
pub(super) fn from_angles(degrees: [f64; 3]) -> Quat {
    let about = |axis: usize| {
        let half = 0.5 * degrees[axis].to_radians();
        let mut coordinates = [0.0; 3];
        coordinates[axis] = libm::sin(half);
        Quaternion::new(libm::cos(half), coordinates[0], coordinates[1], coordinates[2])
    };
    Quat::new_normalize(about(2) * about(1) * about(0))
}
