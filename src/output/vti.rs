//! Fluid fields as VTK image data (`.vti`), written as a stream, of the box or of one block; `.pvti` lists the blocks.
//!
//! Cell data in the appended section, raw; each array is cut into blocks that are compressed with LZ4, in VTK's layout, all numbers `u64`:
//!
//! ```text
//! number of blocks | block size | size of the last block, 0 if it is full | compressed size of each block | blocks
//! ```
//!
//! Offsets of the arrays are not known before they are compressed, so the header has blanks that are filled in at the end. Nothing is held
//! in memory but one block. Pieces have the extents of their blocks in the box: neighbours share a plane of points, but no cell.

use super::atomic::write_atomically;
use super::{pieces, units};
use crate::domain::{Block, Domain};
use crate::error::Result;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The fluid in a block of cells: one value per cell, x fastest, then y, then z.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// Velocity (m/s); in a particle or a wall that of its motion.
    pub velocity: Vec<[f32; 3]>,
    /// Pressure (Pa) above that of the fluid at rest, without the hydrostatic pressure.
    pub pressure: Vec<f32>,
    /// Solid volume fraction of the cell (-): 1 in walls.
    pub solid_fraction: Vec<f32>,
}

/// Bytes per compressed block: small enough for the cache, a multiple of every tuple size.
const BLOCK_BYTES: usize = 3 << 16;
/// Blanks for an offset; more digits than any `u64`.
const OFFSET_WIDTH: usize = 20;

/// Names, units and components of the arrays, in their order.
const ARRAYS: [(&str, &str, usize); 3] =
    [("velocity", "m/s", 3), ("pressure", "Pa", 1), ("solid_fraction", "-", 1)];

/// Writes the fields of a block of the box at a time (s) as cell data. Panics unless there is one value per cell.
pub fn write_fields(path: &Path, domain: &Domain, block: &Block, time: f64, fields: &Fields) -> Result<()> {
    let arrays: [&[f32]; ARRAYS.len()] =
        [fields.velocity.as_flattened(), &fields.pressure, &fields.solid_fraction];
    for (array, (name, _, components)) in arrays.iter().zip(ARRAYS) {
        assert_eq!(array.len(), components * block.cell_count(), "{name}: one value per cell");
    }
    write_atomically(path, |file| write_image(file, &image(block, domain.dx), block, time, &arrays))
}

/// Writes the index of a `file` whose [pieces](pieces::piece), one for each block, are all written; its path.
pub fn write_fields_index(file: &Path, domain: &Domain, time: f64, blocks: &[Block]) -> Result<PathBuf> {
    let whole = Block { lo: [0; 3], hi: domain.cells };
    let mut declared = String::new();
    for (name, _, components) in ARRAYS {
        declared += &pieces::array("Float32", name, components);
    }
    pieces::write_index(
        file,
        "PImageData",
        &image(&whole, domain.dx),
        &format!("{}<PCellData {ACTIVE}>\n{declared}</PCellData>\n", field_data(time)),
        blocks.iter().map(|block| format!(" Extent=\"{}\"", extent(block))),
    )
}

/// The arrays that are seen first.
const ACTIVE: &str = "Scalars=\"solid_fraction\" Vectors=\"velocity\"";

/// Attributes of an image of a block, each with a blank before it.
fn image(block: &Block, dx: f64) -> String {
    // Rust prints the shortest text that reads back as exactly the same number.
    format!(" WholeExtent=\"{}\" Origin=\"0 0 0\" Spacing=\"{dx} {dx} {dx}\"", extent(block))
}

/// First and last plane of points in each direction.
fn extent(Block { lo, hi }: &Block) -> String {
    format!("{} {} {} {} {} {}", lo[0], hi[0], lo[1], hi[1], lo[2], hi[2])
}

fn field_data(time: f64) -> String {
    let time = format!(
        "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time}</DataArray>\n"
    );
    units::field_data(&time, ARRAYS.map(|(name, unit, _)| (name, unit)))
}

