//! The engine that the native one is compared with: how it is started, what it is called, and how it is known to differ.

use super::system::{SAME, System};
use crate::checks::{EngineName, Findings, prepare};
use std::f64::consts::FRAC_1_SQRT_2;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use turbid::case::Setup;
use turbid::comm::Comm;
use turbid::contact::ContactModel;
use turbid::dem::DemEngine;
use turbid::domain::Decomposition;
#[cfg(feature = "liggghts")]
use turbid::engine::liggghts::{Liggghts, LiggghtsParams};
use turbid::engine::process::{External, ExternalParams};
use turbid::engine::{HAS_LIGGGHTS, ProcessOptions, liggghts_is_missing};
use turbid::error::{Error, Result};
use turbid::output::write_bytes;

/// Stands for the name of the other engine in texts, until [`Against::judge`] puts it there.
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

/// Files of the programs.
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
    ("python", "free-flight", "position", 0.0, 2.5e-4, HALF_A_STEP),
];
const ROUNDING: &str =
    "the distance of centres is summed in another order, 2e-19 m of a depth of 5e-12 m or more";
const SOFT_WALL: &str = "YADE takes a wall for a sphere of the same radius, so that R* is R / 2";
const FITTED: &str = "YADE's force never pulls; its fit of the damping to the restitution, which allows for that, is good to 2e-3";
const NO_PULL: &str =
    "YADE's force never pulls, so its damping is stronger for the same restitution; most at e = 0.5";
const HALF_A_STEP: &str = "positions move with the velocity after the kick: half a step ahead";

/// The engine that the native one is compared with.
#[derive(Clone, Debug)]
pub struct Against {
    /// Its name.
    pub name: EngineName,
    /// The program; none for LIGGGHTS.
    program: Option<ProcessOptions>,
    /// True if its forces belong to the positions before the last sub-step.
    pub(super) late: bool,
    /// Directory for its logs, if they are kept.
    logs: Option<PathBuf>,
}

impl Against {
    /// LIGGGHTS, without a log.
    pub fn liggghts() -> Self {
        Self { name: LIGGGHTS, program: None, late: false, logs: None }
    }

    /// This program, or the engine with this id; its logs and files are in `directory`.
    ///
    /// # Errors
    /// That of [`liggghts_is_missing`].
    pub fn chosen(engine: &str, command: &[String], directory: &Path) -> Result<Self> {
        let logs = Some(directory.join("logs"));
        let run = |name, command: Vec<String>, folder: &Path, late| {
            let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
            let program = ProcessOptions { command, folder, timeout: TIMEOUT, refusal: String::new() };
            Self { name, program: Some(program), late, logs: logs.clone() }
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

    /// The engine with a system at its start, and with the laws that most engines have.
    pub(super) fn engine(&self, system: &System) -> Result<Box<dyn DemEngine>> {
        if let Some(engine) = self.external(system)? {
            return Ok(Box::new(engine));
        }
        #[cfg(feature = "liggghts")]
        {
            let (law, damping) = SAME;
            let contact = system.contact.clone().map(|contact| ContactModel { law, damping, ..contact });
            let (walls, gravity, substeps) = (system.walls.clone(), system.gravity, system.substeps);
            let log = self.log(system);
            let params =
                LiggghtsParams { contact, walls, gravity, substeps, log, ..system.options.params()? };
            let (whole, templates) = (Decomposition::solo(system.domain), system.templates.clone());
            Ok(Box::new(Liggghts::new(params, whole, &Comm::Solo, templates, &system.particles)?))
        }
        #[cfg(not(feature = "liggghts"))]
        Err(liggghts_is_missing("`turbid crosscheck`"))
    }

    /// The same, of an engine that measures overlaps itself.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if it does not, so that there is nothing to compare with.
    pub(super) fn measuring(&self, system: &System) -> Result<Box<dyn DemEngine>> {
        let engine = self.external(system)?.filter(External::measures_overlaps);
        let what = "overlaps that it has measured itself".to_owned();
        engine.map_or(Err(Error::Unsupported { engine: "other", what }), |engine| Ok(Box::new(engine)))
    }

    /// The program with a system at its start; none for LIGGGHTS.
    fn external(&self, system: &System) -> Result<Option<External>> {
        let Some(program) = &self.program else { return Ok(None) };
        let params = ExternalParams {
            contact: system.contact.clone().map(|contact| {
                let (law, damping) = SAME;
                ContactModel { law, damping, ..contact }
            }),
            walls: system.walls.clone(),
            gravity: system.gravity,
            substeps: system.substeps,
            ..program.params(self.log(system), Arc::default())
        };
        let whole = Decomposition::solo(system.domain);
        External::new(params, whole, &Comm::Solo, system.templates.clone(), &system.particles).map(Some)
    }

    fn log(&self, system: &System) -> Option<PathBuf> {
        self.logs.as_ref().map(|logs| logs.join(format!("{}.log", system.name)))
    }

    /// The reason why a case says nothing of this engine, if it does not.
    pub(super) fn lacks(&self, case: &str) -> Option<&'static str> {
        (self.name.id == "python" && case != "free-flight")
            .then_some("the template has linear springs and no friction, and tests all pairs")
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
    pub(super) fn judge(&self, case: &str, mut found: Findings) -> Findings {
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
        for overlay in &mut found.overlays {
            name(&mut overlay.title);
            overlay.curves.iter_mut().for_each(|(curve, _)| name(curve));
        }
        found
    }
}
