//! Bad input, end to end: the right words on standard error, exit code 2, and nothing written.

mod bodies;
mod cohesion;
mod drives;
mod engine;
mod files;
mod forms;
mod friction;
mod insertion;
mod lubrication;
mod mesh_walls;
mod motion;
mod statistics;
mod units;
mod walls;

use crate::common::case::{SPHERES, changed};
use crate::common::{Place, has};

/// Each row: what stands in the good case, what replaces it, and what must be said.
fn all_refused(table: &[(&str, &str, &[&str])]) {
    all_refused_of(SPHERES, table);
}

/// The same of another case.
fn all_refused_of(case: &str, table: &[(&str, &str, &[&str])]) {
    let place = Place::empty();
    for (good, spoilt, words) in table {
        place.write("bad.toml", changed(case, &[(good, spoilt)]));
        place.refused(&["check", "bad.toml"], words);
    }
}

#[test]
fn the_case_that_the_others_spoil_is_good() {
    let said = Place::new(SPHERES).well(&["check", "case.toml"]);
    has(&said, &["32768", "Archimedes", "steps per t*", "contact lasts", "estimated time"]);
}

#[test]
fn mistakes_in_the_case_file_are_shown_with_their_line_and_a_remedy() {
    // What stands in the good case, what replaces it, and what must be said.
    let table: &[(&str, &str, &[&str])] = &[
        (
            "density = 1000.0",
            "densty = 1000.0",
            &["bad.toml:6:1", "unknown key `densty`", "did you mean `density`"],
        ),
        ("density = 1000.0", "density = \"thin\"", &["bad.toml:6:11", "\"thin\"", "must be a number"]),
        ("density = 1000.0", "density = -1000.0", &["bad.toml:6:11", "`fluid.density` is -1000", "above 0"]),
        ("density = 1000.0", "density = nan", &["bad.toml:6:11", "`fluid.density` is NaN"]),
        ("density = 1000.0", "", &["bad.toml:5:1", "the key `density` is missing"]),
        ("density = 1000.0", "density = ", &["bad.toml:6:"]),
        ("archimedes = 1000", "archimedes = inf", &["bad.toml:7:14", "`fluid.archimedes` is inf"]),
        (
            "archimedes = 1000",
            "",
            &["bad.toml:5:1", "exactly one of `viscosity`, `archimedes`, `galileo`", "none"],
        ),
        (
            "archimedes = 1000",
            "archimedes = 1000\nviscosity = 1e-6",
            &["bad.toml:7:14", "has 2", "keep either `viscosity` or `archimedes`"],
        ),
        ("archimedes = 1000", "galileo = 0", &["bad.toml:7:11", "`fluid.galileo` is 0"]),
        ("archimedes = 1000", "viscosity = -1e-6", &["bad.toml:7:13", "`fluid.viscosity` is -0.000001"]),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.5",
            &["bad.toml:11:19", "`lattice.relaxation_time` is 0.5", "0.55"],
        ),
        ("relaxation_time = 0.55", "time_step = 0", &["bad.toml:11:13", "relaxation time of 0.55"]),
        ("relaxation_time = 0.55", "", &["bad.toml:9:1", "exactly one of `relaxation_time`, `time_step`"]),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"mrt\"",
            &["bad.toml:12:13", "`mrt`", "bgk"],
        ),
        ("cells_per_diameter = 8", "cells_per_diameter = 1", &["bad.toml:10:22", "at least 2"]),
        (
            "cells_per_diameter = 8",
            "cells_per_diameter = 1e5",
            &["bad.toml:3:", "cells", "lattice.cells_per_diameter"],
        ),
        ("[4, 4, 4]", "[4, 4, 0.5]", &["14 |", "bad.toml:3:", "too large for the box", "1.5e-3 m or 1 d"]),
        ("[4, 4, 4]", "[4, 4]", &["bad.toml:3:", "must have 3"]),
        ("[4, 4, 4]", "[4, 4, -4]", &["bad.toml:3:29", "`domain.size.diameters` is -4", "above 0"]),
        ("1.5e-3", "0", &["bad.toml:14:33", "`particles.0.shape.sphere.diameter` is 0", "metres"]),
        ("sphere", "spere", &["bad.toml:14:", "unknown choice `spere`", "did you mean `sphere`"]),
        ("volume_fraction = 0.1", "volume_fraction = 0.8", &["bad.toml:16:19", "is 0.8", "at most 0.74"]),
        (
            "volume_fraction = 0.1",
            "volume_fraction = 0",
            &["bad.toml:16:19", "`particles.0.volume_fraction` is 0"],
        ),
        (
            "volume_fraction = 0.1",
            "count = 1000",
            &["bad.toml:16:9", "`particles.0.count` is 1000", "at most 90"],
        ),
        ("volume_fraction = 0.1", "count = -1", &["bad.toml:16:9", "whole number"]),
        (
            "volume_fraction = 0.1",
            "volume_fraction = 0.1\ncount = 3",
            &["bad.toml:16:19", "exactly one", "bad.toml"],
        ),
        ("volume_fraction = 0.1", "", &["bad.toml:13:1", "`volume_fraction`, `count`, `file`, `list`"]),
        (
            "volume_fraction = 0.1",
            "volume_fraction = 0.3\nminimum_gap = 1e-3",
            &["bad.toml:17:15", "no room", "minimum_gap"],
        ),
        (
            "volume_fraction = 0.1",
            "list = [[1e-3, 1e-3, 1e-3]]",
            &["bad.toml:17:8", "`particles.0.seed`", "remove it"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-4, 3e-3, 3e-3], [5.9e-3, 3e-3, 3e-3]]",
            &["bad.toml:16:9", "particles 0 and 1", "2.0", "periodic faces", "touch at 1.5"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-4, 3e-3, 3.1]]",
            &["bad.toml:16:9", "outside the box", "z is 3.1 m", "0.006"],
        ),
        ("{ steps = 10 }", "{ steps = 0 }", &["bad.toml:20:7", "`run.end` is 0 steps"]),
        ("{ steps = 10 }", "{ time = -1 }", &["bad.toml:20:16", "`run.end.time` is -1", "{ time = 0.5 }"]),
        ("{ steps = 10 }", "{ steps = 10, time = 1 }", &["bad.toml:20:7", "exactly one"]),
        ("{ steps = 10 }", "10", &["bad.toml:20:7", "{ steps = 100 }"]),
        (
            "{ steps = 10 }",
            "{ steps = 10 }\naverage_from = { steps = 10 }",
            &["bad.toml:20:7", "21 |", "ends at step 10"],
        ),
        (
            "[run]",
            "[contact]\nrestitution = 1.1\n[run]",
            &["bad.toml:20:15", "`contact.restitution` is 1.1", "at most 1"],
        ),
        ("[run]", "[contact]\nrestitution = 0\n[run]", &["bad.toml:20:15", "above 0"]),
        ("[run]", "[contact]\npoisson_ratio = 0.6\n[run]", &["bad.toml:20:17", "at most 0.5"]),
        ("[run]", "[contact]\nyoungs_modulus = 0\n[run]", &["bad.toml:20:18", "above 0", "Pa"]),
        ("[run]", "[contact]\nsubsteps = 0\n[run]", &["bad.toml:20:12", "`contact.substeps` is 0"]),
        ("[run]", "[driving]\ngravity = 0\n[run]", &["bad.toml:7:14", "give `viscosity`"]),
        (
            "[run]",
            "[output]\nfields_every = { steps = 0 }\n[run]",
            &["bad.toml:20:26", "`output.fields_every.steps` is 0", "\"never\""],
        ),
        (
            "[[particles]]",
            "[particle]",
            &["bad.toml:13:2", "unknown key `particle`", "did you mean `particles`"],
        ),
    ];
    all_refused(table);
    Place::empty().refused(&["check", "none.toml"], &["cannot read none.toml"]);
}

