//! The result of a run in numbers, `summary.json`.

use super::atomic::write_bytes;
use super::averages::Averages;
use crate::error::{Error, Result};
use crate::input;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Keys of a [`Summary`] and of its [`ReferenceScales`] whose values are numbers or `null`.
pub const NUMBERS: &str = "settling_velocity_over_stokes settling_velocity_over_schiller_naumann standard_error drift \
    averaged_over_distance transient_end settled_mean settled_standard_error resumed_from particles volume_fraction \
    requested_volume_fraction cells steps \
    dx time_step relaxation_time mlups wall_seconds ranks threads mach relative_viscosity \
    relative_viscosity_standard_error shear_rate shear_strain shear_reynolds superficial_velocity \
    superficial_velocity_standard_error drag drag_standard_error drag_over_stokes drag_over_stokes_standard_error \
    permeability permeability_standard_error cells_per_diameter diameter viscosity density_ratio archimedes \
    galileo stokes_velocity stokes_time schiller_naumann_velocity schiller_naumann_reynolds";

/// The result of a run; its JSON keys are stable.
///
/// `None` is `null` in JSON: there was nothing to average, or no particle to refer to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Version of the program.
    pub version: String,
    /// Name of the case.
    pub case: String,
    /// True if the run was stopped before its end.
    pub interrupted: bool,
    /// True if it has ended because it was steady, as `run.end` asks for.
    #[serde(default)]
    pub steady: bool,
    /// Step from which the run was last resumed; speeds and times of stages are since then.
    pub resumed_from: Option<u64>,
    /// Mean settling velocity relative to the mixture over the Stokes velocity (-), over `averaged_over`.
    pub settling_velocity_over_stokes: Option<f64>,
    /// Mean settling velocity over that of one particle after Schiller and Naumann (-).
    pub settling_velocity_over_schiller_naumann: Option<f64>,
    /// Standard error of `settling_velocity_over_stokes` (-), from its autocorrelation time, which is at least that in which the particles
    /// settle by 1.5 diameters. `null` if several particles settle by less than 4 diameters: all values are of one arrangement.
    pub standard_error: Option<f64>,
    /// Difference of the means over the second and the first half of the averages, over the mean (-): of the settling velocity, or else of
    /// the relative viscosity or the superficial velocity.
    pub drift: Option<f64>,
    /// `t*` at the end of the transient of the settling velocity, if one was found after which several particles settle by 4 diameters or
    /// more.
    pub transient_end: Option<f64>,
    /// Mean settling velocity from there to the end over the Stokes velocity (-).
    pub settled_mean: Option<f64>,
    /// Standard error of `settled_mean` (-).
    pub settled_standard_error: Option<f64>,
    /// Interval of `t*` that the averages are taken over.
    pub averaged_over: Option<[f64; 2]>,
    /// Distance that the particles settle relative to the mixture in that interval, in diameters (-); none for one particle.
    pub averaged_over_distance: Option<f64>,
    /// Interval of time that the averages of a run are taken over (s); none in files of older versions.
    pub averaged_over_time: Option<[f64; 2]>,
    /// Number of particles.
    pub particles: usize,
    /// Volume of the particles over that of the box (-).
    #[serde(deserialize_with = "or_nan")]
    pub volume_fraction: f64,
    /// Volume fraction as the case asks for it, before numbers of particles were rounded up to whole ones (-).
    pub requested_volume_fraction: Option<f64>,
    /// Reference velocities and dimensionless numbers.
    pub scales: ReferenceScales,
    /// Number of cells of the fluid; 0 without a fluid.
    pub cells: usize,
    /// Steps done.
    pub steps: u64,
    /// Edge of a cell (m).
    pub dx: f64,
    /// Fluid time step (s).
    pub time_step: f64,
    /// Relaxation time (time steps).
    #[serde(deserialize_with = "or_nan")]
    pub relaxation_time: f64,
    /// Million cell updates per second since the run began or was resumed, output included.
    #[serde(deserialize_with = "or_nan")]
    pub mlups: f64,
    /// Wall time of all steps since the run began or was resumed (s).
    pub wall_seconds: f64,
    /// Seconds per step by stage, in the mean over all steps: `pictures` (drawing) and `observe` (all other output, but for profiles of the flow in a sweep) take their time at the
    /// steps at which something is due.
    pub stages: BTreeMap<String, f64>,
    /// Storage of the populations.
    pub precision: String,
    /// Instruction set of the kernels.
    pub simd: String,
    /// Name of the device that computed the fluid; none if the processor did.
    #[serde(default)]
    pub device: Option<String>,
    /// Ranks.
    pub ranks: usize,
    /// Threads.
    pub threads: usize,
    /// Hash over all populations and particle states at the end, 16 hexadecimal digits.
    pub state_hash: String,
    /// True without a fluid.
    pub dry: bool,
    /// Largest Mach number of the fluid at the times of `series.csv` (-).
    pub mach: Option<f64>,
    /// Mean shear stress on two plates that pass each other over `rho nu` times the shear rate, over the averages (-). None with other
    /// walls.
    pub relative_viscosity: Option<f64>,
    /// Standard error of `relative_viscosity` (-); none below 3 units of strain.
    pub relative_viscosity_standard_error: Option<f64>,
    /// Shear rate between the plates (1/s).
    pub shear_rate: Option<f64>,
    /// Shear rate times the time of the run, from the branching point on for a branch (-).
    pub shear_strain: Option<f64>,
    /// Reynolds number of the shear, `shear_rate D^2 / nu` (-).
    pub shear_reynolds: Option<f64>,
    /// Mean velocity of the mixture along `driving.body_acceleration` (m/s), over the averages. None unless all bodies are fixed.
    pub superficial_velocity: Option<f64>,
    /// Standard error of `superficial_velocity` (m/s).
    pub superficial_velocity_standard_error: Option<f64>,
    /// Mean force of the fluid on all fixed bodies along the flow, without buoyancy (N).
    pub drag: Option<f64>,
    /// Standard error of `drag` (N).
    pub drag_standard_error: Option<f64>,
    /// `drag` over the sum of the Stokes drags `3 pi rho nu D U` of the bodies at the superficial velocity `U` (-). With `force_balance
    /// = "mixture"` the drag holds the mean pressure gradient on the bodies; with `"fluid_only"` it does not, and is `1 - phi` of it.
    pub drag_over_stokes: Option<f64>,
    /// Standard error of `drag_over_stokes` (-).
    pub drag_over_stokes_standard_error: Option<f64>,
    /// Permeability by Darcy's law, `nu U / a` with the superficial velocity `U` and the body acceleration `a` (m^2).
    pub permeability: Option<f64>,
    /// Standard error of `permeability` (m^2).
    pub permeability_standard_error: Option<f64>,
    /// Cells per diameter of the first kind of particle (-).
    #[serde(deserialize_with = "or_nan")]
    pub cells_per_diameter: f64,
    /// Kinds of particles in the order of the case; `template` in the files of particles counts them from 0.
    pub shapes: Vec<ShapeSummary>,
    /// Walls: `wall` in `walls.vtp` counts them from 0.
    pub walls: Vec<WallSummary>,
    /// Collision operator, as in the case.
    pub collision: Option<String>,
    /// Coupling of particles and fluid, as in the case.
    pub coupling: Option<String>,
    /// Region in which the balancing force acts, as in the case.
    pub force_balance: Option<String>,
    /// The controller of the net flux; none without a fluid and in files of older versions.
    #[serde(default)]
    pub net_flux_control: Option<NetFluxControl>,
    /// Hash over the other numbers that decide the run, but the initial state of the particles; none in files of older versions.
    #[serde(default)]
    pub setup_hash: Option<String>,
    /// Means over time of the columns that `output.average` names, of the numbers of the structure, of velocity fluctuations and diffusion, and
    /// of the velocities of fronts, by their names; empty in files of older versions.
    #[serde(default)]
    pub averages: Averages,
    /// Warnings about the case and of the run; empty in files of older versions.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Text of the case file with overrides applied.
    pub input: String,
}

