//! Particles as points (`.vtp`): a vertex each, at its wrapped position, in double precision, so that a run can begin from them.
//!
//! Arrays: `id`, `kind` (section of the case, counted from 0), `equivalent_diameter` (m), `volume` (m^3), `mass` (kg), `size` (m: edges of the box that holds
//! the shape as the case gives it), `orientation` (unit quaternion `w, x, y, z` that turns the shape as the case gives it),
//! `velocity` and `speed` (m/s), `angular_velocity` (1/s), `contact_force` (N), `contact_torque` (N m), and in a fluid
//! `hydrodynamic_force` (N, buoyancy included) and `hydrodynamic_torque` (N m) of the last step. `ParaView`'s 3D Glyphs of unit size,
//! scaled by `size` and turned by `orientation`, show the particles.

use super::polydata::PolyData;
use crate::dem::Load;
use crate::domain::Domain;
use crate::math::{Quat, Vec3};
use crate::particle::{Particle, Template};

/// The kinds of particles of a run, for its files of points.
#[derive(Clone, Debug)]
pub struct ParticlePoints {
    /// By template.
    kinds: Vec<Kind>,
}

#[derive(Clone, Debug)]
struct Kind {
    section: usize,
    /// From the axes of the body to those in which the case gives the shape.
    frame: Quat,
    diameter: f64,
    volume: f64,
    mass: f64,
    size: Vec3,
}

impl ParticlePoints {
    /// `sections` are the sections of the case that the templates are of, `frames` lead from the axes of their bodies to those
    /// in which the case gives the shape.
    pub fn new(templates: &[Template], sections: &[usize], frames: &[Quat]) -> Self {
        let kinds = templates.iter().zip(sections).zip(frames);
        Self {
            kinds: kinds
                .map(|((template, &section), &frame)| {
                    let (low, high) = template.shape.bounds(&frame);
                    Kind {
                        section,
                        frame,
                        diameter: template.shape.equivalent_diameter(),
                        volume: template.shape.volume(),
                        mass: template.mass(),
                        size: high - low,
                    }
                })
                .collect(),
        }
    }

    /// The file of `particles`, with the loads of the fluid, one for each, if there is one.
    pub fn data(&self, domain: &Domain, particles: &[Particle], hydrodynamic: Option<&[Load]>) -> PolyData {
        let of = |particle: &Particle| &self.kinds[particle.template as usize];
        let all = || particles.iter();
        let mut data = PolyData::double();
        for particle in particles {
            let point = data.point(domain.wrap(particle.position()));
            data.vertex(point);
        }
        data.scalars("speed (m/s)", all().map(|p| p.velocity().norm()));
        data.integers("id", all().map(|p| p.id).collect());
        data.integers("kind", all().map(|p| of(p).section as u32).collect());
        data.scalars("equivalent_diameter (m)", all().map(|p| of(p).diameter));
        data.scalars("volume (m^3)", all().map(|p| of(p).volume));
        data.scalars("mass (kg)", all().map(|p| of(p).mass));
        data.tuples(
            "orientation",
            all().map(|p| {
                let [i, j, k, w]: [f64; 4] = p.orientation_given(&of(p).frame).coords.into();
                [w, i, j, k]
            }),
        );
        data.vectors("velocity (m/s)", all().map(Particle::velocity));
        data.vectors("size (m)", all().map(|p| of(p).size));
        data.vectors("angular_velocity (1/s)", all().map(Particle::angular_velocity));
        data.vectors("contact_force (N)", all().map(|p| p.contact_force.into()));
        data.vectors("contact_torque (N m)", all().map(|p| p.contact_torque.into()));
        if let Some(loads) = hydrodynamic {
            assert_eq!(loads.len(), particles.len(), "one force and torque for each particle");
            data.vectors("hydrodynamic_force (N)", loads.iter().map(|load| load.force));
            data.vectors("hydrodynamic_torque (N m)", loads.iter().map(|load| load.torque));
        }
        data
    }
}

#[cfg(test)]
mod tests {
    use super::super::vtk_reader::{piece as read, point_data as array};
    use super::*;
    use crate::shape::{Cuboid, Sphere};
    use std::sync::Arc;

