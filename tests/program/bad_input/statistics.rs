//! Statistics that cannot be taken.

use super::{all_refused, all_refused_of};

#[test]
fn profiles_structure_and_averages_that_cannot_be_are_refused_with_a_remedy() {
    let with = |key: &str| format!("volume_fraction = 0.1\nseed = 1\n[output]\n{key}\n");
    let table: [(&str, &[&str]); 10] = [
        (
            "structure = { reach = 4e-3 }",
            &["`output.structure.reach` is 0.004", "at most 0.003000 m", "half of the shortest"],
        ),
        (
            "structure = { shortest_wave = 7e-3 }",
            &["`output.structure.shortest_wave` is 0.007", "at most 0.006", "do not fit"],
        ),
        (
            "structure = { shortest_wave = 1e-4 }",
            &["`output.structure.shortest_wave` is 0.0001", "at least 1.6", "100000 wave vectors"],
        ),
        ("paths = [3, 4000]", &["no particle has the id 4000", "count from 0"]),
        ("structure = { bins = 0 }", &["`output.structure.bins` is 0", "at least 1"]),
        ("structure = { plane = \"yx\" }", &["`yx`", "xy"]),
        ("dynamics = { lags = 1 }", &["`output.dynamics.lags` is 1", "at least 2"]),
        ("average = [\"contacts\", \"contact\"]", &["series.csv has no column `contact`", "tables.md"]),
        (
            "profiles = [{ axis = \"z\", bins = 4, radius = 1e-3 }]",
            &["of which `about` is missing", "give about = [x, y, z]"],
        ),
        (
            "profiles = [{ axis = \"z\", bins = 4, about = [3e-3, 3e-3, 0], radius = 4e-3 }]",
            &["`output.profiles.0.radius` is 0.004", "at most 0.003000 m"],
        ),
    ];
    for (key, words) in table {
        all_refused(&[("volume_fraction = 0.1\nseed = 1", &with(key), words)]);
    }
}

#[test]
fn a_stress_by_the_fluid_without_a_fluid_is_refused() {
    let dry = r#"
domain = { size = [5e-3, 5e-3, 5e-3], periodic = [true, true, true] }
dry.time_step = 1e-6
run.end.steps = 1
output.profiles = [{ axis = "z", bins = 4 }]
[[particles]]
shape.sphere.diameter = 1e-3
density = 2000
count = 3
"#;
    let words: &[&str] = &["bad.toml:5:", "`hydrodynamic_stress` is that of a fluid", "remove it"];
    all_refused_of(dry, &[("bins = 4", "bins = 4, hydrodynamic_stress = true", words)]);
}
