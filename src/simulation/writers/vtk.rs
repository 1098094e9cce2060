//! Files for `ParaView`: fields, particles as points, their surfaces, contacts, force chains, and the walls.
//!
//! Each kind is a [`Format`]; [`Vtk`] makes a writer of it, with the index of its pieces and its collection.

use super::{FileEstimate, Need, RankOutput, RootOutput, Writer, WriterState, files_of};
use crate::case::Setup;
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::output::directory::{CONTACTS, FIELDS, FORCE_CHAINS, PARTICLES, SURFACES};
use crate::output::{
    Collection, FieldSnapshot, Numbered, ParticlePoints, ParticleSurfaces, write_contacts,
    write_contacts_index, write_fields, write_fields_index, write_force_chains, write_force_chains_index,
    write_walls,
};
use crate::particle::{FEW_TRIANGLES, surface_triangles};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The writers of all these files.
pub(super) fn writers(setup: &Setup) -> Vec<Box<dyn Writer + '_>> {
    let plan = &setup.plan.output;
    let points = ParticlePoints::new(&setup.templates, &setup.sections, &setup.frames);
    let surfaces = ParticleSurfaces::new(&setup.templates, &setup.sections, &setup.particles);
    let mut writers: Vec<Box<dyn Writer + '_>> = vec![
        Vtk::boxed(setup, plan.fields_every, FieldFiles),
        Vtk::boxed(setup, plan.particles_every, PointFiles(points)),
        Vtk::boxed(setup, plan.surfaces_every, SurfaceFiles(surfaces)),
        Vtk::boxed(setup, plan.contacts_every, ContactFiles),
        Vtk::boxed(setup, plan.contacts_every, ForceChainFiles),
    ];
    writers.push(Box::new(Walls { setup, written: false }));
    writers
}

/// What a file is, about how many bytes it has, and on what these depend.
type Bytes = (&'static str, f64, &'static str);

/// A kind of numbered file.
trait Format {
    /// The names of its files.
    const FILES: Numbered;

    /// What is in a file.
    const NEEDS: &'static [Need];

    /// Writes a file, or a piece of one.
    fn write(&self, setup: &Setup, path: &Path, output: &RankOutput) -> Result<()>;

    /// Writes the index of the pieces of a file; its path.
    fn index(&self, setup: &Setup, file: &Path, time: f64, cut: &Decomposition) -> Result<PathBuf>;

    fn estimate(&self, setup: &Setup) -> Option<Bytes>;
}

/// Writes the files of a format and lists them in its collection.
struct Vtk<'a, F> {
    setup: &'a Setup,
    every: u64,
    format: F,
    collection: Collection,
}

impl<'a, F: Format + 'a> Vtk<'a, F> {
    fn boxed(setup: &'a Setup, every: u64, format: F) -> Box<dyn Writer + 'a> {
        Box::new(Self {
            collection: Collection::new(F::FILES.collection(&setup.plan.output.directory)),
            setup,
            every,
            format,
        })
    }

    fn file(&self, step: u64) -> PathBuf {
        F::FILES.file(&self.setup.plan.output.directory, step)
    }
}

impl<F: Format> Writer for Vtk<'_, F> {
    fn name(&self) -> &'static str {
        F::FILES.name()
    }

    fn every(&self) -> u64 {
        self.every
    }

    fn needs(&self) -> Vec<Need> {
        F::NEEDS.to_vec()
    }

    fn write(&mut self, output: &RankOutput) -> Result<()> {
        let path = output.path(self.file(output.step));
        self.format.write(self.setup, &path, output)
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let file = self.file(output.step);
        let listed = match output.pieces {
            Some(cut) => self.format.index(self.setup, &file, output.time, cut)?,
            None => file,
        };
        self.collection.add(output.time, &listed)
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(F::FILES)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(self.collection.entries()))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let entries = parsed(self.name(), state)?;
        let path = F::FILES.collection(&self.setup.plan.output.directory);
        self.collection = Collection::resume(path, entries)?;
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let (name, bytes, remark) = self.format.estimate(self.setup)?;
        Some(FileEstimate::of(self, end_step, name, bytes, remark))
    }
}

/// The state of the writer of this name.
pub(super) fn parsed<T: for<'de> Deserialize<'de>>(name: &str, state: &WriterState) -> Result<T> {
    T::deserialize(state).map_err(|error| {
        Error::Input(format!("the state of the writer of {name} in the common state: {error}"))
    })
}

/// Velocity, pressure and solid fraction of all cells.
struct FieldFiles;

impl Format for FieldFiles {
    const FILES: Numbered = FIELDS;
    const NEEDS: &'static [Need] = &[Need::Fields];

    fn write(&self, setup: &Setup, path: &Path, output: &RankOutput) -> Result<()> {
        let Some(fields) = &output.fields else {
            return Ok(());
        };
        let snapshot = FieldSnapshot {
            domain: setup.domain,
            block: output.block,
            time: output.time,
            velocity: &fields.velocity,
            pressure: &fields.pressure,
            solid_fraction: &fields.solid_fraction,
        };
        write_fields(path, &snapshot)
    }

