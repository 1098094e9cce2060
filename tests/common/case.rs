//! Cases that several tests run, and changes of them.

/// Thirteen spheres that settle in a periodic box of 32 x 32 x 32 cells, for 10 steps.
///
/// Messages name lines and columns of this text: `tests/program/bad_input.rs`.
pub(crate) const SPHERES: &str = r"
[domain]
size = { diameters = [4, 4, 4] }

[fluid]
density = 1000.0
archimedes = 1000

[lattice]
cells_per_diameter = 8
relaxation_time = 0.55

[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
volume_fraction = 0.1
seed = 1

[run]
end = { steps = 10 }
";

/// The sphere of [`SPHERES`].
pub(crate) const SPHERE: &str = "{ sphere = { diameter = 1.5e-3 } }";

/// A case in which the second text of each pair stands in place of the first, once.
pub(crate) fn changed(case: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(case.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "`{old}` is not in\n{text}");
        text.replacen(old, new, 1)
    })
}

/// Thirty spheres that touch, in a box of 24 x 24 x 30 cells; files go to the folder `out`, as these keys of `[output]` say.
pub(crate) fn crowd(steps: u64, output: &str) -> String {
    let case = changed(
        SPHERES,
        &[
            ("[4, 4, 4]", "[4, 4, 5]"),
            ("cells_per_diameter = 8", "cells_per_diameter = 6"),
            ("volume_fraction = 0.1", "volume_fraction = 0.2"),
            ("steps = 10", &format!("steps = {steps}")),
        ],
    );
    format!("{case}\n[output]\ndirectory = \"out\"\n{output}\n")
}

/// A case in a fluid of twice the viscosity of water, 5 cells per diameter; for spheres of 0.5 mm a cell has 0.1 mm.
pub(crate) fn viscous(domain: &str, rest: &str, steps: u64, output: &str) -> String {
    format!(
        "[domain]\n{domain}\n[fluid]\ndensity = 1000.0\nviscosity = 2e-6\n\
         [lattice]\ncells_per_diameter = 5\nrelaxation_time = 0.55\n{rest}\n\
         [run]\nend = {{ steps = {steps} }}\n[output]\ndirectory = \"out\"\n{output}\n"
    )
}

/// Options that leave no frames, only tables.
pub(crate) const TABLES_ONLY: [&str; 6] = [
    "--set",
    "output.fields_every=never",
    "--set",
    "output.particles_every=never",
    "--set",
    "output.picture_every=never",
];

/// An octahedron of this radius, as OBJ.
pub(crate) fn octahedron(radius: i32) -> String {
    let r = radius;
    let corners = [[r, 0, 0], [0, r, 0], [-r, 0, 0], [0, -r, 0], [0, 0, r], [0, 0, -r]];
    let corners = corners.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    let facets = [(1, 2), (2, 3), (3, 4), (4, 1)].map(|(a, b)| format!("f {a} {b} 5\nf {b} {a} 6\n"));
    corners + &facets.concat()
}
