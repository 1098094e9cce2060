//! Files of positions: `x;y;z;rx;ry;rz;id` (metres, degrees), or CSV with a header that names its columns.
//!
//! Angles are those of the published data sets: `R = Rz(rz) Ry(ry) Rx(rx)` maps the body frame to the world frame.
//! With a header there may also be `kind` (which `[[particles]]` section, counted from 0), `diameter` (m, of the
//! sphere of equal volume), the unit quaternion `qx, qy, qz, qw` in place of angles, velocity `vx, vy, vz` (m/s) and
//! angular velocity `wx, wy, wz` (1/s). That is how [`format()`] writes the particles of a run: reading gives back
//! the same bits.

use crate::input;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use std::fmt::Write;

/// All columns; the first seven are those of a file without a header.
const COLUMNS: [&str; 19] = [
    "x", "y", "z", "rx", "ry", "rz", "id", "kind", "diameter", "qx", "qy", "qz", "qw", "vx", "vy", "vz",
    "wx", "wy", "wz",
];
const HEADERLESS: usize = 7;
const ID: usize = 6;
const KIND: usize = 7;
const DIAMETER: usize = 8;
const QUATERNION: std::ops::Range<usize> = 9..13;
const MOTION: std::ops::Range<usize> = 13..19;
const EXPECTED: &str = "expected lines of x;y;z;rx;ry;rz;id (metres, degrees), or CSV whose header names x, y, z and \
                        optionally rx, ry, rz or qx, qy, qz, qw, id, kind, diameter, vx, vy, vz, wx, wy, wz";
/// Header of what [`format()`] writes.
const WRITTEN: &str = "x,y,z,qx,qy,qz,qw,id,kind,diameter,vx,vy,vz,wx,wy,wz";

/// Numbers of particles stay below this, so that programs that read them as floating point keep them apart.
const MAX_ID: u64 = 1 << 53;

/// Largest deviation of the squared length of a quaternion from 1 if it was written with few digits.
const FEW_DIGITS: f64 = 1e-5;
/// Largest deviation that is taken as rounding.
const ROUNDING: f64 = 1e-12;

/// One line of a positions file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Line number, from 1.
    pub line: usize,
    /// Centre (m).
    pub position: Vec3,
    /// Orientation.
    pub orientation: Quat,
    /// Unique number, if the file has them.
    pub id: Option<u64>,
    /// Section of the case that it belongs to, if the file says so, and the column in the line, from 1.
    pub kind: Option<(u64, usize)>,
    /// Diameter of the sphere of equal volume (m), if the file has them, and the column in the line, from 1.
    pub diameter: Option<(f64, usize)>,
    /// Velocity (m/s) and angular velocity (1/s), if the file has them: then it is the state of a run.
    pub motion: Option<[Vec3; 2]>,
}

/// A particle as [`format()`] writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Unique number.
    pub id: u64,
    /// Section of the case, counted from 0.
    pub kind: usize,
    /// Diameter of the sphere of equal volume (m).
    pub diameter: f64,
    /// Centre (m).
    pub position: Vec3,
    /// Orientation of the shape as the case gives it.
    pub orientation: Quat,
    /// Velocity (m/s).
    pub velocity: Vec3,
    /// Angular velocity (1/s).
    pub angular_velocity: Vec3,
}

