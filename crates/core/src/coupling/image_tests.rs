//! Bodies so large that they share cells with their own images feel what copies of them feel in a box of several periods.

use super::tests::{COUPLINGS, HOMOGENISED, coupled, fluid_for};
use super::*;
use crate::comm::on_threads;
use crate::fluid::Boundary;
use crate::math::Quat;
use crate::shape::composite::tests::dumbbell;
use crate::shape::{Cylinder, Sphere};
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
