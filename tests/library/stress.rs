//! Forces on walls and stresses of particles in `series.csv`, against what drives the fluid and what theory says.

use turbid::case;
use turbid::output::{SeriesTable, Summary};
use turbid::simulation::{self, RunOptions};

/// Between two faces in z; 8 cells per diameter of 1 mm.
const BOX: &str = r#"
[domain]
size = { diameters = SIZE }
periodic = [true, true, false]
FACES
[fluid]
density = 1200.0
viscosity = 1e-5
precision = "f64"
[lattice]
cells_per_diameter = 8
relaxation_time = 1.5
collision = "trt"
COUPLING
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 1200.0
list = [MIDDLE]
[driving]
gravity = 0
zero_net_flux = false
DRIVE
[run]
end = { steps = STEPS }
average_from = { steps = 0 }
[output]
series_every = { steps = EVERY }
fields_every = "never"
particles_every = "never"
picture_every = "never"
"#;
/// kg/m^3, Pa s, m.
const DENSITY: f64 = 1200.0;
const VISCOSITY: f64 = 1.2e-2;
const DIAMETER: f64 = 1e-3;

/// Runs a case, with its particles or without.
fn run(text: &str, with_particles: bool) -> (SeriesTable, Summary) {
    let folder = tempfile::tempdir().unwrap();
    let mut setup = case::from_text(text, "case", &[]).unwrap();
    if !with_particles {
        setup.particles.clear();
    }
    setup.plan.output.directory = folder.path().join("out");
    let options = RunOptions::default();
    let summary = simulation::run(&setup, &options).unwrap().unwrap();
    (SeriesTable::read(&folder.path().join("out/series.csv")).unwrap(), summary)
}

fn column<'a>(series: &'a SeriesTable, name: &str) -> &'a [f64] {
    series.get(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn last(series: &SeriesTable, name: &str) -> f64 {
    *column(series, name).last().unwrap()
}

fn close(what: &str, found: f64, expected: f64, tolerance: f64) {
    println!("{what}: {found:e}, expected {expected:e}");
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found:e}, expected {expected:e}");
}

/// A cubic box of `size` diameters.
fn text(size: f64, extra: &[(&str, &str)], steps: u64, every: u64) -> String {
    let middle = 0.5 * size * DIAMETER;
    let mut text = BOX
        .replace("SIZE", &format!("[{size}, {size}, {size}]"))
        .replace("MIDDLE", &format!("[{middle}, {middle}, {middle}]"))
        .replace("STEPS", &steps.to_string())
        .replace("EVERY", &every.to_string());
    for key in ["FACES", "COUPLING", "DRIVE"] {
        let value = extra.iter().find(|(name, _)| *name == key);
        text = text.replace(key, value.map_or("", |(_, value)| value));
    }
    text
}

/// Driven by 0.048 m/s^2 along x.
const DRIVEN: (&str, &str) = ("DRIVE", "body_acceleration = [0.048, 0.0, 0.0]");
const ACCELERATION: f64 = 0.048;

#[test]
fn a_sphere_in_a_run_that_starts_as_couette_flow_keeps_its_velocity_and_the_walls_their_stress() {
    let faces = "[domain.faces]\n\"z-\".velocity = [0, -5e-3, 0]\n\"z+\".velocity = [0, 5e-3, 0]";
    let rate = 1e-2 / 6e-3;
    for coupling in ["saturated", "homogenised"] {
        let options = [("FACES", faces), ("COUPLING", &format!("coupling = \"{coupling}\""))];
        let case = text(6.0, &options, 20, 20)
            .replace("precision = \"f64\"", "start = \"couette\"")
            .replace("list = [[0.003, 0.003, 0.003]]", "list = [[3e-3, 1e-4, 1.5e-3]]");
        let [one, two] =
            ["1", "2"].map(|n| run(&case.replace("[run]", &format!("[run]\nthreads = {n}")), true));
        assert_eq!(one.1.state_hash, two.1.state_hash, "{coupling}");
        close("velocity of the sphere", last(&one.0, "mean_particle_velocity_y"), -1.5e-3 * rate, 1e-3);
        close("stress at the wall", last(&one.0, "shear_stress_z-_y"), VISCOSITY * rate, 1e-3);
    }
}

