//! What all cases share: a scene that both engines get bit for bit, its record, and checks.

use super::files::sphere as sphere_of;
use super::{Check, Moment};
use std::path::Path;
use std::sync::Arc;
use turbid::case::Setup;
use turbid::comm::Comm;
use turbid::contact::{ContactModel, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use turbid::dem::{DemEngine, Load, Native, NativeParams};
use turbid::engine::{EngineChoice, LiggghtsOptions};
use turbid::domain::{Decomposition, Domain};
use turbid::engine::liggghts::{Liggghts, LiggghtsParams};
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;
use turbid::wall::{Motion, Surface, Wall};

/// Laws of the native engine: the elastic part and the damping.
pub(super) type Laws = (ElasticLaw, DampingLaw);

/// Those of LIGGGHTS.
pub(super) const SAME: Laws = (ElasticLaw::Hertz, DampingLaw::Tsuji);

/// Those of a case that names none.
pub(super) const OWN: Laws = (ElasticLaw::OverlapVolume, DampingLaw::HuntCrossley);

/// Glass.
pub(super) const GLASS: Material = Material { youngs_modulus: 7e10, poisson_ratio: 0.22 };

/// Density of glass (kg/m^3).
pub(super) const DENSITY: f64 = 2500.0;

/// Radius of the usual sphere (m).
pub(super) const RADIUS: f64 = 0.5e-3;

/// Sliding slower than this (m/s) is resisted less than Coulomb says, in the native engine: far below all that is measured.
const TRANSITION: f64 = 1e-6;

/// Spheres, what they touch and what moves them; no fluid.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    /// Id of the case and, where it has several scenes, of this one: stem of the log.
    pub(super) name: String,
    /// The box.
    pub(super) domain: Domain,
    /// Kinds of spheres.
    pub(super) templates: Vec<Template>,
    /// The spheres at the start; ids ascend from 0.
    pub(super) particles: Vec<Particle>,
    /// Materials and what pairs of them do to each other; the laws are those of the native engine.
    pub(super) contact: Option<ContactModel>,
    /// Walls.
    pub(super) walls: Vec<Wall>,
    /// Gravity (m/s^2).
    pub(super) gravity: Vec3,
    /// Sub-steps per step.
    pub(super) substeps: u32,
    /// What LIGGGHTS alone is told.
    pub(super) options: LiggghtsOptions,
}

impl Scene {
    /// Glass spheres of [`RADIUS`] in an open box of 10 mm.
    pub(super) fn glass(name: impl Into<String>, restitution: f64, friction: f64, laws: Laws) -> Self {
        Self {
            name: name.into(),
            domain: Domain { cells: [20; 3], dx: 0.5e-3, periodic: [false; 3] },
            templates: vec![sphere(RADIUS, 0)],
            particles: Vec::new(),
            contact: Some(model(&[GLASS], &[restitution], friction, laws)),
            walls: Vec::new(),
            gravity: Vec3::zeros(),
            substeps: 1,
            options: LiggghtsOptions::default(),
        }
    }

    /// The particles of a case, without its fluid.
    pub(super) fn of(name: &str, setup: &Setup) -> Self {
        Self {
            name: name.to_string(),
            domain: setup.domain,
            templates: setup.templates.to_vec(),
            particles: setup.particles.clone(),
            contact: setup.contact.clone(),
            walls: setup.walls.clone(),
            gravity: setup.gravity,
            substeps: setup.substeps,
            options: match &setup.engine {
                EngineChoice::Native => LiggghtsOptions::default(),
                EngineChoice::Liggghts(options) => options.clone(),
            },
        }
    }

    /// Adds a sphere; returns its id, which is its index as well.
    pub(super) fn add(&mut self, template: usize, position: Vec3, velocity: Vec3, spin: Vec3) -> usize {
        let id = self.particles.len();
        let mut particle = Particle::at(id as u64, template, position);
        particle.velocity = velocity.into();
        particle.angular_velocity = spin.into();
        self.particles.push(particle);
        id
    }

