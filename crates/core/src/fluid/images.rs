//! Bodies as a device gets them: every periodic image that touches a block, by numbers from which the device finds the cells it covers.
//!
//! The order of all numbers is that of `device/kernels.cl`; `coupling/images.rs` writes them.

/// Integers of an image.
pub(crate) const INTS: usize = 20;

/// All images, in ascending order of the ids of their bodies.
#[derive(Clone, Debug, Default)]
pub struct Images {
    pub(crate) ints: Vec<i32>,
    pub(crate) numbers: Vec<f64>,
    /// Faces in double and in single precision.
    pub(crate) planes: Vec<f64>,
    pub(crate) faces: Vec<f32>,
    /// Rows of cells that the host found, and the fractions of those that a surface cuts.
    pub(crate) mapped: Vec<i32>,
    pub(crate) cut: Vec<f32>,
    /// Rows of all images, and of the one with the most.
    pub(crate) rows: usize,
    pub(crate) most_rows: usize,
}

impl Images {
    /// Number of images.
    pub(crate) fn count(&self) -> usize {
        self.ints.len() / INTS
    }

    /// Bytes of all.
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.ints.len() + self.faces.len() + self.mapped.len() + self.cut.len())
            + 8 * (self.numbers.len() + self.planes.len())
    }

    pub(crate) fn clear(&mut self) {
        self.ints.clear();
        self.numbers.clear();
        self.planes.clear();
        self.faces.clear();
        self.mapped.clear();
        self.cut.clear();
        (self.rows, self.most_rows) = (0, 0);
    }

    /// Edges of bins of whole tiles that are about as large as the largest image (tiles).
    pub(crate) fn bin(&self, tile: [usize; 3]) -> [usize; 3] {
        std::array::from_fn(|a| {
            let width = |ints: &[i32]| (ints[3 + 2 * a] - ints[2 + 2 * a]) as usize;
            let largest = self.ints.chunks_exact(INTS).map(width).max().unwrap_or(0);
            (largest / tile[a]).next_power_of_two().clamp(1, 16)
        })
    }

    /// Images that may touch each bin of a block, in their order: the first of each bin and one past the last, and their indices; for
    /// `count` bins with these `edges` (cells).
    pub(crate) fn by_bin(&self, count: [usize; 3], edges: [usize; 3]) -> (Vec<u32>, Vec<i32>) {
        let mut start = vec![0_u32; count.iter().product::<usize>() + 1];
        let each = |visit: &mut dyn FnMut(usize, usize)| {
            for (index, ints) in self.ints.chunks_exact(INTS).enumerate() {
                let [xs, ys, zs] = [0, 1, 2].map(|a| {
                    let cell = |at: usize| (ints[2 + 2 * a + at] + ints[8 + a]) as usize / edges[a];
                    cell(0)..=cell(1)
                });
                for z in zs {
                    for y in ys.clone() {
                        for x in xs.clone() {
                            visit((z * count[1] + y) * count[0] + x, index);
                        }
                    }
                }
            }
        };
        each(&mut |bin, _| start[bin + 1] += 1);
        for bin in 1..start.len() {
            start[bin] += start[bin - 1];
        }
        let mut next = start.clone();
        let mut listed = vec![0; start[start.len() - 1] as usize];
        each(&mut |bin, index| {
            listed[next[bin] as usize] = index as i32;
            next[bin] += 1;
        });
        (start, listed)
    }
}
