//! The time series of a run, `series.csv`.

use super::units;
use crate::error::{Error, Result};
use crate::input;
use crate::wall::Wall;
use serde::{Serialize, Serializer};
use std::path::Path;
use std::sync::LazyLock;

/// Quantities of `series.csv`, in the order of [`SeriesRow`]'s fields: names, units and definitions of their columns. Those of walls
/// ([`wall_columns`]), of bodies with prescribed motion ([`load_columns`]), of inlets and outlets ([`flow_columns`]) and of particles that come and go ([`population_columns`]) follow. Here `v` is the velocity of a particle, `m` its mass,
/// `V_p` its volume, `V` the volume of the box that is in no wall (without a fluid of the whole box), `u` the velocity of the fluid, `rho` its
/// density, and `<>` a mean.
///
/// A row is the state between two steps: all forces of the steps so far have acted, and none of the coming one. So with a body
/// acceleration `a` its flow lies `a dt / 2` behind that of the fields, which is taken in the middle of the coming collision.
const QUANTITIES: &str = "\
step (-): Steps done: of the fluid, or without one of the particles.
t (s): Time, `step * time_step`.
t_star (-): Time over the time in which a particle travels its diameter at the Stokes velocity, `t u_Stokes / D`. 0 if nothing settles.
settling_velocity_over_stokes (-): Settling velocity, `(<v> - net_flux) . g / u_Stokes`, with the unit vector `g` along the weight less \
    buoyancy of all particles.
mean_particle_velocity_{x,y,z} (m/s): Mean velocity of the particles, `<v>`.
mean_particle_speed (m/s): Mean speed of the particles, `<|v|>`.
max_particle_speed (m/s): Largest speed of a particle.
net_flux_{x,y,z} (m/s): Mean velocity of the mixture by volume: of `u` over all cells, in which a particle counts with its own velocity.
contacts (-): Number of contacts between particles, and of particles with walls.
max_overlap (-): Depth of the deepest contact over `D`.
kinetic_energy_fluid (J): Kinetic energy of the fluid, `sum rho u^2 dx^3 / 2` over all cells, those inside of particles included.
kinetic_energy_translation (J): Kinetic energy of the particles by translation, `sum m v^2 / 2`.
kinetic_energy_rotation (J): Kinetic energy of the particles by rotation, `sum w . I w / 2`.
momentum_{x,y,z} (kg m/s): Momentum of fluid and particles, `rho V net_flux + sum (m - rho V_p) v`; before the first step that of the flow at \
    the start, and `sum m v` less what of the flow the particles displace.
wall_force_{x,y,z} (N): Force of the particles on all walls, by contacts. Empty, as are all stresses by contacts, if the engine does not tell \
    its contacts.
gravitational_energy (J): Energy of the weight less buoyancy of the particles, `-sum (m - rho V_p) g . x` over directions that are not \
    periodic, from the origin.
max_mach (-): Mach number of the fastest cell, `sqrt(3) |u| dt / dx`.
contact_stress_{xx,yy,zz,xy,xz,yz} (Pa): Stress by contacts, `-sum l F / V`, symmetric part: `F` acts on a particle, to whose centre `l` leads \
    from that of the other one, or from the contact with a wall. Positive where it pulls, or resists shear as viscosity does.
hydrodynamic_stress_{xx,yy,zz,xy,xz,yz} (Pa): Stress of the particles by the fluid: the stresslet of Batchelor (1970), the first moment about \
    each centre of the momentum that the fluid gives to the particle in the coming step, and the stress that partially saturated cells carry, \
    over `V`. In steady shear the stress on the plates is viscosity times shear rate, plus this and the contact stress, minus the Reynolds \
    stress.
";

/// Definitions of what stands in the columns of walls and of bodies with prescribed motion.
const OF_BODIES: &str = "\
fluid_force: Force of the fluid on the wall in the last step, without the pressure at rest. Of an inlet or outlet the momentum that leaves \
    through it, by pressure, viscosity and flow.
contact_force: Force of contacts on the wall, or on all bodies of a section with prescribed motion.
shear_stress: Force of fluid and contacts along a plane wall over its area in the box. Planes only.
fluid_torque: Torque of the fluid in the last step on a pipe, rod or mesh, about its `pivot`, by default the `point` of its axis or the position of the mesh.
contact_torque: Torque of contacts on a pipe, rod or mesh about the same point, or on all bodies of a section with prescribed motion, about the \
    centre of each.