/// Reads `null`, which is how JSON has what is not finite, as NaN.
fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Reference velocities and dimensionless numbers, for the first kind of particle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReferenceScales {
    /// Diameter of the sphere of equal volume (m).
    #[serde(deserialize_with = "or_nan")]
    pub diameter: f64,
    /// Kinematic viscosity (m^2/s).
    #[serde(deserialize_with = "or_nan")]
    pub viscosity: f64,
    /// Particle density over fluid density (-).
    #[serde(deserialize_with = "or_nan")]
    pub density_ratio: f64,
    /// Archimedes number, `|rho_p / rho - 1| g D^3 / nu^2` (-).
    #[serde(deserialize_with = "or_nan")]
    pub archimedes: f64,
    /// Galileo number, the root of the Archimedes number (-).
    #[serde(deserialize_with = "or_nan")]
    pub galileo: f64,
    /// Stokes velocity, `|rho_p / rho - 1| g D^2 / (18 nu)` (m/s).
    #[serde(deserialize_with = "or_nan")]
    pub stokes_velocity: f64,
    /// Unit of `t*`, `D / u_Stokes` (s).
    #[serde(deserialize_with = "or_nan")]
    pub stokes_time: f64,
    /// Terminal velocity of one particle after Schiller and Naumann (m/s).
    #[serde(deserialize_with = "or_nan")]
    pub schiller_naumann_velocity: f64,
    /// Reynolds number at `schiller_naumann_velocity`, `u D / nu` (-).
    #[serde(deserialize_with = "or_nan")]
    pub schiller_naumann_reynolds: f64,
}

