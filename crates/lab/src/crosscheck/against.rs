//! The engine that the native one is compared with: how it is started, what it is called, and how it is known to differ.

use super::Case;
use super::prelude::*;
use crate::checks::suite::Context;
use crate::checks::{EngineName, prepare};
use std::f64::consts::FRAC_1_SQRT_2;
use std::path::{Path, PathBuf};
use turbid::domain::Decomposition;
use turbid::engine::process::{External, ExternalParams};
use turbid::engine::{
    EngineProcess, HAS_LIGGGHTS, LammpsOptions, LiggghtsOptions, ProcessOptions, liggghts_is_missing,
};
use turbid::output::write_bytes;

/// Stands for the name of the other engine in texts, until [`Against::judged`] puts it there.
pub(super) const OTHER: &str = "OTHER";

/// Longest time that a program may take for a step (s).
const TIMEOUT: f64 = 600.0;

/// Engines that this program has programs for: the name, the command, and whether the forces that it reports belong to the positions
/// before the last sub-step. `ffi/engines/README.md` has more about them.
const PROGRAMS: [(EngineName, [&str; 2], bool); 3] = [
    (EngineName { id: "lammps", label: "LAMMPS" }, ["python3", "lammps/engine.py"], false),
    // Debian's package is for Debian's own Python.
    (EngineName { id: "yade", label: "YADE" }, ["/usr/bin/python3", "yade/engine.py"], true),
    (EngineName { id: "python", label: "Python template" }, ["python3", "python/spheres.py"], true),
];
pub(super) const LIGGGHTS: EngineName = EngineName { id: "liggghts", label: "LIGGGHTS" };
const PROGRAM: EngineName = EngineName { id: "program", label: "program" };

const FILES: [(&str, &str); 4] = [
    ("protocol.py", include_str!("../../../../ffi/engines/protocol.py")),
    ("lammps/engine.py", include_str!("../../../../ffi/engines/lammps/engine.py")),
    ("yade/engine.py", include_str!("../../../../ffi/engines/yade/engine.py")),
    ("python/spheres.py", include_str!("../../../../ffi/engines/python/spheres.py")),
];

/// Differences of engines whose reasons are known: a check passes if its difference is the one here. Engine, case, beginning of the
/// name of the quantity, difference, tolerance, reason.
const KNOWN: &[(&str, &str, &str, f64, f64, &str)] = &[
    ("yade", "static-pair", "force", 0.0, 1e-7, ROUNDING),
    ("yade", "static-wall", "force", 1.0 - FRAC_1_SQRT_2, 1e-7, SOFT_WALL),
    // 2^(1/5) - 1.
    ("yade", "wall-impact", "duration", 0.148_698, 6e-3, SOFT_WALL),
    ("yade", "wall-impact", "largest depth", 0.148_698, 6e-3, SOFT_WALL),
    ("yade", "restitution", "restitution", 0.0, 2.5e-3, FITTED),
    ("yade", "duration", "duration", 0.0, 1.2e-2, NO_PULL),
    ("yade", "duration", "largest depth", 0.0, 4e-2, NO_PULL),
    ("yade", "force-history", "whole history", 0.0, 0.14, NO_PULL),
    ("yade", "force-history", "force off the law", 0.0, 0.14, NO_PULL),
    ("yade", "force-history", "end of the contact", 0.0, 13.0, NO_PULL),
    ("yade", "sticking", "velocities", 0.0, 9e-3, UNSCALED),
    ("yade", "sticking", "spins", 0.0, 2e-2, UNSCALED),
    ("lammps", "sticking", "velocities", 0.0, 3e-3, DASHPOT),
    ("lammps", "sticking", "spins", 0.0, 6e-3, DASHPOT),
    ("python", "free-flight", "position", 0.0, 2.5e-4, HALF_A_STEP),
];
const ROUNDING: &str =
    "the distance of centres is summed in another order, 2e-19 m of a depth of 5e-12 m or more";
const SOFT_WALL: &str = "YADE takes a wall for a sphere of the same radius, so that R* is R / 2";
const FITTED: &str = "YADE's force never pulls; its fit of the damping to the restitution, which allows for that, is good to 2e-3";
const NO_PULL: &str =
    "YADE's force never pulls, so its damping is stronger for the same restitution; most at e = 0.5";