#[test]
fn the_walls_of_a_driven_slit_carry_the_force_that_drives_the_fluid() {
    let (series, summary) = run(&text(2.0, &[DRIVEN], 1000, 250), false);
    let height = 2.0 * DIAMETER;
    let drive = DENSITY * ACCELERATION * height.powi(3);
    for wall in ["z-", "z+"] {
        close(wall, last(&series, &format!("fluid_force_{wall}_x")), 0.5 * drive, 1e-3);
        let stress = 0.5 * DENSITY * ACCELERATION * height;
        close(wall, last(&series, &format!("shear_stress_{wall}_x")), stress, 1e-3);
        assert!(last(&series, &format!("shear_stress_{wall}_z")).abs() < 1e-12);
    }
    let flux = ACCELERATION * height * height / (12.0 * VISCOSITY / DENSITY);
    close("mean velocity", last(&series, "net_flux_x"), flux, 1e-2);
    assert_eq!(summary.relative_viscosity, None, "nothing is sheared between plates");
}

#[test]
fn every_row_holds_the_momentum_of_its_own_step() {
    // What the box gains in a step is what drives it less what the walls take, with a sphere in it as well.
    let (series, summary) = run(&text(2.0, &[DRIVEN], 40, 1), true);
    let impulse = DENSITY * ACCELERATION * (2.0 * DIAMETER).powi(3) * summary.time_step;
    let momentum = column(&series, "momentum_x");
    let on_walls: Vec<f64> = (column(&series, "fluid_force_z-_x").iter())
        .zip(column(&series, "fluid_force_z+_x"))
        .map(|(low, high)| low + high)
        .collect();
    assert_eq!(momentum[0].to_bits(), 0.0_f64.to_bits());
    // Rows are of the middle of a collision: the first one has half of the next impulse besides, as far as its cells are fluid.
    let fluid = 1.0 - std::f64::consts::PI / 6.0 / 8.0;
    let half = momentum[1] - impulse + on_walls[1] * summary.time_step;
    let part = half / (0.5 * impulse * fluid);
    assert!((0.97..1.0).contains(&part), "{part}");
    for step in 1..momentum.len() {
        let before = if step == 1 { half } else { momentum[step - 1] };
        let gained = momentum[step] - before;
        let left = impulse - on_walls[step] * summary.time_step;
        assert!(
            (gained - left).abs() < 1e-2 * impulse,
            "step {step}: {gained:e} gained, {left:e} left over of {impulse:e}"
        );
    }
    // A flow from rest, seen at the step of the row and not up to eight before.
    assert!(momentum.windows(2).all(|pair| pair[1] > pair[0]));
    let flux = column(&series, "net_flux_x");
    assert!(flux.windows(2).all(|pair| pair[1] > pair[0]));
}

#[test]
fn a_body_that_starts_with_a_velocity_has_the_momentum_of_the_box_then_and_later() {
    let start = "list = [{ position = [2e-3, 2e-3, 2e-3], velocity = [1e-2, 0, -2e-3] }]";
    let mass = DENSITY * std::f64::consts::PI / 6.0 * DIAMETER.powi(3);
    // Homogenised cells are set in motion by their body without a reaction in the first step, by other cells than its volume.
    for (coupling, tolerance) in [("saturated", 2e-3), ("homogenised", 0.03)] {
        for precision in ["f32", "f64"] {
            let case = text(4.0, &[("COUPLING", &format!("coupling = \"{coupling}\""))], 400, 1)
                .replace("periodic = [true, true, false]", "")
                .replace("\"f64\"", &format!("\"{precision}\""))
                .replace("list = [[0.002, 0.002, 0.002]]", start);
            let (series, _) = run(&case, true);
            for (axis, velocity) in [("x", 1e-2), ("z", -2e-3)] {
                let momentum = column(&series, &format!("momentum_{axis}"));
                let parts = momentum.iter().map(|p| p / (mass * velocity)).collect::<Vec<_>>();
                println!(
                    "{coupling} {precision} {axis}: {:.5} {:.5} {:.5}",
                    parts[0], parts[100], parts[400]
                );
                assert!((parts[0] - 1.0).abs() < 1e-12, "{coupling} {precision}: {}", parts[0]);
                assert!((parts[400] - 1.0).abs() < tolerance, "{coupling} {precision}: {}", parts[400]);
            }
        }
    }
}