/// The controller of the mean volume flux, and the accelerations that it has added to the fluid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NetFluxControl {
    /// Directions x, y, z along which it acts.
    pub directions: [bool; 3],
    /// Mean volume flux that it keeps (m/s); 0 in files of older versions.
    #[serde(default)]
    pub target: [f64; 3],
    /// Mean acceleration over all steps, from the branching point on for a branch (m/s^2).
    pub mean_acceleration: [f64; 3],
    /// Largest magnitude of the acceleration in a step (m/s^2).
    pub largest_acceleration: f64,
}

/// A kind of particle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapeSummary {
    /// Name of the shape.
    pub kind: String,
    /// Diameter of the sphere of equal volume (m).
    pub equivalent_diameter: f64,
    /// Density (kg/m^3).
    pub density: f64,
    /// Number of particles.
    pub count: usize,
}

/// A wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WallSummary {
    /// Name.
    pub name: String,
    /// `"plane"`, `"pipe"` (free inside) or `"rod"` (free outside).
    pub kind: String,
    /// Velocity of its pivot (m/s), at the end.
    pub velocity: [f64; 3],
    /// Angular velocity (1/s), at the end.
    pub angular_velocity: [f64; 3],
}

impl Summary {
    /// Reads a summary, but not through a symbolic link.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read_unlinked(path, input::RECORD).map_err(|e| Error::io("read", path, e))?;
        serde_json::from_slice(&bytes).map_err(|e| Error::Input(format!("{}: {e}", path.display())))
    }

    /// Writes the summary as indented JSON.
    pub fn write(&self, path: &Path) -> Result<()> {
        let json = serde_json::to_string_pretty(self).expect("plain data always serialises") + "\n";
        write_bytes(path, json.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::super::averages::Average;
    use super::*;

    fn summary() -> Summary {
        Summary {
            version: "0.1.0".into(),
            case: "settling".into(),
            interrupted: false,
            steady: false,
            resumed_from: Some(4),
            settling_velocity_over_stokes: Some(0.1 + 0.2),
            settling_velocity_over_schiller_naumann: Some(0.7),
            standard_error: Some(0.01),
            drift: Some(-0.02),
            transient_end: Some(32.5),
            settled_mean: Some(0.31),
            settled_standard_error: Some(0.02),
            averaged_over: Some([50.0, 150.0]),
            averaged_over_distance: Some(30.0),
            averaged_over_time: Some([0.25, 0.75]),
            particles: 3,
            volume_fraction: 0.2,
            requested_volume_fraction: Some(0.19),
            scales: ReferenceScales {
                diameter: 1.5e-3,
                viscosity: 8.7e-6,
                density_ratio: 3.25,
                archimedes: 1000.0,
                galileo: 1000.0_f64.sqrt(),
                stokes_velocity: 0.3,
                stokes_time: 5e-3,
                schiller_naumann_velocity: 0.1,
                schiller_naumann_reynolds: 19.0,
            },
            cells: 512,
            steps: 7,
            dx: 1e-4,
            time_step: 1e-5,
            relaxation_time: 0.55,
            mlups: 40.0,
            wall_seconds: 1.5,
            stages: BTreeMap::from([("collide".to_string(), 1e-3)]),
            precision: "f32".into(),
            simd: "avx2".into(),
            device: None,
            ranks: 2,
            threads: 2,
            state_hash: "00ff00ff00ff00ff".into(),
            dry: false,
            mach: Some(0.02),
            relative_viscosity: Some(1.6),
            relative_viscosity_standard_error: Some(0.1),
            shear_rate: Some(2.0),
            shear_strain: Some(1.5),
            shear_reynolds: Some(0.4),
            superficial_velocity: Some(1e-3),
            superficial_velocity_standard_error: Some(1e-5),
            drag: Some(4e-6),
            drag_standard_error: Some(1e-8),
            drag_over_stokes: Some(6.2),
            drag_over_stokes_standard_error: Some(0.1),
            permeability: Some(1e-8),
            permeability_standard_error: Some(1e-10),
            cells_per_diameter: 15.0,
            shapes: vec![ShapeSummary {
                kind: "sphere".into(),
                equivalent_diameter: 1.5e-3,
                density: 3250.0,
                count: 3,
            }],
            walls: vec![WallSummary {
                name: "z-".into(),
                kind: "plane".into(),
                velocity: [0.1, 0.0, 0.0],
                angular_velocity: [0.0; 3],
            }],
            collision: Some("bgk".into()),
            coupling: Some("homogenised".into()),
            force_balance: None,
            net_flux_control: Some(NetFluxControl {
                directions: [false, false, true],
                target: [0.0; 3],
                mean_acceleration: [0.0, 0.0, 1e-3],
                largest_acceleration: 0.02,
            }),
            setup_hash: None,
            averages: Averages::from([(
                "coordination".into(),
                Average { unit: "-".into(), mean: 4.5, standard_error: Some(0.25), ..Average::default() },
            )]),
            warnings: vec!["the box is small".into()],
            input: "[domain]\nsize = \"8 D\"\n".into(),
        }
    }

    #[test]
    fn every_number_is_in_the_list_of_them_and_survives() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("summary.json");
        summary().write(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary());
        let all = json.as_object().unwrap().iter();
        let numbers = all.chain(json["scales"].as_object().unwrap());
        let mut found: Vec<&str> =
            (numbers.filter(|(_, value)| value.is_number())).map(|(key, _)| key.as_str()).collect();
        let mut listed: Vec<&str> = NUMBERS.split_whitespace().collect();
        found.sort_unstable();
        listed.sort_unstable();
        assert_eq!(found, listed, "keys are stable: add, never rename");
    }

    #[test]
    fn the_summary_of_a_run_without_a_fluid_and_of_an_older_version_can_be_read() {
        let mut dry = summary();
        (dry.scales.density_ratio, dry.scales.stokes_time) = (f64::INFINITY, f64::NAN);
        let mut json: serde_json::Value = serde_json::to_value(&dry).unwrap();
        json.as_object_mut().unwrap().remove("transient_end");
        let read: Summary = serde_json::from_value(json).unwrap();
        assert!(read.scales.density_ratio.is_nan() && read.scales.stokes_time.is_nan());
        assert_eq!((read.transient_end, read.scales.diameter), (None, 1.5e-3));
    }
}