    /// Radius of a sphere (m).
    pub(super) fn radius(&self, id: usize) -> f64 {
        let shape = &self.templates[self.particles[id].template as usize].shape;
        shape.as_sphere().expect("scenes are made of spheres")
    }

    /// Mass of a sphere (kg).
    pub(super) fn mass(&self, id: usize) -> f64 {
        self.templates[self.particles[id].template as usize].mass()
    }

    /// What the native engine is told.
    pub(super) fn native_params(&self) -> NativeParams {
        NativeParams {
            contact: self.contact.clone(),
            walls: self.walls.clone(),
            gravity: self.gravity,
            substeps: self.substeps,
        }
    }

    /// The native engine at the start.
    pub(super) fn native(&self) -> Result<Native> {
        let (params, templates) = (self.native_params(), self.shared_templates());
        Native::new(params, self.whole(), 0, templates, &self.particles)
    }

    /// LIGGGHTS at the start; its log goes to the directory, if there is one.
    pub(super) fn liggghts(&self, directory: Option<&Path>) -> Result<Liggghts> {
        let (law, damping) = SAME;
        let contact = self.contact.clone().map(|contact| ContactModel { law, damping, ..contact });
        let params = LiggghtsParams {
            contact,
            walls: self.walls.clone(),
            gravity: self.gravity,
            substeps: self.substeps,
            log: directory.map(|directory| directory.join(format!("{}.log", self.name))),
            ..self.options.params()?
        };
        let templates = self.shared_templates();
        Liggghts::new(params, self.whole(), &Comm::Solo, templates, &self.particles)
    }

    /// Records both engines, each from the start: native, then LIGGGHTS.
    pub(super) fn record(
        &self,
        directory: Option<&Path>,
        dt: f64,
        steps: usize,
        until: impl Fn(&[Particle]) -> bool,
    ) -> Result<[Track; 2]> {
        let native = self.record_native(dt, steps, &until)?;
        let liggghts = Track::of(&mut self.liggghts(directory)?, dt, steps, false, until)?;
        Ok([native, liggghts])
    }

    /// Records the native engine from the start.
    pub(super) fn record_native(
        &self,
        dt: f64,
        steps: usize,
        until: impl Fn(&[Particle]) -> bool,
    ) -> Result<Track> {
        Track::of(&mut self.native()?, dt, steps, true, until)
    }

    fn whole(&self) -> Decomposition {
        Decomposition::with_grid(self.domain, [1; 3])
    }

    fn shared_templates(&self) -> Arc<[Template]> {
        self.templates.clone().into()
    }
}

/// A kind of spheres with [`DENSITY`], by radius (m) and index of material.
pub(super) fn sphere(radius: f64, material: usize) -> Template {
    Template { shape: Arc::new(Sphere { radius }), density: DENSITY, material }
}

/// A contact model with a coefficient of restitution for each pair of materials, row by row, and one of friction.
pub(super) fn model(
    materials: &[Material],
    restitution: &[f64],
    friction: f64,
    (law, damping): Laws,
) -> ContactModel {
    let pair = |&restitution: &f64| PairParams {
        restitution,
        friction_static: friction,
        friction_kinetic: friction,
        transition_velocity: TRANSITION,
    };
    ContactModel {
        materials: materials.to_vec(),
        pairs: restitution.iter().map(pair).collect(),
        enlargement: 0.0,
        geometry: Geometry::Exact,
        law,
        damping,
    }
}

/// A plane wall at rest across an axis; `up` if the free space lies above it.
pub(super) fn plane(axis: usize, at: f64, up: bool, material: usize) -> Wall {
    let name = format!("{}{}", ["x", "y", "z"][axis], if up { "-" } else { "+" });
    Wall {
        name,
        surface: Surface::Plane {
            point: Vec3::ith(axis, at),
            normal: Vec3::ith(axis, if up { 1.0 } else { -1.0 }),
        },
        motion: Motion::default(),
        material,
    }
}

