//! Figures of a run: a slice through the velocity field, the box in perspective, the settling velocity over time. They are
//! drawn by the crate `turbid-plot`, all but the [`Plane`] only with the cargo feature `pictures`.

#[cfg(feature = "pictures")]
mod facets;
#[cfg(feature = "pictures")]
mod outline;
mod plane;
#[cfg(feature = "pictures")]
mod settling;
#[cfg(feature = "pictures")]
mod slice;
#[cfg(feature = "pictures")]
mod snapshot;
#[cfg(feature = "pictures")]
mod view;

pub use plane::Plane;
#[cfg(feature = "pictures")]
pub use {
    facets::write_facets,
    settling::{SettlingPlot, settling_chart, write_settling},
    slice::{Slice, write_slice},
    snapshot::{Scale, Snapshot},
    turbid_plot::{Colours, Figure, Format, Image, KINDS, film, round_up},
    view::{Chains, Scene, write_view},
};

/// Writes a figure; the file appears whole.
#[cfg(feature = "pictures")]
pub fn write_figure(path: &std::path::Path, figure: &Figure, format: Format) -> crate::Result<()> {
    super::write_bytes(path, &figure.encode(format))
}
