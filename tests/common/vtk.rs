//! Readers of files for VTK that share no code with what writes them.

use std::path::Path;
use vtkio::Vtk;
use vtkio::model::{Attribute, DataSet, Piece, PolyDataPiece};

/// The header of a file of fields, and its arrays one after the other: vtkio does not know raw data.
pub(crate) struct Image {
    file: Vec<u8>,
    /// Offset of the arrays.
    data: usize,
}

impl Image {
    pub(crate) fn read(path: &Path) -> Self {
        let file = std::fs::read(path).unwrap();
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let at = file.windows(marker.len()).position(|w| w == marker).unwrap();
        assert!(file.trim_ascii_end().ends_with(b"</VTKFile>"));
        Self { data: at + marker.len(), file }
    }

    pub(crate) fn header(&self) -> &str {
        std::str::from_utf8(&self.file[..self.data]).unwrap()
    }

    /// The numbers of 32 bits of the array that a line of the header describes.
    pub(crate) fn array<T: bytemuck::Pod>(&self, line: &str) -> Vec<T> {
        let mut rest = &self.file[self.data + attribute(line, "offset").trim().parse::<usize>().unwrap()..];
        let mut number = || {
            let (head, tail) = rest.split_first_chunk().unwrap();
            rest = tail;
            u64::from_le_bytes(*head) as usize
        };
        // Blocks, bytes of a block, bytes of the last one (0 if it is full), compressed bytes of each.
        let (blocks, full, last) = (number(), number(), number());
        let compressed: Vec<usize> = (0..blocks).map(|_| number()).collect();
        let mut bytes = Vec::new();
        for (i, length) in compressed.into_iter().enumerate() {
            let size = if i + 1 == blocks && last > 0 { last } else { full };
            let (block, tail) = rest.split_at(length);
            bytes.extend(lz4_flex::block::decompress(block, size).unwrap());
            rest = tail;
        }
        bytemuck::pod_collect_to_vec(&bytes)
    }

    /// The array of this name.
    pub(crate) fn named(&self, name: &str) -> Vec<f32> {
        let tag = format!("Name=\"{name}\"");
        let line = self.header().lines().find(|line| line.contains(&tag));
        self.array(line.unwrap_or_else(|| panic!("no array {name}")))
    }
}

/// An attribute of a line of XML.
pub(crate) fn attribute<'a>(line: &'a str, name: &str) -> &'a str {
    let (_, rest) = line.split_once(&format!("{name}=\"")).unwrap();
    rest.split_once('"').unwrap().0
}

/// The pieces of a file of polygons, or of all files that its index names.
pub(crate) fn polygons(path: &Path) -> Vec<PolyDataPiece> {
    let mut vtk = Vtk::import(path).unwrap();
    vtk.load_all_pieces().unwrap();
    let DataSet::PolyData { pieces, .. } = vtk.data else {
        panic!("{} holds no polygons", path.display());
    };
    let inline = |piece| match piece {
        Piece::Inline(piece) => *piece,
        _ => panic!("{}: no inline piece", path.display()),
    };
    pieces.into_iter().map(inline).collect()
}

/// The only piece of a file of polygons.
pub(crate) fn piece(path: &Path) -> PolyDataPiece {
    let mut pieces = polygons(path);
    assert_eq!(pieces.len(), 1, "{}", path.display());
    pieces.remove(0)
}

/// Values of the points of a piece.
pub(crate) fn point_data(piece: &PolyDataPiece, name: &str) -> Vec<f64> {
    let find = |attribute: &Attribute| match attribute {
        Attribute::DataArray(array) if array.name == name => array.data.cast_into(),
        _ => None,
    };
    let found = piece.data.point.iter().find_map(find);
    found.unwrap_or_else(|| panic!("no array {name}"))
}
