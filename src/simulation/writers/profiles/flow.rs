//! The flow in profiles: sums over the layers of cells across their axes, which bins are made of afterwards, or over their rings.

use super::Profiles;
use crate::case::{Profile, Setup};
use crate::domain::Block;
use crate::fluid::{CellState, FLOW_SUMS, FlowRow, FlowSums, SumsAlongRows};
use crate::math::Vec3;
use crate::simulation::observe::Sums;
use std::ops::Range;

/// Number of sums of the flow of all profiles.
pub(super) fn sums(setup: &Setup) -> usize {
    groups(setup).sum::<usize>() * FLOW_SUMS
}

/// Of each profile the number of the layers across its axis, or of its rings; none without a fluid.
fn groups(setup: &Setup) -> impl Iterator<Item = usize> {
    setup.plan.output.profiles.iter().map(|profile| match (&setup.fluid, profile.rings) {
        (None, _) => 0,
        (_, None) => setup.domain.cells[profile.axis],
        (_, Some(_)) => profile.bins,
    })
}

/// Adds to the sums from index `first` on.
fn add(sums: &mut [i128], first: usize, of: &FlowSums) {
    for (sum, value) in sums[first..].iter_mut().zip(of) {
        *sum += i128::from(*value);
    }
}

/// The rings in which the cells of a block lie, the same for all along their axis.
#[derive(Debug)]
struct CellRings {
    /// Axes of the plane across the one of the rings, and the cells of the block along them.
    plane: [usize; 2],
    lo: [usize; 2],
    width: usize,
    /// First sum, and direction outwards, of each cell of the plane that lies in a ring.
    cells: Vec<Option<(usize, [f64; 2])>>,
}

impl CellRings {
    /// Those of a profile, whose sums begin at `first`.
    fn new(profiles: &Profiles, profile: &Profile, first: usize, block: Block) -> Self {
        let plane = [(profile.axis + 1) % 3, (profile.axis + 2) % 3];
        let [columns, rows] = plane.map(|axis| block.lo[axis]..block.hi[axis]);
        let (dx, lo) = (profiles.setup.domain.dx, [columns.start, rows.start]);
        let width = columns.len();
        let cell = |at: [usize; 2]| {
            let mut middle = Vec3::zeros();
            plane.iter().zip(at).for_each(|(axis, k)| middle[*axis] = (k as f64 + 0.5) * dx);
            let (ring, axes) = profiles.place(profile, middle)?;
            Some((first + ring * FLOW_SUMS, plane.map(|axis| axes.map_or(0.0, |axes| axes[(0, axis)]))))
        };
        let cells = rows.flat_map(|row| columns.clone().map(move |column| [column, row])).map(cell).collect();
        Self { plane, lo, width, cells }
    }

    /// Adds a row of cells.
    fn add(&self, row: &FlowRow, sums: &mut [i128]) {
        let [i, j] = self.plane;
        let axis = 3 - i - j;
        for (cell, state) in row.each().filter(|(_, state)| state.solid_fraction < 1.0) {
            let at = cell[i] - self.lo[0] + self.width * (cell[j] - self.lo[1]);
            let Some((first, [out_i, out_j])) = self.cells[at] else { continue };
            let v = state.velocity;
            let velocity = [out_i * v[i] + out_j * v[j], out_i * v[j] - out_j * v[i], v[axis]];
            add(sums, first, &FlowRow::of_cell(&CellState { velocity, ..state }));
        }
    }
}

/// Sums of the flow of all profiles over the rows of a block.
#[derive(Debug)]
pub struct FlowOfRows {
    /// First sum of the layers of each profile along an axis.
    layers: [Vec<usize>; 3],
    rings: Vec<CellRings>,
    along: SumsAlongRows,
    cells: Range<usize>,
    sums: Vec<i128>,
}

impl FlowOfRows {
    /// Adds a row of the block.
    pub(in crate::simulation) fn add(&mut self, row: &FlowRow) {
        let [_, y, z] = row.corner();
        if !self.layers[0].is_empty() && self.along.add(row) {
            self.take_along();
        }
        let [_, y_layers, z_layers] = &self.layers;
        if !(y_layers.is_empty() && z_layers.is_empty()) {
            let of_row = row.sums();
            for (firsts, layer) in [(y_layers, y), (z_layers, z)] {
                for first in firsts {
                    add(&mut self.sums, first + layer * FLOW_SUMS, &of_row);
                }
            }
        }
        for rings in &self.rings {
            rings.add(row, &mut self.sums);
        }
    }

    fn take_along(&mut self) {
        for (cell, of_cell) in self.cells.clone().zip(self.along.take()) {
            for first in &self.layers[0] {
                add(&mut self.sums, first + cell * FLOW_SUMS, &of_cell);
            }
        }
    }

    /// Adds what the rows were to the sums of the writer.
    pub(in crate::simulation) fn add_to(&mut self, sums: &mut Sums) {
        self.take_along();
        sums.add_integers(0, &self.sums);
    }
}

impl Profiles<'_> {
    /// Sums over no rows yet of a block.
    pub(super) fn flow_of_rows(&self, block: Block) -> FlowOfRows {
        let (mut layers, mut rings, mut first) = ([const { Vec::new() }; 3], Vec::new(), 0);
        for (profile, groups) in self.setup.plan.output.profiles.iter().zip(groups(self.setup)) {
            match profile.rings {
                None => layers[profile.axis].push(first),
                Some(_) => rings.push(CellRings::new(self, profile, first, block)),
            }
            first += groups * FLOW_SUMS;
        }
        let (cells, sums) = (block.lo[0]..block.hi[0], vec![0; first]);
        FlowOfRows { layers, rings, along: SumsAlongRows::default(), cells, sums }
    }

    /// Sums of the flow in each bin of profile number `number`, from those of all.
    pub(super) fn flow_in_bins(&self, number: usize, totals: &[f64]) -> Vec<[f64; FLOW_SUMS]> {
        let profile = &self.setup.plan.output.profiles[number];
        let first: usize = groups(self.setup).take(number).sum();
        let count = groups(self.setup).nth(number).unwrap_or(0);
        let mut bins = vec![[0.0; FLOW_SUMS]; profile.bins];
        for (group, of_group) in totals[first * FLOW_SUMS..].chunks(FLOW_SUMS).take(count).enumerate() {
            let mut add = |bin: usize, part: f64| {
                bins[bin].iter_mut().zip(of_group).for_each(|(bin, sum)| *bin += sum * part);
            };
            if profile.rings.is_some() {
                add(group, 1.0);
                continue;
            }
            // The layer from `low` to `high`, in bins, which it is cut into.
            let [mut low, high] =
                [group, group + 1].map(|end| end as f64 * profile.bins as f64 / count as f64);
            let whole = high - low;
            while low < high {
                let end = high.min(low.floor() + 1.0);
                add(self.bin(profile, low), (end - low) / whole);
                low = end;
            }
        }
        bins
    }
}
