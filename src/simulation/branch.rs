//! Branches: runs that begin with the fluid and the particles of another one, in a directory of their own, whose case may differ.
//!
//! The lattice, the shapes and the walls are those of the origin. What else the state remembers is dropped where it no longer fits: the
//! contacts if their model, the materials, the densities or the sub-steps differ; what the bodies left in the fluid if the coupling differs.

use super::checkpointer::{Shared, means_the_same, refuse_end, saved_head};
use super::identity::{physics, run_id};
use super::{Simulation, identity};
use crate::case::{self, Setup};
use crate::checkpoint::{CaseText, Head};
use crate::comm::SavedParts;
use crate::dem::states;
use crate::engine::EngineChoice;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::output::OutputFiles;
use crate::wall::{Surface, Wall};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};

/// Relative difference of cell size and time step that rounding may cause.
const ROUNDING: f64 = 1e-9;

/// A run that is branched off another one.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Its case; among the warnings is what the branch does.
    pub setup: Setup,
    /// Output directory of the origin.
    origin: PathBuf,
    /// The case of the origin; of particles that are placed at random it has none.
    before: Setup,
    /// The contacts remembered by the engine are those of this case.
    keeps_contacts: bool,
    /// The state that the bodies have left in the fluid is that of this coupling.
    keeps_coupling: bool,
    /// Particles that come do so as in the origin.
    keeps_insertion: bool,
}

impl Branch {
    /// A branch of the run in `origin` at its newest checkpoint, with `changes` of any keys, into the directory `out`.
    ///
    /// # Errors
    /// [`Error::Agreed`] if there is no checkpoint; those of the changed case; [`Error::Input`] for a change with which the fluid and the
    /// particles cannot continue. Collective.
    pub fn new(origin: &Path, changes: &[String], threads: Option<usize>, out: &Path) -> Result<Self> {
        let Head { step, case: CaseText { name, text, files, .. }, .. } = saved_head(origin)?;
        let mut before = case::from_saved_anew(&name, &text, &files, &case::of_machine(changes), false)?;
        let mut setup = case::from_saved_anew(&name, &text, &files, changes, true)?;
        setup.plan.output.directory = out.to_path_buf();
        setup.plan.threads = threads.unwrap_or(setup.plan.threads);
        refuse_another_box(&before, &setup)?;
        // To the bit, as of particles that are placed.
        before.volume_fraction = setup.volume_fraction;
        refuse_end(step, &setup)?;
        if setup.plan.end_step == step {
            let what = format!(
                "the branch would begin at step {step}, where it ends: give a later end, --set run.end.steps=N"
            );
            return Err(Error::Input(what));
        }
        let [then, now] = [&before, &setup].map(physics);
        let same = |key: &str| then[key] == now[key];
        let keeps_contacts = before.engine.name() == setup.engine.name()
            && same("contact")
            && same("substeps")
            && of_each(&then["templates"], &["density", "material"])
                == of_each(&now["templates"], &["density", "material"])
            && of_each(&then["walls"], &["material"]) == of_each(&now["walls"], &["material"]);
        if !keeps_contacts && [&before, &setup].iter().any(|setup| setup.engine != EngineChoice::Native) {
            return Err(Error::Input(
                "a branch of a run with an external engine cannot change contacts, materials, densities or the engine: the state is the engine's own"
                    .to_string(),
            ));
        }
        let light = |setup: &Setup| -> Vec<bool> {
            let Some(fluid) = &setup.fluid else { return Vec::new() };
            (0..setup.templates.len()).map(|n| setup.virtual_mass(fluid, n).is_some()).collect()
        };
        let keeps_coupling =
            then["fluid"]["coupling"] == now["fluid"]["coupling"] && light(&before) == light(&setup);
        let keeps_insertion = same("insertion");
        let mut branch = Self {
            setup,
            origin: origin.to_path_buf(),
            before,
            keeps_contacts,
            keeps_coupling,
            keeps_insertion,
        };
        let note = branch.note(changes);
        branch.setup.provenance.warnings.push(note);
        Ok(branch)
    }

    /// The action of the branch, in words.
    fn note(&self, changes: &[String]) -> String {
        let subject = if self.setup.fluid.is_some() { "fluid and particles" } else { "particles" };
        let changes = match changes {
            [] => "an unchanged case".to_string(),
            changes => changes.join(", "),
        };
        let dropped = [
            (self.keeps_contacts, "the history of the contacts"),
            (self.keeps_coupling, "what the coupling remembers of the last step"),
            (self.keeps_insertion, "the numbers of particles that insertions were to bring"),
        ];
        let dropped: Vec<&str> = dropped.iter().filter(|(keeps, _)| !keeps).map(|(_, what)| *what).collect();
        let dropped = match &dropped[..] {
            [] => String::new(),
            dropped => format!("; dropped, as it no longer fits: {}", dropped.join(", ")),
        };
        let origin = self.origin.display();
        format!("a branch of {origin}: {subject} continue from its last checkpoint with {changes}{dropped}")
    }

