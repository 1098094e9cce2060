//! Walls, overlapping particles, materials and dry runs that cannot be.

use super::all_refused;
use crate::common::Place;
use crate::common::case::{SPHERES, changed};

#[test]
fn walls_and_faces_that_cannot_be_are_refused() {
    const SIZE: &str = "[4, 4, 4] }";
    let closed = |more: &str| format!("[4, 4, 4] }}\nperiodic = [true, true, false]\n{more}");
    let wall = |text: &str| format!("[[walls]]\nname = \"floor\"\n{text}\n\n[run]");
    let tables: Vec<(&str, String, &[&str])> = vec![
        (
            SIZE,
            "[4, 4, 4] }\n[domain.faces]\n\"z+\" = { velocity = [1e-3, 0, 0] }".to_string(),
            &["bad.toml:5:8", "\"z+\" is periodic", "false for z"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z*\" = {}"),
            &["bad.toml:6:1", "unknown key `z*`", "z+"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { velocity = [0, 0, 1e-3] }"),
            &["bad.toml:6:8", "\"z+\" moves along its normal", "dry", "piston", "an inlet with its velocity"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { velocity = [inf, 0, 0] }"),
            &["bad.toml:6:22", "`domain.faces.z+.velocity` is inf"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { material = \"steel\" }"),
            &["bad.toml:6:21", "\"steel\"", "no such material", "[[materials]]"],
        ),
        (
            "[4, 4, 4] }",
            "[4, 4, 0.5] }\nperiodic = [true, true, false]".to_string(),
            &["bad.toml:3:", "does not fit between walls"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[3e-3, 3e-3, 1e-3]]\n[[walls]]\nname = \"floor\"\nplane = { point = [0, 0, 5e-4], normal = [0, 0, 1] }"
                .to_string(),
            &["bad.toml:", "\"floor\" meets the periodic faces in z"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, 1], normal = [0, 0, 1] }"),
            &["bad.toml:19:1", "leaves no free space"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, -1], normal = [0, 0, 1] }"),
            &["bad.toml:19:1", "outside the box", "6.000000e-3"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, 0], normal = [0, 0, 0] }"),
            &["bad.toml:21:39", "`walls.0.plane.normal` is [0, 0, 0]"],
        ),
        (
            "[run]",
            wall("pipe = { point = [3e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 0 }"),
            &["bad.toml:21:", "`walls.0.pipe.diameter` is 0"],
        ),
        (
            "[run]",
            wall("pipe = { point = [3e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 5e-3 }\nvelocity = [1e-3, 0, 0]"),
            &["bad.toml:19:1", "\"floor\" moves across its axis"],
        ),
        (
            "[run]",
            wall("rod = { point = [6e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 1e-3 }"),
            &["bad.toml:19:1", "periodic faces in x"],
        ),
        ("[run]", wall(""), &["bad.toml:19:1", "`plane`, `pipe`, `rod`, `mesh`", "none"]),
    ];
    for (good, spoilt, words) in &tables {
        all_refused(&[(good, spoilt, words)]);
    }
}