#[test]
fn mistakes_in_options_are_shown_with_the_option() {
    let table: &[(&str, &[&str])] = &[
        ("fluid.densty=3", &["option --set:1:7", "unknown key `densty`", "did you mean `density`"]),
        ("fluids.density=3", &["option --set:1:1", "did you mean `fluid`"]),
        ("fluid.density=thin", &["option --set:1:15", "\"thin\"", "must be a number"]),
        ("fluid.density=-3", &["option --set:1:15", "`fluid.density` is -3"]),
        ("fluid.density.x=3", &["option --set:1:15", "`density` is a float"]),
        ("particles.1.density=3", &["option --set:1:11", "array of 1"]),
        ("run.end.stepz=3", &["option --set:1:9", "did you mean `steps`"]),
        ("run.end.steps=0", &["option --set:1:5", "`run.end` is 0 steps"]),
        ("run.end", &["no value", "key.path=value"]),
        ("=1", &["empty key"]),
        ("fluid.density=[1,", &["option --set:1:", "unclosed array"]),
        ("fluid.density=1\nfluid.viscosity=2", &["more than one"]),
    ];
    let place = Place::new(SPHERES);
    for (option, words) in table {
        place.refused(&["check", "case.toml", "--set", option], words);
    }
}

#[test]
fn mistakes_in_a_positions_file_are_shown_with_their_line() {
    let table: &[(&str, &[&str])] = &[
        (
            "1e-3;1e-3;1e-3;0;0;0;1\n3e-3;x;1e-3;0;0;0;2\n",
            &["balls.txt:2:6", "`y` is `x`", "x;y;z;rx;ry;rz;id"],
        ),
        ("1e-3;1e-3;1e-3;0;0;0\n", &["balls.txt:1", "6 fields instead of 7"]),
        ("x,y\n1,2\n", &["balls.txt:1", "no column `z`"]),
        ("\n", &["balls.txt", "no particles"]),
        ("1e-3;1e-3;1e-3;0;0;0;1\n4e-3;4e-3;4e-3;0;0;0;1\n", &["id 1", "balls.txt:1", "balls.txt:2"]),
        (
            "1e-3;1e-3;1e-3;0;0;0;1\n1e-3;1e-3;2e-3;0;0;0;2\n",
            &["overlap", "1 (balls.txt:1) and 2 (balls.txt:2)"],
        ),
        ("1;1;1;0;0;0;1\n", &["balls.txt:1", "outside the box", "x is 1 m", "metres"]),
    ];
    let file = ("volume_fraction = 0.1\nseed = 1", "file = \"balls.txt\"");
    let place = Place::new(&changed(SPHERES, &[file]));
    place.refused(&["check", "case.toml"], &["case.toml:16:8", "balls.txt", "relative to the case file"]);
    for (text, words) in table {
        place.write("balls.txt", text);
        place.refused(&["check", "case.toml"], words);
    }
}

