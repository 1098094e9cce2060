//! Bodies so large that they share cells with their own images feel what copies of them feel in a box of several periods.

use super::tests::{COUPLINGS, HOMOGENISED, coupled, fluid_for};
use super::*;
use crate::comm::on_threads;
use crate::fluid::Boundary;
use crate::math::Quat;
use crate::shape::composite::tests::dumbbell;
use crate::shape::{Cuboid, Cylinder, Sphere, Through};
use std::sync::Arc;

const CELLS: usize = 16;

/// Loads on a body in a periodic box in each of `copies` periods in each direction, by period.
fn loads(method: Method, shape: &Arc<dyn Shape>, copies: usize, grid: [usize; 3]) -> Vec<Load> {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [copies * CELLS; 3], dx: 1.0 };
    let decomposition = Decomposition::with_grid(domain, grid);
    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let templates: Arc<[Template]> = [Template { shape: shape.clone(), material: 0, density: 2.0 }].into();
    let parts = on_threads(decomposition.ranks(), |comm| {
        let params = fluid_for(method);
        let mut fluid = Fluid::<f64>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
        let reach = shape.circumradius();
        let params = CouplingParams { units, ..coupled(method) };
        let mut coupling = Coupling::new(params, &decomposition, comm.rank(), reach);
        let mut loads = Vec::new();
        for step in 0..30 {
            let all = (0..copies.pow(3)).map(|n| {
                let cell = [n % copies, n / copies % copies, n / copies / copies];
                let drift = Vec3::new(0.05, -0.02, 0.01);
                let from = Vec3::from(cell.map(|n| (n * CELLS) as f64)) + Vec3::new(15.0, 0.4, 9.3);
                let position = domain.wrap(from + drift * f64::from(step));
                let mut body = Particle::at(n as u64, 0, position);
                (body.velocity, body.angular_velocity) = (drift.into(), [0.004, -0.006, 0.01]);
                body.set_orientation(&Quat::from_scaled_axis(Vec3::new(0.3, 0.5, -0.2)));
                body
            });
            let owner = |p: &Particle| decomposition.owner(p.position());
            let (mine, others): (Vec<Particle>, Vec<Particle>) = all.partition(|p| owner(p) == comm.rank());
            let (owned, particles) = (mine.len(), [mine, others].concat());
            let owners = particles.iter().map(|p| owner(p) as u32).collect();
            let store = ParticleStore { templates: templates.clone(), particles, owned, owners };
            coupling.map(&store);
            coupling.sweep(&mut fluid, [1e-5, 2e-5, 0.0], false);
            fluid.exchange();
            let of_step = coupling.loads(&store, Vec3::zeros(), &comm);
            loads = store.owned().iter().map(|p| p.id).zip(of_step).collect::<Vec<_>>();
        }
        loads
    });
    let mut all = parts.concat();
    all.sort_by_key(|(id, _)| *id);
    all.into_iter().map(|(_, load)| load).collect()
}

#[test]
fn a_body_alone_in_its_period_feels_what_each_of_8_feels_in_twice_the_box_on_any_blocks() {
    // A volume fraction of 0.45, a cylinder, and a body of two parts; all share cells with their images.
    let shapes: [Arc<dyn Shape>; 3] = [
        Arc::new(Sphere { radius: CELLS as f64 * 0.47536 }),
        Arc::new(Cylinder::new(5.5, 5.6).unwrap()),
        dumbbell(3.95),
    ];
    for (at, shape) in shapes.iter().enumerate() {
        for method in COUPLINGS {
            // Homogenised cells must not be shared.
            let small: Arc<dyn Shape> = Arc::new(Sphere { radius: 6.5 });
            let shape = if method == HOMOGENISED { &small } else { shape };
            let alone = loads(method, shape, 1, [1, 1, 1])[0];
            assert_eq!(loads(method, shape, 1, [2, 1, 2])[0], alone, "{method:?} {shape:?}");
            assert_eq!(loads(method, shape, 1, [4, 1, 1])[0], alone, "{method:?} {shape:?}");
            if at > 0 && method != COUPLINGS[1] {
                continue;
            }
            for load in loads(method, shape, 2, [1, 1, 1]) {
                let [force, torque] =
                    [load.force - alone.force, load.torque - alone.torque].map(|d| d.norm());
                println!("{method:?} {shape:?}: {force:.1e} of {:.1e}, {torque:.1e}", alone.force.norm());
                assert!(force < 1e-11 * alone.force.norm() && torque < 1e-11 * alone.torque.norm());
            }
        }
    }
}