#[test]
fn particles_that_overlap_each_other_or_a_wall_are_listed() {
    const SHAPE: &str =
        "shape = { sphere = { diameter = 1.5e-3 } }\ndensity = 3300.0\nvolume_fraction = 0.1\nseed = 1";
    let with = |shape: &str, list: &str| format!("shape = {shape}\ndensity = 3300.0\nlist = [{list}]");
    let cube = "{ cube = { edge = 1e-3 } }";
    let turned = "{ position = [4.3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 1], angle = 45 } }";
    let tables: Vec<(&str, String, &[&str])> = vec![
        (
            SHAPE,
            // Corner to face: half an edge and half a diagonal are 1.207 mm.
            with(
                cube,
                "[3.1e-3, 3e-3, 3e-3], { position = [4.3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 1], angle = 45 } }",
            ),
            &["bad.toml:16:9", "particles 0 and 1", "deep", "1.2", "set `overlaps = \"relax\"`"],
        ),
        (
            SHAPE,
            with(cube, "[3.1e-3, 3e-3, 3e-3], [3.3e-3, 3e-3, 3e-3]")
                + "\noverlaps = \"relax\"\nrelax_distance = 3e-4",
            &[
                "bad.toml:16:9",
                "particles 0 and 1",
                "deep",
                "up to 3.000e-4 m did not suffice",
                "`relax_distance`",
            ],
        ),
        (
            SHAPE,
            with(cube, "[3.1e-3, 3e-3, 3e-3]") + "\nrelax_distance = 1e-4",
            &[
                "bad.toml:17:18",
                "`particles.0.relax_distance` belongs to `overlaps = \"relax\"`",
                "remove it",
            ],
        ),
        (
            SHAPE,
            with(cube, "[3.1e-3, 3e-3, 3e-3]") + "\noverlaps = \"relaxed\"",
            &["bad.toml:17:12", "unknown choice `relaxed`", "did you mean `relax`"],
        ),
        (
            SHAPE,
            format!("{SHAPE}\noverlaps = \"relax\""),
            &[
                "bad.toml:18:12",
                "`particles.0.overlaps` belongs to particles of a list or a file",
                "remove it",
            ],
        ),
        (
            SHAPE,
            with(cube, "{ position = [1e-3, 1e-3, 1e-3], orientation = { axis = [0, 0, 0], angle = 45 } }"),
            &["bad.toml:16:", "`particles.0.list.0.orientation.axis` is [0, 0, 0]"],
        ),
        (
            SHAPE,
            with(cube, "{ position = [1e-3, 1e-3, 1e-3], orientation = { axis = [0, 0, 1] } }"),
            &["bad.toml:16:", "has an axis, but no angle"],
        ),
        (
            SHAPE,
            with(cube, "{ position = [1e-3, 1e-3, 1e-3], orientation = { quaternion = [0, 0, 0, 0] } }"),
            &["bad.toml:16:", "quaternion", "not all zero"],
        ),
        (
            SHAPE,
            with(cube, "{ position = [1e-3, 1e-3, 1e-3], orientation = { angle = 3 } }"),
            &["bad.toml:16:", "exactly one of `axis`, `quaternion`"],
        ),
    ];
    for (good, spoilt, words) in &tables {
        all_refused(&[(good, spoilt, words)]);
    }
    // In a closed box, and without the turn there is room for the cubes.
    let list = format!("[3.1e-3, 3e-3, 3e-3], {}", turned.replace("45", "0"));
    let closed = ("[4, 4, 4] }", "[4, 4, 4] }\nperiodic = [true, true, false]");
    let closed = changed(SPHERES, &[closed, (SHAPE, &with(cube, &list))]);
    let place = Place::new(&closed);
    place.well(&["check", "case.toml"]);
    let high = ("[3.1e-3, 3e-3, 3e-3]", "[3.1e-3, 3e-3, 4.5e-3]");
    place.write("case.toml", changed(&closed, &[high]));
    let words = ["1 particle overlaps a wall", "particle 0: 3.7", "the wall \"z+\""];
    place.refused(&["check", "case.toml"], &words);
}

