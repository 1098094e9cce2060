//! Time of a step: the [forecast](super::Forecast) of the slowest rank, times what `turbid bench --calibrate` has found on
//! this machine.
//!
//! The cuts of the box never depend on the calibration, only on the built-in costs: all ranks must find the same ones.

use super::Work;
use super::costs::by_precision;
use crate::case::Setup;
use crate::comm;
use crate::error::Result;
use crate::input;
use crate::output::write_bytes;
use crate::simulation::decompose;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the file.
const FORMAT: u64 = 2;
/// Times over the estimates with the built-in costs that a machine can have.
const FACTORS: std::ops::Range<f64> = 0.01..100.0;

/// Time of a step, estimated from the particles and walls at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeEstimate {
    /// Of a step (s).
    pub seconds_per_step: f64,
    /// Number of ranks, threads or processes.
    pub ranks: usize,
    /// True if it is adapted to this machine.
    pub calibrated: bool,
}

/// Time of a step of a case on the ranks that it asks for, or [`Error::Input`](crate::Error::Input) if these are too many.
pub fn time_estimate(setup: &Setup) -> Result<TimeEstimate> {
    let cut = decompose(setup)?;
    let calibration = file().and_then(|path| Calibration::read(&path));
    let factor = calibration
        .as_ref()
        .map_or(1.0, |found| by_precision(setup.plan.precision, found.half, found.single, found.double));
    let ranks = cut.ranks();
    // Threads may share cores; the cores of processes are unknown.
    let turns = match comm::launched() {
        Some(launched) if launched.size > 1 => 1.0,
        _ => (ranks as f64 / cores() as f64).max(1.0),
    };
    Ok(TimeEstimate {
        seconds_per_step: factor * turns * Work::of(setup).forecast(&cut).seconds_per_step(),
        ranks,
        calibrated: calibration.is_some(),
    })
}

/// Measured over estimated times of this machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    format: u64,
    /// Model of the processor, and number of cores: a folder may be that of several machines.
    processor: String,
    cores: usize,
    /// Threads it was measured on.
    pub threads: usize,
    /// Time of a step over that with the built-in costs, with populations in half precision.
    pub half: f64,
    /// The same in single precision.
    pub single: f64,
    /// The same in double precision.
    pub double: f64,
}

impl Calibration {
    /// Of this machine, from measured over estimated times in half, single and double precision.
    pub(in crate::simulation) fn new(threads: usize, [half, single, double]: [f64; 3]) -> Self {
        Self { format: FORMAT, processor: processor(), cores: cores(), threads, half, single, double }
    }

    /// The contents of a file, if it is whole and of this machine.
    fn read(path: &Path) -> Option<Self> {
        let bytes = input::read(path, input::RECORD).ok()?;
        let read: Self = serde_json::from_slice(&bytes).ok()?;
        let factors = [read.half, read.single, read.double];
        let here = Self::new(read.threads, factors);
        let sound = factors.iter().all(|factor| FACTORS.contains(factor));
        Some(read).filter(|read| *read == here && sound)
    }

    /// Writes it for later estimates of this user, if there is a folder for it; the file.
    pub fn keep(&self) -> Result<Option<PathBuf>> {
        let path = file();
        if let Some(path) = &path {
            write_bytes(path, self.to_json().as_bytes())?;
        }
        Ok(path)
    }

    fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain data always serialises") + "\n"
    }
}

/// `turbid/costs.json` in the folder for what can be made again: that of `XDG_CACHE_HOME`, else `~/.cache`.
fn file() -> Option<PathBuf> {
    let folder = |name| Some(PathBuf::from(std::env::var_os(name)?)).filter(|path| path.is_absolute());
    let cache = folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")))?;
    Some(cache.join("turbid").join("costs.json"))
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// As the system calls it; empty where it does not say.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.unwrap_or_default().trim_start_matches([' ', '\t', ':']);
    model.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::seconds_of_files;
    use crate::simulation::work::tests::suspension;

    #[test]
    fn a_calibration_is_read_back_and_what_is_missing_damaged_or_of_another_machine_is_ignored() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("costs.json");
        let here = Calibration::new(2, [1.75, 1.5, 1.25]);
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Calibration::read(&path)
        };
        assert_eq!(Calibration::read(&path), None);
        assert_eq!(read(&here.to_json()), Some(here.clone()));
        assert_eq!(read(&here.to_json()[..40]), None);
        for other in [
            Calibration { format: FORMAT + 1, ..here.clone() },
            Calibration { processor: "another one".to_owned(), ..here.clone() },
            Calibration { double: -1.0, ..here.clone() },
        ] {
            assert_eq!(read(&other.to_json()), None, "{other:?}");
        }
    }

    #[test]
    fn rows_fields_and_surfaces_take_time_as_often_as_they_are_written() {
        let mut setup = suspension();
        let plan = &mut setup.plan;
        plan.end_step = 1000;
        plan.output.series_every = 1000;
        for every in [
            &mut plan.output.fields_every,
            &mut plan.output.particles_every,
            &mut plan.output.surfaces_every,
            &mut plan.output.contacts_every,
            &mut plan.output.picture_every,
        ] {
            *every = 0;
        }
        let least = seconds_of_files(&setup);
        setup.plan.output.series_every = 5;
        let rows = seconds_of_files(&setup);
        assert!((rows / least - 201.0 / 2.0).abs() < 1e-9, "{rows} {least}");
        setup.plan.output.fields_every = 100;
        assert!(seconds_of_files(&setup) > rows);
    }

    #[test]
    fn a_suspension_takes_longer_than_its_fluid_and_on_one_core_not_much_more() {
        let mut setup = suspension();
        setup.plan.threads = 1;
        let cells = setup.domain.cell_count() as f64;
        let forecast = crate::simulation::forecast(&setup, 1).unwrap();
        let each = forecast.seconds_per_step() / cells;
        assert!((5e-9..20e-9).contains(&each), "{each}");
        assert_eq!(time_estimate(&setup).unwrap().ranks, 1);
    }
}