hydrodynamic_force: Force of the fluid in the last step on all bodies of a section with prescribed motion, with buoyancy: `drag` is without.
hydrodynamic_torque: Torque of the fluid on them, about the centre of each.
drag: `hydrodynamic_force` without the hydrostatic part, the buoyancy `-sum rho V_p g`; with `force_balance = \"mixture\"` it holds the force of \
    the mean pressure gradient, `sum rho V_p a`.
mass_flow: Fluid that came in through an inlet or outlet in the last step, over the time step; negative where it left. The sum over all of \
    them is the change of the mass of the fluid.
inserted: Particles of a section that have come since the start of the run.
removed: Particles of a section that have gone since the start of the run.
inserted_mass: Mass of the particles of a section that have come.
removed_mass: Mass of the particles of a section that have gone.
";

/// Header of `series.csv`: name and unit of every column but those of walls and bodies.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));

/// Definition of every quantity, by the name of its column without the axis: `net_flux` of `net_flux_x`.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> =
    LazyLock::new(|| [definitions(QUANTITIES), definitions(OF_BODIES)].concat());

/// Heads `name (unit)` of the columns of a table of lines `name (unit): definition`; `name_{x,y} (unit)` stands for two columns.
pub(super) fn heads(table: &str) -> Vec<String> {
    let of_line = |line: &str| -> Vec<String> {
        let head = line.split(": ").next().unwrap_or_default();
        let (name, rest) = head.split_once('{').unwrap_or((head, ""));
        let (axes, unit) = rest.split_once('}').unwrap_or_default();
        axes.split(',').map(|axis| format!("{name}{axis}{unit}")).collect()
    };
    table.lines().flat_map(of_line).collect()
}

/// Definitions of such a table by name, without axes and unit.
pub(super) fn definitions(table: &'static str) -> Vec<(&'static str, &'static str)> {
    let of_line = |line: &'static str| {
        let (head, definition) = line.split_once(": ")?;
        Some((head.split(['{', ' ']).next()?.trim_end_matches('_'), definition))
    };
    table.lines().filter_map(of_line).collect()
}

/// Beginnings of the names of the columns of a wall, before its name and the axis, and their units.
pub const WALL_COLUMNS: [(&str, &str); 5] = [
    ("fluid_force", "N"),
    ("contact_force", "N"),
    ("shear_stress", "Pa"),
    ("fluid_torque", "N m"),
    ("contact_torque", "N m"),
];

/// Those of a plane come first; a pipe or rod has all but the last one of them.
pub const PLANE_COLUMNS: usize = 3;

/// True of the names of the columns of walls, of inlets and outlets, of bodies with prescribed motion, and of particles that come and go.
pub fn is_of_a_body(name: &str) -> bool {
    let rest = WALL_COLUMNS
        .iter()
        .chain(&LOADS)
        .chain([&MASS_FLOW])
        .chain(&POPULATION)
        .find_map(|(what, _)| name.strip_prefix(what));
    rest.is_some_and(|rest| rest.starts_with('_'))
}

/// Header of the columns of walls, wall by wall: force of the fluid on it in the last step, without the pressure at rest; force of
/// contacts; of planes the shear stress, the force of fluid and contacts along the plane over its area in the box; and of others the
/// torques of fluid and of contacts about the pivot.
pub fn wall_columns(walls: &[Wall]) -> impl Iterator<Item = String> {
    walls.iter().flat_map(|wall| {
        let (of_planes, others) = WALL_COLUMNS.split_at(PLANE_COLUMNS);
        let (both, _) = of_planes.split_at(PLANE_COLUMNS - 1);
        let known = if wall.surface.is_plane() { [of_planes, &[]] } else { [both, others] };
        known.into_iter().flatten().flat_map(|(what, unit)| {
            ["x", "y", "z"].map(|axis| format!("{what}_{}_{axis} ({unit})", wall.name))
        })
    })
}

/// Loads on the bodies of a section with prescribed motion, beginnings of the names of their columns, and their units.
pub const LOADS: [(&str, &str); 5] = [
    ("hydrodynamic_force", "N"),
    ("hydrodynamic_torque", "N m"),
    ("contact_force", "N"),
    ("contact_torque", "N m"),
    ("drag", "N"),
];