/// One step without loads.
pub(super) fn advance(engine: &mut dyn DemEngine, dt: f64) -> Result<()> {
    let loads = vec![Load::default(); engine.particles().owned];
    engine.advance(&Comm::Solo, &loads, dt)
}

/// All that happened to the spheres of a scene.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Between two frames (s).
    pub(super) dt: f64,
    /// Spheres by id, at the start and after every step.
    pub(super) frames: Vec<Vec<Particle>>,
    /// Whether the forces of a frame belong to the positions of the frame before.
    late: bool,
}

impl Track {
    /// Advances an engine by `steps`, or until the spheres are as asked.
    fn of(
        engine: &mut dyn DemEngine,
        dt: f64,
        steps: usize,
        late: bool,
        until: impl Fn(&[Particle]) -> bool,
    ) -> Result<Self> {
        let mut frames = vec![engine.particles().owned().to_vec()];
        for _ in 0..steps {
            advance(engine, dt)?;
            let frame = engine.particles().owned().to_vec();
            let done = until(&frame);
            frames.push(frame);
            if done {
                break;
            }
        }
        Ok(Self { dt, frames, late })
    }

    /// The last frame.
    pub(super) fn last(&self) -> &[Particle] {
        self.frames.last().expect("the start is a frame")
    }

    /// The contact force (N) on a sphere at the positions of a frame; the native engine knows it one step later.
    pub(super) fn force(&self, frame: usize, id: usize) -> Vec3 {
        let known = self.frames.get(frame + usize::from(self.late));
        known.map_or_else(Vec3::zeros, |frame| frame[id].contact_force.into())
    }

    /// The contact force (N) on a sphere in the last frame, if the spheres have not moved since the frame before.
    pub(super) fn resting_force(&self, id: usize) -> Vec3 {
        self.last()[id].contact_force.into()
    }

    /// Time of a frame (s).
    pub(super) fn time(&self, frame: usize) -> f64 {
        frame as f64 * self.dt
    }

    /// What an impact that begins with the first frame comes to, by the depth (m) of the overlap in a frame.
    pub(super) fn impact(&self, depth: impl Fn(&[Particle]) -> f64) -> Option<Measured> {
        let depths: Vec<f64> = self.frames.iter().map(|frame| depth(frame)).collect();
        let in_contact = (1..depths.len()).find(|&k| depths[k] > 0.0)?;
        let end = (in_contact..depths.len()).find(|&k| depths[k] <= 0.0)?;
        let part = depths[end - 1] / (depths[end - 1] - depths[end]);
        let top = (1..end).max_by(|&a, &b| depths[a].total_cmp(&depths[b]))?;
        // The peak of the parabola through three points.
        let [before, most, after] = [depths[top - 1], depths[top], depths[top + 1]];
        let slope = 0.5 * (after - before);
        let deepest = most - 0.5 * slope * slope / (before - 2.0 * most + after);
        Some(Measured { duration: self.dt * ((end - 1) as f64 + part), deepest })
    }
}

/// Duration and depth of an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// From the first touch to the separation, between two frames by linear interpolation (s).
    pub(super) duration: f64,
    /// Largest depth (m).
    pub(super) deepest: f64,
}

/// What a difference is taken of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Between {
    /// The engines.
    Engines,
    /// Theory and the engine that is further from it.
    Theory,
    /// All: engines and theory.
    All,
}

/// A check of both engines whose difference the caller has worked out; the values are native, LIGGGHTS, analytic.
pub(super) fn given(
    quantity: impl Into<String>,
    values: [Option<f64>; 3],
    difference: f64,
    tolerance: f64,
    reason: &str,
) -> Check {
    Check { engines: Some(values), ..Check::new(quantity, difference, 0.0, tolerance, reason) }
}

/// A check of the largest absolute difference.
pub(super) fn absolute(
    quantity: impl Into<String>,
    values: [Option<f64>; 3],
    between: Between,
    tolerance: f64,
    reason: &str,
) -> Check {
    given(quantity, values, difference(values, between), tolerance, reason)
}