const UNSCALED: &str = "YADE's spring of friction keeps its force where the contact shrinks (1.3e-2 at e = 1), and its damping is stronger for the same restitution";
const DASHPOT: &str = "LAMMPS's sliding velocity has the whole radius for a lever (5e-4 at e = 1), and where it slides its spring has Coulomb's limit less the dashpot";
const HALF_A_STEP: &str = "positions move with the velocity after the kick: half a step ahead";

#[derive(Clone, Debug)]
pub struct Against {
    pub name: EngineName,
    /// The program; none for the engine that follows.
    program: Option<ProcessOptions>,
    /// An engine of Turbid.
    own: EngineChoice,
    /// True if its forces belong to the positions before the last sub-step.
    pub(super) late: bool,
    /// Directory for its logs, if they are kept.
    logs: Option<PathBuf>,
}

impl Against {
    pub fn liggghts() -> Self {
        let own = EngineChoice::Liggghts(LiggghtsOptions::default());
        Self { name: LIGGGHTS, program: None, own, late: false, logs: None }
    }

    /// This program, or the engine with this id; its logs and files are in `directory`.
    ///
    /// # Errors
    /// That of [`liggghts_is_missing`].
    pub fn chosen(engine: &str, command: &[String], directory: &Path) -> Result<Self> {
        let logs = Some(directory.join("logs"));
        let run = |name, command: Vec<String>, folder: &Path, late| {
            let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
            let program =
                ProcessOptions { command, folder, timeout: TIMEOUT, processes: 1, refusal: String::new() };
            Self { name, program: Some(program), own: EngineChoice::Native, late, logs: logs.clone() }
        };
        if !command.is_empty() {
            // Forces at the last sub-step are most often those before its motion.
            return Ok(run(PROGRAM, command.to_vec(), Path::new("."), true));
        }
        let known = PROGRAMS.into_iter().find(|(name, ..)| name.id == engine);
        let Some((name, command, late)) = known else {
            return if HAS_LIGGGHTS {
                Ok(Self { logs, ..Self::liggghts() })
            } else {
                Err(liggghts_is_missing("`turbid crosscheck --engine liggghts`"))
            };
        };
        Ok(run(name, command.map(String::from).to_vec(), &directory.join("engines"), late))
    }

    /// The engine with this id in all processes of an MPI job, if there is one: LIGGGHTS or LAMMPS.
    ///
    /// # Errors
    /// That of [`liggghts_is_missing`].
    pub fn in_parts(engine: &str, directory: &Path) -> Result<Option<Self>> {
        let process = EngineProcess::Own;
        let (name, own) = match engine {
            "liggghts" if HAS_LIGGGHTS => {
                (LIGGGHTS, EngineChoice::Liggghts(LiggghtsOptions { process, ..LiggghtsOptions::default() }))
            }
            "liggghts" => return Err(liggghts_is_missing("`turbid crosscheck --engine liggghts`")),
            "lammps" => {
                (PROGRAMS[0].0, EngineChoice::Lammps(LammpsOptions { process, ..LammpsOptions::default() }))
            }
            _ => return Ok(None),
        };
        Ok(Some(Self { name, program: None, own, late: false, logs: Some(directory.join("logs")) }))
    }

    /// Makes the directories for logs, and writes the files of the program, if this one has brought them along.
    ///
    /// # Errors
    /// An error with a remedy if that is not possible.
    pub fn prepare(&self, directory: &Path) -> Result<()> {
        prepare(&directory.join("logs"))?;
        let brought = PROGRAMS.iter().any(|(name, ..)| *name == self.name);
        FILES
            .iter()
            .filter(|_| brought)
            .try_for_each(|(file, text)| write_bytes(&directory.join("engines").join(file), text.as_bytes()))
    }

