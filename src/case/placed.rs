//! The particles of a job of several processes at the start: what each process must know of all, where it has only its own.
//!
//! One process reads and places all particles, and the others get their own from it. Until then that one has them all, some 200 bytes each;
//! no other process ever does.

use super::Setup;
use super::array::{FixedArray, HeldBodies};
use crate::domain::{Decomposition, Domain};
use crate::math::Vec3;
use crate::output::PATHS;
use crate::packing::progress::Follow;
use crate::particle::Particle;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// The places of the particles when a case is read.
pub(super) enum Places<'a> {
    /// All are found; dense packings are followed.
    Here(&'a mut dyn Follow),
    /// Particles at random are only counted.
    Counted,
    /// Another process has found them.
    Elsewhere(&'a Arc<Placed>),
}

/// Numbers that follow from all particles of a case at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Totals {
    /// Number of particles of each template.
    pub(crate) counts: Vec<usize>,
    /// Weight less buoyancy (N), in the directions in which forces move them.
    weight: [f64; 3],
    /// Volume (m^3).
    pub(crate) volume: f64,
    /// Sum of the diameters of spheres of the same volume (m).
    pub(crate) diameters: f64,
    /// Largest velocity (m/s).
    pub(crate) fastest: f64,
    /// Least and largest velocity (m/s) beside that of the flow at the start, by component; none without particles.
    pub(super) velocities: Option<[[f64; 3]; 2]>,
    /// Largest velocity (m/s) of a surface along itself, by the rotation beside that of the flow, of bodies that are no spheres.
    pub(super) rim: f64,
    /// Those that are held along each axis.
    pub(super) held: [Option<HeldBodies>; 3],
    /// The highest of the lowest ids, of as many as there are paths in a file.
    pub(crate) last_path: Option<u64>,
    /// Hash of their states.
    pub(crate) hash: u64,
}

impl Totals {
    pub(super) fn of(setup: &Setup) -> Self {
        let Setup { particles, templates, .. } = setup;
        let shape = |particle: &Particle| &templates[particle.template as usize].shape;
        let flow = setup.fluid.as_ref().and_then(|fluid| fluid.start);
        let (mut velocities, mut rim): (Option<[Vec3; 2]>, f64) = (None, 0.0);
        for particle in particles {
            let at = particle.position();
            let [own, spin] =
                flow.map_or([Vec3::zeros(); 2], |flow| [flow.velocity(at), flow.angular_velocity(at)]);
            let velocity = particle.velocity() - own;
            let [low, high] = velocities.unwrap_or([velocity; 2]);
            velocities = Some([low.inf(&velocity), high.sup(&velocity)]);
            // The surface of a sphere moves along itself.
            if shape(particle).as_sphere().is_none() {
                rim = rim.max((particle.angular_velocity() - spin).norm() * shape(particle).circumradius());
            }
        }
        let mut ids: Vec<u64> = particles.iter().map(|particle| particle.id).collect();
        let last = ids.len().min(PATHS).checked_sub(1);
        Self {
            counts: setup.start_counts(),
            weight: setup.submerged_weight().into(),
            volume: particles.iter().map(|particle| shape(particle).volume()).sum(),
            diameters: particles.iter().map(|particle| shape(particle).equivalent_diameter()).sum(),
            fastest: particles.iter().map(|particle| particle.velocity().norm()).fold(0.0, f64::max),
            velocities: velocities.map(|of| of.map(Into::into)),
            rim,
            held: std::array::from_fn(|axis| HeldBodies::of(setup, axis)),
            last_path: last.map(|last| *ids.select_nth_unstable(last).1),
            hash: xxh3_64(bytemuck::cast_slice(particles)),
        }
    }

    /// Weight less buoyancy (N), in the directions in which forces move them.
    pub(crate) fn weight(&self) -> Vec3 {
        self.weight.into()
    }
}

/// The particles that one process has placed, for the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Placed {
    /// Factors on the shape of each section that has the sizes of its positions file.
    pub(super) scales: Vec<Option<Vec<f64>>>,
    pub(super) totals: Totals,
    /// Actual and requested volume fraction (-).
    pub(super) volume_fractions: [f64; 2],
    pub(super) fixed_array: Option<FixedArray>,
    /// See [`Decomposition::cuts`].
    cuts: [Vec<usize>; 3],
    /// Hash of the case with all its files.
    pub(crate) setup_hash: String,
}

