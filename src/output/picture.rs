//! Pictures of a run as PNG: a slice through the velocity field, the particles from the side, settling velocity over
//! time; curves over each other; charts and bars, as PNG and SVG.

mod axis;
mod bars;
mod canvas;
mod chart;
mod colour;
mod drawing;
mod labels;
mod markup;
mod outline;
mod overlay;
mod page;
mod plane;
mod plot;
mod plot_axis;
mod raster;
mod scales;
mod scene;
mod side_view;
mod slice;
mod text;

pub use bars::Bars;
pub use chart::{Chart, ChartAxis, ChartPanel, ChartPoint, ChartSeries, ChartStyle};
pub use drawing::{Figure, Format};
pub use overlay::{Curve, CurveStyle, OverlayPlot, write_overlay, write_overlay_svg};
pub use plane::{Cut, Plane};
pub use plot::{SettlingPlot, settling_figure, write_settling};
pub use scene::{Clock, Scene};
pub use side_view::write_side_view;
pub use slice::write_slice;

use super::atomic::write_atomically;
use crate::error::Result;
use canvas::Canvas;
use std::io;
use std::path::Path;

fn write_png(path: &Path, canvas: &Canvas) -> Result<()> {
    write_atomically(path, |file| {
        let mut encoder = png::Encoder::new(file, canvas.width(), canvas.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: PIXELS_PER_METRE,
            yppu: PIXELS_PER_METRE,
            unit: png::Unit::Meter,
        }));
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&canvas.rgb()).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)
    })
}

/// 200 dots per inch: a picture 1200 pixels wide fills 15 cm of a page.
const PIXELS_PER_METRE: u32 = 7874;
