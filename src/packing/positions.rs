//! Files of positions: from which a case reads its particles, and what `turbid pack` writes.
//!
//! | file | module |
//! |---|---|
//! | lines of `x;y;z;rx;ry;rz;id` or `x;y;z` (metres, degrees), or a table with a header | [`table`] |
//! | `.xyz` | [`xyz`] |
//! | dumps and data files of LAMMPS and LIGGGHTS | [`lammps`] |
//! | points of VTK: `.vtp`, `.vtu`, `.vtk` | [`vtk`] |
//!
//! Angles are those of the published data sets: `R = Rz(rz) Ry(ry) Rx(rx)` maps the body frame to the world frame.
//! Other columns are `kind` (which `[[particles]]` section, counted from 0), `diameter` or `radius` (m, of the
//! sphere of equal volume), the unit quaternion `qx, qy, qz, qw` in place of angles, velocity `vx, vy, vz` (m/s) and
//! angular velocity `wx, wy, wz` (1/s). That is how [`format()`] writes the particles of a run: reading gives back
//! the same bits.

mod columns;
mod lammps;
mod table;
#[cfg(test)]
mod tests;
mod vtk;
mod xyz;

pub use columns::{Columns, names};

use crate::math::{Quat, Vec3};
use std::fmt::Write;
use std::path::Path;

/// Header of what [`format()`] writes.
const WRITTEN: &str = "x,y,z,qx,qy,qz,qw,id,kind,diameter,vx,vy,vz,wx,wy,wz";

/// Most particles of a file that are read.
const MOST: usize = 1 << 24;
/// Lines of a data file of LAMMPS in which its number of atoms stands.
const HEAD: usize = 40;

/// One particle of a positions file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Number of the line, or in a file of VTK of the point, from 1.
    pub line: usize,
    /// Centre (m).
    pub position: Vec3,
    /// Orientation.
    pub orientation: Quat,
    /// Unique number, if the file has them.
    pub id: Option<u64>,
    /// Section of the case that it belongs to, if the file says so, and its column in the line, from 1, or 0 if there is none.
    pub kind: Option<(u64, usize)>,
    /// Diameter of the sphere of equal volume (m), if the file has them, and its column in the line, from 1, or 0 if there is none.
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

/// The contents of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Its particles, in its order.
    pub placements: Vec<Placement>,
    /// Notes for the user on how it was read.
    pub notes: Vec<String>,
}

/// Reads a positions file, whose `name` may say its kind; the error has `name:line:column`, the word found and what was expected.
///
/// If `several` sections read the file, the types of LAMMPS are kinds: type 1 is that of the first section.
pub fn parse(bytes: &[u8], name: &str, columns: &Columns, several: bool) -> Result<Found, String> {
    if vtk::is_vtk(bytes) {
        return vtk::parse(bytes, name, columns, several);
    }
    let text = std::str::from_utf8(bytes).map_err(|_| format!("{name}: it is not UTF-8 text"))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let extension = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    if text.trim_start().starts_with("ITEM:") {
        lammps::dump(text, name, columns, several)
    } else if extension == "xyz" || extension == "extxyz" {
        xyz::parse(text, name, columns)
    } else if text.lines().skip(1).take(HEAD).any(is_count_of_atoms) {
        lammps::data(text, name, columns, several)
    } else {
        table::parse(text, name, columns)
    }
}

/// Reads the particles in the points of a run, of which there may be none.
pub fn of_a_run(bytes: &[u8], name: &str) -> Result<Vec<Row>, String> {
    let points = if vtk::is_vtk(bytes) {
        vtk::points(bytes, name, &Columns::default(), false)?
    } else {
        return Err(format!("{name}: it is no file of VTK"));
    };
    let row = |point: &Placement| {
        let [velocity, angular_velocity] = point.motion?;
        Some(Row {
            id: point.id?,
            kind: point.kind?.0 as usize,
            diameter: point.diameter?.0,
            position: point.position,
            orientation: point.orientation,
            velocity,
            angular_velocity,
        })
    };
    let rows = points.iter().map(row).collect::<Option<_>>();
    rows.ok_or_else(|| format!("{name}: its points have not all of id, kind, equivalent_diameter, velocity"))
}

/// Numbers of the points in a file of a run, in arrays with these names and numbers of components; `Points` are the points. None if the file
/// lacks one of them.
///
/// # Errors
/// What is wrong with the file.
pub fn arrays_of_a_run(bytes: &[u8], wanted: &[(&str, usize)]) -> Result<Option<Vec<Vec<f64>>>, String> {
    if vtk::is_vtk(bytes) { vtk::arrays(bytes, wanted) } else { Err("it is no file of VTK".into()) }
}

/// True for the line of a data file of LAMMPS that every one has.
fn is_count_of_atoms(line: &str) -> bool {
    let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
    matches!(words[..], [count, "atoms"] if count.parse::<u64>().is_ok())
}

/// Words of a message for the place of a particle in a file, at a column of its line if there is one.
pub fn place(name: &str, placement: &Placement, column: usize) -> String {
    let extension = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    let points = ["vtp", "vtu", "vtk"].iter().any(|known| extension == *known);
    let place = format!("{name}{}{}", if points { ": point " } else { ":" }, placement.line);
    if column > 0 { format!("{place}:{column}") } else { place }
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
