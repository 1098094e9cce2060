//! Drives, starts and ends that are none.

use super::all_refused;

#[test]
fn accelerations_velocities_of_walls_and_fluxes_that_are_none_are_refused() {
    all_refused(&[
        (
            "[run]",
            "[driving]\nbody_acceleration = { oscillation = { amplitude = [1, 0, 0], frequency = 1e5 } }\n[run]",
            &["bad.toml:20:", "`driving.body_acceleration.oscillation.frequency` is 100000", "10 time steps"],
        ),
        (
            "[run]",
            "[driving]\nbody_acceleration = { table = [[0, 1, 0, 0], [0, 2, 0, 0]] }\n[run]",
            &["bad.toml:20:", "`driving.body_acceleration.table.1` is 0", "later than 0 s"],
        ),
        (
            "diameters = [4, 4, 4] }",
            "diameters = [4, 4, 4] }\nperiodic = [true, true, false]\nfaces = { \"z+\" = { velocity = { table = [] } } }",
            &["bad.toml:5:", "`domain.faces.z+.velocity.table` is empty", "[t, x, y, z]"],
        ),
        (
            "diameters = [4, 4, 4] }",
            "diameters = [4, 4, 4] }\nperiodic = [true, true, false]\n\
             faces = { \"z+\" = { velocity = { oscillation = { amplitude = [0, 0, 1e-3], frequency = 1 } } } }",
            &["bad.toml:5:", "the wall \"z+\" moves along its normal", "slides along itself"],
        ),
        (
            "[run]",
            "[driving]\nnet_flux = [1e-3, 0, 0]\nzero_net_flux = true\n[run]",
            &["bad.toml:20:", "`driving.net_flux` and `driving.zero_net_flux` both", "remove one"],
        ),
        (
            "[run]",
            "[driving]\nnet_flux = [1e-3, 0, 0]\nbody_acceleration = [1e-3, 0, 0]\n[run]",
            &["bad.toml:20:", "`driving.net_flux` and `driving.body_acceleration` both drive", "along x"],
        ),
        (
            "diameters = [4, 4, 4] }",
            "diameters = [4, 4, 4] }\nperiodic = [true, true, false]\n[driving]\nnet_flux = [0, 0, 1e-3]",
            &["bad.toml:6:", "`driving.net_flux` is 0.001 m/s along z", "which is not periodic"],
        ),
        (
            "[run]",
            "[driving]\nnet_flux = [9, 0, 0]\n[run]",
            &["bad.toml:20:", "the flow of `driving.net_flux` is 9.0000e0 m/s", "cannot follow"],
        ),
    ]);
}

#[test]
fn forces_temperatures_and_starts_that_are_none_are_refused() {
    all_refused(&[
        (
            "seed = 1",
            "seed = 1\nmotion = \"fixed\"\nforce = [0, 0, 1e-6]",
            &["bad.toml:", "`particles.0.force` acts where `particles.0.motion` prescribes", "`free`"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { free = [\"x\"] }\nforce = [1e-6, 0, 0]\ntorque = [0, 0, 1e-9]",
            &["bad.toml:", "`particles.0.torque` acts where"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = \"fixed\"\ngranular_temperature = 1e-4",
            &["bad.toml:", "`particles.0.granular_temperature` gives velocities", "prescribed"],
        ),
        (
            "seed = 1",
            "seed = 1\ngranular_temperature = -1",
            &["bad.toml:18:", "`particles.0.granular_temperature` is -1", "above 0"],
        ),
        (
            "archimedes = 1000",
            "archimedes = 1000\nstart = \"swirl\"",
            &["bad.toml:8:9", "`swirl`", "couette"],
        ),
        (
            "archimedes = 1000",
            "archimedes = 1000\nstart = { poiseuille = { velocity = [1e-3, 0, 0] } }",
            &["bad.toml:8:", "`fluid.start.poiseuille` is the flow between two plates"],
        ),
    ]);
}

#[test]
fn ends_that_are_none_are_refused() {
    all_refused(&[
        (
            "steps = 10",
            "steady = { over = { steps = 8 }, at_most = { steps = 10 } }",
            &["bad.toml:20:", "two windows of 8 steps do not fit into the 10 steps", "shorter windows"],
        ),
        ("steps = 10", "steady = { over = { steps = 8 } }", &["bad.toml:20:", "`at_most` is missing"]),
        (
            "end = { steps = 10 }",
            "end = { steady = { over = { steps = 4 }, at_most = { steps = 100 } } }\n[output]\nseries_every.steps = 5",
            &["bad.toml:20:", "`run.end.steady.over` is 4 steps", "come every 5", "series_every"],
        ),
    ]);
}
