//! Spheres that both engines get bit for bit, without a fluid, and the record of their motion.
//!
//! A system is a case, of which engines take the box, particles, contacts, walls and gravity; its name is the stem of the log of the other
//! engine.

use super::prelude::*;
use turbid::case::from_text;
use turbid::contact::PairParams;
use turbid::shape::Sphere;
use turbid::wall::{Motion, Surface, Wall};

/// Elastic law, damping and friction of the native engine: those of most other engines, and those of a case that names none.
pub(super) type Laws = (ElasticLaw, DampingLaw, FrictionLaw);
pub(super) const SAME: Laws = (ElasticLaw::Hertz, DampingLaw::Tsuji, FrictionLaw::MindlinDisplacement);
pub(super) const OWN: Laws = (ElasticLaw::OverlapVolume, DampingLaw::HuntCrossley, FrictionLaw::Mindlin);

/// Glass, its density (kg/m^3), and the usual radius (m).
pub(super) const GLASS: Material = Material { youngs_modulus: 7e10, poisson_ratio: 0.22 };
pub(super) const DENSITY: f64 = 2500.0;
pub(super) const RADIUS: f64 = 0.5e-3;

const DRY: &str = "domain.size = [10e-3, 10e-3, 10e-3]\ndry.time_step = 1e-6\ndriving.gravity = 0\nrun.end.steps = 1\n\
    particles = [{ shape.sphere.diameter = 1e-3, density = 2500, list = [[5e-3, 5e-3, 5e-3]] }]";

/// An open box of 10 mm for glass spheres of [`RADIUS`].
pub(super) fn glass(name: impl Into<String>, restitution: f64, friction: f64, laws: Laws) -> Setup {
    let mut system = from_text(DRY, "glass", &[]).expect("a sound case");
    system.provenance.name = name.into();
    system.domain = open([20; 3], 0.5e-3);
    system.contact = Some(model(&[GLASS], &[restitution], friction, laws));
    system.particles.clear();
    system
}

/// A box without walls, with this number of cells of this edge (m).
pub(super) const fn open(cells: [usize; 3], dx: f64) -> Domain {
    Domain { cells, dx, faces: Domain::faces([false; 3]) }
}

/// Adds a body at a position (m) with a velocity (m/s); its id is the next one.
pub(super) fn add(system: &mut Setup, template: usize, position: Vec3, velocity: Vec3) -> &mut Particle {
    let particle = Particle::at(system.particles.len() as u64, template, position);
    system.particles.push(Particle { velocity: velocity.into(), ..particle });
    system.particles.last_mut().expect("it was added")
}

fn template(system: &Setup, id: usize) -> &Template {
    &system.templates[system.particles[id].template as usize]
}

pub(super) fn radius(system: &Setup, id: usize) -> f64 {
    template(system, id).shape.as_sphere().expect("all particles are spheres")
}

pub(super) fn mass(system: &Setup, id: usize) -> f64 {
    template(system, id).mass()
}

pub(super) fn native(system: &Setup) -> Result<Box<dyn DemEngine>> {
    let mut system = system.clone();
    system.engine = EngineChoice::Native;
    engine_of(&system, None)
}

/// Tracks of both engines: native, then the other one.
pub(super) fn record(system: &Setup, against: &Against, dt: f64, steps: usize) -> Result<[Track; 2]> {
    let native = Track::of(native(system)?, dt, steps)?;
    Ok([native, Track { late: against.late, ..Track::of(against.engine(system)?, dt, steps)? }])
}

/// Spheres with [`DENSITY`], by radius (m) and index of material.
pub(super) fn sphere(radius: f64, material: usize) -> Template {
    Template { shape: Arc::new(Sphere { radius }), density: DENSITY, material }
}

/// A contact model with a coefficient of restitution for each pair of materials, row by row, and one of friction.
pub(super) fn model(
    materials: &[Material],
    restitution: &[f64],
    friction: f64,
    (law, damping, friction_law): Laws,
) -> ContactModel {
    let pair = |&restitution: &f64| PairParams {
        restitution,
        friction_static: friction,
        friction_kinetic: friction,
        transition_velocity: 1e-3,
        rolling_friction: 0.0,
        work_of_adhesion: 0.0,
        cohesion_density: 0.0,
    };
    ContactModel {
        materials: materials.to_vec(),
        pairs: restitution.iter().map(pair).collect(),
        law,
        damping,
        friction: friction_law,
        ..ContactModel::default()
    }
}

