//! Cases of the literature, each with the question it answers, the case files, the reference and what counts as agreement.
//!
//! `validation/<name>/` holds what a case is made of: its texts are part of this program, so that it validates itself
//! anywhere. The module of a case here says how it is run, what is measured and how far it may be off; the `README.md` of its
//! folder says why.

mod channel;
mod context;
mod drafting;
mod friction;
mod hertz;
mod hindered_settling;
mod liggghts;
mod periodic_settling;
mod prescribed_motion;
mod random_array;
mod reference;
mod restitution;
mod rising_sphere;
mod settling_tank;
mod shear;
mod shear_viscosity;
mod shear_wave;
mod sphere_array;
mod suite;
mod taylor_green;
mod watch;
mod wet_impact;

use crate::checks::Check;
pub use crate::checks::Findings;
pub use context::SuiteContext;
pub use suite::{list, run};
use turbid::error::Result;

/// Names that most cases use.
mod prelude {
    pub(super) use super::context::{SuiteContext, unsteady};
    pub(super) use super::reference::{Table, interpolated};
    pub(super) use super::watch::{Watch, sphere_course};
    pub(super) use super::{Case, Findings, Part};
    pub(super) use turbid::case::Setup;
    pub(super) use turbid::error::Result;
    pub(super) use turbid::math::Vec3;
    pub(super) use turbid::output::Overlay;
    pub(super) use turbid::particle::Particle;
    pub(super) use turbid::simulation::Simulation;
}

/// Levels, by the time that they take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Level {
    /// The parts that take seconds.
    Quick,
    /// All parts.
    Full,
}

/// A run of a case that needs no other.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// From which level on it is done.
    pub level: Level,
    /// About how long it takes on one core (s).
    pub seconds: f64,
    /// True if it uses all cores by itself.
    pub wide: bool,
    /// Does it.
    pub run: fn(&SuiteContext) -> Result<Findings>,
}

impl Part {
    /// A part of the full level on one core.
    const fn full(seconds: f64, run: fn(&SuiteContext) -> Result<Findings>) -> Self {
        Self { level: Level::Full, ..Self::quick(seconds, run) }
    }

    /// A part of the full level that takes all cores.
    const fn wide(seconds: f64, run: fn(&SuiteContext) -> Result<Findings>) -> Self {
        Self { wide: true, ..Self::full(seconds, run) }
    }

    /// A part of the quick level on one core.
    const fn quick(seconds: f64, run: fn(&SuiteContext) -> Result<Findings>) -> Self {
        Self { level: Level::Quick, seconds, wide: false, run }
    }
}

/// A case of the suite.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Short name: the folder below `validation/`.
    pub name: &'static str,
    /// Question, one line.
    pub question: &'static str,
    /// Sources of its references: author, year, DOI.
    pub source: &'static str,
    /// Its runs; none if it needs LIGGGHTS and this program was built without it.
    pub parts: &'static [Part],
}

impl Case {
    /// The lowest level at which it does anything.
    pub fn level(&self) -> Level {
        let levels = self.parts.iter().map(|part| part.level);
        levels.min().unwrap_or(Level::Full)
    }

    /// About how long its parts of a level take on one core (s).
    pub fn seconds(&self, level: Level) -> f64 {
        let parts = self.parts.iter().filter(|part| part.level <= level);
        parts.map(|part| part.seconds).sum()
    }
}

/// The suite.
pub const CASES: &[Case] = &[
    shear_wave::CASE,
    taylor_green::CASE,
    channel::CASE,
    sphere_array::CASE,
    periodic_settling::CASE,
    rising_sphere::CASE,
    prescribed_motion::CASE,
    shear::CASE,
    settling_tank::CASE,
    restitution::CASE,
    friction::CASE,
    hertz::CASE,
    liggghts::CASE,
    wet_impact::CASE,
    drafting::CASE,
    random_array::CASE,
    shear_viscosity::CASE,
    hindered_settling::CASE,
];

/// Results of cases. Their checks have the name and, unless they say another, the source of the case.
impl Findings {
    /// Holds a number against its reference; the tolerance is in the unit of both.
    fn absolute(&mut self, quantity: impl Into<String>, measured: f64, reference: f64, tolerance: f64) {
        self.checks.push(Check::new(quantity, measured, reference, tolerance, ""));
    }

    /// Holds a number against its reference; the tolerance is a part of the reference.
    fn relative(&mut self, quantity: impl Into<String>, measured: f64, reference: f64, part: f64) {
        self.absolute(quantity, measured, reference, part * reference.abs());
    }

    /// Reports a number that has no reference.
    fn note(&mut self, quantity: impl Into<String>, value: f64) {
        self.notes.push((quantity.into(), value));
    }

    /// Another source for the check made last.
    fn from(&mut self, source: &str) {
        if let Some(check) = self.checks.last_mut() {
            check.source = source.to_string();
        }
    }

    /// Takes what another part found.
    fn append(&mut self, other: Self) {
        self.checks.extend(other.checks);
        self.notes.extend(other.notes);
        self.overlays.extend(other.overlays);
    }
}

#[cfg(test)]
mod tests;
