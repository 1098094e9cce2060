//! Charts as in a journal and pictures of fields, as PNG and SVG.
//!
//! A [`Chart`] (panels with common axes, measured points with error bars, references as lines), [`Bars`] or a [`Picture`] (pixels
//! on axes with a colour bar) is plain data; its method `figure` draws a [`Figure`], which [encodes](Figure::encode) itself in
//! any [`Format`]. There is one system of ticks ([`Chart`] and [`Picture`] share it) and one font, which is embedded: a figure
//! has the same bytes on every machine. A [`View`] shows solid bodies in perspective; [`film()`] makes one moving picture of several.
//!
//! ```
//! use turbid_plot::{Axis, Chart, Format, Series, Style};
//!
//! let spheres = Series::new("spheres", Style::Measured, [(0.1, 0.31), (0.2, 0.23), (0.3, 0.15)]);
//! let x = Axis::new("volume fraction phi (-)", false);
//! let y = Axis::new("settling velocity / u_Stokes (-)", false);
//! let chart = Chart::new("Hindered settling", x, y, vec![spheres]);
//! assert!(chart.figure().encode(Format::Svg).starts_with(b"<svg"));
//! ```
//!
//! # Text
//! In titles, labels and names a letter that stands alone is a symbol, as are the names of Greek letters; `^` raises the word that
//! follows, and `_` after a symbol lowers it: `"u / u_Stokes"`, `"acceleration (m/s^2)"`. The unit of an axis stands in parentheses at the
//! end of its label; `(-)` stands for none. A [`literal()`] is set as it is.

mod bars;
mod chart;
mod colour;
mod drawing;
mod film;
mod image;
mod markup;
mod picture;
mod scale;
mod svg;
mod text;
mod view;

pub use bars::Bars;
pub use chart::{Axis, Chart, Mark, Panel, Point, Series, Style};
pub use colour::{BLUE, Colours, INK, KINDS, REFERENCES, VERMILION, WALL};
pub use drawing::{Curve, Figure, Format, Readings};
pub use film::film;
pub use image::Image;
pub use markup::literal;
pub use picture::{Bar, Picture};
pub use view::{Item, Mesh, Paint, Triangle, View};

/// The smallest round number from `largest` on, so that a scale from zero to it has ticks at round numbers.
pub fn round_up(largest: f64) -> f64 {
    scale::rounded(0.0, largest, 10.0).1
}
