//! Fluid between walls in a whole simulation, SI units.

use turbid::case::{self, Setup};
use turbid::comm::{Comm, on_threads};
use turbid::domain::{Decomposition, Domain};
use turbid::fluid::{Collision, Precision};
use turbid::math::Vec3;
use turbid::simulation::Simulation;
use turbid::wall::{Motion, Surface, Wall};

const CASE: &str = r"
[domain]
size = { diameters = [2, 2, 2] }
[fluid]
density = 1200.0
viscosity = 1e-5
[lattice]
cells_per_diameter = 8
relaxation_time = 1.5
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2000.0
count = 1
[driving]
gravity = [0.0, 0.0, -9.81]
[run]
end = { steps = 500 }
";

/// A box of fluid without particles, closed in z; the upper wall slides.
fn setup(speed: f64) -> Setup {
    let mut setup = case::from_text(CASE, "case", &[]).unwrap();
    setup.particles.clear();
    // A sliding wall means a net flux.
    let fluid = setup.fluid.as_mut().unwrap();
    fluid.net_flux = [None; 3];
    fluid.collision = Collision::Trt { magic: 0.1875 };
    setup.domain.faces = Domain::faces([true, true, false]);
    let wall = |name: &str, point, normal, velocity: Vec3| Wall {
        name: name.into(),
        surface: Surface::Plane { point, normal },
        motion: Motion { velocity: velocity.into(), ..Motion::default() },
        material: 0,
    };
    let height = setup.domain.size();
    setup.walls = vec![
        wall("z-", Vec3::zeros(), Vec3::z(), Vec3::zeros()),
        wall("z+", height, -Vec3::z(), speed * Vec3::x()),
    ];
    setup
}

#[test]
fn the_walls_of_a_shear_cell_feel_viscosity_times_shear_rate_times_area() {
    let mut setup = setup(2e-3);
    setup.plan.precision = Precision::F64;
    let size = setup.domain.size();
    let expected = 1200.0 * 1e-5 * 2e-3 / size.z * size.x * size.y;
    for grid in [[1, 1, 1], [1, 2, 2]] {
        let cut = Decomposition::with_grid(setup.domain, grid);
        let loads = on_threads(cut.ranks(), |comm| {
            let mut simulation = Simulation::new(&setup, &cut, comm).unwrap();
            for _ in 0..2400 {
                simulation.step().unwrap();
            }
            // Gravity has nothing to drive here, and a closed direction would not be driven.
            assert!(simulation.acceleration().z == 0.0);
            simulation.wall_loads()
        });
        for loads in loads {
            let [lower, upper] = [loads[0].force, loads[1].force];
            assert!((lower.x / expected - 1.0).abs() < 1e-6, "{} {expected}", lower.x);
            assert!((upper.x / expected + 1.0).abs() < 1e-6, "{} {expected}", upper.x);
        }
    }
}

#[test]
fn a_fluid_that_gets_too_fast_in_the_last_steps_is_found_at_the_end() {
    let mut setup = setup(0.0);
    // From rest to the limit in three steps, between two measurements.
    let acceleration = 0.15 * setup.units().acceleration();
    setup.fluid.as_mut().unwrap().body_acceleration = (Vec3::x() * acceleration).into();
    let cut = Decomposition::new(setup.domain, 1).unwrap();
    let mut simulation = Simulation::new(&setup, &cut, Comm::Solo).unwrap();
    for _ in 0..2 {
        simulation.step().unwrap();
        simulation.check().unwrap();
    }
    simulation.step().unwrap();
    let error = simulation.check().unwrap_err().to_string();
    assert!(error.contains("cells per step") && error.contains('3'), "{error}");
}
