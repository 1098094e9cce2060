//! Neighbour search: bounding spheres in lists of cells, periodic, nearest image.
//!
//! Bodies of about the same size are sorted by a counting sort into cells at least as wide as the largest sum of two of their
//! bounding radii; a body then looks into its own cell and the neighbours, in its class of sizes and in those of wider bodies.
//! Pairs come out in lexicographic order of the indices, so the list depends only on the set of bodies.

use crate::domain::Domain;
use crate::math::Vec3;

/// Cells are wider than the reach of a pair by this part, so that rounding cannot hide a neighbour.
const SLACK: f64 = 1e-9;
/// Radii of a class are at most this many times as large as each other.
const CLASS: f64 = 1.5;

/// Finds pairs of bodies whose bounding spheres meet. Keeps its buffers from call to call.
#[derive(Clone, Debug)]
pub struct PairFinder {
    domain: Domain,
    /// Part of the box in which the bodies lie: low corner and edges (m).
    window: (Vec3, Vec3),
    /// From the widest bodies to the narrowest.
    classes: Vec<Class>,
    class_of: Vec<u16>,
    pairs: Vec<[u32; 2]>,
}

/// Bodies of about the same size.
#[derive(Clone, Debug)]
struct Class {
    axes: [Axis; 3],
    /// Start of each cell in `sorted`, x fastest.
    starts: Vec<u32>,
    sorted: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    position: Vec3,
    radius: f64,
    index: u32,
}

/// Cells along one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    lo: f64,
    /// Edge of the box (m).
    length: f64,
    per_metre: f64,
    cells: usize,
    periodic: bool,
}

impl PairFinder {
    /// For bodies anywhere in the box.
    pub fn new(domain: Domain) -> Self {
        Self::in_window(domain, Vec3::zeros(), domain.size())
    }

    /// For bodies that, taken periodically, lie in the box from `lo` with edges `extent` (m): cells are made there
    /// only. An extent not below that of the domain means all of it.
    pub fn in_window(domain: Domain, lo: Vec3, extent: Vec3) -> Self {
        Self { domain, window: (lo, extent), classes: Vec::new(), class_of: Vec::new(), pairs: Vec::new() }
    }

    /// The box.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// All `[i, j]`, `i < j`, in ascending order, with the nearest images of the centres at most
    /// `radii[i] + radii[j]` (m) apart.
    ///
    /// # Shape
    /// `positions.len() == radii.len()`; positions are wrapped.
    pub fn find(&mut self, positions: &[Vec3], radii: &[f64]) -> &[[u32; 2]] {
        assert_eq!(positions.len(), radii.len());
        self.pairs.clear();
        self.sort_into_classes(positions, radii);
        for (i, (&position, &radius)) in positions.iter().zip(radii).enumerate() {
            let first = self.pairs.len();
            let own = usize::from(self.class_of[i]);
            for (number, class) in self.classes[..=own].iter().enumerate() {
                class.look(position, |other| {
                    // Pairs of a class are found by the first body, the others by the narrower one.
                    if (number < own || other.index as usize > i)
                        && meet(&self.domain, other.position - position, radius + other.radius)
                    {
                        let pair = [i as u32, other.index];
                        self.pairs.push(if pair[0] < pair[1] { pair } else { [pair[1], pair[0]] });
                    }
                });
            }
            if self.classes.len() == 1 {
                self.pairs[first..].sort_unstable();
            }
        }
        if self.classes.len() > 1 {
            self.pairs.sort_unstable();
        }
        &self.pairs
    }

    fn sort_into_classes(&mut self, positions: &[Vec3], radii: &[f64]) {
        self.class_of.clear();
        self.class_of.resize(radii.len(), 0);
        let (mut classes, mut wider) = (0, f64::INFINITY);
        loop {
            let (mut count, mut widest) = (0, 0.0_f64);
            for (class, &radius) in self.class_of.iter_mut().zip(radii) {
                if radius * CLASS < wider {
                    *class = classes as u16;
                    (count, widest) = (count + 1, widest.max(radius));
                }
            }
            if count == 0 {
                break;
            }
            // Those that are too narrow for this class become the next one.
            let members =
                (0..radii.len()).filter(|&i| radii[i] * CLASS < wider && radii[i] * CLASS >= widest);
            let entry = |i: usize| Entry { position: positions[i], radius: radii[i], index: i as u32 };
            let axes = self.axes(2.0 * widest, count);
            if self.classes.len() == classes {
                self.classes.push(Class { axes, starts: Vec::new(), sorted: Vec::new() });
            }
            self.classes[classes].fill(axes, members.map(entry));
            (classes, wider) = (classes + 1, widest);
        }
        self.classes.truncate(classes);
    }

