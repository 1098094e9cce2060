//! The files that a case names: on disk, or kept with a case that was saved.

use crate::input;
use crate::mesh::decompose::{Decomposition, decompose};
use crate::shape::{Shape, ShapeError};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Names as they stand in the case, and contents.
pub(super) type Contents = Vec<(String, Vec<u8>)>;

/// Shapes of a caller's own, by what stands for them in place of the name of a mesh file.
pub(crate) type OwnShapes = [(String, Arc<dyn Shape>)];

/// The files that a case names, and what was read of them.
#[derive(Default)]
pub(super) struct Files<'a> {
    /// Names are relative to this folder.
    pub(super) folder: PathBuf,
    /// All that were read when the case was new, in place of those in the folder.
    pub(super) saved: Option<&'a [(String, Vec<u8>)]>,
    /// Shapes besides.
    pub(super) shapes: &'a OwnShapes,
    /// All that was read.
    pub(super) read: RefCell<Contents>,
    /// Bodies that were cut, by name and excess: sizes have the same parts.
    pub(super) decomposed: RefCell<Vec<(String, f64, Arc<Decomposition>)>>,
}

impl Files<'_> {
    /// On disk, relative to `folder`.
    pub(super) fn on_disk(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), ..Self::default() }
    }

    /// The shape of the caller's own that goes by this name.
    pub(super) fn shape(&self, name: &str) -> Option<Arc<dyn Shape>> {
        let found = self.shapes.iter().find(|(known, _)| known == name);
        found.map(|(_, shape)| Arc::clone(shape))
    }

    /// The contents of a file of at most `limit` bytes; or what is wrong.
    pub(super) fn contents(&self, name: &str, limit: u64) -> Result<Vec<u8>, String> {
        let bytes = match self.saved {
            None => input::read(&self.folder.join(name), limit).map_err(|e| e.to_string())?,
            Some(files) => {
                let found = files.iter().find(|(known, _)| known == name);
                found.map(|(_, bytes)| bytes.clone()).ok_or("it was not saved with the case")?
            }
        };
        let mut read = self.read.borrow_mut();
        if !read.iter().any(|(known, _)| known == name) {
            read.push((name.to_string(), bytes.clone()));
        }
        Ok(bytes)
    }

    /// The contents of the file of a mesh.
    pub(super) fn mesh(&self, name: &str) -> Result<Vec<u8>, ShapeError> {
        let unread = |e| ShapeError::Mesh { path: self.path(name), problem: format!("cannot be read: {e}") };
        self.contents(name, input::MESH).map_err(unread)
    }

    /// The convex parts of the body in a file.
    pub(super) fn decomposed(&self, name: &str, excess: f64) -> Result<Arc<Decomposition>, ShapeError> {
        let same = |(known, part, _): &&(String, f64, _)| known == name && part.total_cmp(&excess).is_eq();
        if let Some((.., found)) = self.decomposed.borrow().iter().find(same) {
            return Ok(Arc::clone(found));
        }
        let found = Arc::new(decompose(&self.path(name), &self.mesh(name)?, excess)?);
        self.decomposed.borrow_mut().push((name.to_owned(), excess, Arc::clone(&found)));
        Ok(found)
    }

    /// The path of a file, for messages.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}