    /// Ids of the engines that need no command.
    pub fn ids() -> Vec<&'static str> {
        [LIGGGHTS].into_iter().chain(PROGRAMS.map(|(name, ..)| name)).map(|name| name.id).collect()
    }

    /// The engine with a system at its start.
    pub(super) fn engine(&self, system: &Setup) -> Result<Box<dyn DemEngine>> {
        let mut system = self.with_usual_laws(system);
        match (&self.program, &system.engine) {
            (Some(program), _) => system.engine = EngineChoice::Process(program.clone()),
            (None, EngineChoice::Liggghts(_)) if !self.own.is_in_parts() => {}
            (None, _) => system.engine = self.own.clone(),
        }
        engine_of(&system, self.log(&system))
    }

    /// A program with a system at its start that measures overlaps itself.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if it does not, so that there is nothing to compare with.
    pub(super) fn measuring(&self, system: &Setup) -> Result<Box<dyn DemEngine>> {
        let what = "overlaps that it has measured itself".to_owned();
        let unsupported = Error::Unsupported { engine: "other", what };
        let Some(program) = &self.program else { return Err(unsupported) };
        let params = ExternalParams {
            contact: self.with_usual_laws(system).contact,
            walls: system.walls.clone(),
            substeps: system.substeps,
            ..program.params(self.log(system), Arc::default())
        };
        let (whole, templates) = (Decomposition::solo(system.domain), system.templates.clone());
        let engine = External::new(params, whole, &Comm::Solo, templates, &system.particles)?;
        if engine.measures_overlaps() { Ok(Box::new(engine)) } else { Err(unsupported) }
    }

    /// A system with the laws that most engines have; LAMMPS has another friction, too.
    fn with_usual_laws(&self, system: &Setup) -> Setup {
        let mut system = system.clone();
        if let Some(contact) = &mut system.contact {
            let own = (SAME.0, SAME.1, FrictionLaw::Mindlin);
            let has_own = self.name.id == "lammps" && (contact.law, contact.damping, contact.friction) == own;
            (contact.law, contact.damping, contact.friction) = if has_own { own } else { SAME };
        }
        system
    }

    fn log(&self, system: &Setup) -> Option<PathBuf> {
        self.logs.as_ref().map(|logs| logs.join(format!("{}.log", system.provenance.name)))
    }

    /// The reason why its contacts of such a case have other laws whatever it is told, if so.
    pub(super) fn other_contacts(&self, setup: &Setup) -> Option<&'static str> {
        let damped = |contact: &ContactModel| contact.pairs.iter().any(|params| params.restitution < 1.0);
        match self.name.id {
            "python" => Some("its springs are linear"),
            "yade" if !setup.walls.is_empty() => Some(SOFT_WALL),
            "yade" if setup.contact.as_ref().is_some_and(damped) => Some(NO_PULL),
            _ => None,
        }
    }

    /// Puts the name of the engine into all texts of a case, and judges checks by the difference that is known, where one is.
    pub(super) fn judged(&self, case: &str, mut found: Findings) -> Findings {
        let name = |text: &mut String| *text = text.replace(OTHER, self.name.label);
        for check in &mut found.checks {
            let is = |(engine, of, quantity, ..): &&(&str, &str, &str, f64, f64, &str)| {
                *engine == self.name.id && *of == case && check.quantity.starts_with(quantity)
            };
            let measured = check.engines.is_some_and(|values| values[1].is_some());
            if let Some(&(.., difference, tolerance, reason)) = KNOWN.iter().filter(|_| measured).find(is) {
                (check.reference, check.tolerance) = (difference, tolerance);
                check.pass = (check.measured - difference).abs() <= tolerance;
                check.source = format!("known to be {difference:.3e} within {tolerance:.1e}: {reason}");
            }
            name(&mut check.quantity);
            name(&mut check.source);
        }
        for chart in found.figures.iter_mut().map(|figure| &mut figure.chart) {
            name(&mut chart.title);
            chart.panels[0].series.iter_mut().for_each(|series| name(&mut series.label));
        }
        found
    }
}

impl Context for Against {
    fn engine(&self) -> Option<EngineName> {
        Some(self.name)
    }

    fn lacks(&self, case: &Case) -> Option<&'static str> {
        (self.name.id == "python" && case.name != "free-flight")
            .then_some("the template has linear springs and no friction, and tests all pairs")
    }

    fn judge(&self, case: &Case, found: Findings) -> Findings {
        self.judged(case.name, found)
    }
}