impl Placed {
    /// Those of a case that has them all, whose box is cut so; `setup_hash` is that of the case.
    pub(crate) fn of(setup: &Setup, cut: &Decomposition, setup_hash: String) -> Self {
        Self {
            scales: setup.scales.clone(),
            totals: Totals::of(setup),
            volume_fractions: [setup.volume_fraction, setup.requested_volume_fraction],
            fixed_array: setup.fixed_array,
            cuts: cut.cuts.clone(),
            setup_hash,
        }
    }

    /// The blocks of the processes.
    pub(crate) fn cut(&self, domain: Domain) -> Decomposition {
        Decomposition::with_cuts(domain, self.cuts.clone())
    }
}

impl Setup {
    /// Numbers that follow from the particles of all processes at the start.
    pub(crate) fn totals(&self) -> Totals {
        self.placed.as_ref().map_or_else(|| Totals::of(self), |placed| placed.totals.clone())
    }

    /// Number of particles of each template at the start.
    pub(crate) fn start_counts(&self) -> Vec<usize> {
        if let Some(placed) = &self.placed {
            return placed.totals.counts.clone();
        }
        let mut counts = vec![0; self.templates.len()];
        self.particles.iter().for_each(|particle| counts[particle.template as usize] += 1);
        counts
    }

    /// Number of particles at the start, of all processes.
    pub fn start_count(&self) -> usize {
        self.placed.as_ref().map_or(self.particles.len(), |placed| placed.totals.counts.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Origin, read_alone, read_from};
    use crate::packing::progress::Unfollowed;
    use std::fmt::Write;
    use std::path::PathBuf;

    /// A case read in two ways: with all particles, and with what another process tells of them.
    fn both(origin: Origin, options: &[&str]) -> [Setup; 2] {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        let whole = read_alone(origin, &options).unwrap_or_else(|e| panic!("{origin:?}: {e}"));
        let placed = Placed::of(&whole, &Decomposition::solo(whole.domain), "hash".to_string());
        let told: Placed = serde_json::from_slice(&serde_json::to_vec(&placed).unwrap()).unwrap();
        assert_eq!(told, placed, "to the bit");
        let apart = read_from(origin, &options, (Some(&Arc::new(told)), &mut Unfollowed));
        [whole, apart.unwrap_or_else(|e| panic!("{origin:?}: {e}"))]
    }

    /// All that a run asks of a case, but for its particles, the files of their positions, and words for the user.
    fn rest(mut setup: Setup) -> String {
        let mut text = format!("{:?}", setup.totals());
        for axis in 0..3 {
            let resistance = setup.fluid.as_ref().and_then(|fluid| setup.resistance_rate(fluid, axis));
            let _ = write!(text, " {resistance:?}");
        }
        let counts: Vec<(usize, usize)> = setup.expected_counts().collect();
        let _ = write!(text, " {:?} {counts:?} {:?}", setup.impact(), setup.driven_flow());
        setup.particles.clear();
        setup.placed = None;
        let of = &mut setup.provenance;
        of.inputs.clear();
        of.warnings.clear();
        of.notes.clear();
        of.files.retain(|(name, _)| name.contains(".stl"));
        format!("{text} {setup:?}")
    }

    #[test]
    fn a_process_that_places_no_particles_has_the_same_case_to_the_bit() {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/cases"));
        for name in [
            "dry_box",
            "flow_past_sphere",
            "hindered_settling",
            "hydraulic_conveying",
            "porous_sample",
            "pouring",
            "rotating_cylinder",
            "shear_cell",
            "sphere_array",
            "sticky_grains",
        ] {
            let path = folder.join(name).with_extension("toml");
            let [whole, apart] = both(Origin::File(&path), &[]);
            assert!(apart.particles.is_empty(), "{name}");
            assert_eq!(rest(apart), rest(whole), "{name}");
        }
    }

    #[test]
    fn the_sizes_of_a_positions_file_are_known_without_the_file() {
        let files = [(
            "rows.csv".to_string(),
            b"x,y,z,diameter\n1e-3,1e-3,1e-3,1e-3\n3e-3,3e-3,3e-3,7e-4\n1e-3,3e-3,3e-3,7e-4\n".to_vec(),
        )];
        let text = "domain.size = [4e-3, 4e-3, 4e-3]\ndry.time_step = 1e-6\nrun.end.steps = 1\n\
                    [[particles]]\nshape.sphere.diameter = 1e-3\ndensity = 2000\nfile = \"rows.csv\"\nvelocity = [0.1, 0, 0]\n";
        let text = text.replace("velocity = [0.1, 0, 0]\n", "");
        let [whole, apart] = both(Origin::Saved("rows", &text, &files), &[]);
        assert_eq!((whole.templates.len(), whole.particles.len()), (2, 3));
        assert!(apart.provenance.files.is_empty());
        assert_eq!(rest(apart), rest(whole));
    }
}