    fn axes(&self, reach: f64, bodies: usize) -> [Axis; 3] {
        let size = self.domain.size();
        let width = reach * (1.0 + SLACK);
        let (lo, extent) = self.window;
        // A window whose ends see each other round the back is the whole circle.
        let periodic: [bool; 3] = std::array::from_fn(|i| extent[i] + width >= size[i]);
        let extent = extent.zip_map(&size, |extent, size| if extent + width >= size { size } else { extent });
        let mut cells: [usize; 3] = extent.map(|e| if width > 0.0 { e / width } else { 1.0 } as usize).into();
        cells = cells.map(|n| n.clamp(1, 1 << 20));
        // Cells beyond a few per body only cost time.
        while cells.iter().map(|&n| n as f64).product::<f64>() > 8.0 * bodies as f64 + 64.0 {
            let widest = (0..3).max_by_key(|&i| cells[i]).expect("three axes");
            cells[widest] = cells[widest].div_ceil(2);
        }
        std::array::from_fn(|i| Axis {
            lo: if periodic[i] { 0.0 } else { lo[i] },
            length: size[i],
            per_metre: cells[i] as f64 / extent[i],
            cells: cells[i],
            periodic: periodic[i],
        })
    }
}

impl Class {
    fn row(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.axes[0].cells * (y + self.axes[1].cells * z)
    }

    fn cell(&self, position: &Vec3) -> [usize; 3] {
        std::array::from_fn(|i| self.axes[i].cell(position[i]))
    }

    /// Counting sort; within a cell by index.
    fn fill(&mut self, axes: [Axis; 3], members: impl Iterator<Item = Entry> + Clone) {
        self.axes = axes;
        let cells = axes.iter().map(|a| a.cells).product::<usize>();
        self.starts.clear();
        self.starts.resize(cells + 2, 0);
        let mut count = 0;
        for entry in members.clone() {
            let row = self.row(self.cell(&entry.position));
            self.starts[row + 2] += 1;
            count += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let nothing = Entry { position: Vec3::zeros(), radius: 0.0, index: 0 };
        self.sorted.clear();
        self.sorted.resize(count, nothing);
        for entry in members {
            // One index ahead: after this loop `starts[cell]` is the start of the cell.
            let row = self.row(self.cell(&entry.position));
            let place = &mut self.starts[row + 1];
            self.sorted[*place as usize] = entry;
            *place += 1;
        }
    }

    /// Shows all bodies in the cell of a position and in its neighbours.
    #[inline]
    fn look(&self, position: Vec3, mut see: impl FnMut(&Entry)) {
        let [x, y, z] = self.cell(&position);
        let runs = self.axes[0].runs(x);
        for &z in self.axes[2].near(z).iter().flatten() {
            for &y in self.axes[1].near(y).iter().flatten() {
                let row = self.axes[0].cells * (y + self.axes[1].cells * z);
                for &(lo, hi) in runs.iter().flatten() {
                    let (from, to) = (self.starts[row + lo], self.starts[row + hi]);
                    self.sorted[from as usize..to as usize].iter().for_each(&mut see);
                }
            }
        }
    }
}

impl Axis {
    fn cell(&self, x: f64) -> usize {
        let mut offset = x - self.lo;
        if offset < 0.0 {
            offset += self.length;
        } else if offset >= self.length {
            offset -= self.length;
        }
        ((offset * self.per_metre) as usize).min(self.cells - 1)
    }

    /// The cell and its neighbours, each once.
    fn near(&self, cell: usize) -> [Option<usize>; 3] {
        let (n, wrap) = (self.cells, self.periodic && self.cells > 2);
        let below = if cell > 0 { Some(cell - 1) } else { wrap.then_some(n - 1) };
        let above = if cell + 1 < n { Some(cell + 1) } else { wrap.then_some(0) };
        [below, Some(cell), above]
    }