    /// Gives a simulation of the branch the state of the origin: the id of the branch, and why newer checkpoints were skipped. Collective.
    pub(super) fn restore(&self, simulation: &mut Simulation) -> Result<(String, Vec<String>)> {
        let (before, setup) = (&self.before, &self.setup);
        let (shared, skipped) = simulation.read_state(
            &OutputFiles::new(&self.origin).checkpoints(),
            setup,
            |saved| means_the_same(saved, before),
            |shared: &Shared| shared.is_of(&self.origin),
            |step, [engines, couplings]| {
                if !self.keeps_contacts {
                    let substep = step * u64::from(setup.substeps);
                    let engine = [before, setup].map(|setup| setup.engine.name());
                    *engines = states::without_memory(engine, engines, substep, &setup.templates)?;
                }
                if !self.keeps_coupling {
                    *couplings = SavedParts::default();
                }
                Ok(())
            },
        )?;
        // Placed at random they are known by their number alone.
        let (then, now) = (simulation.counts(), &simulation.record.counts(&simulation.counts.start)[..]);
        if then != now {
            let what = format!("the particles of each kind were {then:?} and would be {now:?}");
            return Err(Error::Agreed { code: 2, text: cannot_continue(&what).to_string() });
        }
        if !self.keeps_insertion {
            let Simulation { record, plan, step, .. } = simulation;
            record.restart(plan, *step);
        }
        simulation.begin_anew();
        let origin = format!("{} at step {}", shared.run.as_deref().unwrap_or("?"), simulation.step);
        Ok((run_id(setup, &origin), skipped))
    }
}

/// Refuses a change of what fluid and particles cannot continue with.
fn refuse_another_box(before: &Setup, setup: &Setup) -> Result<()> {
    let shapes = |of: &Json| of_each(&of["templates"], &["shape", "volume", "inertia_per_mass"]);
    let walls = |of: &Json| of_each(&of["walls"], &["name", "surface"]);
    let kept = |setup: &Setup| -> [(&str, Json); 9] {
        let (of, physics) = (identity(setup), physics(setup));
        [
            ("`dry`", of["dry"].clone()),
            ("the number of cells", format!("{:?}", setup.domain.cells).into()),
            ("`domain.periodic`", format!("{:?}", setup.domain.periodic()).into()),
            ("the size of a cell (m)", of["dx"].clone()),
            ("`fluid.precision`", of["precision"].clone()),
            ("`fluid.density`", physics["fluid"]["density"].clone()),
            ("the shape of particles", shapes(&physics)),
            ("the volume fraction of the particles", of["volume_fraction"].clone()),
            ("a wall", walls(&physics)),
        ]
    };
    let refuse = |what: &str, then: &Json, now: &Json, remedy: &str| {
        Err(cannot_continue(&format!("{what} was {then} and would be {now}{remedy}")))
    };
    let differ = |then: &Json, now: &Json| match (then.as_f64(), now.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() > ROUNDING * a.abs(),
        _ => then != now,
    };
    for ((what, then), (_, now)) in kept(before).iter().zip(&kept(setup)) {
        if differ(then, now) {
            return refuse(what, then, now, "");
        }
    }
    let [then, now] = [before, setup].map(|setup| Json::from(setup.time_step));
    if differ(&then, &now) {
        let remedy = setup.fluid.as_ref().map_or(String::new(), |fluid| {
            let dx = setup.domain.dx;
            let relaxation_time = 0.5 + 3.0 * fluid.viscosity * before.time_step / (dx * dx);
            let viscosity = fluid.viscosity;
            format!(" (with fluid.viscosity = {viscosity} and lattice.relaxation_time = {relaxation_time} it is the old one)")
        });
        return refuse("the time step (s)", &then, &now, &remedy);
    }
    let moved = |(then, now): &(&Wall, &Wall)| setup.fluid.is_none() && !stays(then, now);
    if let Some((then, now)) = before.walls.iter().zip(&setup.walls).find(moved) {
        let what = format!("the motion of the wall \"{}\", and with it its position,", then.name);
        let [then, now] = [then, now].map(|wall| Json::from(format!("{:?}", wall.motion)));
        return refuse(&what, &then, &now, "");
    }
    Ok(())
}

fn cannot_continue(what: &str) -> Error {
    Error::Input(format!(
        "this change makes a run that cannot continue from the state of another one: {what}; start it with `turbid run`"
    ))
}

/// True if a wall without a fluid is where it was though its motion differs.
fn stays(then: &Wall, now: &Wall) -> bool {
    let Surface::Plane { normal, .. } = &then.surface else {
        return then.motion == now.motion;
    };
    // To the bit the same motion across the plane.
    let slides = |wall: &Wall| wall.motion.velocity.span().iter().all(|v| v.dot(normal) == 0.0);
    let differs = |[then, now]: [Vec3; 2]| (now - then).dot(normal);
    let steady = [then, now].map(|wall| wall.motion.velocity.constant());
    then.motion == now.motion
        || then.motion.angular_velocity == now.motion.angular_velocity
            && (slides(then) && slides(now)
                || matches!(steady, [Some(then), Some(now)] if differs([then, now]) == 0.0))
}

/// These fields of each object of a list.
fn of_each(list: &Json, fields: &[&str]) -> Json {
    let of = |object: &Json| -> Json {
        fields.iter().map(|field| object[field].clone()).collect::<Vec<_>>().into()
    };
    list.as_array().into_iter().flatten().map(of).collect::<Vec<_>>().into()
}