fn write_image<W: Write + Seek>(
    out: &mut W,
    image: &str,
    block: &Block,
    time: f64,
    arrays: &[&[f32]; ARRAYS.len()],
) -> io::Result<()> {
    let byte_order = if cfg!(target_endian = "big") { "BigEndian" } else { "LittleEndian" };
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="{byte_order}" header_type="UInt64" compressor="vtkLZ4DataCompressor">
<ImageData{image}>
{field_data}<Piece Extent="{extent}">
<CellData {ACTIVE}>
"#,
        field_data = field_data(time),
        extent = extent(block),
    )?;
    let mut offset_places = Vec::with_capacity(arrays.len());
    for (name, _, components) in ARRAYS {
        write!(
            out,
            r#"<DataArray type="Float32" Name="{name}" NumberOfComponents="{components}" format="appended" offset=""#
        )?;
        offset_places.push(out.stream_position()?);
        writeln!(out, "{:OFFSET_WIDTH$}\"/>", "")?;
    }
    write!(out, "</CellData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_")?;
    let start = out.stream_position()?;
    let mut offsets = Vec::with_capacity(arrays.len());
    for array in arrays {
        offsets.push(out.stream_position()? - start);
        write_compressed(out, bytemuck::cast_slice(array))?;
    }
    write!(out, "\n</AppendedData>\n</VTKFile>\n")?;
    for (place, offset) in offset_places.into_iter().zip(offsets) {
        out.seek(SeekFrom::Start(place))?;
        write!(out, "{offset:<OFFSET_WIDTH$}")?;
    }
    Ok(())
}

