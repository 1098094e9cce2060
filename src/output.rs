//! What came out: tables, VTK files, pictures, the summary.
//!
//! Everything here takes plain data in SI units and knows nothing of how it was computed. A run calls, in this
//! order, [`directory::create`] before anything is computed and [`directory::clear`] when the run begins; [`SeriesWriter`], [`ParticleSeries`],
//! [`write_fields`], [`ParticlePoints::write`], [`ParticleSurfaces::write`], [`write_contacts`], [`write_force_chains`] (each followed by
//! [`Collection::add`]), [`write_walls`], and [`picture::write_slice`] or [`picture::write_side_view`] on the way, with
//! names from [`OutputFiles`]; [`picture::write_settling`] and [`Summary::write`] at the end. Where ranks are processes, the files for
//! VTK are written in [`pieces`], and the functions `write_..._index` follow before the collection.
//!
//! Files appear under their final name only when they are complete and on disk: they are written beside as
//! `NAME.tmp`, synced, and renamed. The files that grow are `series.csv` and `particle_series.csv`, by whole rows. So a run that is killed
//! leaves nothing that cannot be read.

mod atomic;
pub mod contacts;
pub mod directory;
pub mod numbers;
#[cfg(feature = "pictures")]
mod overlay;
pub mod particle_series;
pub mod picture;
pub mod pieces;
pub mod points;
pub mod polydata;
pub mod pvd;
pub mod series;
mod series_table;
pub mod statistics;
pub mod summary;
pub mod surfaces;
pub mod vti;
#[cfg(test)]
#[path = "../tests/common/vtk.rs"]
mod vtk_reader;
pub mod walls;

pub use atomic::write_bytes;
pub use contacts::{contacts, force_chains};
pub use directory::{Numbered, OutputFiles};
#[cfg(feature = "pictures")]
pub use overlay::Overlay;
pub use particle_series::{PATHS, ParticleSeries, PathsState};
pub use points::ParticlePoints;
pub use polydata::PolyData;
pub use pvd::Collection;
pub use series::{SeriesRow, SeriesWriter};
pub use series_table::{SeriesColumn, SeriesTable};
pub use statistics::{Estimate, Settled, estimate_mean, settled};
pub use summary::{NetFluxControl, ReferenceScales, ShapeSummary, Summary, WallSummary};
pub use surfaces::ParticleSurfaces;
pub use vti::{Fields, write_fields, write_fields_index};
pub use walls::write_walls;