/// A plane wall at rest across an axis; `up` if the free space lies above it.
pub(super) fn plane(axis: usize, at: f64, up: bool) -> Wall {
    let (point, normal) = (Vec3::ith(axis, at), Vec3::ith(axis, if up { 1.0 } else { -1.0 }));
    Wall {
        name: format!("{}{}", ["x", "y", "z"][axis], if up { "-" } else { "+" }),
        surface: Surface::Plane { point, normal },
        motion: Motion::default(),
        material: 0,
    }
}

/// Position (m), velocity (m/s) and angular velocity (1/s) of a sphere.
pub(super) type State = [Vec3; 3];

pub(super) fn state(particle: &Particle) -> State {
    [particle.position(), particle.velocity(), particle.angular_velocity()]
}

/// Samples of a motion without loads at the start and after each of `count` steps of `dt` (s), and the spheres at every
/// `every`-th of them.
pub(super) fn sampled<S>(
    mut engine: Box<dyn DemEngine>,
    dt: f64,
    count: usize,
    every: usize,
    sample: impl Fn(&dyn DemEngine) -> S,
) -> Result<(Vec<S>, Vec<Vec<Particle>>)> {
    let loads = vec![Load::default(); engine.particles().owned];
    let (mut samples, mut frames) = (Vec::new(), Vec::new());
    for k in 0..=count {
        if k > 0 {
            engine.advance(&Comm::Solo, &loads, dt)?;
        }
        samples.push(sample(&*engine));
        if k.is_multiple_of(every) {
            frames.push(engine.particles().owned().to_vec());
        }
    }
    Ok((samples, frames))
}

#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Time between two frames (s).
    pub(super) dt: f64,
    pub(super) frames: Vec<Vec<Particle>>,
    /// True if the forces of a frame belong to the positions of the frame before.
    late: bool,
}

impl Track {
    pub(super) fn of(engine: Box<dyn DemEngine>, dt: f64, steps: usize) -> Result<Self> {
        Ok(Self { dt, frames: sampled(engine, dt, steps, 1, |_| ())?.1, late: true })
    }

    pub(super) fn last(&self) -> &[Particle] {
        self.frames.last().expect("the start is a frame")
    }

    /// Contact force (N) on a sphere at the positions of a frame; an engine that is late knows it one step later.
    pub(super) fn force(&self, frame: usize, id: usize) -> Vec3 {
        let known = self.frames.get(frame + usize::from(self.late));
        known.map_or_else(Vec3::zeros, |frame| frame[id].contact_force.into())
    }

    /// Contact force (N) on a sphere in the last frame, if the spheres have not moved since the frame before.
    pub(super) fn resting_force(&self, id: usize) -> Vec3 {
        self.last()[id].contact_force.into()
    }

    pub(super) fn time(&self, frame: usize) -> f64 {
        frame as f64 * self.dt
    }

    /// Duration (s), between two frames by linear interpolation, and largest depth (m) of an impact that begins with the first frame,
    /// from the depth (m) of the overlap in a frame.
    pub(super) fn impact(&self, depth: impl Fn(&[Particle]) -> f64) -> Option<[f64; 2]> {
        let depths: Vec<f64> = self.frames.iter().map(|frame| depth(frame)).collect();
        let in_contact = (1..depths.len()).find(|&k| depths[k] > 0.0)?;
        let end = (in_contact..depths.len()).find(|&k| depths[k] <= 0.0)?;
        let part = depths[end - 1] / (depths[end - 1] - depths[end]);
        let top = (1..end).max_by(|&a, &b| depths[a].total_cmp(&depths[b]))?;
        // The peak of the parabola through three points.
        let [before, most, after] = [depths[top - 1], depths[top], depths[top + 1]];
        let slope = 0.5 * (after - before);
        let deepest = most - 0.5 * slope * slope / (before - 2.0 * most + after);
        Some([self.dt * ((end - 1) as f64 + part), deepest])
    }
}

/// Random numbers between -1 and 1 from a linear congruence.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((self.0 >> 33) as f64 + 0.5) / f64::from(1_u32 << 31) - 1.0
    }

    pub(super) fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| self.next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impact_is_measured_between_the_frames() {
        // A parabola: touch at 0, peak 1 at 1.5, separation at 3 steps of 0.25 s, off the frames.
        let at = |time: f64| {
            let mut particle = Particle::at(0, 0, Vec3::zeros());
            particle.position[0] = time * (3.1 - time);
            vec![particle]
        };
        let track =
            Track { dt: 0.25, frames: (0..20).map(|k| at(0.25 * f64::from(k))).collect(), late: false };
        let [duration, deepest] = track.impact(|frame| frame[0].position[0]).unwrap();
        assert!((deepest - 1.55 * 1.55).abs() < 1e-12);
        assert!((duration - 3.1).abs() < 0.25 * 0.25 / 3.1);
    }
}
