//! Particles that come and go as they cannot.

use super::all_refused_of;
use crate::common::{Place, has};

/// Grains that are poured onto a floor, and go beyond a plane.
const POUR: &str = r"[domain]
size = [0.02, 0.02, 0.04]
periodic = [true, true, false]
[dry]
time_step = 1e-5
[[particles]]
shape = { sphere = { diameter = 2e-3 } }
density = 2500.0
count = 0
[[insertion]]
kind = 0
region = { lower = [0, 0, 0.03], upper = [0.02, 0.02, 0.035] }
particle_rate = 1000
velocity = [0, 0, -0.5]
[run]
end = { time = 0.2 }
";

const REGION: &str = "region = { lower = [0, 0, 0.03], upper = [0.02, 0.02, 0.035] }";

#[test]
fn the_insertion_that_the_others_spoil_is_good_and_check_says_what_it_brings() {
    let said = Place::new(POUR).well(&["check", "case.toml"]);
    has(&said, &["insertion 0", "200", "1.0000e3 per second", "fraction at the end", "0.05236"]);
}

#[test]
fn insertions_and_removals_that_cannot_be_are_refused() {
    let after = |more: &str| format!("velocity = [0, 0, -0.5]\n{more}");
    let removal = |what: &str| after(&format!("[[removal]]\n{what}"));
    let rows: Vec<(&str, String, &[&str])> = vec![
        (
            "kind = 0",
            "kind = 1".into(),
            &["bad.toml:11:8", "`insertion.0.kind` is 1", "one of the 1 `[[particles]]` sections"],
        ),
        ("kind = 0", "kinds = 0".into(), &["bad.toml:11:1", "unknown key `kinds`", "did you mean `kind`"]),
        (
            "count = 0",
            "count = 0\nmotion = \"fixed\"".into(),
            &["bad.toml:10:10", "11 |", "`insertion.0` inserts", "prescribed"],
        ),
        (REGION, String::new(), &["bad.toml:10:1", "the key `region` is missing"]),
        (
            REGION,
            "region = { lower = [0, 0, 0.03], upper = [0.02, 0.02, 0.045] }".into(),
            &["bad.toml:12:", "`insertion.0.region.upper` lies outside the box: z is 0.045 m", "0.04 m"],
        ),
        (
            REGION,
            "region = { lower = [0, 0, 0.03], upper = [0.02, 0.02, 0.02] }".into(),
            &["bad.toml:12:10", "begins at z = 0.03 m and ends at 0.02 m", "lower corner"],
        ),
        (
            REGION,
            "region = { lower = [0, 0, 0.0395], upper = [0.02, 0.02, 0.04] }".into(),
            &[
                "bad.toml:12:10",
                "no room for a particle of `particles.0`",
                "1.0000e-3 m from its centre",
                "from walls",
            ],
        ),
        ("particle_rate = 1000", String::new(), &["bad.toml:10:1", "exactly one of", "`mass_rate`"]),
        (
            "particle_rate = 1000",
            "particle_rate = 1000\nvolume_fraction = 0.1".into(),
            &["bad.toml:13:17", "exactly one of", "keep either"],
        ),
        (
            "particle_rate = 1000",
            "particle_rate = 0".into(),
            &["bad.toml:13:17", "`insertion.0.particle_rate` is 0"],
        ),
        ("particle_rate = 1000", "volume_fraction = 0.5".into(), &["bad.toml:13:19", "at most 0.35"]),
        (
            "0.035] }\nparticle_rate = 1000",
            "0.03] }\nvolume_fraction = 0.1".into(),
            &["bad.toml:12:10", "less than one particle", "give a rate"],
        ),
        (
            "particle_rate = 1000",
            "particle_rate = 1e6".into(),
            &[
                "bad.toml:13:17",
                "1.0000e6 particles per second, but at most",
                "find room",
                "larger `velocity`",
            ],
        ),
        (
            "particle_rate = 1000",
            "mass_rate = 10".into(),
            &["bad.toml:13:13", "`insertion.0.mass_rate` requests", "particles per second"],
        ),
        (
            "particle_rate = 1000",
            "particle_rate = 20000".into(),
            &["bad.toml:10:1", "volume fraction of 1.047", "no packing has", "`count`"],
        ),
        (
            "particle_rate = 1000",
            "particle_rate = 1000\nstart = { time = 0.1 }\nend = { time = 0.05 }".into(),
            &["bad.toml:14:9", "15 |", "ends at step 5000, but begins at step 10000"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            "velocity = [0, 0, -500]".into(),
            &["bad.toml:14:12", "cells in a step", "m/s"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            after("velocity_spread = [0, 0, -1]"),
            &["bad.toml:15:", "velocity_spread", "at least 0"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            after("orientation = { axis = [0, 0, 0], angle = 1 }"),
            &["bad.toml:15:", "`insertion.0.orientation.axis`", "not all zero"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            after(
                "[[insertion]]\nregion = { lower = [0, 0, 0.034], upper = [0.02, 0.02, 0.036] }\nvolume_fraction = 0.1",
            ),
            &["bad.toml:12:10", "16 |", "overlap", "filled to a volume fraction"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            removal("plane = { point = [0, 0, 0.032], normal = [0, 0, 1] }"),
            &["bad.toml:12:10", "15 |", "`removal.0` removes particles where `insertion.0` inserts them"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            removal("plane = { point = [0, 0, -0.1], normal = [0, 0, 1] }"),
            &["bad.toml:16:9", "`removal.0.plane` has nothing of the box", "behind it"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            removal("outlet = \"z-\""),
            &["bad.toml:16:10", "`removal.0.outlet` is \"z-\"", "with an `outlet`"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            removal("kind = 3\nplane = { point = [0, 0, 0.01], normal = [0, 0, 1] }"),
            &["bad.toml:16:8", "`removal.0.kind` is 3"],
        ),
        (
            "count = 0",
            "count = 0\n[[particles]]\nshape = { sphere = { diameter = 2e-3 } }\ndensity = 2500.0\ncount = 1\nmotion = \"fixed\"\n[[removal]]\nkind = 1\nregion = { lower = [0, 0, 0], upper = [0.02, 0.02, 0.002] }".into(),
            &["`removal.0` removes", "prescribed"],
        ),
        (
            "velocity = [0, 0, -0.5]\n",
            removal("region = { lower = [-0.01, 0, 0], upper = [0.02, 0.02, 0.002] }\n"),
            &["`removal.0.region.lower` lies outside the box: x is -0.01 m"],
        ),
        (
            "velocity = [0, 0, -0.5]",
            removal("kind = 0"),
            &["bad.toml:15:", "exactly one of `region`, `plane`, `outlet`"],
        ),
        (
            "[run]",
            "[dem]\nengine = { command = [\"x\"] }\n[run]".into(),
            &["bad.toml:10:1", "16 |", "an external engine", "\"native\""],
        ),
    ];
    for (good, spoilt, words) in &rows {
        all_refused_of(POUR, &[(good, spoilt, words)]);
    }
}

#[test]
fn inserted_particles_that_are_too_fast_for_a_fluid_are_refused() {
    let wet = POUR.replace(
        "[dry]\ntime_step = 1e-5",
        "[fluid]\ndensity = 1000\nviscosity = 1e-5\n[lattice]\ncells_per_diameter = 5\nrelaxation_time = 0.6",
    );
    all_refused_of(
        &wet,
        &[(
            "velocity = [0, 0, -0.5]",
            "velocity = [0, 0, -0.3]",
            &["`insertion.0`", "cells per time step", "relaxation_time"],
        )],
    );
}
