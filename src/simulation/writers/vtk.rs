//! Files for `ParaView`: fields, particles as points, their surfaces, contacts, force chains, and the walls.

use super::{FileEstimate, Need, PACKED_BYTE, RankOutput, RootOutput, Writer, WriterState, files_of};
use crate::case::Setup;
use crate::domain::Block;
use crate::error::{Error, Result};
use crate::output::directory::{CONTACTS, FIELDS, FORCE_CHAINS, PARTICLES, SURFACES};
use crate::output::surfaces::estimated_triangles;
use crate::output::{
    Collection, Numbered, ParticlePoints, ParticleSurfaces, PolyData, contacts, force_chains, write_bytes,
    write_fields, write_fields_index, write_walls,
};
use serde::Deserialize;
use std::path::PathBuf;

pub(super) fn writers(setup: &Setup) -> Vec<Box<dyn Writer + '_>> {
    let plan = &setup.plan.output;
    let points = ParticlePoints::new(&setup.templates, &setup.sections, &setup.frames);
    let surfaces = ParticleSurfaces::new(&setup.templates, &setup.sections, setup.expected_counts());
    let mut writers: Vec<Box<dyn Writer + '_>> = Vec::new();
    for (files, every, format) in [
        (FIELDS, plan.fields_every, Format::Fields),
        (PARTICLES, plan.particles_every, Format::Points(points)),
        (SURFACES, plan.surfaces_every, Format::Surfaces(surfaces)),
        (CONTACTS, plan.contacts_every, Format::Contacts),
        (FORCE_CHAINS, plan.contacts_every, Format::ForceChains),
    ] {
        let collection = Collection::new(files.collection(&plan.directory));
        writers.push(Box::new(Vtk { setup, files, every, format, collection }));
    }
    writers.push(Box::new(Walls { setup, written: [false; 2] }));
    writers
}

/// A kind of numbered file.
enum Format {
    /// Velocity, pressure and solid fraction of all cells.
    Fields,
    /// Particles as points, with the forces of the fluid.
    Points(ParticlePoints),
    Surfaces(ParticleSurfaces),
    /// A point for each contact.
    Contacts,
    /// Lines from the centres of particles to their contacts.
    ForceChains,
}

/// Writes the files of a format and lists them in its collection.
struct Vtk<'a> {
    setup: &'a Setup,
    files: Numbered,
    every: u64,
    format: Format,
    collection: Collection,
}

impl Vtk<'_> {
    fn file(&self, step: u64) -> PathBuf {
        self.files.file(&self.setup.plan.output.directory, step)
    }

    /// The contents of a file, unless it is one of fields.
    fn data(&self, output: &RankOutput) -> Option<PolyData> {
        let domain = &self.setup.domain;
        Some(match &self.format {
            Format::Fields => return None,
            Format::Points(points) => points.data(domain, &output.particles, output.loads.as_deref()),
            Format::Surfaces(surfaces) => surfaces.data(domain, &output.particles, true),
            Format::Contacts => contacts(&output.contacts),
            Format::ForceChains => force_chains(domain, output.partners(), &output.contacts),
        })
    }
}

impl Writer for Vtk<'_> {
    fn name(&self) -> &'static str {
        self.files.name()
    }

    fn every(&self) -> u64 {
        self.every
    }

    fn needs(&self) -> Vec<Need> {
        match self.format {
            Format::Fields => vec![Need::Fields],
            Format::Points(_) => vec![Need::Particles, Need::Loads],
            Format::Surfaces(_) => vec![Need::Particles],
            Format::Contacts | Format::ForceChains => vec![Need::Contacts],
        }
    }

    fn write(&mut self, output: &RankOutput) -> Result<()> {
        let path = output.path(self.file(output.step));
        match (self.data(output), &output.fields) {
            (Some(data), _) => data.write(&path),
            (None, Some(fields)) => {
                write_fields(&path, &self.setup.domain, &output.block, output.time, fields)
            }
            (None, None) => Ok(()),
        }
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let (setup, mut listed) = (self.setup, self.file(output.step));
        if let Some(cut) = output.pieces {
            let blocks: Vec<Block> = (0..cut.ranks()).map(|rank| cut.block(rank)).collect();
            let mut none = RankOutput::empty(None, blocks[0], output.step, output.time);
            none.loads = setup.fluid.as_ref().map(|_| Vec::new());
            listed = match self.data(&none) {
                Some(data) => data.write_index(&listed, blocks.len())?,
                None => write_fields_index(&listed, &setup.domain, output.time, &blocks)?,
            };
        }
        self.collection.add(output.time, &listed)
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(self.files)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(self.collection.entries()))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let path = self.files.collection(&self.setup.plan.output.directory);
        self.collection = Collection::resume(path, parsed(self.name(), state)?)?;
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let particles = self.setup.expected_particles() as f64;
        let (name, bytes, remark) = match self.format {
            Format::Fields => {
                let bytes = (size_of::<[f32; 5]>() * self.setup.fluid_cells()) as f64;
                ("field output", bytes, " before compression")
            }
            Format::Points(_) => ("particle output", 360.0 * particles, ""),
            Format::Surfaces(_) => {
                let triangles = estimated_triangles(&self.setup.templates, self.setup.expected_counts());
                // 35 bytes of a triangle with its part of the points.
                ("surface output", 35.0 * triangles as f64, "")
            }
            // In a bed a particle is responsible for three contacts: 160 bytes of each, with its two lines of force chains.
            Format::Contacts => ("contact output", 160.0 * 3.0 * particles, ", a bed's contacts"),
            // Counted with the contacts.
            Format::ForceChains => return None,
        };
        let files = FileEstimate::of(self, end_step, name, bytes, remark);
        Some(FileEstimate { seconds: PACKED_BYTE * bytes, ..files })
    }
}

/// The state of the writer of this name.
pub(super) fn parsed<T: for<'de> Deserialize<'de>>(name: &str, state: &WriterState) -> Result<T> {
    T::deserialize(state).map_err(|error| {
        Error::Input(format!("the state of the writer of {name} in the common state: {error}"))
    })
}

/// Opens the files of a run in `ParaView`.
const SCRIPT: &str = include_str!("open.py");

/// The walls and the script that opens everything, once, beside the first file for VTK.
struct Walls<'a> {
    setup: &'a Setup,
    /// On rank 0: the walls; the script, which each run and each resumed one writes.
    written: [bool; 2],
}

impl Writer for Walls<'_> {
    fn name(&self) -> &'static str {
        "walls"
    }

    fn every(&self) -> u64 {
        0
    }

    fn due(&self, step: u64, last: bool) -> bool {
        let plan = &self.setup.plan.output;
        let is_due = |every| every > 0 && (last || step.is_multiple_of(every));
        let all = [plan.fields_every, plan.particles_every, plan.surfaces_every, plan.contacts_every];
        all.into_iter().any(is_due)
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn complete(&mut self, _: &RootOutput) -> Result<()> {
        let Setup { domain, walls, .. } = self.setup;
        let (files, [walls_written, script_written]) = (files_of(self.setup), &mut self.written);
        if !*walls_written && !walls.is_empty() {
            write_walls(&files.walls(), domain, walls)?;
            *walls_written = true;
        }
        if !*script_written {
            // A user's own file of this name stays.
            if files.has_own_script() || !files.script().exists() {
                write_bytes(&files.script(), SCRIPT.as_bytes())?;
            }
            *script_written = true;
        }
        Ok(())
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(self.written[0].into())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        self.written[0] = parsed("walls", state)?;
        Ok(())
    }
}