#[test]
fn materials_steps_and_dry_runs_that_make_no_sense_are_refused() {
    let dry = SPHERES.find("[fluid]").unwrap()..SPHERES.find("[[particles]]").unwrap();
    let dry = &SPHERES[dry];
    all_refused(&[
        (
            "density = 3300.0",
            "density = 3300.0\nmaterial = \"glas\"\n",
            &["bad.toml:16:12", "no such material"],
        ),
        (
            "[run]",
            "[[materials]]\nname = \"glass\"\n[[materials]]\nname = \"glass\"\n[run]",
            &["bad.toml:22:8", "given twice"],
        ),
        (
            "[run]",
            "[[materials]]\nname = \"glass\"\n[[contact.pairs]]\nmaterials = [\"glass\", \"steal\"]\n[run]",
            &["bad.toml:22:23", "\"steal\"", "glass"],
        ),
        (
            "[run]",
            "[[contact.pairs]]\nmaterials = [\"default\", \"default\"]\nrestitution = 2\n[run]",
            &["bad.toml:21:15", "`contact.pairs.0.restitution` is 2"],
        ),
        (
            "[run]",
            "[contact]\nsubsteps = 10001\n[run]",
            &["bad.toml:20:12", "`contact.substeps` is 10001", "at most 10000"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"bgk\"\nmagic_parameter = 0.2",
            &["bad.toml:13:19", "trt"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"trt\"\nmagic_parameter = 0",
            &["bad.toml:13:19", "`lattice.magic_parameter` is 0"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"recursive_regularised\"\ncoupling = \"homogenised\"",
            &["bad.toml:12:13", "only with the coupling \"saturated\"", "remove `lattice.coupling`"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\nsmagorinsky = 0.1",
            &[
                "bad.toml:12:15",
                "`lattice.smagorinsky` belongs to",
                "add `collision = \"recursive_regularised\"`",
            ],
        ),
        ("[run]", "[output]\nseries_every = \"never\"\n[run]", &["bad.toml:20:16", "\"never\"", "means"]),
        (
            "[run]",
            "[output]\npicture_range = 0.5\n[run]",
            &["bad.toml:20:1", "unknown key `picture_range`", "write pictures = [{ slice = { range"],
        ),
        (
            "[run]",
            "[output]\npicture_plane = { normal = \"y\" }\n[run]",
            &["bad.toml:20:1", "unknown key `picture_plane`", "write pictures = [{ slice = { normal"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ slice = { normal = \"y\", position = 1 } }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.slice.position` is 1", "from 0 to 0.006"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ slice = { position = 1e-3 } }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.slice.position`", "add normal"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ slice = { normal = \"w\" } }]\n[run]",
            &["bad.toml:20:", "unknown choice `w`"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ view = { slice = { range = [1, -1] } } }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.view.slice.range` is [1, -1]", "smaller value first"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ slice = {}, view = {} }]\n[run]",
            &["bad.toml:20:", "exactly one of `slice`, `view`"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ view = {} }, { view = { zoom = 2 } }]\n[run]",
            &["bad.toml:20:", "two pictures have the name `view`", "name = "],
        ),
        (
            "[run]",
            "[output]\npictures = [{ name = \"../a\", view = {} }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.name` is", "letters, digits"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ view = { from = [0, 0, 0] } }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.view.from`", "any length but 0"],
        ),
        (
            "[run]",
            "[output]\npictures = [{ view = { size = [200, 9000] } }]\n[run]",
            &["bad.toml:20:", "`output.pictures.0.view.size`", "at least 300 and at most 4000"],
        ),
        ("[run]", "[dry]\ntime_step = 1e-5\n[run]", &["[fluid]", "bad.toml:5:1", "dry run"]),
        (dry, "", &["section [fluid] is missing", "[dry]"]),
        (dry, "[dry]\n", &["`time_step`, `impact_speed`"]),
        (dry, "[dry]\ntime_step = 0\n", &["bad.toml:6:13", "`dry.time_step` is 0"]),
        (dry, "[dry]\nimpact_speed = 0\n", &["bad.toml:6:16", "`dry.impact_speed` is 0"]),
        (
            dry,
            "[contact]\nenlargement = 0.1\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:15", "dry.enlargement"],
        ),
        (
            dry,
            "[driving]\nzero_net_flux = true\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:17", "no meaning in a dry run"],
        ),
        (
            dry,
            "[output]\nfields_every = { steps = 1 }\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:16", "no field"],
        ),
        (
            dry,
            "[output]\npictures = [{ slice = {} }]\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:", "no flow to slice"],
        ),
    ]);
}

#[test]
fn inlets_outlets_and_free_slip_that_cannot_be_are_refused() {
    const SIZE: &str = "[4, 4, 4] }";
    let closed =
        |faces: &str| format!("[4, 4, 4] }}\nperiodic = [true, true, false]\n[domain.faces]\n{faces}");
    let inlet = "\"z-\" = { inlet = { velocity = [0, 0, 1e-3] } }";
    let outlet = "\"z+\" = { outlet = {} }";
    let with_profile = |profile: &str| {
        closed(&format!(
            "\"z-\" = {{ inlet = {{ velocity = [0, 0, 1e-3], profile = {profile} }} }}\n{outlet}"
        ))
    };
    let tables: Vec<(&str, String, &[&str])> = vec![
        (
            SIZE,
            "[4, 4, 4] }\n[domain.faces]\n\"z+\" = { outlet = {} }".to_string(),
            &["bad.toml:5:8", "\"z+\" is periodic", "false for z"],
        ),
        (SIZE, closed(inlet), &["bad.toml:6:", "\"z-\" lets fluid in", "no face lets it out", "outlet"]),
        (
            SIZE,
            closed("\"z-\" = { inlet = { velocity = [0, 0, 1e-3] }, outlet = {} }"),
            &["bad.toml:6:", "contradict each other", "remove one"],
        ),
        (
            SIZE,
            closed("\"z-\" = { free_slip = true, velocity = [1e-3, 0, 0] }"),
            &["bad.toml:6:", "moves a wall", "free_slip"],
        ),
        (
            SIZE,
            closed(&format!("\"z-\" = {{ inlet = {{ velocity = [1e-3, 0, 1e-3] }} }}\n{outlet}")),
            &["bad.toml:6:", "component along x", "normal, z"],
        ),
        (
            SIZE,
            closed(&format!("\"z-\" = {{ inlet = {{ velocity = [0, 0, -1e-3] }} }}\n{outlet}")),
            &["bad.toml:6:", "points out of the box", "other sign along z"],
        ),
        (
            SIZE,
            closed(&format!("\"z-\" = {{ inlet = {{ velocity = {{ table = [[0, 0, 0, -1e-3], [1, 0, 0, -2e-3]] }} }} }}\n{outlet}")),
            &["bad.toml:6:", "points out of the box", "other sign along z"],
        ),
        (
            SIZE,
            "[4, 4, 4] }\nperiodic = [true, false, false]\n[domain.faces]\n\"y-\" = { outlet = {} }\n\
             \"z-\" = { inlet = { velocity = [0, 0, 1e-3], profile = \"parabolic\" } }"
                .to_string(),
            &["bad.toml:7:", "\"parabolic\"", "\"y-\" beside it is no wall at rest", "uniform"],
        ),
        (
            SIZE,
            "[4, 4, 4] }\nperiodic = [true, true, false]\n[domain.faces]\n\"z-\" = { outlet = { pressure = 200 } }\n\
             \"z+\" = { outlet = { pressure = -200 } }"
                .to_string(),
            &["bad.toml:6:", "the flow between the outlets \"z-\" and \"z+\"", "cells per time step"],
        ),
        (
            SIZE,
            closed(&format!("\"z-\" = {{ inlet = {{ velocity = [0, 0, 50] }} }}\n{outlet}")),
            &["bad.toml:6:", "the inlet \"z-\" is 5.0000e1 m/s", "cells per time step"],
        ),
        (
            SIZE,
            with_profile("\"parabolic\""),
            &["bad.toml:6:", "\"parabolic\"", "no direction along it has walls", "uniform"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ pressure = 1e9 }} }}")),
            &["bad.toml:7:", "pressure", "time step"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ pressure = {{ table = [[0, 0], [1, 1e9]] }} }} }}")),
            &["bad.toml:7:", "`domain.faces.z+.outlet.pressure` is 1", "as density"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ pressure = {{ table = [[1, 0], [0, 1]] }} }} }}")),
            &["bad.toml:7:", "`domain.faces.z+.outlet.pressure.table.1` is 0", "later than 1 s", "order of time"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ patch = {{ disc = {{ centre = [3e-3, 1e-3, 0], diameter = 3e-3 }} }} }} }}")),
            &["bad.toml:7:", "`domain.faces.z+.outlet.patch` reaches from y = -5.0000e-4 m", "beyond the face", "symmetry"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ patch = {{ disc = {{ centre = [3e-3, 3e-3, 0], diameter = 1e-4 }} }} }} }}")),
            &["bad.toml:7:", "`domain.faces.z+.outlet.patch` has no cell", "larger than a cell of 1.875e-4 m"],
        ),
        (
            SIZE,
            closed(&format!(
                "\"z-\" = {{ inlet = {{ velocity = [0, 0, 1e-3], patch = {{ rectangle = {{ lower = [2e-3, 1e-3, 0], upper = [1e-3, 2e-3, 0] }} }} }} }}\n{outlet}"
            )),
            &["bad.toml:6:", "`domain.faces.z-.inlet.patch` begins at x = 0.002 m and ends at 0.001 m", "lower corner"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ patch = [] }} }}")),
            &["bad.toml:7:", "`domain.faces.z+.outlet.patch` is an empty list", "whole face"],
        ),
        (
            SIZE,
            closed(&format!(
                "{inlet}\n\"z+\" = {{ outlet = {{ patch = [{{ disc = {{ centre = [1e-3, 1e-3, 0], diameter = 1e-3 }} }}, \
                 {{ rectangle = {{ lower = [0, 0, 0], upper = [1e-3, 1e-3, 0] }} }}] }} }}"
            )),
            &["bad.toml:7:", "`domain.faces.z+.outlet.patch.1` has cells that part 0 of the list has, too", "move it"],
        ),
        (
            SIZE,
            with_profile("{ table = [[0, 0, 1], [1e-3, 0, 1], [0, 1e-3, 1]] }"),
            &[
                "bad.toml:6:",
                "the points of `domain.faces.z-.inlet.profile.table` form no grid",
                "(x, y) = (0.001, 0.001) m of 2 x 2 points is missing",
                "one row for each pair of a value of x and one of y",
            ],
        ),
        (
            SIZE,
            with_profile("{ table = [[0, 0, 1], [0, 0, 2]] }"),
            &["bad.toml:6:", "form no grid: (x, y) = (0, 0) m is there twice"],
        ),
        (
            SIZE,
            with_profile("{ table = [] }"),
            &["bad.toml:6:", "`domain.faces.z-.inlet.profile.table`", "no rows"],
        ),
        (
            SIZE,
            with_profile("{ table = [[0, 0, nan]] }"),
            &["bad.toml:6:", "`domain.faces.z-.inlet.profile.table.0` is NaN", "finite number"],
        ),
        (
            SIZE,
            with_profile("{ table = [[0, 0, -5e4], [1e-3, 0, 1]] }"),
            &["bad.toml:6:", "the inlet \"z-\" is 5.0000e1 m/s", "cells per time step"],
        ),
        (
            SIZE,
            with_profile("{ table = [[0, 0, -1]] }"),
            &["bad.toml:6:", "`domain.faces.z-.inlet.profile.table` has no factor above 0"],
        ),
        (
            SIZE,
            with_profile("{ table = [[5, 0, 1], [9, 0, 1]] }"),
            &["bad.toml:6:", "reach from x = 5.0000e0 m to 9.0000e0 m", "coordinates in m"],
        ),
        (
            SIZE,
            with_profile("\"plug\""),
            &["bad.toml:6:", "domain.faces.z-.inlet.profile", "parabolic"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ density = 1 }} }}")),
            &["bad.toml:7:", "unknown key `density`"],
        ),
        (
            SIZE,
            closed(&format!("{inlet}\n\"z+\" = {{ outlet = {{ absorbs_sound = 1 }} }}")),
            &["bad.toml:7:", "absorbs_sound"],
        ),
    ];
    for (good, spoilt, words) in &tables {
        all_refused(&[(good, spoilt, words)]);
    }
}
