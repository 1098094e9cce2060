//! The files that a case names: on disk, or kept with a case that was saved.

use crate::input;
use crate::shape::Shape;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Names as they stand in the case, and contents.
pub(super) type Contents = Vec<(String, Vec<u8>)>;

/// Shapes of a caller's own, by what stands for them in place of the name of a mesh file.
pub(crate) type OwnShapes = [(String, Arc<dyn Shape>)];

/// Where the files are that a case names, and what was read of them.
pub(super) struct Files<'a> {
    place: Place<'a>,
    shapes: &'a OwnShapes,
    read: RefCell<Contents>,
}

enum Place<'a> {
    /// Names are relative to this folder.
    Folder(&'a Path),
    /// All that were read when the case was new.
    Saved(&'a [(String, Vec<u8>)]),
}

impl<'a> Files<'a> {
    /// On disk, relative to `folder`.
    pub(super) fn on_disk(folder: &'a Path) -> Self {
        Self::new(Place::Folder(folder))
    }

    /// Kept with the case.
    pub(super) fn saved(files: &'a [(String, Vec<u8>)]) -> Self {
        Self::new(Place::Saved(files))
    }

    fn new(place: Place<'a>) -> Self {
        Self { place, shapes: &[], read: RefCell::default() }
    }

    /// These shapes besides.
    pub(super) fn with_shapes(self, shapes: &'a OwnShapes) -> Self {
        Self { shapes, ..self }
    }

    /// The shape of the caller's own that goes by this name.
    pub(super) fn shape(&self, name: &str) -> Option<Arc<dyn Shape>> {
        let found = self.shapes.iter().find(|(known, _)| known == name);
        found.map(|(_, shape)| Arc::clone(shape))
    }

    /// The contents of a file of at most `limit` bytes; or what is wrong.
    pub(super) fn contents(&self, name: &str, limit: u64) -> Result<Vec<u8>, String> {
        let bytes = match self.place {
            Place::Folder(folder) => input::read(&folder.join(name), limit).map_err(|e| e.to_string())?,
            Place::Saved(files) => files
                .iter()
                .find(|(known, _)| known == name)
                .map(|(_, bytes)| bytes.clone())
                .ok_or("it was not saved with the case")?,
        };
        let mut read = self.read.borrow_mut();
        if !read.iter().any(|(known, _)| known == name) {
            read.push((name.to_string(), bytes.clone()));
        }
        Ok(bytes)
    }

    /// How messages call a file.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        match self.place {
            Place::Folder(folder) => folder.join(name),
            Place::Saved(_) => PathBuf::from(name),
        }
    }

    /// All that was read.
    pub(super) fn into_read(self) -> Contents {
        self.read.into_inner()
    }
}