/// Reads a positions file; the error has `name:line:column`, the word found and what was expected.
pub fn parse(text: &str, name: &str) -> Result<Vec<Placement>, String> {
    let mut columns: Option<Vec<usize>> = None;
    let mut placements = Vec::new();
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in text.lines().enumerate() {
        let number = number + 1;
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let delimiter = if line.contains(';') { ';' } else { ',' };
        let fields: Vec<&str> = line.split(delimiter).collect();
        let known = match &columns {
            Some(known) => known,
            None if fields.iter().all(|f| f.trim().parse::<f64>().is_err()) => {
                columns = Some(header(&fields).map_err(|e| format!("{name}:{number}: {e}; {EXPECTED}"))?);
                continue;
            }
            None => columns.insert((0..HEADERLESS).collect()),
        };
        if fields.len() != known.len() {
            let (found, wanted) = (fields.len(), known.len());
            return Err(format!("{name}:{number}: {found} fields instead of {wanted}; {EXPECTED}"));
        }
        let mut values = [0.0; COLUMNS.len()];
        let (mut id, mut kind, mut diameter) = (None, None, None);
        let mut column = 1;
        for (field, &which) in fields.iter().zip(known) {
            let trimmed = field.trim();
            let bad = |wanted: &str| {
                let key = COLUMNS[which];
                let has = input::word(trimmed);
                format!("{name}:{number}:{column}: `{key}` is `{has}`, expected {wanted}; {EXPECTED}")
            };
            let whole = || match whole(trimmed) {
                Some(n) if n < MAX_ID => Ok(n),
                _ => Err(bad("a whole number from 0 to 2^53")),
            };
            let finite = || match trimmed.parse::<f64>() {
                Ok(x) if x.is_finite() => Ok(x),
                _ => Err(bad("a finite number")),
            };
            match which {
                ID => id = Some(whole()?),
                KIND => kind = Some((whole()?, column)),
                DIAMETER => diameter = Some((finite()?, column)),
                _ => values[which] = finite()?,
            }
            column += field.chars().count() + 1;
        }
        let three = |first: usize| Vec3::from_row_slice(&values[first..first + 3]);
        let orientation = if known.contains(&QUATERNION.start) {
            let [x, y, z, w] = values[QUATERNION] else { unreachable!("four columns") };
            from_quaternion(Quaternion::new(w, x, y, z))
                .map_err(|e| format!("{name}:{number}: the quaternion qx, qy, qz, qw {e}"))?
        } else {
            from_angles(three(3).into())
        };
        placements.push(Placement {
            line: number,
            position: three(0),
            orientation,
            id,
            kind,
            diameter,
            motion: (known.iter().any(|which| MOTION.contains(which)))
                .then(|| [three(MOTION.start), three(MOTION.start + 3)]),
        });
    }
    if placements.is_empty() {
        return Err(format!("{name}: holds no particles; {EXPECTED}"));
    }
    Ok(placements)
}

/// A whole number, also with a point and an exponent, as numpy writes all numbers: `3.000e+00`.
fn whole(text: &str) -> Option<u64> {
    let as_float = |x: &f64| x.fract() == 0.0 && (0.0..MAX_ID as f64).contains(x);
    let float = || text.parse().ok().filter(as_float).map(|x| x as u64);
    text.parse().ok().or_else(float)
}

/// Index in [`COLUMNS`] of each field of a header.
fn header(fields: &[&str]) -> Result<Vec<usize>, String> {
    let mut columns = Vec::new();
    for field in fields {
        let name = field.trim().trim_matches('"').to_ascii_lowercase();
        match COLUMNS.iter().position(|c| *c == name) {
            Some(column) if columns.contains(&column) => {
                return Err(format!("column `{name}` appears twice"));
            }
            Some(column) => columns.push(column),
            None => return Err(format!("unknown column `{}`", input::word(&name))),
        }
    }
    let given = |column: &usize| columns.contains(column);
    if QUATERNION.clone().any(|c| given(&c)) {
        if let Some(missing) = QUATERNION.clone().find(|c| !given(c)) {
            return Err(format!(
                "a quaternion needs all of qx, qy, qz, qw, and there is no column `{}`",
                COLUMNS[missing]
            ));
        }
        if let Some(angle) = (3..6).find(given) {
            return Err(format!(
                "an orientation is given twice, by a quaternion and by `{}`",
                COLUMNS[angle]
            ));
        }
    }
    match (0..3).find(|c| !given(c)) {
        Some(missing) => Err(format!("no column `{}`", COLUMNS[missing])),
        None => Ok(columns),
    }
}

