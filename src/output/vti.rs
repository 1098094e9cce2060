//! Fluid fields as VTK image data (`.vti`), written as a stream.
//!
//! Cell data in the appended section, raw, each array cut into blocks that are compressed with LZ4, sizes as
//! 64-bit integers. VTK's layout of one such array, all numbers `u64`:
//!
//! ```text
//! number of blocks | block size | size of the last block, 0 if it is full | compressed size of each block | blocks
//! ```
//!
//! Offsets of the arrays are not known before they are compressed, so the header is written with blanks that are
//! filled in at the end. Nothing is held in memory but one block.

use super::atomic::write_atomically;
use crate::domain::Domain;
use crate::error::Result;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

/// The fluid in the whole box at one time.
///
/// # Shape
/// One value per cell, `domain.cell_count()` each; x runs fastest, then y, then z.
#[derive(Clone, Copy, Debug)]
pub struct FieldSnapshot<'a> {
    /// Box and cells.
    pub domain: Domain,
    /// Physical time (s).
    pub time: f64,
    /// Velocity (m/s).
    pub velocity: &'a [[f32; 3]],
    /// Pressure, relative to the reference (Pa).
    pub pressure: &'a [f32],
    /// Solid fraction (-), 0 in fluid and 1 in solid.
    pub solid_fraction: &'a [f32],
}

/// Bytes per compressed block: small enough for the cache, a multiple of every tuple size.
const BLOCK_BYTES: usize = 3 << 16;
/// Blanks that hold the place of an offset; more digits than any `u64`.
const OFFSET_WIDTH: usize = 20;

/// Writes velocity, pressure and solid fraction as cell data.
///
/// # Panics
/// If an array of `fields` does not have one value per cell.
pub fn write_fields(path: &Path, fields: &FieldSnapshot) -> Result<()> {
    let cells = fields.domain.cell_count();
    assert_eq!(fields.velocity.len(), cells, "one velocity per cell");
    assert_eq!(fields.pressure.len(), cells, "one pressure per cell");
    assert_eq!(fields.solid_fraction.len(), cells, "one solid fraction per cell");
    let arrays = [
        Array::new("velocity", 3, fields.velocity.as_flattened()),
        Array::new("pressure", 1, fields.pressure),
        Array::new("solid_fraction", 1, fields.solid_fraction),
    ];
    write_atomically(path, |file| {
        write_image(file, &fields.domain, fields.time, &arrays)
    })
}

/// One array of cell data.
struct Array<'a> {
    name: &'static str,
    components: usize,
    values: &'a [f32],
}

impl<'a> Array<'a> {
    fn new(name: &'static str, components: usize, values: &'a [f32]) -> Self {
        Self {
            name,
            components,
            values,
        }
    }
}

