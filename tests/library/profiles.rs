//! Profiles of a suspension and of a flow, written by a run.

use crate::written;
use turbid::output::SeriesTable;
use turbid::output::directory::{PROFILE_MEANS, PROFILES};

/// Spheres and cubes between plates that slide.
const SHEARED: &str = r#"
[domain]
size = { diameters = [5, 5, 6] }
periodic = [true, true, false]
faces = { "z+" = { velocity = [5e-3, 0, 0] } }
[fluid]
density = 1000.0
viscosity = 1e-6
start = "couette"
[lattice]
cells_per_diameter = 5
relaxation_time = 0.7
[driving]
gravity = [0, 0, -0.02]
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 1500.0
volume_fraction = 0.1
[[particles]]
shape = { cube = { edge = 0.8e-3 } }
density = 1200.0
count = 9
[run]
end = { steps = 96 }
average_from = { steps = 32 }
[output]
profiles_every = { steps = 4 }
series_every = { steps = 4 }
profiles = [
    { axis = "z", bins = 12, hydrodynamic_stress = true }, { axis = "x", bins = 7 },
    { axis = "z", bins = 3, about = [2.5e-3, 2.5e-3, 0], hydrodynamic_stress = true },
]
fields_every = "never"
particles_every = "never"
picture_every = "never"
checkpoint_every = { steps = 40 }
"#;

#[test]
fn profiles_add_up_to_what_is_in_the_box_and_have_the_same_bits_on_1_to_4_ranks() {
    let root = tempfile::tempdir().unwrap();
    let read = |threads: u32| {
        let out = root.path().join(threads.to_string());
        let (setup, files) = written(&out, SHEARED, &[format!("run.threads={threads}")]);
        let bytes =
            [files.table(PROFILES), files.table(PROFILE_MEANS)].map(|file| std::fs::read(file).unwrap());
        (setup, files, bytes)
    };
    let (setup, files, alone) = read(1);
    for threads in [2, 4] {
        assert!(read(threads).2 == alone, "{threads} threads");
    }
    let table = SeriesTable::read(&files.table(PROFILES)).unwrap();
    let column = |name: &str| table.get(name).unwrap_or_else(|| panic!("{name}"));
    let (profile, step) = (column("profile"), column("step"));
    let [cubes, spheres] = [1, 0].map(|n| setup.sections.iter().filter(|section| **section == n).count());
    assert_eq!([cubes, spheres], [1, 1]);
    let volume = setup.domain.volume();
    for number in 0..2 {
        let bins = setup.plan.output.profiles[number].bins;
        for at in [0.0, 48.0, 96.0] {
            let rows: Vec<usize> = (0..step.len())
                .filter(|&row| profile[row] as usize == number && (step[row] - at).abs() < 0.5)
                .collect();
            assert_eq!(rows.len(), bins);
            let mean = |name: &str| rows.iter().map(|&row| column(name)[row]).sum::<f64>() / bins as f64;
            let count = mean("number_density") * volume;
            assert!((count - setup.particles.len() as f64).abs() < 1e-9, "{count}");
            assert!((mean("number_density_particles.1") * volume - 9.0).abs() < 1e-9);
            assert!((mean("solid_fraction") / setup.volume_fraction - 1.0).abs() < 1e-12);
        }
    }
    // The stress by the fluid adds up to that of the box.
    let series = SeriesTable::read(&files.series()).unwrap();
    let stresses = ["xx", "zz", "xz"].map(|of| format!("hydrodynamic_stress_{of}"));
    for (row, at) in series.get("step").unwrap().iter().enumerate() {
        for stress in &stresses {
            let of_bins = |number: usize| {
                let rows = (0..step.len()).filter(|&row| profile[row] as usize == number);
                let rows = rows.filter(|&row| (step[row] - at).abs() < 0.5);
                rows.map(|row| column(stress)[row]).sum::<f64>()
            };
            let (sum, whole) = (of_bins(0) / 12.0, series.get(stress).unwrap()[row]);
            assert!((sum - whole).abs() <= 1e-9 * whole.abs(), "{stress} at {at}: {sum} {whole}");
            assert!(of_bins(1).is_nan() && of_bins(2).is_finite());
        }
    }
    // What the suspension is pulled along with grows from plate to plate.
    let means = SeriesTable::read(&files.table(PROFILE_MEANS)).unwrap();
    let flow = &means.get("fluid_velocity_x").unwrap()[..12];
    assert!(flow.windows(2).all(|pair| pair[0] < pair[1]), "{flow:?}");
    assert!(means.get("rows").unwrap().iter().all(|rows| (rows - 17.0).abs() < 0.5));
    assert!(means.get("fluid_velocity_x_error").unwrap()[..12].iter().all(|error| *error > 0.0));
}

#[test]
fn the_profile_of_a_couette_flow_is_a_line_and_has_no_variance_but_that_within_a_bin() {
    let root = tempfile::tempdir().unwrap();
    let text = SHEARED.replace("volume_fraction = 0.1", "count = 0").replace("count = 9", "count = 0");
    let (setup, files) = written(root.path(), &text, &[]);
    let means = SeriesTable::read(&files.table(PROFILE_MEANS)).unwrap();
    let [flow, square] =
        ["fluid_velocity_x", "fluid_velocity_variance_xx"].map(|name| means.get(name).unwrap());
    // Two and a half cells in a bin: one of them has half its weight in each of two.
    let cells = setup.domain.cells[2] as f64;
    for bin in 0..12 {
        let from = 2.5 * f64::from(bin);
        let in_bin = |k: f64| ((k + 1.0).min(from + 2.5) - k.max(from)).max(0.0) / 2.5;
        let mean = |of: &dyn Fn(f64) -> f64| {
            (0..30).map(|k| in_bin(f64::from(k)) * of(f64::from(k) + 0.5)).sum::<f64>()
        };
        let (line, squares) = (mean(&|z| z), mean(&|z| z * z));
        let [found, variance] = [flow[bin as usize] / 5e-3, square[bin as usize] / 2.5e-5];
        assert!((found * cells / line - 1.0).abs() < 1e-4, "{bin}: {found}");
        assert!((variance * cells * cells - (squares - line * line)).abs() < 0.01, "{bin}: {variance}");
    }
    assert!(means.get("particle_velocity_x").unwrap().iter().all(|v| v.is_nan()));
}
