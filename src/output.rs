//! Results: tables, VTK files, pictures, the summary.
//!
//! Everything here takes plain data in SI units. A run calls [`directory::create`] before anything is computed and [`directory::clear`]
//! when it begins, then the writers, with names from [`OutputFiles`], and [`Summary::write`] at the end.
//!
//! Files appear under their final name only when they are complete and on disk: they are written as `NAME.tmp`, synced, and renamed. Only
//! tables over time grow, as `series.csv`, by whole rows. So a run that is killed leaves readable files.

mod atomic;
mod averages;
pub mod contacts;
pub mod directory;
pub mod dynamics;
pub mod fronts;
mod growing;
pub mod means;
pub mod numbers;
pub mod particle_series;
pub mod picture;
pub mod pieces;
pub mod points;
pub mod polydata;
pub mod profiles;
pub mod pvd;
pub mod series;
pub mod statistics;
pub mod structure;
pub mod summary;
pub mod surfaces;
mod units;
pub mod vti;
#[cfg(test)]
#[path = "../tests/common/vtk.rs"]
mod vtk_reader;
pub mod walls;

pub use atomic::{write_atomically, write_bytes};
pub use averages::{Average, Averages, averages};
pub use contacts::{contacts, force_chains};
pub use directory::{Numbered, OutputFiles};
pub use growing::{RowsMark, SeriesWriter};
pub use particle_series::{PATHS, ParticleSeries, PathsState};
pub use points::ParticlePoints;
pub use polydata::PolyData;
pub use pvd::Collection;
pub use series::{SeriesColumn, SeriesRow, SeriesTable};
pub use statistics::{
    Estimate, LEAST_DISTANCE, Settled, estimate_independent, estimate_mean, estimate_ratio,
    estimate_settling, estimate_sheared, estimate_slope, settled, settled_suspension,
};
pub use summary::{NetFluxControl, ReferenceScales, ShapeSummary, Summary, WallSummary};
pub use surfaces::ParticleSurfaces;
pub use vti::{Fields, write_fields, write_fields_index};
pub use walls::{write_walls, write_wear};
