//! A run that starts with the steady flow between plates that move, `u = u_- + (u_+ - u_-) x / H`.

use super::checks::Document;
use super::placement::Placer;
use super::walls::PlacedWall;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, PrescribedMotion};
use crate::wall::Wall;

/// Plane Couette flow between the two closed faces of one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Couette {
    /// The direction from face to face.
    pub axis: usize,
    /// Velocity (m/s) of the lower face.
    pub lower: Vec3,
    /// Rise of the velocity along the axis (1/s).
    pub gradient: Vec3,
}

impl Couette {
    /// Velocity (m/s) at a position (m).
    pub fn velocity(&self, position: Vec3) -> Vec3 {
        self.lower + self.gradient * position[self.axis]
    }

    /// Angular velocity of the fluid (1/s), half its vorticity `e_axis x du/dx`.
    pub fn angular_velocity(&self) -> Vec3 {
        0.5 * Vec3::ith(self.axis, 1.0).cross(&self.gradient)
    }

    /// The flow between the faces that move.
    pub(super) fn between(document: &Document, domain: &Domain, walls: &[PlacedWall]) -> Result<Self> {
        let face = |axis: usize, upper: usize| {
            let name = super::file::FACES[2 * axis + upper];
            walls.iter().find(|placed| placed.is_face && placed.wall.name == name).map(|placed| &placed.wall)
        };
        let slides = |wall: &Wall| !wall.motion.velocity.is_zero();
        let moving: Vec<(usize, [&Wall; 2])> = (0..3)
            .filter_map(|axis| Some((axis, [face(axis, 0)?, face(axis, 1)?])))
            .filter(|(_, faces)| faces.iter().any(|face| slides(face)))
            .collect();
        let turns = walls.iter().any(|placed| !placed.wall.motion.angular_velocity.is_zero());
        let varies = walls.iter().any(|placed| !placed.wall.motion.is_steady());
        let what = match moving[..] {
            _ if turns => "a wall turns",
            _ if varies => "the velocity of a wall varies",
            [] => "no closed face of the box has a velocity",
            [(axis, [lower, upper])] => {
                let [lower, upper] = [lower, upper].map(|wall| wall.motion.velocity.at(0.0));
                let gradient = (upper - lower) / domain.size()[axis];
                return Ok(Self { axis, lower, gradient });
            }
            _ => "faces move in more than one direction of the box",
        };
        let title =
            format!("`fluid.start` is \"couette\", the flow between two faces that slide, but {what}");
        let remedy = "give `domain.faces` of one direction a velocity, e.g. \"z+\" = { velocity = [1e-3, 0, 0] }, or \
                      remove `fluid.start`";
        Err(document.error("fluid.start", &title, "not between two plates", remedy))
    }

    /// Gives the velocity and the angular velocity of the flow to the bodies that are free and have none of their own.
    pub(super) fn carry(&self, placer: &Placer, motions: &[PrescribedMotion], particles: &mut [Particle]) {
        let sections = placer.kinds.of_each(|section, _| section);
        let still = Vec3::zeros();
        for particle in particles {
            let template = particle.template as usize;
            let rests = particle.velocity() == still && particle.angular_velocity() == still;
            if rests && motions[sections[template]].is_free() {
                let pose = (particle.position(), particle.orientation());
                let motion = [self.velocity(pose.0), self.angular_velocity()];
                *particle = placer.particle(particle.id, template, pose, motion);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::case::from_text;
    use crate::math::Vec3;

    const SHEAR: &str = "domain.size.diameters = [6, 6, 6]\n\
                         domain.periodic = [true, true, false]\n\
                         domain.faces = { z-.velocity = [-1e-3, 0, 0], \"z+\".velocity = [2e-3, 0, 0] }\n\
                         fluid = { density = 1000, viscosity = 1e-6, start = \"couette\" }\n\
                         lattice = { cells_per_diameter = 4, relaxation_time = 0.8 }\n\
                         driving.gravity = 0\n\
                         run.end.steps = 10\n\
                         [[particles]]\n\
                         shape.cuboid.edges = [1e-3, 1e-3, 2e-3]\n\
                         density = 1000.0\n\
                         list = [[2e-3, 2e-3, 1.5e-3], { position = [2e-3, 2e-3, 6e-3], velocity = [0, 1e-3, 0] }]\n";

    #[test]
    fn bodies_start_with_the_velocity_and_half_the_vorticity_of_the_flow_or_their_own() {
        let setup = from_text(SHEAR, "shear", &[]).unwrap_or_else(|e| panic!("{e}"));
        let flow = setup.expect_fluid().start.unwrap();
        let rate = 3e-3 / setup.domain.size().z;
        assert!((flow.gradient - Vec3::new(rate, 0.0, 0.0)).norm() < 1e-12 * rate);
        let [carried, own] = &setup.particles[..] else { panic!() };
        assert!((carried.velocity() - Vec3::new(-1e-3 + 1.5e-3 * rate, 0.0, 0.0)).norm() < 1e-18);
        // The fluid turns about y from z to x.
        assert!((carried.angular_velocity() - Vec3::new(0.0, 0.5 * rate, 0.0)).norm() < 1e-15);
        let inertia = setup.templates[0].inertia();
        let spin = carried.orientation().inverse_transform_vector(&carried.angular_velocity());
        let momentum = carried.orientation().transform_vector(&inertia.component_mul(&spin));
        assert_eq!(Vec3::from(carried.angular_momentum), momentum);
        assert_eq!((own.velocity(), own.angular_velocity()), (Vec3::new(0.0, 1e-3, 0.0), Vec3::zeros()));
    }

    #[test]
    fn bodies_that_start_with_the_flow_meet_at_the_shear_rate() {
        let carried = "particles.0.list=[[2e-3, 2e-3, 1.5e-3], [2e-3, 2e-3, 5e-3]]".to_string();
        let impact = from_text(SHEAR, "shear", &[carried]).unwrap().impact().unwrap();
        assert_eq!(impact.cause, "shear rate times D");
    }

    #[test]
    fn of_a_flow_that_is_too_fast_the_wall_is_named_and_not_the_bodies_that_it_carries() {
        let options = ["domain.faces={\"z+\"={velocity=[2, 0, 0]}}", "particles.0.list=[[2e-3, 2e-3, 5e-3]]"];
        let error = from_text(SHEAR, "shear", &options.map(String::from)).unwrap_err().to_string();
        assert!(error.contains("the wall \"z+\"") && !error.contains("particles.0"), "{error}");
    }

    #[test]
    fn a_flow_that_is_not_between_two_sliding_faces_is_refused() {
        for (option, what) in [
            ("domain.faces={}", "no closed face of the box has a velocity"),
            ("domain.faces={\"z-\"={velocity=[1,0,0]},\"x-\"={velocity=[0,1,0]}}", "more than one direction"),
            ("domain.faces={\"z-\"={rotation=1}}", "a wall turns"),
            ("domain.faces={\"z-\"={velocity.table=[[0,1,0,0]]}}", "the velocity of a wall varies"),
        ] {
            let options = [option.to_string(), "domain.periodic=[false, false, false]".to_string()];
            let error = from_text(SHEAR, "shear", &options).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