/// Beginning of the names of the columns of inlets and outlets, and their unit.
pub const MASS_FLOW: (&str, &str) = ("mass_flow", "kg/s");

/// Header of the columns of inlets and outlets with these names.
pub fn flow_columns(open: &[&str]) -> impl Iterator<Item = String> {
    let (what, unit) = MASS_FLOW;
    open.iter().map(move |name| format!("{what}_{name} ({unit})"))
}

/// Numbers of particles of a section that have come and gone, beginnings of the names of their columns, and their units.
pub const POPULATION: [(&str, &str); 4] =
    [("inserted", "-"), ("removed", "-"), ("inserted_mass", "kg"), ("removed_mass", "kg")];

/// Header of the columns of the `[[particles]]` sections, given by their indices, whose particles come and go.
pub fn population_columns(sections: &[usize]) -> impl Iterator<Item = String> {
    sections.iter().flat_map(|section| {
        POPULATION.iter().map(move |(what, unit)| format!("{what}_particles.{section} ({unit})"))
    })
}

/// Index of the drag among [`LOADS`].
pub const DRAG: usize = 4;

/// Header of the columns of `[[particles]]` sections, given by their indices, whose motion is prescribed: sums over their bodies of the
/// load of the fluid in the last step, with buoyancy, of contacts, and the force of the fluid without buoyancy; torques about the centre
/// of each.
pub fn load_columns(sections: &[usize]) -> impl Iterator<Item = String> {
    sections.iter().flat_map(|section| {
        LOADS.iter().flat_map(move |(what, unit)| {
            ["x", "y", "z"].map(|axis| format!("{what}_particles.{section}_{axis} ({unit})"))
        })
    })
}

/// One row of `series.csv`; units in [`COLUMNS`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SeriesRow {
    /// Fluid step.
    pub step: u64,
    /// Physical time (s).
    pub time: f64,
    /// Time over `D / u_Stokes` (-).
    pub t_star: f64,
    /// Mean particle velocity relative to the mixture, along their submerged weight, over `u_Stokes` (-).
    pub settling_velocity: f64,
    /// Mean particle velocity (m/s).
    pub mean_particle_velocity: [f64; 3],
    /// Mean of the particles' speeds (m/s).
    pub mean_particle_speed: f64,
    /// Largest particle speed (m/s).
    pub max_particle_speed: f64,
    /// Mean velocity of the mixture (m/s).
    pub net_flux: [f64; 3],
    /// Number of contacts.
    pub contacts: usize,
    /// Largest contact depth over diameter (-).
    pub max_overlap: f64,
    /// Kinetic energy of the fluid (J).
    pub kinetic_energy_fluid: f64,
    /// Translational kinetic energy of the particles (J).
    pub kinetic_energy_translation: f64,
    /// Rotational kinetic energy of the particles (J).
    pub kinetic_energy_rotation: f64,
    /// Momentum of fluid and particles (kg m/s).
    pub momentum: [f64; 3],
    /// Force of the particles on all walls, by contacts (N). This and all that follows from contacts is `None`, cells that are empty,
    /// if the engine does not tell its contacts.
    #[serde(serialize_with = "cells")]
    pub wall_force: Option<[f64; 3]>,
    /// Gravitational energy of the particles (J).
    pub gravitational_energy: f64,
    /// Largest Mach number of the fluid (-).
    pub max_mach: f64,
    /// Stress of the particles by contacts (Pa): `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
    #[serde(serialize_with = "cells")]
    pub contact_stress: Option<[f64; 6]>,
    /// Stress of the particles by the fluid (Pa).
    pub hydrodynamic_stress: [f64; 6],
    /// Vectors of the columns that [`wall_columns`] names.
    #[serde(serialize_with = "each_cells")]
    pub walls: Vec<Option<[f64; 3]>>,
    /// Values of the columns that [`load_columns`] names.
    pub prescribed: Vec<f64>,
    /// Values of the columns that [`flow_columns`] names.
    pub mass_flows: Vec<f64>,
    /// Values of the columns that [`population_columns`] names.
    pub population: Vec<f64>,
}

/// A group of columns: its numbers, or empty cells.
#[expect(clippy::ref_option, reason = "serde hands over references to fields")]
fn cells<S: Serializer, const N: usize>(
    values: &Option<[f64; N]>,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    each_cells(std::slice::from_ref(values), serializer)
}