/// Writes one array in VTK's block layout (see the module text).
fn write_compressed<W: Write + Seek>(out: &mut W, bytes: &[u8]) -> io::Result<()> {
    let blocks = bytes.chunks(BLOCK_BYTES);
    let count = blocks.len();
    let mut header = vec![0_u64; 3 + count];
    header[0] = count as u64;
    header[1] = BLOCK_BYTES as u64;
    header[2] = (bytes.len() % BLOCK_BYTES) as u64;
    let start = out.stream_position()?;
    out.write_all(bytemuck::cast_slice(&header))?;
    let mut compressed = vec![0; lz4_flex::block::get_maximum_output_size(BLOCK_BYTES)];
    for (block, size) in blocks.zip(&mut header[3..]) {
        let length = lz4_flex::block::compress_into(block, &mut compressed).map_err(io::Error::other)?;
        out.write_all(&compressed[..length])?;
        *size = length as u64;
    }
    let end = out.stream_position()?;
    out.seek(SeekFrom::Start(start))?;
    out.write_all(bytemuck::cast_slice(&header))?;
    out.seek(SeekFrom::Start(end))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Decomposition;
    use crate::error::Error;
    use crate::output::vtk_reader::Image;

    fn whole(domain: &Domain) -> Block {
        Block { lo: [0; 3], hi: domain.cells }
    }

    const TIME: f64 = 0.1 + 0.2;

    fn example(cells: [usize; 3]) -> (Domain, Fields) {
        let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: 0.1 };
        let wave = |i: usize, k: f32| (i as f32 * k).sin();
        let all = 0..domain.cell_count();
        let fields = Fields {
            velocity: all.clone().map(|i| [wave(i, 0.1), wave(i, 0.7), wave(i, 1.3)]).collect(),
            pressure: all.clone().map(|i| 1e3 * wave(i, 0.01)).collect(),
            solid_fraction: all.map(|i| wave(i, 0.05).max(0.0)).collect(),
        };
        (domain, fields)
    }

    #[test]
    fn every_value_reads_back_whether_or_not_blocks_are_full() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.vti");
        // 16 * 16 * 128 velocities are exactly two blocks; the other boxes end within one.
        for cells in [[16, 16, 128], [5, 7, 3], [31, 40, 55]] {
            let (domain, fields) = example(cells);
            write_fields(&path, &domain, &whole(&domain), TIME, &fields).unwrap();
            let image = Image::read(&path);
            assert_eq!(image.named("velocity"), fields.velocity.as_flattened());
            assert_eq!(image.named("pressure"), fields.pressure);
            assert_eq!(image.named("solid_fraction"), fields.solid_fraction);
            let text = image.header();
            assert!(text.contains(">0.30000000000000004</DataArray>"), "exact time");
            assert!(text.contains(&format!(" WholeExtent=\"0 {} 0 {} 0 {}\"", cells[0], cells[1], cells[2])));
        }
    }

    #[test]
    fn the_pieces_of_six_blocks_hold_every_cell_once_where_the_index_says() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("fields_0000000012.vti");
        let (domain, fields) = example([11, 8, 13]);
        let cut = Decomposition::with_grid(domain, [1, 2, 3]);
        let blocks: Vec<Block> = (0..6).map(|rank| cut.block(rank)).collect();
        let cells = |b: &Block| -> Vec<usize> {
            let rows = (b.lo[2]..b.hi[2]).flat_map(|z| (b.lo[1]..b.hi[1]).map(move |y| 11 * (y + 8 * z)));
            rows.flat_map(|row| row + b.lo[0]..row + b.hi[0]).collect()
        };
        for (rank, block) in blocks.iter().enumerate() {
            let cells = cells(block);
            let velocity = cells.iter().map(|&i| fields.velocity[i]).collect();
            let of = |values: &[f32]| -> Vec<f32> { cells.iter().map(|&i| values[i]).collect() };
            let part = Fields {
                velocity,
                pressure: of(&fields.pressure),
                solid_fraction: of(&fields.solid_fraction),
            };
            write_fields(&pieces::piece(&file, rank), &domain, block, TIME, &part).unwrap();
        }
        let index = write_fields_index(&file, &domain, TIME, &blocks).unwrap();
        assert!(index.ends_with("fields_0000000012.pvti") && !file.exists());
        let text = std::fs::read_to_string(&index).unwrap();
        assert!(
            text.contains("WholeExtent=\"0 11 0 8 0 13\"")
                && text.contains(">0.30000000000000004</DataArray>")
        );

        // By the index alone: whose extent, in which file.
        let mut velocity = vec![[f32::NAN; 3]; domain.cell_count()];
        for line in text.lines().filter(|line| line.starts_with("<Piece ")) {
            let quoted = |name: &str| line.split(name).nth(1).unwrap().split('"').nth(1).unwrap();
            let e: Vec<usize> = (quoted("Extent").split(' ')).map(|n| n.parse().unwrap()).collect();
            let (lo, hi) = ([e[0], e[2], e[4]], [e[1], e[3], e[5]]);
            let values = Image::read(&directory.path().join(quoted("Source"))).named("velocity");
            for (cell, u) in cells(&Block { lo, hi }).into_iter().zip(values.chunks(3)) {
                assert!(velocity[cell][0].is_nan(), "cell {cell} is in two pieces");
                velocity[cell].copy_from_slice(u);
            }
        }
        assert_eq!(velocity, fields.velocity);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_disk_that_fills_up_is_an_error_and_leaves_no_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.vti");
        let (domain, fields) = example([31, 40, 55]);
        let arrays: [&[f32]; 3] = [fields.velocity.as_flattened(), &fields.pressure, &fields.solid_fraction];
        let (block, full) = (whole(&domain), std::fs::File::options().write(true).open("/dev/full").unwrap());
        let error = write_atomically(&path, |file| {
            *file = io::BufWriter::new(full);
            write_image(file, &image(&block, domain.dx), &block, TIME, &arrays)
        })
        .unwrap_err();
        assert!(matches!(&error, Error::Io { path, .. } if path.ends_with("fields.vti")), "{error}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