/// Shear rate (1/s) of plates that pass each other, for a box of this many diameters.
const RATE: f64 = 0.8;

fn sheared(size: f64, coupling: &str, steps: u64, with_particles: bool) -> (SeriesTable, Summary) {
    let speed = 0.5 * RATE * size * DIAMETER;
    let faces = format!(
        "faces = {{ \"z-\" = {{ velocity = [{}, 0.0, 0.0] }}, \"z+\" = {{ velocity = [{speed}, 0.0, 0.0] }} }}",
        -speed
    );
    let coupling = format!("coupling = \"{coupling}\"");
    let extra = [("FACES", faces.as_str()), ("COUPLING", coupling.as_str())];
    run(&text(size, &extra, steps, 100), with_particles)
}

/// Mean stress on the plates (Pa).
fn on_plates(series: &SeriesTable) -> f64 {
    0.5 * (last(series, "shear_stress_z-_x") - last(series, "shear_stress_z+_x"))
}

#[test]
fn plates_that_shear_a_fluid_feel_its_viscosity() {
    let (series, summary) = sheared(2.0, "saturated", 600, false);
    close("lower", last(&series, "shear_stress_z-_x"), VISCOSITY * RATE, 1e-3);
    close("upper", last(&series, "shear_stress_z+_x"), -VISCOSITY * RATE, 1e-3);
    let area = 4.0 * DIAMETER * DIAMETER;
    close("force", last(&series, "fluid_force_z-_x"), VISCOSITY * RATE * area, 1e-3);
    // Over the start from rest as well, so that this is only near one.
    assert!(summary.relative_viscosity.is_some());
    assert_eq!(last(&series, "hydrodynamic_stress_xz").to_bits(), 0.0_f64.to_bits());
}

#[test]
fn the_stress_on_plates_is_that_of_the_fluid_and_of_the_particle_between_them() {
    for coupling in ["saturated", "paper"] {
        let (series, _) = sheared(2.5, coupling, 500, true);
        let added = on_plates(&series) - VISCOSITY * RATE;
        close(coupling, last(&series, "hydrodynamic_stress_xz"), added, 0.02);
        assert!(added > 0.05 * VISCOSITY * RATE);
        assert_eq!(last(&series, "contacts").to_bits(), 0.0_f64.to_bits());
    }
}

#[test]
fn a_sphere_in_a_wide_shear_cell_has_the_stresslet_of_einstein() {
    // 20/3 pi mu a^3 E with E_xz = rate / 2. The plates are four diameters apart and the sphere has images beside it (volume fraction
    // 0.008): both add a few per cent. The grid adds more: the stresslet goes with the cube of the radius, and a twentieth of a cell
    // is 4 % of it here.
    let volume = (4.0 * DIAMETER).powi(3);
    let radius = 0.5 * DIAMETER;
    let exact = 20.0 / 3.0 * std::f64::consts::PI * VISCOSITY * radius.powi(3) * (0.5 * RATE) / volume;
    let (series, summary) = sheared(4.0, "saturated", 700, true);
    close("stresslet", last(&series, "hydrodynamic_stress_xz"), exact, 0.15);
    // The other shear stresses are none.
    for other in ["xy", "yz"] {
        assert!(last(&series, &format!("hydrodynamic_stress_{other}")).abs() < 1e-3 * exact);
    }
    let added = on_plates(&series) / (VISCOSITY * RATE) - 1.0;
    close("viscosity", added, 2.5 * summary.volume_fraction, 0.15);
}

