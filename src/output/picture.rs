//! Figures of a run: a slice through the velocity field, the particles from the side, the settling velocity over time. They are
//! drawn by [`turbid_plot`].

mod outline;
mod plane;
mod scene;
mod settling;
mod side_view;
mod slice;

pub use plane::{Cut, Plane};
pub use scene::{Clock, Scene};
pub use settling::{SettlingPlot, settling_chart, write_settling};
pub use side_view::write_side_view;
pub use slice::write_slice;
pub use turbid_plot::{Figure, Format};

use super::atomic::write_bytes;
use crate::error::Result;
use std::path::Path;

/// Writes a figure; the file appears whole.
pub fn write_figure(path: &Path, figure: &Figure, format: Format) -> Result<()> {
    write_bytes(path, &figure.encode(format))
}
