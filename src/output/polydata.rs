//! VTK polygonal data (`.vtp`): points, vertices, lines and polygons with numbers on the points.

use super::{pieces, vtkio_file};
use crate::error::Result;
use crate::math::Vec3;
use std::path::{Path, PathBuf};
use vtkio::IOBuffer;
use vtkio::model::{Attribute, Attributes, DataArray, ElementType, PolyDataPiece, ScalarType, VertexNumbers};

/// Polygonal data in the making; every array has its values for all points, in their order. Points, vectors and scalars that are
/// not integers have the precision `T`.
#[derive(Debug, Default)]
pub(super) struct PolyData<T = f32> {
    points: Vec<T>,
    vertices: Cells,
    lines: Cells,
    polygons: Cells,
    arrays: Vec<DataArray>,
}

/// Precision of a file: `f32` to look at, `f64` to go on from.
pub(super) trait Number: Copy {
    /// VTK's name.
    const NAME: &'static str;

    /// The nearest number of this precision.
    fn of(number: f64) -> Self;
}

impl Number for f32 {
    const NAME: &'static str = "Float32";

    fn of(number: f64) -> Self {
        number as Self
    }
}

impl Number for f64 {
    const NAME: &'static str = "Float64";

    fn of(number: f64) -> Self {
        number
    }
}

/// Cells of one kind: the points of all, and where each ends among them.
#[derive(Debug, Default)]
struct Cells {
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
}

impl Cells {
    fn add(&mut self, points: impl IntoIterator<Item = u64>) {
        self.connectivity.extend(points);
        self.offsets.push(self.connectivity.len() as u64);
    }

    /// What vtkio wants; nothing for none.
    fn topology(self) -> Option<VertexNumbers> {
        (!self.offsets.is_empty())
            .then_some(VertexNumbers::XML { connectivity: self.connectivity, offsets: self.offsets })
    }
}

impl<T: Number> PolyData<T>
where
    IOBuffer: From<Vec<T>>,
{
    /// Adds a point (m) and returns its number.
    pub(super) fn point(&mut self, at: Vec3) -> u64 {
        self.points.extend(at.iter().map(|&x| T::of(x)));
        (self.points.len() / 3 - 1) as u64
    }

    /// Makes a point a cell, so that it is seen.
    pub(super) fn vertex(&mut self, point: u64) {
        self.vertices.add([point]);
    }

    /// Adds a line through points.
    pub(super) fn line(&mut self, points: impl IntoIterator<Item = u64>) {
        self.lines.add(points);
    }

    /// Adds a polygon, counter-clockwise seen from its front.
    pub(super) fn polygon(&mut self, points: impl IntoIterator<Item = u64>) {
        self.polygons.add(points);
    }

    /// Numbers of all points.
    pub(super) fn scalars(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        self.tuples(name, values.into_iter().map(|x| [x]));
    }

    /// Tuples of numbers of all points that are no vectors.
    pub(super) fn tuples<const N: usize>(&mut self, name: &str, values: impl IntoIterator<Item = [f64; N]>) {
        let values: Vec<T> = values.into_iter().flatten().map(T::of).collect();
        self.arrays.push(DataArray::scalars(name, N as u32).with_data(values));
    }

    /// Whole numbers of all points, of any type of VTK.
    pub(super) fn integers<I>(&mut self, name: &str, values: Vec<I>)
    where
        IOBuffer: From<Vec<I>>,
    {
        self.arrays.push(DataArray::scalars(name, 1).with_data(values));
    }

    /// Vectors of all points.
    pub(super) fn vectors(&mut self, name: &str, values: impl IntoIterator<Item = Vec3>) {
        self.arrays.push(DataArray::vectors(name).with_data(flat::<T>(values)));
    }

    /// Normals of all points: what looks at them takes the surface for smooth.
    pub(super) fn normals(&mut self, values: impl IntoIterator<Item = Vec3>) {
        self.arrays.push(DataArray::normals("Normals").with_data(flat::<T>(values)));
    }

    /// Writes the index of a `file` of so many pieces, which all have the arrays of this; the path of the index.
    pub(super) fn write_index(&self, file: &Path, pieces: usize) -> Result<PathBuf> {
        let (mut declared, mut active) = (String::new(), Vec::new());
        for array in &self.arrays {
            // The first of each kind is seen first, as in a file of its own.
            let (kind, components) = match array.elem {
                ElementType::Vectors => ("Vectors", 3),
                ElementType::Normals => ("Normals", 3),
                _ => ("Scalars", array.num_comp()),
            };
            if !active.iter().any(|(known, _)| *known == kind) {
                active.push((kind, &array.name));
            }
            declared += &pieces::array(type_name(&array.data), &array.name, components);
        }
        let active: Vec<String> = (active.iter().map(|(kind, name)| format!("{kind}=\"{name}\""))).collect();
        let points = pieces::array(T::NAME, "Points", 3);
        pieces::write_index(
            file,
            "PPolyData",
            "",
            &format!(
                "<PPointData {}>\n{declared}</PPointData>\n<PPoints>\n{points}</PPoints>\n",
                active.join(" ")
            ),
            (0..pieces).map(|_| String::new()),
        )
    }

    /// Writes a file that VTK reads, without points, too.
    pub(super) fn write(self, path: &Path) -> Result<()> {
        let piece = PolyDataPiece {
            points: IOBuffer::from(self.points),
            verts: self.vertices.topology(),
            lines: self.lines.topology(),
            polys: self.polygons.topology(),
            data: Attributes {
                point: self.arrays.into_iter().map(Attribute::DataArray).collect(),
                cell: Vec::new(),
            },
            ..PolyDataPiece::default()
        };
        vtkio_file::write(path, piece)
    }
}

/// VTK's name of the type of an array.
fn type_name(data: &IOBuffer) -> &'static str {
    match data.scalar_type() {
        ScalarType::F64 => f64::NAME,
        ScalarType::I64 => "Int64",
        ScalarType::U64 => "UInt64",
        ScalarType::I32 => "Int32",
        ScalarType::U32 => "UInt32",
        ScalarType::F32 => f32::NAME,
        other => unreachable!("no file of ours has arrays of {other:?}"),
    }
}

fn flat<T: Number>(values: impl IntoIterator<Item = Vec3>) -> Vec<T> {
    values.into_iter().flat_map(|value| <[f64; 3]>::from(value).map(T::of)).collect()
}