/// Loads on a body that goes through a box of this length along z at a place along it.
fn loads_through(method: Method, shape: &Arc<dyn Shape>, length: usize, z: f64, blocks: usize) -> Load {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [20, 16, length], dx: 1.0 };
    let decomposition = Decomposition::with_grid(domain, [2, 1, blocks]);
    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let templates: Arc<[Template]> = [Template { shape: shape.clone(), material: 0, density: 2.0 }].into();
    let parts = on_threads(decomposition.ranks(), |comm| {
        let params = fluid_for(method);
        let mut fluid = Fluid::<f64>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
        let params = CouplingParams { units, ..coupled(method) };
        let mut coupling = Coupling::new(params, &decomposition, comm.rank(), shape.circumradius());
        let mut load = None;
        for step in 0..40 {
            let velocity = Vec3::new(0.02, -0.01, 0.05);
            let position = Vec3::new(18.7, 7.2, z) + velocity * f64::from(step);
            let mut body = Particle::at(0, 0, domain.wrap(position));
            (body.velocity, body.angular_velocity) = (velocity.into(), [0.0, 0.0, 0.01]);
            body.set_orientation(&Quat::from_scaled_axis(Vec3::z() * (0.3 + 0.01 * f64::from(step))));
            let owner = decomposition.owner(body.position());
            let owned = usize::from(owner == comm.rank());
            let owners = vec![owner as u32];
            let store = ParticleStore { templates: templates.clone(), particles: vec![body], owned, owners };
            coupling.map(&store);
            coupling.sweep(&mut fluid, [1e-5, 2e-5, 3e-5], false);
            fluid.exchange();
            load = coupling.loads(&store, Vec3::zeros(), &comm).first().copied().filter(|_| owned == 1);
        }
        load
    });
    parts.into_iter().flatten().next().expect("a rank has the body")
}

#[test]
fn a_body_that_goes_through_the_box_feels_the_same_per_length_in_any_box_wherever_its_centre_is() {
    for shape in ["cylinder", "prism"] {
        let of = |length: usize| -> Arc<dyn Shape> {
            let length = length as f64;
            let piece: Arc<dyn Shape> = match shape {
                "cylinder" => Arc::new(Cylinder::new(4.7, length).unwrap()),
                _ => Arc::new(Cuboid::new(Vec3::new(9.3, 8.1, length)).unwrap()),
            };
            Arc::new(Through::new(piece, 2, Vec3::z()).unwrap())
        };
        for method in COUPLINGS {
            let one = loads_through(method, &of(8), 8, 3.3, 1);
            for (length, z, blocks) in [(8, 3.3, 2), (8, 7.9, 1), (16, 0.2, 1), (16, 9.3, 4), (5, 0.1, 1)] {
                let other = loads_through(method, &of(length), length, z, blocks);
                let ratio = length as f64 / 8.0;
                let [off, turned] = [other.force - one.force * ratio, other.torque - one.torque * ratio];
                let scale = one.force.norm();
                // The ends of a piece add a little to the curvature, from which the place of the surface follows.
                assert!(off.norm() < 1e-4 * scale, "{method:?} {shape} {length} {z}: {off} of {}", one.force);
                assert!(turned.z.abs() < 1e-3 * scale, "{method:?} {shape} {length} {z}: {}", turned.z);
            }
            let halves = loads_through(method, &of(8), 8, 3.3, 2);
            assert_eq!((halves.force, halves.torque.z), (one.force, one.torque.z), "{method:?} {shape}");
        }
    }
}
