//! Bodies on a device: their images, the cells of each row that they cover, and what they receive.

use super::TILE;
use crate::device::{Argument, Array, Done, NamedKernel, Queue};
use crate::error::Result;
use crate::fluid::Images;
use crate::fluid::population::Population;

/// Rows that a work-group finds the ends of.
const SPANS_GROUP: usize = 64;

/// Arrays of the bodies of a block.
pub(super) struct BodyArrays {
    /// As in [`Images`].
    pub(super) ints: Array,
    pub(super) numbers: Array,
    planes: Array,
    pub(super) faces: Array,
    mapped: Array,
    pub(super) cut: Array,
    /// Of each row of an image: the cells that it covers, what their fractions need, and its velocities.
    pub(super) spans: Array,
    pub(super) lengths: Array,
    pub(super) velocities: Array,
    /// Images that may touch a bin of tiles, of all bins, and the first of each; tiles of a bin, and bins.
    pub(super) bin_start: Array,
    pub(super) bin_images: Array,
    pub(super) bin: [usize; 3],
    pub(super) bins: [usize; 3],
    pub(super) received: Array,
    /// Bytes written for this sweep, and those that its rows take besides.
    pub(super) written: usize,
    pub(super) of_rows: usize,
}

impl BodyArrays {
    pub(super) fn new(queue: &Queue) -> Result<Self> {
        let small = || queue.zeroed(0, "the bodies");
        Ok(Self {
            ints: small()?,
            numbers: small()?,
            planes: small()?,
            faces: small()?,
            mapped: small()?,
            cut: small()?,
            spans: small()?,
            lengths: small()?,
            velocities: small()?,
            bin_start: small()?,
            bin_images: small()?,
            bin: [1; 3],
            bins: [1; 3],
            received: small()?,
            written: 0,
            of_rows: 0,
        })
    }

    /// Writes what a sweep needs, with room for its rows and `received` bytes that bodies receive.
    pub(super) fn write<S: Population>(
        &mut self,
        queue: &Queue,
        images: &Images,
        tiles: [usize; 3],
        received: usize,
    ) -> Done {
        queue.write(&mut self.ints, &images.ints)?;
        queue.write(&mut self.numbers, &images.numbers)?;
        queue.write(&mut self.planes, &images.planes)?;
        queue.write(&mut self.faces, &images.faces)?;
        queue.write(&mut self.mapped, &images.mapped)?;
        queue.write(&mut self.cut, &images.cut)?;
        self.bin = images.bin(TILE);
        self.bins = std::array::from_fn(|a| tiles[a].div_ceil(self.bin[a]));
        let (start, listed) = images.by_bin(self.bins, std::array::from_fn(|a| TILE[a] * self.bin[a]));
        queue.write(&mut self.bin_start, &start)?;
        queue.write(&mut self.bin_images, &listed)?;
        self.written = images.bytes() + size_of_val(&start[..]) + size_of_val(&listed[..]);
        self.of_rows = 0;
        for (array, bytes) in [
            (&mut self.spans, 5 * size_of::<i32>()),
            (&mut self.lengths, 3 * size_of::<f32>()),
            (&mut self.velocities, 6 * size_of::<S::Number>()),
        ] {
            queue.reserve(array, images.rows * bytes)?;
            self.of_rows += images.rows * bytes;
        }
        queue.reserve(&mut self.received, received)?;
        queue.clear(&mut self.received, received.max(8))
    }

    /// Finds the cells of each row that each image covers.
    pub(super) fn find_spans(&self, queue: &Queue, kernel: &NamedKernel, images: &Images) -> Done {
        let (count, most) = (images.count(), images.most_rows);
        if count == 0 {
            return Ok(());
        }
        let arguments = [
            Argument::Int(count as i32),
            Argument::Int(most as i32),
            Argument::Array(&self.ints),
            Argument::Array(&self.numbers),
            Argument::Array(&self.planes),
            Argument::Array(&self.mapped),
            Argument::Array(&self.spans),
            Argument::Array(&self.lengths),
            Argument::Array(&self.velocities),
        ];
        let (groups, bytes) = ((count * most).div_ceil(SPANS_GROUP), self.of_rows + images.bytes());
        // SAFETY: the arguments of the kernel; arrays have room for all images and rows.
        unsafe { queue.launch(kernel, &arguments, groups, SPANS_GROUP, bytes) }
    }
}
