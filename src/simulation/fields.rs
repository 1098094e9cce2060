//! Fields of the fluid in SI units.

use super::Simulation;
use super::observe::gather;
use crate::domain::Block;
use crate::error::Result;
use crate::memory;

/// Name of the arrays of [`Fields`] in messages.
const FIELDS: &str = "the fields";

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
    /// Fluid at rest in a block.
    pub(super) fn zeros(block: Block) -> Result<Self> {
        let cells = block.cell_count();
        Ok(Self {
            block,
            velocity: memory::zeroed(cells, FIELDS)?,
            pressure: memory::zeroed(cells, FIELDS)?,
            solid_fraction: memory::zeroed(cells, FIELDS)?,
        })
    }

    /// Room for the values of `cells` cells in a message.
    pub(super) fn room(cells: usize) -> Result<Vec<u8>> {
        memory::with_capacity(cells * size_of::<[f32; 5]>(), FIELDS)
    }

    pub(super) fn set(&mut self, at: usize, [u, v, w, pressure, solid_fraction]: [f32; 5]) {
        self.velocity[at] = [u, v, w];
        self.pressure[at] = pressure;
        self.solid_fraction[at] = solid_fraction;
    }

    /// The cells of the box in the order of the fields.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        self.block.cells()
    }
}

impl Simulation {
    /// Fields of the block of this rank, which is the whole box on one rank, with the particles where they are now. Changes
    /// nothing. Empty without a fluid.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) if there is no room for them.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// simulation.advance(2)?;
    /// let fields = simulation.fields()?;
    /// let solid: f32 = fields.solid_fraction.iter().sum();
    /// assert_eq!(fields.cells().count(), fields.velocity.len());
    /// assert!((solid - std::f32::consts::PI / 6.0 * 64.0).abs() < 1e-2);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn fields(&mut self) -> Result<Fields> {
        let nothing = Block { lo: [0; 3], hi: [0; 3] };
        let block = self.fluid().map_or(nothing, |fluid| fluid.block());
        gather::own_fields(self, block)
    }
}