fn write_image<W: Write + Seek>(out: &mut W, domain: &Domain, time: f64, arrays: &[Array]) -> io::Result<()> {
    let [nx, ny, nz] = domain.cells;
    let dx = domain.dx;
    let byte_order = if cfg!(target_endian = "big") {
        "BigEndian"
    } else {
        "LittleEndian"
    };
    // Rust prints the shortest text that reads back as exactly the same number.
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="{byte_order}" header_type="UInt64" compressor="vtkLZ4DataCompressor">
<ImageData WholeExtent="0 {nx} 0 {ny} 0 {nz}" Origin="0 0 0" Spacing="{dx} {dx} {dx}">
<FieldData>
<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time}</DataArray>
</FieldData>
<Piece Extent="0 {nx} 0 {ny} 0 {nz}">
<CellData Scalars="solid_fraction" Vectors="velocity">
"#
    )?;
    let mut offset_places = Vec::with_capacity(arrays.len());
    for Array { name, components, .. } in arrays {
        write!(
            out,
            r#"<DataArray type="Float32" Name="{name}" NumberOfComponents="{components}" format="appended" offset=""#
        )?;
        offset_places.push(out.stream_position()?);
        writeln!(out, "{:OFFSET_WIDTH$}\"/>", "")?;
    }
    write!(
        out,
        "</CellData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_"
    )?;
    let start = out.stream_position()?;
    let mut offsets = Vec::with_capacity(arrays.len());
    for array in arrays {
        offsets.push(out.stream_position()? - start);
        write_compressed(out, bytemuck::cast_slice(array.values))?;
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
    use crate::error::Error;

    /// Reads one array back by the description of the format, not by the writer's code.
    fn read_array(file: &[u8], name: &str) -> Vec<f32> {
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let data = file.windows(marker.len()).position(|w| w == marker).unwrap();
        let header = std::str::from_utf8(&file[..data]).unwrap();
        let data = data + marker.len();
        let tag = header
            .lines()
            .find(|line| line.contains(&format!("Name=\"{name}\"")))
            .unwrap();
        let offset = tag.split("offset=\"").nth(1).unwrap().split('"').next().unwrap();
        let mut at = data + offset.trim().parse::<usize>().unwrap();
        let mut number = || {
            at += 8;
            u64::from_ne_bytes(file[at - 8..at].try_into().unwrap()) as usize
        };
        let (count, size, last) = (number(), number(), number());
        let compressed: Vec<usize> = (0..count).map(|_| number()).collect();
        let mut bytes = Vec::new();
        for (i, length) in compressed.into_iter().enumerate() {
            let full = if i + 1 == count && last != 0 { last } else { size };
            bytes.extend(lz4_flex::block::decompress(&file[at..at + length], full).unwrap());
            at += length;
        }
        bytemuck::pod_collect_to_vec(&bytes)
    }

    struct Fields {
        domain: Domain,
        velocity: Vec<[f32; 3]>,
        pressure: Vec<f32>,
        solid_fraction: Vec<f32>,
    }

    impl Fields {
        fn new(cells: [usize; 3]) -> Self {
            let domain = Domain {
                periodic: [true; 3],
                cells,
                dx: 0.1,
            };
            let wave = |i: usize, k: f32| (i as f32 * k).sin();
            let all = 0..domain.cell_count();
            Self {
                domain,
                velocity: all
                    .clone()
                    .map(|i| [wave(i, 0.1), wave(i, 0.7), wave(i, 1.3)])
                    .collect(),
                pressure: all.clone().map(|i| 1e3 * wave(i, 0.01)).collect(),
                solid_fraction: all.map(|i| wave(i, 0.05).max(0.0)).collect(),
            }
        }

        fn snapshot(&self) -> FieldSnapshot<'_> {
            FieldSnapshot {
                domain: self.domain,
                time: 0.1 + 0.2,
                velocity: &self.velocity,
                pressure: &self.pressure,
                solid_fraction: &self.solid_fraction,
            }
        }
    }

    #[test]
    fn every_value_reads_back_whether_or_not_blocks_are_full() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.vti");
        // 16 * 16 * 128 velocities are exactly two blocks; the other boxes end within one.
        for cells in [[16, 16, 128], [5, 7, 3], [31, 40, 55]] {
            let fields = Fields::new(cells);
            write_fields(&path, &fields.snapshot()).unwrap();
            let file = std::fs::read(&path).unwrap();
            assert_eq!(read_array(&file, "velocity"), fields.velocity.as_flattened());
            assert_eq!(read_array(&file, "pressure"), fields.pressure);
            assert_eq!(read_array(&file, "solid_fraction"), fields.solid_fraction);
            let text = String::from_utf8_lossy(&file);
            assert!(text.contains(">0.30000000000000004</DataArray>"), "exact time");
            assert!(text.contains(&format!(
                "WholeExtent=\"0 {} 0 {} 0 {}\"",
                cells[0], cells[1], cells[2]
            )));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_disk_that_fills_up_is_an_error_and_leaves_no_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.vti");
        std::os::unix::fs::symlink("/dev/full", directory.path().join("fields.vti.tmp")).unwrap();
        let fields = Fields::new([31, 40, 55]);
        let error = write_fields(&path, &fields.snapshot()).unwrap_err();
        assert!(
            matches!(&error, Error::Io { path, .. } if path.ends_with("fields.vti")),
            "{error}"
        );
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