    fn index(&self, setup: &Setup, file: &Path, time: f64, cut: &Decomposition) -> Result<PathBuf> {
        let blocks: Vec<Block> = (0..cut.ranks()).map(|rank| cut.block(rank)).collect();
        write_fields_index(file, &setup.domain, time, &blocks)
    }

    fn estimate(&self, setup: &Setup) -> Option<Bytes> {
        let bytes = size_of::<[f32; 5]>() * setup.fluid_cells();
        Some(("field output", bytes as f64, " before compression"))
    }
}

/// Particles as points, with the forces of the fluid.
struct PointFiles(ParticlePoints);

impl Format for PointFiles {
    const FILES: Numbered = PARTICLES;
    const NEEDS: &'static [Need] = &[Need::Particles, Need::Loads];

    fn write(&self, setup: &Setup, path: &Path, output: &RankOutput) -> Result<()> {
        let loads = output.loads.as_deref();
        (self.0).write(path, &setup.domain, &output.particles, loads)
    }

    fn index(&self, setup: &Setup, file: &Path, _: f64, cut: &Decomposition) -> Result<PathBuf> {
        (self.0).write_index(file, &setup.domain, setup.fluid.is_some(), cut.ranks())
    }

    fn estimate(&self, setup: &Setup) -> Option<Bytes> {
        Some(("particle output", 360.0 * setup.particles.len() as f64, ""))
    }
}

/// Particles as surfaces.
struct SurfaceFiles(ParticleSurfaces);

impl Format for SurfaceFiles {
    const FILES: Numbered = SURFACES;
    const NEEDS: &'static [Need] = &[Need::Particles];

    fn write(&self, setup: &Setup, path: &Path, output: &RankOutput) -> Result<()> {
        (self.0).write(path, &setup.domain, &output.particles)
    }

    fn index(&self, setup: &Setup, file: &Path, _: f64, cut: &Decomposition) -> Result<PathBuf> {
        (self.0).write_index(file, &setup.domain, cut.ranks())
    }

    /// 35 bytes of a triangle, with its share of points.
    fn estimate(&self, setup: &Setup) -> Option<Bytes> {
        let one_each = setup.particles.iter().map(|p| (p.template as usize, 1));
        let fine = surface_triangles(&setup.templates, one_each);
        // Many are drawn once less refined.
        let triangles = if fine > FEW_TRIANGLES { fine / 4 } else { fine };
        Some(("surface output", 35.0 * triangles as f64, ""))
    }
}

/// A point for each contact.
struct ContactFiles;

impl Format for ContactFiles {
    const FILES: Numbered = CONTACTS;
    const NEEDS: &'static [Need] = &[Need::Contacts];

    fn write(&self, _: &Setup, path: &Path, output: &RankOutput) -> Result<()> {
        write_contacts(path, &output.contacts)
    }

    fn index(&self, _: &Setup, file: &Path, _: f64, cut: &Decomposition) -> Result<PathBuf> {
        write_contacts_index(file, cut.ranks())
    }

    /// Of a bed, where a particle is responsible for three contacts: 160 bytes of each, with its two lines of force chains.
    fn estimate(&self, setup: &Setup) -> Option<Bytes> {
        let bytes = 160.0 * 3.0 * setup.particles.len() as f64;
        Some(("contact output", bytes, ", a bed's contacts"))
    }
}

/// Lines from the centres of particles to their contacts.
struct ForceChainFiles;

impl Format for ForceChainFiles {
    const FILES: Numbered = FORCE_CHAINS;
    const NEEDS: &'static [Need] = &[Need::Contacts];

    fn write(&self, setup: &Setup, path: &Path, output: &RankOutput) -> Result<()> {
        write_force_chains(path, &setup.domain, output.partners(), &output.contacts)
    }

    fn index(&self, setup: &Setup, file: &Path, _: f64, cut: &Decomposition) -> Result<PathBuf> {
        write_force_chains_index(file, &setup.domain, cut.ranks())
    }

    /// Counted with the contacts.
    fn estimate(&self, _: &Setup) -> Option<Bytes> {
        None
    }
}

/// The walls, once, beside the first file of particles.
struct Walls<'a> {
    setup: &'a Setup,
    /// On rank 0.
    written: bool,
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
        let mut every = [plan.particles_every, plan.surfaces_every].into_iter();
        every.any(|every| every > 0 && (last || step.is_multiple_of(every)))
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn complete(&mut self, _: &RootOutput) -> Result<()> {
        let Setup { domain, walls, .. } = self.setup;
        if !self.written && !walls.is_empty() {
            write_walls(&files_of(self.setup).walls(), domain, walls)?;
            self.written = true;
        }
        Ok(())
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(self.written.into())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        self.written = parsed("walls", state)?;
        Ok(())
    }
}
