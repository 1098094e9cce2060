//! Files of positions: `x;y;z;rx;ry;rz;id` (metres, degrees), or CSV with a header.
//!
//! Angles are those of the published data sets: `R = Rz(rz) Ry(ry) Rx(rx)` maps the body frame to the world frame.

use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::particle::Particle;
use std::fmt::Write;

/// Columns of a file without a header.
const COLUMNS: [&str; 7] = ["x", "y", "z", "rx", "ry", "rz", "id"];
const EXPECTED: &str = "expected lines of x;y;z;rx;ry;rz;id (metres, degrees), or CSV whose header names x, y, z and \
                        optionally rx, ry, rz, id";

/// Numbers of particles stay below this, so that programs that read them as floating point keep them apart.
const MAX_ID: u64 = 1 << 53;

/// Sine of the angle about y above which those about x and z can no longer be told apart.
const LOCKED: f64 = 1.0 - 1e-12;

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
}

/// Reads a positions file; the error says `name:line:column`, what is there and what was expected.
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
            None => columns.insert((0..COLUMNS.len()).collect()),
        };
        if fields.len() != known.len() {
            let (found, wanted) = (fields.len(), known.len());
            return Err(format!(
                "{name}:{number}: {found} fields instead of {wanted}; {EXPECTED}"
            ));
        }
        let mut values = [0.0; 7];
        let mut id = None;
        let mut column = 1;
        for (field, &which) in fields.iter().zip(known) {
            let trimmed = field.trim();
            let bad = |wanted: &str| {
                let key = COLUMNS[which];
                Err(format!(
                    "{name}:{number}:{column}: `{key}` is `{trimmed}`, expected {wanted}; {EXPECTED}"
                ))
            };
            if COLUMNS[which] == "id" {
                match trimmed.parse() {
                    Ok(n) if n < MAX_ID => id = Some(n),
                    _ => return bad("a whole number from 0 to 2^53"),
                }
            } else {
                match trimmed.parse::<f64>() {
                    Ok(x) if x.is_finite() => values[which] = x,
                    _ => return bad("a finite number"),
                }
            }
            column += field.chars().count() + 1;
        }
        placements.push(Placement {
            line: number,
            position: Vec3::new(values[0], values[1], values[2]),
            orientation: from_angles([values[3], values[4], values[5]]),
            id,
        });
    }
    if placements.is_empty() {
        return Err(format!("{name}: holds no particles; {EXPECTED}"));
    }
    Ok(placements)
}

/// Which of [`COLUMNS`] each field of a header names.
fn header(fields: &[&str]) -> Result<Vec<usize>, String> {
    let mut columns = Vec::new();
    for field in fields {
        let name = field.trim().trim_matches('"').to_ascii_lowercase();
        match COLUMNS.iter().position(|c| *c == name) {
            Some(column) if columns.contains(&column) => {
                return Err(format!("column `{name}` appears twice"));
            }
            Some(column) => columns.push(column),
            None => return Err(format!("unknown column `{name}`")),
        }
    }
    match (0..3).find(|c| !columns.contains(c)) {
        Some(missing) => Err(format!("no column `{}`", COLUMNS[missing])),
        None => Ok(columns),
    }
}

/// The lines of a positions file; positions are written so that reading gives back the same bits.
///
/// `frames` are, for each template, the rotations from the axes of the body to those in which its shape was given: the
/// angles in a file belong to the latter.
pub fn format(particles: &[Particle], frames: &[Quat]) -> String {
    let mut text = String::new();
    for particle in particles {
        let [x, y, z] = particle.position;
        let [rx, ry, rz] = angles(&given(particle, frames));
        let id = particle.id;
        writeln!(text, "{x:?};{y:?};{z:?};{rx:?};{ry:?};{rz:?};{id}").expect("a string can always grow");
    }
    text
}

/// Orientation of the shape as it was given.
fn given(particle: &Particle, frames: &[Quat]) -> Quat {
    let frame = &frames[particle.template as usize];
    if *frame == Quat::identity() {
        particle.orientation()
    } else {
        particle.orientation() * frame.inverse()
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

/// Angles about x, then y, then z (degrees) of an orientation.
fn angles(orientation: &Quat) -> [f64; 3] {
    let (i, j, k, w) = (orientation.i, orientation.j, orientation.k, orientation.w);
    let sine = 2.0 * (w * j - k * i);
    if sine.abs() > LOCKED {
        // Turns about x and z are the same then: all of them is about z.
        let rz = 2.0 * libm::atan2(k - sine.signum() * i, w + sine.signum() * j);
        return [0.0, sine.signum() * 90.0, rz.to_degrees()];
    }
    let rx = libm::atan2(2.0 * (w * i + j * k), 1.0 - 2.0 * (i * i + j * j));
    let ry = libm::asin(sine);
    let rz = libm::atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k));
    [rx, ry, rz].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn positions_come_back_to_the_last_bit(p in prop::array::uniform3(0.0..1.0_f64), id in 0..MAX_ID) {
            let particle = Particle::at(id, 0, p.into());
            let back = parse(&format(&[particle], &[Quat::identity()]), "p").unwrap();
            prop_assert_eq!(back.len(), 1);
            prop_assert_eq!(back[0].position, particle.position());
            prop_assert_eq!(back[0].id, Some(id));
            prop_assert_eq!(back[0].orientation, Quat::identity());
        }

        #[test]
        fn angles_and_orientations_round_trip(
            rx in -179.0..179.0, ry in -89.0..89.0, rz in -179.0..179.0,
        ) {
            let back = angles(&from_angles([rx, ry, rz]));
            for (a, b) in back.iter().zip([rx, ry, rz]) {
                prop_assert!((a - b).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn bodies_that_stand_upright_keep_their_orientation() {
        for degrees in [[30.0, 90.0, 50.0], [-70.0, -90.0, 20.0], [10.0, 89.99, -120.0]] {
            let orientation = from_angles(degrees);
            let back = from_angles(angles(&orientation));
            assert!(back.angle_to(&orientation) < 1e-5, "{degrees:?}");
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
            (
                "0;0;0;0;0;0;1\n0;0;zero;0;0;0;2",
                "p:2:5: `z` is `zero`, expected a finite number",
            ),
            ("0;0;0;0;0;0", "p:1: 6 fields instead of 7"),
            ("0;0;0;0;0;0;-1", "p:1:13: `id` is `-1`, expected a whole number"),
            ("x,y\n1,2", "p:1: no column `z`"),
            ("x,y,radius\n1,2,3", "p:1: unknown column `radius`"),
            ("x,x,y,z\n1,2,3,4", "p:1: column `x` appears twice"),
            ("0;nan;0;0;0;0;1", "p:1:3: `y` is `nan`"),
            ("", "p: holds no particles"),
        ] {
            let error = parse(text, "p").unwrap_err();
            assert!(error.starts_with(words), "{error}");
            assert!(error.contains("x;y;z;rx;ry;rz;id"));
        }
    }
}
