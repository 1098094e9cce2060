//! Wear of walls from meshes: contact force and work of friction by facet, summed over time by the engine.

use super::vtk::parsed;
use super::{FileEstimate, Need, PACKED_BYTE, RankState, RootOutput, Writer, WriterState, files_of};
use crate::case::Setup;
use crate::dem::Facets;
use crate::error::Result;
use crate::math::FIXED_POINT_BITS;
use crate::output::directory::WEAR;
use crate::output::{Collection, Numbered, write_wear};
use crate::simulation::observe::Sums;

/// A unit of fixed-point sums over one of the sums of facets (-).
const SCALE: f64 = (1_u64 << FIXED_POINT_BITS) as f64 / Facets::ONE;

/// Writes `wear_*.vtp` and lists them in `wear.pvd`.
pub(super) struct Wear<'a> {
    setup: &'a Setup,
    collection: Collection,
}

impl<'a> Wear<'a> {
    /// That of a case, if it asks for one.
    pub(super) fn of(setup: &'a Setup) -> Option<Self> {
        let plan = &setup.plan.output;
        let collection = Collection::new(WEAR.collection(&plan.directory));
        (plan.wear_every > 0).then_some(Self { setup, collection })
    }

    /// Number of facets of all meshes.
    fn facets(&self) -> usize {
        let meshes = self.setup.walls.iter().filter_map(|wall| wall.surface.mesh());
        meshes.map(|placed| placed.mesh.facets().len()).sum()
    }
}

impl Writer for Wear<'_> {
    fn name(&self) -> &'static str {
        WEAR.name()
    }

    fn every(&self) -> u64 {
        self.setup.plan.output.wear_every
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn sums(&self, rank: &mut RankState) -> Sums {
        let mut sums = Sums::new(0, 5 * self.facets(), 0);
        let kept = rank.simulation().dem().facets().map_or(&[][..], Facets::walls);
        kept.iter().flatten().enumerate().for_each(|(n, of)| sums.add_integers(5 * n, of));
        sums
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let walls = &self.setup.walls;
        let sums: Vec<f64> = output.totals.fixed.iter().map(|&sum| sum * SCALE).collect();
        let path = files_of(self.setup).file(WEAR, output.step);
        write_wear(&path, walls, output.time, &sums)?;
        self.collection.add(output.time, &path)
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(WEAR)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(self.collection.entries()))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let path = WEAR.collection(&self.setup.plan.output.directory);
        self.collection = Collection::resume(path, parsed(self.name(), state)?)?;
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        // Three points of a facet with eight numbers each, and a polygon.
        let bytes = 130.0 * self.facets() as f64;
        let files = FileEstimate::of(self, end_step, "wear output", bytes, "");
        Some(FileEstimate { seconds: PACKED_BYTE * bytes, ..files })
    }
}