/// Groups of columns.
fn each_cells<S: Serializer, const N: usize>(
    groups: &[Option<[f64; N]>],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_seq(groups.iter().flat_map(|group| group.map_or([None; N], |values| values.map(Some))))
}

/// The columns of a time series, by the names in its header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeriesTable {
    /// In the order of the file.
    pub columns: Vec<SeriesColumn>,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesColumn {
    /// Name without its unit.
    pub name: String,
    /// Unit, in parentheses behind the name; `-` for none.
    pub unit: String,
    /// A number for each row; NaN for an empty cell.
    pub values: Vec<f64>,
}

impl SeriesTable {
    /// Reads the file; a last row that was not written to its end is left out. Errors: [`Error::Io`] if it cannot be read;
    /// [`Error::Input`] with line and column of what is not a number.
    pub fn read(path: &Path) -> Result<Self> {
        let broken = |error: csv::Error| {
            let (shown, text) = (path.display(), error.to_string());
            let line = error.position().map_or(String::new(), |at| format!(":{}", at.line()));
            match error.into_kind() {
                csv::ErrorKind::Io(source) => Error::io("read", path, source),
                csv::ErrorKind::Utf8 { .. } => Error::Input(format!("{shown}{line}: not UTF-8 text")),
                _ => Error::Input(format!("{shown}: {text}")),
            }
        };
        let bytes =
            input::read_unlinked(path, input::TABLE).map_err(|source| Error::io("read", path, source))?;
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(&bytes[..]);
        let header = reader.headers().map_err(broken)?.clone();
        let mut columns: Vec<SeriesColumn> = header.iter().map(column).collect();
        let records = reader.records().collect::<std::result::Result<Vec<_>, _>>();
        let records = records.map_err(broken)?;
        for (row, record) in records.iter().enumerate() {
            let torn = row + 1 == records.len() && !bytes.ends_with(b"\n");
            let number =
                |word: &str| if word.is_empty() && !torn { Some(f64::NAN) } else { word.parse().ok() };
            let numbers: Option<Vec<f64>> = record.iter().map(number).collect();
            match numbers.filter(|numbers| numbers.len() == columns.len()) {
                Some(numbers) => {
                    for (column, number) in columns.iter_mut().zip(numbers) {
                        column.values.push(number);
                    }
                }
                None if row + 1 == records.len() => {}
                None => return Err(bad_row(path, record, &columns)),
            }
        }
        Ok(Self { columns })
    }

    /// The values of a column, if there is one of this name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let found = self.columns.iter().find(|column| column.name == name);
        found.map(|column| column.values.as_slice())
    }
}

fn column(head: &str) -> SeriesColumn {
    let (name, unit) = units::split(head);
    SeriesColumn { name: name.to_string(), unit: unit.to_string(), values: Vec::new() }
}