/// A file of positions; all numbers are written so that reading gives back the same bits.
pub fn format(rows: impl IntoIterator<Item = Row>) -> String {
    let mut text = format!("{WRITTEN}\n");
    for row in rows {
        let [x, y, z]: [f64; 3] = row.position.into();
        let [qx, qy, qz, qw]: [f64; 4] = row.orientation.coords.into();
        let [vx, vy, vz]: [f64; 3] = row.velocity.into();
        let [wx, wy, wz]: [f64; 3] = row.angular_velocity.into();
        let Row { id, kind, diameter, .. } = row;
        writeln!(
            text,
            "{x:?},{y:?},{z:?},{qx:?},{qy:?},{qz:?},{qw:?},{id},{kind},{diameter:?},{vx:?},{vy:?},{vz:?},{wx:?},{wy:?},{wz:?}"
        )
        .expect("a string can always grow");
    }
    text
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
fn from_angles(degrees: [f64; 3]) -> Quat {
    let about = |axis: usize| {
        let half = 0.5 * degrees[axis].to_radians();
        let mut coordinates = [0.0; 3];
        coordinates[axis] = libm::sin(half);
        Quaternion::new(libm::cos(half), coordinates[0], coordinates[1], coordinates[2])
    };
    Quat::new_normalize(about(2) * about(1) * about(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn three(at: f64) -> Vec3 {
        Vec3::new(at, -at / 3.0, 1e-9 * at)
    }

    proptest! {
        #[test]
        fn all_numbers_come_back_to_the_last_bit(
            p in prop::array::uniform3(0.0..1.0_f64), id in 0..MAX_ID, kind in 0..9_usize, a in prop::array::uniform3(-180.0..180.0),
        ) {
            let row = Row {
                id,
                kind,
                diameter: p[0],
                position: p.into(),
                orientation: from_angles(a),
                velocity: three(p[1]),
                angular_velocity: three(p[2]),
            };
            let back = parse(&format([row]), "p").unwrap();
            prop_assert_eq!(back.len(), 1);
            prop_assert_eq!(back[0].position, row.position);
            prop_assert_eq!(back[0].id, Some(id));
            prop_assert_eq!(back[0].orientation, row.orientation);
            prop_assert_eq!(back[0].kind.unwrap().0, kind as u64);
            prop_assert_eq!(back[0].diameter.unwrap().0.to_bits(), row.diameter.to_bits());
            prop_assert_eq!(back[0].motion, Some([row.velocity, row.angular_velocity]));
        }
    }

    #[test]
    fn a_quaternion_of_few_digits_is_made_one_of_unit_length() {
        let read = parse("x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0.707107,0.707107", "p").unwrap();
        assert!((read[0].orientation.norm() - 1.0).abs() < 1e-15);
        assert!((read[0].orientation * Vec3::x() - Vec3::y()).norm() < 1e-12);
        assert_eq!((read[0].motion, read[0].kind), (None, None));
    }

    #[test]
    fn ids_that_numpy_has_written_are_whole_numbers_and_no_others_are() {
        let id = |text: &str| parse(&format!("0;0;0;0;0;0;{text}\n"), "p").map(|found| found[0].id);
        for (text, wanted) in
            [("0.000e+00", 0), ("1.2e+01", 12), ("7.0", 7), ("9007199254740991", MAX_ID - 1)]
        {
            assert_eq!(id(text), Ok(Some(wanted)), "{text}");
        }
        for text in ["1.5", "-1", "-1.0e+00", "1e16", "9.007199254740992e15", "nan", "inf", "1e"] {
            assert!(id(text).unwrap_err().contains("a whole number from 0 to 2^53"), "{text}");
        }
    }

    #[test]
    fn rotations_apply_about_x_first_and_z_last() {
        let turned = from_angles([90.0, 0.0, 90.0]) * Vec3::y();
        assert!((turned - Vec3::z()).norm() < 1e-15, "y goes to z and stays");
        let turned = from_angles([0.0, 90.0, 90.0]) * Vec3::z();
        assert!((turned - Vec3::y()).norm() < 1e-15, "z goes to x, then to y");
    }

    #[test]
    fn a_csv_file_may_order_its_columns_and_leave_angles_out() {
        let text = "\u{feff}# made by hand\nID, z,y,x\r\n7,0.3,0.2,0.1\r\n\n";
        let read = parse(text, "p").unwrap();
        assert_eq!(read[0].position, Vec3::new(0.1, 0.2, 0.3));
        assert_eq!((read[0].id, read[0].line), (Some(7), 3));
    }

    #[test]
    fn errors_name_line_column_field_and_what_was_expected() {
        for (text, words) in [
            ("0;0;0;0;0;0;1\n0;0;zero;0;0;0;2", "p:2:5: `z` is `zero`, expected a finite number"),
            ("0;0;0;0;0;0", "p:1: 6 fields instead of 7"),
            ("0;0;0;0;0;0;-1", "p:1:13: `id` is `-1`, expected a whole number"),
            ("x,y\n1,2", "p:1: no column `z`"),
            ("x,y,radius\n1,2,3", "p:1: unknown column `radius`"),
            ("x,x,y,z\n1,2,3,4", "p:1: column `x` appears twice"),
            ("0;nan;0;0;0;0;1", "p:1:3: `y` is `nan`"),
            ("x,y,z,kind\n0,0,0,-1", "p:2:7: `kind` is `-1`"),
            ("x,y,z,diameter\n0,0,0,big", "p:2:7: `diameter` is `big`"),
            (
                "x,y,z,qx,qy,qz\n0,0,0,0,0,0",
                "p:1: a quaternion needs all of qx, qy, qz, qw, and there is no column `qw`",
            ),
            ("x,y,z,rz,qx,qy,qz,qw\n0", "p:1: an orientation is given twice"),
            ("", "p: holds no particles"),
        ] {
            let error = parse(text, "p").unwrap_err();
            assert!(error.starts_with(words), "{error}");
            assert!(error.contains("x;y;z;rx;ry;rz;id"));
        }
    }
}
