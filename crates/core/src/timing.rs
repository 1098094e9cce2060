//! Seconds spent in each stage of a step.

use std::time::Instant;

/// Accumulated wall time by stage name, in the order of first use.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    stages: Vec<(&'static str, f64)>,
}

impl Timings {
    /// Runs `work` and adds its wall time to `stage`.
    pub fn stage<R>(&mut self, stage: &'static str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.add(stage, start.elapsed().as_secs_f64());
        result
    }

    /// Adds `seconds` to `stage`.
    pub fn add(&mut self, stage: &'static str, seconds: f64) {
        match self.stages.iter_mut().find(|(name, _)| *name == stage) {
            Some((_, total)) => *total += seconds,
            None => self.stages.push((stage, seconds)),
        }
    }

    /// Stage names with their total seconds.
    pub fn stages(&self) -> &[(&'static str, f64)] {
        &self.stages
    }
}