    const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [10, 10, 20], dx: 0.1 };

    fn points() -> ParticlePoints {
        let template = |shape| Template { shape, material: 0, density: 2.0 };
        let edges = Vec3::new(0.1, 0.2, 0.3);
        // A quarter turn about x leads from the axes of the body to those of the case.
        let frame = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        ParticlePoints::new(
            &[template(Arc::new(Sphere { radius: 0.25 })), template(Arc::new(Cuboid::new(edges).unwrap()))],
            &[0, 3],
            &[Quat::identity(), frame],
        )
    }

    fn particles() -> Vec<Particle> {
        (0..5_u32)
            .map(|i| {
                let k = f64::from(i) + 1.0 / 3.0;
                let position = Vec3::new(0.1 * k, 0.07 * k, 0.3 * k);
                let mut particle = Particle::at(u64::from(7 + i), (i % 2) as usize, position);
                particle.velocity = [0.3 * k, 0.0, -0.4 * k];
                particle.angular_velocity = [k, 2.0, 3.0];
                particle.contact_force = [0.0, -1.5, k];
                particle.contact_torque = [0.1, k, -k];
                particle.set_orientation(&Quat::from_euler_angles(0.1 * k, 0.2, 0.3));
                particle
            })
            .collect()
    }

    #[test]
    fn every_number_of_a_particle_is_in_the_file_to_the_last_bit() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        let particles = particles();
        let loads: Vec<Load> = (particles.iter())
            .map(|p| Load { force: p.position() * 3.0, torque: p.position() / 3.0 })
            .collect();
        points().data(&BOX, &particles, Some(&loads)).write(&path).unwrap();
        let piece = read(&path);
        let at: Vec<f64> = piece.points.cast_into().unwrap();
        assert_eq!(piece.verts.as_ref().unwrap().num_cells(), 5);
        for (i, particle) in particles.iter().enumerate() {
            let three =
                |name: &str| -> [f64; 3] { array(&piece, name)[3 * i..3 * i + 3].try_into().unwrap() };
            assert_eq!(Vec3::from_column_slice(&at[3 * i..3 * i + 3]), particle.position());
            assert_eq!(Vec3::from(three("velocity")), Vec3::from(particle.velocity));
            assert_eq!(Vec3::from(three("angular_velocity")), Vec3::from(particle.angular_velocity));
            assert_eq!(Vec3::from(three("contact_force")), Vec3::from(particle.contact_force));
            assert_eq!(Vec3::from(three("contact_torque")), Vec3::from(particle.contact_torque));
            assert_eq!(Vec3::from(three("hydrodynamic_force")), loads[i].force);
            assert_eq!(Vec3::from(three("hydrodynamic_torque")), loads[i].torque);
            let [x, y, z, w] =
                particle.orientation_given(&points().kinds[particle.template as usize].frame).coords.into();
            assert_eq!(array(&piece, "orientation")[4 * i..4 * i + 4], [w, x, y, z]);
            assert_eq!(array(&piece, "id")[i] as u64, particle.id);
            assert_eq!(array(&piece, "kind")[i] as usize, [0, 3][i % 2]);
        }
    }

    #[test]
    fn volume_and_mass_are_those_of_the_shape() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        points().data(&BOX, &particles(), None).write(&path).unwrap();
        let piece = read(&path);
        let sphere = std::f64::consts::PI / 6.0 * 0.125;
        for (name, expected) in [("volume", [sphere, 0.006]), ("mass", [2.0 * sphere, 0.012])] {
            for (i, value) in array(&piece, name).into_iter().enumerate() {
                assert!((value / expected[i % 2] - 1.0).abs() < 1e-12, "{name} of {i}: {value}");
            }
        }
    }

    #[test]
    fn size_and_orientation_are_of_the_shape_as_the_case_gives_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        let particles = particles();
        points().data(&BOX, &particles, None).write(&path).unwrap();
        let piece = read(&path);
        let (size, orientation) = (array(&piece, "size"), array(&piece, "orientation"));
        let cuboid = Vec3::from_row_slice(&size[3..6]);
        assert!((cuboid - Vec3::new(0.1, 0.3, 0.2)).norm() < 1e-12, "{cuboid}");
        assert!(size[..3].iter().all(|edge| (edge - 0.5).abs() < 1e-12));
        // The glyph of the cuboid ends where its body does.
        let [w, x, y, z] = orientation[4..8] else { panic!() };
        let turn = Quat::new_normalize(crate::math::nalgebra::Quaternion::new(w, x, y, z));
        let along = turn * Vec3::new(0.0, 0.15, 0.0);
        let body = particles[1].orientation() * Vec3::new(0.0, 0.0, 0.15);
        assert!((along - body).norm() < 1e-12 || (along + body).norm() < 1e-12);
        let bytes = std::fs::metadata(&path).unwrap().len();
        assert!(bytes < 8000, "{bytes}");
    }

    #[test]
    fn thousands_of_particles_stay_small() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        let mut seed = 1.0_f64;
        let mut number = || {
            seed = (seed * 91.7 + 0.123).fract();
            seed
        };
        let many: Vec<Particle> = (0..2000)
            .map(|id| {
                let mut three = || [number(), number(), number()];
                let mut particle = Particle::at(id, 0, three().into());
                (particle.velocity, particle.angular_velocity) = (three(), three());
                (particle.contact_force, particle.contact_torque) = (three(), three());
                let [a, b, c] = three();
                particle.set_orientation(&Quat::from_euler_angles(a, b, c));
                particle
            })
            .collect();
        let loads: Vec<Load> =
            (many.iter()).map(|p| Load { force: p.position() / 3.0, torque: p.velocity() / 7.0 }).collect();
        points().data(&BOX, &many, Some(&loads)).write(&path).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len();
        assert!(bytes < 400 * 2000, "{bytes} bytes for 2000 particles");
    }
}
