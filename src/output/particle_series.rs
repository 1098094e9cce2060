//! The paths of single particles, `particle_series.csv`.

use super::growing::{RowsMark, SeriesWriter};
use super::series::{definitions, heads};
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::Particle;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::LazyLock;

/// Particles whose paths are written if a case names none: those with the lowest ids.
pub const PATHS: usize = 16;

/// Quantities of `particle_series.csv`, one row per particle and time: names, units and definitions of their columns.
const QUANTITIES: &str = "\
step (-): Steps done.
t (s): Time, `step * time_step`.
id (-): Number of the particle, from 0 in the order of the sections.
{x,y,z} (m): Centre of mass, on a continuous path: passages through periodic faces add the edge of the box.
velocity_{x,y,z} (m/s): Velocity of the centre of mass.
angular_velocity_{x,y,z} (1/s): Angular velocity in the world frame.
orientation_{w,x,y,z} (-): Unit quaternion that maps the body frame to the world frame; `w` is its real part.
";

/// Header of `particle_series.csv`: name and unit of every column.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));

/// Definition of every quantity, by the name of its column without the axis.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| definitions(QUANTITIES));

/// State of `particle_series.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PathsState {
    pub(crate) rows: RowsMark,
    /// Last position of each particle, in the box and on its continuous path (m).
    last: Vec<[[f64; 3]; 2]>,
    /// Ids of these particles; none in checkpoints of older versions.
    #[serde(default)]
    ids: Vec<u64>,
}

/// Writes `particle_series.csv`, one row for each of some particles at a time.
#[derive(Debug)]
pub struct ParticleSeries {
    writer: SeriesWriter,
    domain: Domain,
    /// As of [`PathsState`].
    last: Vec<[[f64; 3]; 2]>,
    ids: Vec<u64>,
}

impl ParticleSeries {
    /// Creates the file, replacing an older one, and writes the header.
    pub fn create(path: &Path, domain: Domain) -> Result<Self> {
        let writer = SeriesWriter::with_columns(path, COLUMNS.iter())?;
        Ok(Self { writer, domain, last: Vec::new(), ids: Vec::new() })
    }

    /// Continues from a [state](Self::state); rows that follow are cut off. Errors:
    /// [`Error::Input`](crate::error::Error::Input) if the file is not there or has become shorter.
    pub fn resume(path: &Path, domain: Domain, state: &PathsState) -> Result<Self> {
        let writer = SeriesWriter::resume(path, &state.rows)?;
        Ok(Self { writer, domain, last: state.last.clone(), ids: state.ids.clone() })
    }

    /// As [`SeriesWriter::intact`].
    pub fn intact(&self) -> Result<()> {
        self.writer.intact()
    }

    /// State to [resume](Self::resume) from; the rows so far are safe on disk after this.
    pub fn state(&self) -> Result<PathsState> {
        Ok(PathsState { rows: self.writer.mark()?, last: self.last.clone(), ids: self.ids.clone() })
    }

    /// Appends some particles, in ascending order of id; they may come and go. A particle moves by less than half of the box between two calls.
    pub fn write(&mut self, step: u64, time: f64, particles: &[Particle]) -> Result<()> {
        let ids: Vec<u64> = particles.iter().map(|particle| particle.id).collect();
        // None are known of an older version, whose particles stayed.
        let same = ids == self.ids || (self.ids.is_empty() && self.last.len() == ids.len());
        if !same {
            let last = |id: u64| self.ids.iter().position(|known| *known == id).map(|at| self.last[at]);
            let begin = |p: &Particle| last(p.id).unwrap_or([self.domain.wrap(p.position()).into(); 2]);
            self.last = particles.iter().map(begin).collect();
        }
        self.ids = ids;
        let mut rows = Vec::with_capacity(particles.len());
        for (particle, [inside, path]) in particles.iter().zip(&mut self.last) {
            let now = self.domain.wrap(particle.position());
            *path = (Vec3::from(*path) + self.domain.nearest_image(now - Vec3::from(*inside))).into();
            *inside = now.into();
            let Particle { id, velocity, angular_velocity, orientation: [i, j, k, w], .. } = *particle;
            rows.push((step, time, id, *path, velocity, angular_velocity, [w, i, j, k]));
        }
        self.writer.write(&rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_continues_through_periodic_faces() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particle_series.csv");
        let domain = Domain { faces: Domain::faces([true, true, false]), cells: [10, 10, 10], dx: 0.1 };
        let mut series = ParticleSeries::create(&path, domain).unwrap();
        let mut particles: Vec<Particle> = (0..5).map(|id| Particle::at(id, 0, Vec3::repeat(0.5))).collect();
        for step in 0..8_u64 {
            let x = 0.5 + 0.2 * step as f64;
            particles[3].position = domain.wrap(Vec3::new(x, 0.5, 0.5 - 0.01 * x)).into();
            particles[3].angular_velocity = [1.0, 2.0, 3.0];
            series.write(step, 0.125 * step as f64, &particles).unwrap();
        }
        let mut reader = csv::Reader::from_path(&path).unwrap();
        assert_eq!(reader.headers().unwrap(), COLUMNS.to_vec());
        let rows: Vec<Vec<f64>> = reader.deserialize().map(std::result::Result::unwrap).collect();
        assert_eq!(rows.len(), 8 * 5);
        let last = &rows[7 * 5 + 3];
        assert_eq!((last[0], last[1], last[2]), (7.0, 0.875, 3.0));
        assert!((last[3] - 1.9).abs() < 1e-12 && (last[5] - 0.481).abs() < 1e-12, "{last:?}");
        assert_eq!(last[9..], [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]);
    }
}