    /// The same as at most two runs `lo..hi` of adjacent cells.
    fn runs(&self, cell: usize) -> [Option<(usize, usize)>; 2] {
        let n = self.cells;
        if self.periodic && n == 3 {
            return [Some((0, 3)), None];
        }
        let wrapped = match cell {
            _ if !self.periodic || n < 3 => None,
            0 => Some((n - 1, n)),
            _ => (cell + 1 == n).then_some((0, 1)),
        };
        [Some((cell.saturating_sub(1), (cell + 2).min(n))), wrapped]
    }
}

/// Returns true if the nearest image of a difference of wrapped positions is at most `reach` long.
#[inline]
fn meet(domain: &Domain, difference: Vec3, reach: f64) -> bool {
    let along = |i: usize| domain.shorter_way(i, difference[i].abs());
    let (x, y, z) = (along(0), along(1), along(2));
    x * x + y * y + z * z <= reach * reach * (1.0 + SLACK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Result of [`PairFinder::find`] by a test of every pair.
    fn brute_force(domain: Domain, positions: &[Vec3], radii: &[f64]) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for i in 0..positions.len() {
            for j in i + 1..positions.len() {
                if meet(&domain, positions[j] - positions[i], radii[i] + radii[j]) {
                    pairs.push([i as u32, j as u32]);
                }
            }
        }
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn the_list_of_cells_finds_what_looking_at_every_pair_finds(
            cells in [1_usize..12, 1..12, 1..12],
            bodies in prop::collection::vec(([0.0..1.0_f64, 0.0..1.0, 0.0..1.0], -6.0..0.5_f64), 0..80),
        ) {
            let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: 1.0 };
            let size = domain.size();
            let positions: Vec<Vec3> = bodies.iter().map(|(x, _)| domain.wrap(Vec3::from(*x).component_mul(&size))).collect();
            // From 0.0025 to 1.6.
            let radii: Vec<f64> = bodies.iter().map(|&(_, r)| libm::exp(r)).collect();
            let mut finder = PairFinder::new(domain);
            for _ in 0..2 {
                prop_assert_eq!(finder.find(&positions, &radii), &brute_force(domain, &positions, &radii)[..]);
            }
        }

        #[test]
        fn a_window_finds_the_pairs_of_the_bodies_inside_it(
            lo in [-3.0..20.0_f64, -3.0..20.0, -3.0..20.0],
            extent in [1.0..25.0_f64, 1.0..25.0, 1.0..25.0],
            bodies in prop::collection::vec(([0.0..1.0_f64, 0.0..1.0, 0.0..1.0], 0.2..1.5_f64), 0..80),
        ) {
            let domain = Domain { faces: Domain::faces([true; 3]), cells: [20, 21, 22], dx: 1.0 };
            let (lo, extent) = (Vec3::from(lo), Vec3::from(extent));
            let positions: Vec<Vec3> =
                bodies.iter().map(|(x, _)| domain.wrap(lo + Vec3::from(*x).component_mul(&extent))).collect();
            let radii: Vec<f64> = bodies.iter().map(|&(_, r)| r).collect();
            let mut finder = PairFinder::in_window(domain, domain.wrap(lo), extent);
            prop_assert_eq!(finder.find(&positions, &radii), &brute_force(domain, &positions, &radii)[..]);
        }
    }

    #[test]
    fn bodies_on_a_lattice_of_spacing_equal_to_the_reach_all_find_each_other() {
        // Rounding decides which cell holds a body that lies on an edge between cells; no pair may be lost.
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [7, 5, 3], dx: 0.1 };
        let mut positions = Vec::new();
        for n in 0..7 * 5 * 3 {
            let cell = Vec3::new(f64::from(n % 7), f64::from(n / 7 % 5), f64::from(n / 35));
            positions.push(domain.wrap(cell * 0.1));
        }
        let radii = vec![0.05; positions.len()];
        let found = PairFinder::new(domain).find(&positions, &radii).len();
        assert_eq!(found, 3 * positions.len(), "six neighbours each");
    }
}