#[test]
fn an_output_directory_that_cannot_be_written_is_found_before_anything_is_computed() {
    let place = Place::new(SPHERES);
    let arguments = ["run", "case.toml", "--out", "case.toml/out"];
    place.refused(&arguments, &["output directory", "case.toml/out"]);
}

#[test]
fn bad_input_leaves_the_output_directory_uncreated() {
    let place = Place::new(SPHERES);
    let arguments = ["run", "case.toml", "--out", "out", "--set", "lattice.relaxation_time=0.4"];
    place.refused(&arguments, &["`lattice.relaxation_time` is 0.4"]);
    let arguments = ["run", "case.toml", "--out", "out", "--set", "lattice.cells_per_diameter=2000"];
    place.refused(&arguments, &["this machine has", "lattice.cells_per_diameter ="]);
}

#[test]
fn a_wrong_command_line_ends_with_the_same_code() {
    let place = Place::empty();
    place.refused(&["run"], &["CASE"]);
    place.refused(&["rum", "case.toml"], &["rum"]);
    place.refused(&["bench", "case.toml", "--steps", "0"], &["--steps"]);
}

#[test]
fn packed_positions_come_back_to_the_last_bit() {
    let place = Place::new(SPHERES);
    place.well(&["pack", "case.toml", "--out", "a.txt"]);
    let again = ["pack", "case.toml", "--out", "b.txt", "--set", "particles.0.file=a.txt"];
    place.well(&again);
    assert_eq!(place.text("a.txt").lines().count(), 1 + 13);
    assert_eq!(place.text("a.txt"), place.text("b.txt"));
}