#[test]
fn a_sphere_that_touches_its_own_images_has_the_contact_stress_of_an_array_of_them() {
    let stress = |cells: usize| {
        let (edge, size) = (0.0101, 0.0101 * cells as f64);
        let at = |n: usize| [n % cells, n / cells % cells, n / cells / cells].map(|k| k as f64 * edge);
        let list: Vec<[f64; 3]> = (0..cells.pow(3)).map(at).collect();
        let text = format!(
            "domain.size = [{size}, {size}, {size}]\n\
             dry = {{ impact_speed = 0.1, enlargement = 1e-4 }}\n\
             particles = [{{ shape.sphere.diameter = 0.01, density = 2500, list = {list:?} }}]\n\
             contact.youngs_modulus = 1e7\n\
             driving.gravity = 0\n\
             run.end.steps = 8\n\
             output = {{ series_every.steps = 1, particles_every = \"never\", picture_every = \"never\" }}\n"
        );
        let (series, _) = run(&text, true);
        ["xx", "yy", "zz", "xz"].map(|ij| last(&series, &format!("contact_stress_{ij}")))
    };
    let (one, many) = (stress(1), stress(3));
    for (one, many) in one.iter().zip(many) {
        assert!((one - many).abs() < 1e-6 * many.abs().max(1.0), "{one} {many}");
    }
    assert!(one[0] < -1.0 && one[3].abs() < 1e-6, "{one:?}");
}

#[test]
fn a_column_of_spheres_carries_its_weight_as_stress() {
    let text = "
[domain]
size = [0.011, 0.011, 0.03]
periodic = [false, false, false]
[dry]
impact_speed = 0.1
[[particles]]
shape = { sphere = { diameter = 0.01 } }
density = 2500.0
list = [[5.5e-3, 5.5e-3, 5e-3], [5.5e-3, 5.5e-3, 1.5e-2]]
[contact]
youngs_modulus = 1e7
restitution = 0.2
[driving]
gravity = 9.81
[run]
end = { time = 0.3 }
[output]
series_every = { time = 5e-4 }
particles_every = \"never\"
picture_every = \"never\"
";
    let (series, _) = run(text, true);
    let radius: f64 = 5e-3;
    let weight = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) * 9.81;
    // Twice the weight over one radius from the floor, once over two from below.
    let exact = -(2.0 * weight * radius + weight * 2.0 * radius) / (0.011 * 0.011 * 0.03);
    // It swings about that, hardly damped: as momentum stays, the mean forces are those at rest.
    let mean = |name: &str| {
        let values = &column(&series, name)[100..];
        values.iter().sum::<f64>() / values.len() as f64
    };
    close("zz", mean("contact_stress_zz"), exact, 0.01);
    assert!(last(&series, "contact_stress_xz").abs() < 1e-6 * exact.abs());
    close("floor", mean("wall_force_z"), -2.0 * weight, 0.01);
    assert_eq!(last(&series, "hydrodynamic_stress_zz").to_bits(), 0.0_f64.to_bits());
}

#[test]
fn the_summary_of_a_sheared_run_has_its_rate_strain_and_reynolds_number() {
    let (_, summary) = sheared(2.0, "saturated", 100, false);
    close("rate", summary.shear_rate.unwrap(), RATE, 1e-12);
    close("strain", summary.shear_strain.unwrap(), RATE * 100.0 * summary.time_step, 1e-12);
    close(
        "Reynolds number",
        summary.shear_reynolds.unwrap(),
        RATE * DENSITY * DIAMETER * DIAMETER / VISCOSITY,
        1e-12,
    );
    assert_eq!(summary.drag_over_stokes, None, "nothing is fixed");
}
