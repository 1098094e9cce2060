//! Fields of the fluid in SI units.

use super::{Simulation, Wet};
use crate::domain::Block;

/// Fields of a [block](Self::block) of cells in SI units, x fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub struct Fields {
    /// The cells, counted over the whole box.
    pub block: Block,
    /// Velocity (m/s); in a particle or a wall that of its motion.
    pub velocity: Vec<[f32; 3]>,
    /// Pressure (Pa) above that of the fluid at rest, without the hydrostatic pressure.
    pub pressure: Vec<f32>,
    /// Solid volume fraction of the cell (-): 1 in walls.
    pub solid_fraction: Vec<f32>,
}

impl Fields {
    /// The cells of the box in the order of the fields.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let Block { lo, hi } = self.block;
        let rows = (lo[2]..hi[2]).flat_map(move |z| (lo[1]..hi[1]).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| (lo[0]..hi[0]).map(move |x| [x, y, z]))
    }
}

impl Simulation {
    /// Fields of the block of this rank, which is the whole box on one rank, with the particles where they are now. Changes
    /// nothing. Empty without a fluid.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// simulation.advance(2)?;
    /// let fields = simulation.fields();
    /// let solid: f32 = fields.solid_fraction.iter().sum();
    /// assert_eq!(fields.cells().count(), fields.velocity.len());
    /// assert!((solid - std::f32::consts::PI / 6.0 * 64.0).abs() < 1e-3);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn fields(&mut self) -> Fields {
        let acceleration = (self.acceleration() / self.units.acceleration()).into();
        let Self { units, wet, dem, .. } = self;
        let Some(Wet { fluid, coupling, .. }) = wet else {
            return Fields {
                block: Block {
                    lo: [0; 3],
                    hi: [0; 3],
                },
                velocity: Vec::new(),
                pressure: Vec::new(),
                solid_fraction: Vec::new(),
            };
        };
        let block = fluid.block();
        let cells = block.cell_count();
        let mut fields = Fields {
            block,
            velocity: Vec::with_capacity(cells),
            pressure: Vec::with_capacity(cells),
            solid_fraction: Vec::with_capacity(cells),
        };
        coupling.map(dem.particles());
        fluid.each_cell(block, acceleration, coupling, dem.particles(), |cell| {
            let velocity = cell.velocity.map(|u| (u * units.velocity()) as f32);
            fields.velocity.push(velocity);
            fields
                .pressure
                .push((cell.density_deviation * units.pressure()) as f32);
            fields.solid_fraction.push(cell.solid_fraction as f32);
        });
        fields
    }
}