fn bad_row(path: &Path, record: &csv::StringRecord, columns: &[SeriesColumn]) -> Error {
    let line = record.position().map_or(0, csv::Position::line);
    let is_wrong = |word: &str| !word.is_empty() && word.parse::<f64>().is_err();
    let wrong = record.iter().zip(columns).find(|(word, _)| is_wrong(word));
    let what = match wrong {
        Some((word, column)) => format!("`{word}` in column `{}` is not a number", column.name),
        None => format!("{} values under {} heads", record.len(), columns.len()),
    };
    Error::Input(format!(
        "{}, line {line}: {what}\n  the file was changed after the run; run the case again, or remove this line",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::SeriesWriter;

    #[test]
    fn every_column_has_one_definition_and_every_definition_a_column() {
        // Walls and bodies share one.
        let loads = LOADS[..2].iter().chain(&LOADS[4..]);
        let of_bodies =
            WALL_COLUMNS.iter().chain(loads).chain([&MASS_FLOW]).chain(&POPULATION).map(|(name, _)| *name);
        let names = COLUMNS.iter().map(|head| head.split(" (").next().unwrap()).chain(of_bodies);
        let quantity = |name: &'static str| match name.rsplit_once('_') {
            Some((vector, "x" | "y" | "z" | "xx" | "yy" | "zz" | "xy" | "xz" | "yz")) => vector,
            _ => name,
        };
        let mut quantities: Vec<&str> = names.map(quantity).collect();
        quantities.dedup();
        assert_eq!(quantities, DEFINITIONS.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    }

    #[test]
    fn each_row_is_on_disk_at_once_and_stands_under_its_header() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("series.csv");
        let mut series = SeriesWriter::create(&path, &[], &[], &[], &[]).unwrap();
        for step in 1..4 {
            let row = SeriesRow {
                step,
                time: 0.1 + 0.2,
                net_flux: [1e-9, 0.0, -2.5],
                contacts: 17,
                momentum: [0.0, 0.0, 1e-30],
                ..SeriesRow::default()
            };
            series.write(&[&row]).unwrap();
            // The writer is still open: this is what a killed run leaves.
            let mut reader = csv::Reader::from_path(&path).unwrap();
            let header = reader.headers().unwrap().clone();
            assert_eq!(header, COLUMNS.to_vec());
            let rows: Vec<csv::StringRecord> = reader.records().map(std::result::Result::unwrap).collect();
            assert_eq!(rows.len() as u64, step);
            let value = |name: &str| -> f64 {
                let column = header.iter().position(|h| h.starts_with(name)).unwrap();
                rows.last().unwrap()[column].parse().unwrap()
            };
            for (name, expected) in [
                ("step", step as f64),
                ("t (s)", row.time),
                ("net_flux_x", 1e-9),
                ("net_flux_z", -2.5),
                ("contacts", 17.0),
                ("momentum_z", 1e-30),
            ] {
                assert_eq!(value(name).to_bits(), expected.to_bits(), "{name}");
            }
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported_by_the_row_that_does_not_fit() {
        let error = SeriesWriter::create(Path::new("/dev/full"), &[], &[], &[], &[]).unwrap_err();
        assert!(error.to_string().contains("/dev/full"), "{error}");
    }

    #[test]
    fn a_directory_that_does_not_exist_is_named() {
        let error =
            SeriesWriter::create(Path::new("/nowhere/at/all/series.csv"), &[], &[], &[], &[]).unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all/series.csv"));
    }

    fn read(text: &str) -> Result<SeriesTable> {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        std::fs::write(&path, text).unwrap();
        SeriesTable::read(&path)
    }

    #[test]
    fn names_and_units_are_taken_apart_and_a_torn_last_row_is_left_out() {
        let series = read("step (-),v (m/s),plain\n0,1.5,2\n1,-2e-3,3\n2,4").unwrap();
        let units: Vec<&str> = series.columns.iter().map(|c| c.unit.as_str()).collect();
        assert_eq!(units, ["-", "m/s", "-"]);
        assert_eq!(series.get("v").unwrap(), [1.5, -2e-3]);
        assert_eq!(series.get("w"), None);
    }

    #[test]
    fn what_is_not_known_is_an_empty_cell_and_is_read_as_nan() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        let row = SeriesRow { max_mach: 0.25, ..SeriesRow::default() };
        SeriesWriter::create(&path, &[], &[], &[], &[]).unwrap().write(&[row]).unwrap();
        assert!(
            std::fs::read_to_string(&path).unwrap().ends_with(",,,,0.0,0.25,,,,,,,0.0,0.0,0.0,0.0,0.0,0.0\n")
        );
        let read = SeriesTable::read(&path).unwrap();
        let value = |name| read.get(name).unwrap()[0];
        assert!(value("wall_force_x").is_nan() && value("contact_stress_yz").is_nan());
        assert_eq!(value("max_mach").to_bits(), 0.25_f64.to_bits());
        assert!(super::tests::read("a,b\n1,2\n3,").unwrap().get("a").unwrap() == [1.0], "torn");
    }

    #[test]
    fn a_table_that_is_no_text_is_named_with_its_line() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        std::fs::write(&path, b"step (-),time (s)\n1,2\n3,\xff\n").unwrap();
        let said = SeriesTable::read(&path).unwrap_err().to_string();
        assert!(said.ends_with("series.csv:3: not UTF-8 text"), "{said}");
    }

    #[test]
    fn a_row_that_is_broken_is_named_with_its_line_and_column() {
        let error = read("step (-),v (m/s)\n0,1\n1,x\n2,3\n").unwrap_err().to_string();
        assert!(error.contains("line 3: `x` in column `v` is not a number"), "{error}");
        let error = read("a,b\n0\n1,2\n").unwrap_err().to_string();
        assert!(error.contains("line 2: 1 values under 2 heads"), "{error}");
    }
}
