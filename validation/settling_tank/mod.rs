//! One sphere settling in a tank of oil; see the README of this folder.

use crate::support::{compare, folder, note, setup};
use turbid::case::Setup;
use turbid::comm::{Comm, on_threads};
use turbid::domain::Decomposition;
use turbid::simulation::Simulation;

const CASE: &str = "settling_tank";
const DIAMETER: f64 = 15e-3;

/// The fluids of ten Cate et al. (2002): density (kg/m^3), dynamic viscosity (Pa s) and largest velocity (m/s).
fn fluid(name: &str) -> [f64; 3] {
    let text = std::fs::read_to_string(folder(CASE).join("reference.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row: Vec<&str> = lines
        .map(|line| line.split(',').collect::<Vec<_>>())
        .find(|row| row[0] == name)
        .unwrap();
    ["rho_f", "mu", "u_max"].map(|key| {
        let column = names.iter().position(|n| *n == key).unwrap();
        row[column].parse().unwrap()
    })
}

/// Time (s), gap to the floor (diameters), downward velocity (m/s) after every step, and the largest sideways move
/// (diameters).
fn fall(setup: &Setup, until_gap: f64) -> (Vec<[f64; 3]>, f64) {
    let ranks = std::thread::available_parallelism().map_or(1, usize::from);
    let decomposition =
        Decomposition::new(setup.domain, Decomposition::max_ranks(setup.domain, ranks)).unwrap();
    let mut all = on_threads(decomposition.ranks(), |comm: Comm| {
        let mut simulation = Simulation::<f32>::new(setup, &decomposition, comm).unwrap();
        let (mut course, mut aside) = (Vec::new(), 0.0_f64);
        let start = setup.particles[0].position();
        while simulation.steps_done() < setup.end_step {
            simulation.step().unwrap();
            let time = simulation.steps_done() as f64 * setup.units.dt;
            // Both ranks know a particle this close to their border, or one does not; the one that owns it says.
            let mut low = [f64::NEG_INFINITY];
            if let Some(sphere) = simulation.dem().particles().owned().first() {
                let gap = sphere.position().z / DIAMETER - 0.5;
                course.push([time, gap, -sphere.velocity().z]);
                aside = aside.max((sphere.position() - start).xy().norm() / DIAMETER);
                low = [-gap];
            }
            simulation.comm().max(&mut low);
            if -low[0] < until_gap {
                break;
            }
        }
        (course, aside)
    });
    // The sphere may change its owner on the way down.
    let mut course: Vec<[f64; 3]> = all.iter_mut().flat_map(|(course, _)| course.drain(..)).collect();
    course.sort_by(|a, b| a[0].total_cmp(&b[0]));
    (course, all.iter().map(|(_, aside)| *aside).fold(0.0, f64::max))
}

/// Runs one of the fluids at a resolution and relaxation time; the course, and the deviation of the largest velocity.
fn check(
    name: &str,
    cells: u32,
    relaxation_time: f64,
    collision: &str,
    until_gap: f64,
    tolerance: f64,
) -> Vec<[f64; 3]> {
    let [density, viscosity, fastest] = fluid(name);
    let (setup, _) = setup(
        CASE,
        &[
            format!("fluid.density={density}"),
            format!("fluid.viscosity={}", viscosity / density),
            format!("lattice.cells_per_diameter={cells}"),
            format!("lattice.relaxation_time={relaxation_time}"),
            format!("lattice.collision={collision:?}"),
        ],
    );
    let (course, aside) = fall(&setup, until_gap);
    let largest = course.iter().map(|at| at[2]).fold(0.0, f64::max);
    let title = format!("{name}, N = {cells}, tau = {relaxation_time}, {collision}");
    note(&format!("{title}: sideways (diameters)"), aside);
    assert!(aside < 0.05);
    compare(
        &format!("{title}: largest velocity (m/s)"),
        largest,
        fastest,
        tolerance,
    );
    course
}

/// Gap (diameters) at a time.
fn gap_at(course: &[[f64; 3]], time: f64) -> f64 {
    let after = course
        .partition_point(|at| at[0] < time)
        .clamp(1, course.len() - 1);
    let [[t0, g0, _], [t1, g1, _]] = [course[after - 1], course[after]];
    g0 + (g1 - g0) * (time - t0) / (t1 - t0)
}

/// Largest distance (diameters) of the course from the digitised one of E1, while the gap is above one diameter.
fn off_measured_course(course: &[[f64; 3]]) -> f64 {
    let text = std::fs::read_to_string(folder(CASE).join("trajectory_E1.csv")).unwrap();
    let mut worst = 0.0_f64;
    for line in text.lines().filter(|line| line.starts_with("h_over_d,")) {
        let number: Vec<f64> = line.split(',').skip(1).map(|x| x.parse().unwrap()).collect();
        if number[1] > 1.0 && number[0] <= course[course.len() - 1][0] {
            worst = worst.max((gap_at(course, number[0]) - number[1]).abs());
        }
    }
    worst
}

#[test]
fn a_sphere_in_a_tank_reaches_the_velocity_of_experiment_e4_at_8_cells_per_diameter() {
    check("E4", 8, 0.55, "bgk", 4.0, 0.08);
}

#[test]
#[ignore = "half a minute; the full study"]
fn e4_at_15_cells_per_diameter() {
    check("E4", 15, 0.55, "bgk", 0.3, 0.05);
}

#[test]
#[ignore = "minutes; the full study"]
fn e1_at_15_cells_per_diameter_follows_the_measured_course() {
    let course = check("E1", 15, 0.65, "bgk", 0.5, 0.05);
    let worst = off_measured_course(&course);
    note("E1: furthest from the measured course (diameters)", worst);
    assert!(worst < 0.4);
}
