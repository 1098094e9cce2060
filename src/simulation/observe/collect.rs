//! What this rank has of a step: everything at rank 0 where the ranks share one memory, the piece of its own block where they are
//! processes.

use super::gather;
use crate::dem::ContactState;
use crate::domain::{Block, Decomposition};
use crate::error::Result;
use crate::simulation::Simulation;
use crate::simulation::writers::{Need, RankOutput};

impl RankOutput {
    /// With nothing of a step.
    fn empty(rank: Option<usize>, block: Block, step: u64, time: f64) -> Self {
        Self {
            step,
            time,
            rank,
            block,
            fields: None,
            particles: Vec::new(),
            loads: None,
            contacts: Vec::new(),
            partners: None,
        }
    }

    /// All that is needed on rank 0, nothing elsewhere; `touches` are the contacts this rank is responsible for. Collective.
    ///
    /// # Errors
    /// On every rank, if one of them has not the memory.
    pub(super) fn whole(
        simulation: &mut Simulation,
        decomposition: &Decomposition,
        needs: &[Need],
        touches: &[ContactState],
        time: f64,
    ) -> Result<Option<Self>> {
        let block = Block { lo: [0; 3], hi: decomposition.domain.cells };
        let mut output = Self::empty(None, block, simulation.step, time);
        let needed = |need| needs.contains(&need);
        if needed(Need::Fields) {
            output.fields = Some(gather::fields(simulation, decomposition)?);
        }
        if needed(Need::Contacts) {
            output.contacts = gather::contacts(simulation, touches);
        }
        if needed(Need::Particles) || needed(Need::Loads) || needed(Need::Contacts) {
            output.particles = gather::particles(simulation, |_| true);
        }
        if needed(Need::Loads) {
            output.loads = gather::loads(simulation, &output.particles, false);
        }
        Ok(Some(output).filter(|_| simulation.comm.rank() == 0))
    }

    /// What belongs to this rank: the cells of its block, its particles, the contacts it is responsible for. Collective.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) on this rank.
    pub(super) fn piece(
        simulation: &mut Simulation,
        decomposition: &Decomposition,
        needs: &[Need],
        touches: &[ContactState],
        time: f64,
    ) -> Result<Option<Self>> {
        let rank = simulation.comm.rank();
        let block = decomposition.block(rank);
        let mut output = Self::empty(Some(rank), block, simulation.step, time);
        let needed = |need| needs.contains(&need);
        if needed(Need::Contacts) {
            output.contacts = touches.iter().map(gather::contact).collect();
            output.partners = Some(gather::partners(simulation, touches));
        }
        if needed(Need::Particles) || needed(Need::Loads) {
            output.particles = simulation.dem.particles().owned().to_vec();
        }
        if needed(Need::Loads) {
            output.loads = gather::loads(simulation, &output.particles, true);
        }
        // Last, as it is no matter of the others whether this rank has room for them.
        if needed(Need::Fields) {
            output.fields = Some(gather::own_fields(simulation, block)?);
        }
        Ok(Some(output))
    }
}