/// A check of the largest relative difference; relative to theory or, without, to LIGGGHTS.
pub(super) fn relative(
    quantity: impl Into<String>,
    values: [Option<f64>; 3],
    between: Between,
    tolerance: f64,
    reason: &str,
) -> Check {
    let unit = values[2].or(values[1]).map_or(f64::NAN, f64::abs);
    given(quantity, values, difference(values, between) / unit, tolerance, reason)
}

/// The largest absolute difference.
fn difference([native, liggghts, analytic]: [Option<f64>; 3], between: Between) -> f64 {
    let pairs = match between {
        Between::Engines => vec![(native, liggghts)],
        Between::Theory => vec![(native, analytic), (liggghts, analytic)],
        Between::All => vec![(native, analytic), (liggghts, analytic), (native, liggghts)],
    };
    worst(pairs.into_iter().filter_map(|(a, b)| Some((a? - b?).abs())))
}

/// Moments of a scene in both engines, from its particles at equal times (s).
pub(super) fn moments(
    scene: &Scene,
    frames: [&[Vec<Particle>]; 2],
    time: impl Fn(usize) -> f64,
    every: usize,
) -> Vec<Moment> {
    let spheres = |frame: &Vec<Particle>| {
        let of = |p: &Particle| sphere_of(p, &scene.templates[p.template as usize]);
        frame.iter().map(of).collect()
    };
    let both = frames[0].iter().zip(frames[1]).enumerate().step_by(every);
    let moment =
        |(k, (native, liggghts))| Moment { time: time(k), spheres: [spheres(native), spheres(liggghts)] };
    both.map(moment).collect()
}

/// Random numbers between -1 and 1 from a linear congruence.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// The next number.
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((self.0 >> 33) as f64 + 0.5) / f64::from(1_u32 << 31) - 1.0
    }

    /// A vector of three numbers.
    pub(super) fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| self.next())
    }
}

/// The largest of some numbers, and not a number if one of them is none, or there are none.
pub(super) fn worst(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if b.is_nan() || b > a { b } else { a };
    numbers.into_iter().reduce(larger).unwrap_or(f64::NAN)
}

/// Every n-th point, so that about `most` of them are left, and the last one.
pub(super) fn thinned(points: impl IntoIterator<Item = [f64; 2]>, most: usize) -> Vec<[f64; 2]> {
    let points: Vec<[f64; 2]> = points.into_iter().collect();
    let every = points.len().div_ceil(most).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.iter().enumerate().filter(|(k, _)| k % every == 0 || *k == last);
    kept.map(|(_, point)| *point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_that_is_not_a_number_or_missing_fails() {
        let nothing = absolute("x", [None, Some(1.0), None], Between::All, 1e9, "");
        assert!(!nothing.pass);
        let wrong = relative("x", [Some(f64::NAN), Some(1.0), Some(1.0)], Between::Theory, 1e9, "");
        assert!(!wrong.pass);
    }

    #[test]
    fn the_worst_of_the_differences_asked_for_decides() {
        let values = [Some(1.0), Some(1.2), Some(1.1)];
        let differs = |between| absolute("x", values, between, 0.15, "");
        assert!((differs(Between::Engines).measured - 0.2).abs() < 1e-12);
        assert!(!differs(Between::Engines).pass);
        assert!((differs(Between::Theory).measured - 0.1).abs() < 1e-12);
        assert!(differs(Between::Theory).pass);
        assert!((differs(Between::All).measured - 0.2).abs() < 1e-12);
        assert!(worst([0.0, f64::NAN, 1.0]).is_nan());
    }

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
        let measured = track.impact(|frame| frame[0].position[0]).unwrap();
        assert!((measured.deepest - 1.55 * 1.55).abs() < 1e-12);
        assert!((measured.duration - 3.1).abs() < 0.25 * 0.25 / 3.1);
    }
}
