//! The second engine: cases that it cannot represent, commands that would break the coupling, and a program without it.

use super::all_refused_of;
use crate::common::case::{SPHERES, changed};
use crate::common::{Place, has, words};

/// [`SPHERES`] with LIGGGHTS: `[dem]` is line 19, `engine` line 20.
fn with_liggghts() -> String {
    changed(SPHERES, &[("[run]", "[dem]\nengine = \"liggghts\"\n[run]")])
}

#[test]
fn what_the_second_engine_cannot_represent_is_refused_when_the_case_is_read() {
    all_refused_of(
        &with_liggghts(),
        &[
            (
                "\"liggghts\"",
                "\"ligghts\"",
                &["bad.toml:20:10", "unknown choice `ligghts`", "did you mean `liggghts`"],
            ),
            (
                "engine = \"liggghts\"",
                "liggghts = { process = \"own\" }",
                &["bad.toml:20:12", "`dem.engine` is \"native\"", "engine = \"liggghts\" in [dem]"],
            ),
            (
                "engine = \"liggghts\"",
                "engine = \"liggghts\"\nliggghts.process = \"thread\"",
                &["bad.toml:21:20", "`thread`", "worker, own"],
            ),
            (
                "engine = \"liggghts\"",
                "engine = \"liggghts\"\nliggghts.timeout = 0",
                &["bad.toml:21:20", "`dem.liggghts.timeout` is 0", "above 0 and at most 1000000"],
            ),
            (
                "[4, 4, 4]",
                "[4, 4, 2]",
                &[
                    "bad.toml:3:8",
                    "two periodic images at once",
                    "native engine",
                    "contact enlargement included",
                ],
            ),
            (
                "[4, 4, 4]",
                "[4, 4, 1]",
                &[
                    "14 |",
                    "bad.toml:3:",
                    "larger than half the box",
                    "native engine",
                    "3.1875e-3 m or 2.125 d",
                ],
            ),
            (
                "{ sphere = { diameter = 1.5e-3 } }",
                "{ cube = { edge = 1.5e-3 } }",
                &["bad.toml:14:9", "`particles.0.shape` is \"cube\"", "spheres only", "\"native\"", "20 |"],
            ),
            (
                "[dem]",
                "[contact]\nrestitution = 0.05\n[dem]",
                &["bad.toml:20:15", "`contact.restitution` is 0.05", "above 0.05 and at most 1 for LIGGGHTS"],
            ),
            (
                "[dem]",
                "[contact]\npairs = [{ materials = [\"default\", \"default\"], restitution = 0.01 }]\n[dem]",
                &["bad.toml:20:", "`contact.pairs.0.restitution` is 0.01"],
            ),
            (
                "[dem]",
                "[contact]\npoisson_ratio = -0.1\n[dem]",
                &["bad.toml:20:17", "`contact.poisson_ratio` is -0.1", "from 0 to 0.5"],
            ),
            (
                "[dem]",
                "[[materials]]\nname = \"cork\"\npoisson_ratio = -0.2\n[dem]",
                &["bad.toml:21:17", "`materials.0.poisson_ratio` is -0.2"],
            ),
            (
                "[dem]",
                "[contact]\nlaw = \"overlap_energy\"\n[dem]",
                &["bad.toml:20:7", "`contact.law` is \"overlap_energy\"", "a law of its own"],
            ),
            (
                "[dem]",
                "[contact]\ngeometry = \"sampled\"\n[dem]",
                &["bad.toml:20:12", "`contact.geometry` is \"sampled\""],
            ),
        ],
    );
}

#[test]
fn what_lammps_cannot_represent_is_refused_when_the_case_is_read() {
    let case = with_liggghts().replace("liggghts", "lammps");
    let of_contact = |keys: &str| format!("[contact]\n{keys}\n[dem]");
    let refuse = |old: &str, new: &str, said: &[&str]| all_refused_of(&case, &[(old, new, said)]);
    refuse(
        "engine = \"lammps\"",
        "engine = \"lammps\"\nliggghts.timeout = 3",
        &["bad.toml:20:10", "`dem.engine` is \"lammps\"", "engine = \"liggghts\" in [dem]"],
    );
    refuse("engine = \"lammps\"", "lammps.timeout = 3", &["bad.toml:20:1", "`dem.engine` is \"native\""]);
    refuse("{ sphere = { diameter = 1.5e-3 } }", "{ cube = { edge = 1.5e-3 } }", &["LAMMPS", "spheres only"]);
    refuse("[dem]", &of_contact("restitution = 0.1"), &["`contact.restitution` is 0.1", "from 0.12 to 1"]);
    refuse("[dem]", &of_contact("cohesion = \"sjkr\""), &["`contact.cohesion`", "\"dmt\" and \"jkr\""]);
    refuse("[dem]", &of_contact("rolling = \"constant_torque\""), &["`contact.rolling`", "remove it"]);
    refuse(
        "[dem]",
        &of_contact("law = \"overlap_energy\""),
        &["`contact.law`", "LAMMPS has a law of its own"],
    );
    let rod = "rod = { point = [3e-3, 3e-3, 3e-3], axis = [0, 0, 1], diameter = 1e-3 }";
    let wall = format!("[[walls]]\nname = \"plate\"\n{rod}\n[dem]");
    refuse("[dem]", &wall, &["the wall \"plate\" is a cylinder", "LAMMPS has planes"]);
}

#[test]
fn walls_that_the_second_engine_does_not_have_are_refused_by_name() {
    let closed = with_liggghts().replace("size = {", "periodic = [false, false, false]\nsize = {");
    let dry = closed
        .replace("[fluid]\ndensity = 1000.0\narchimedes = 1000\n", "[dry]\ntime_step = 1e-6\n")
        .replace("[lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55\n", "")
        .replace("diameters = [4, 4, 4]", "diameters = [8, 8, 8]");
    let wall = |text: &str| format!("[[walls]]\nname = \"plate\"\n{text}\n[dem]");
    let planes = "planes across x, y or z";
    let refuse = |case: &str, text: &str, what: &str| {
        all_refused_of(case, &[("[dem]", &wall(text), &["the wall \"plate\"", what, planes])]);
    };
    refuse(
        &closed,
        "plane = { point = [1e-3, 0, 0], normal = [1, 0, 1] }",
        "is a plane across none of x, y, z",
    );
    refuse(
        &closed,
        "plane = { point = [0, 0, 1e-3], normal = [0, 0, 2] }\nvelocity = [1e-3, 1e-3, 0]",
        "slides along none of x, y, z",
    );
    refuse(
        &closed,
        "plane = { point = [0, 0, 1e-3], normal = [0, 0, 1] }\nangular_velocity = [0, 0, 3]",
        "turns",
    );
    refuse(
        &closed,
        "plane = { point = [0, 0, 1e-3], normal = [0, 0, 1] }\nvelocity = { table = [[0, 1e-3, 0, 0], [1, 0, 0, 0]] }",
        "varies its velocity",
    );
    refuse(
        &closed,
        "rod = { point = [3e-3, 3e-3, 3e-3], axis = [0, 1, 1], diameter = 1e-3 }",
        "its axis along none of x, y, z",
    );
    refuse(
        &closed,
        "rod = { point = [3e-3, 3e-3, 3e-3], axis = [0, 0, 1], diameter = 1e-3 }\nvelocity = [0, 0, 1e-3]",
        "is a cylinder that moves",
    );
    refuse(
        &dry,
        "plane = { point = [0, 0, 1e-3], normal = [0, 0, 1] }\nvelocity = [0, 0, 1e-3]",
        "moves along its normal",
    );
    // Those that it has, and any of them where nothing touches.
    let place = Place::empty();
    for (case, text) in [
        (&closed, "plane = { point = [0, 0, 1e-3], normal = [0, 0, 2] }\nvelocity = [0, -1e-3, 0]"),
        (&closed, "rod = { point = [3e-3, 3e-3, 3e-3], axis = [0, 0, -1], diameter = 1e-3 }"),
        (&closed, "plane = { point = [1e-3, 0, 0], normal = [1, 0, 1] }\n[contact]\nenabled = false"),
    ] {
        place.write("good.toml", case.replace("[dem]", &wall(text)));
        place.well(&["check", "good.toml"]);
    }
}

#[test]
fn only_commands_of_the_list_are_passed_on_and_others_are_refused_with_the_reason() {
    let character = "which no command that turbid passes on has";
    let refused = "which turbid does not pass on";
    let files = "must not make LIGGGHTS read, write or run anything";
    // A command, as in a string of TOML, and what must be said of it.
    let table: &[(&str, &[&str])] = &[
        ("run 100", &["\"run ...\"", "`run.end`"]),
        ("  timestep 1e-9", &["\"timestep ...\"", "`contact.substeps`"]),
        ("clear", &["\"clear ...\"", refused, "turbid passes on: group .. type,"]),
        ("quit", &["\"quit ...\"", refused]),
        ("atom_style sphere", &["\"atom_style ...\"", refused]),
        ("units cgs", &["\"units ...\"", refused]),
        ("create_box 1 box", &["\"create_box ...\"", refused]),
        ("newton on", &["\"newton ...\"", refused]),
        ("set group all diameter 1", &["\"set ...\"", "[[particles]]"]),
        ("unfix motion", &["\"unfix ...\"", refused]),
        ("neigh_modify every 100000 check no", &["\"neigh_modify ...\"", "no contact is missed"]),
        ("neigh_modify exclude type 1 1", &["\"neigh_modify ...\"", "without a word"]),
        ("neighbor 0 bin", &["\"neighbor ...\"", "no contact is missed"]),
        ("thermo_modify lost ignore", &["\"thermo_modify ...\"", files]),
        ("fix_modify motion energy yes", &["\"fix_modify ...\"", refused]),
        ("pair_style gran model hooke", &["\"pair_style ...\"", "[contact]"]),
        ("fix f all freeze", &["style \"freeze\"", "forces of contacts", "[[walls]]"]),
        ("fix f all setforce 0 0 0", &["style \"setforce\"", "[[walls]]"]),
        ("fix again all nve/sphere", &["style \"nve/sphere\"", "move them twice"]),
        ("fix g all gravity 9.81 vector 0 0 -1", &["style \"gravity\"", "`driving.gravity`"]),
        ("fix more all insert/pack seed 1", &["style \"insert/pack\"", "of the case"]),
        // What reads and writes files.
        ("include more.in", &["\"include ...\"", files]),
        ("print stolen file /tmp/turbid-escaped", &["\"print ...\"", files]),
        ("dump d all custom 1 /tmp/turbid-escaped x", &["\"dump ...\"", files]),
        ("write_restart x", &["\"write_restart ...\"", files]),
        ("write_data x", &["\"write_data ...\"", files]),
        ("info all out overwrite x", &["\"info ...\"", files]),
        ("log x", &["\"log ...\"", files]),
        ("variable v file /etc/passwd", &["\"variable ...\"", files]),
        ("fix p all print 1 text file x", &["style \"print\"", refused]),
        ("fix m all mesh/surface file x.stl type 1", &["style \"mesh/surface\"", refused]),
        ("region t mesh/tet file x scale 1", &["\"region ...\"", refused]),
        // Words that LIGGGHTS takes apart in another way than they look.
        ("group \\\"x y\\\" type 1", &["the character `\"`", character]),
        ("group 'x y' type 1", &["the character `'`", character]),
        ("fix one $g viscous 1", &["the character `$`", character]),
        ("${command} 100", &["the character `$`", character]),
        ("group a type 1 &", &["the character `&`", character]),
        ("group a type 1\\nrun 1", &["more than one line"]),
        ("group a\\ttype 1", &["a control character"]),
        // Those of the list in another form.
        ("fix one all viscous", &["\"fix ...\", but not in the form", "incomplete", "viscous NUMBER"]),
        ("fix one all viscous 1 scale 0 1", &["`scale` does not fit", "COUNT: a whole number"]),
        ("fix one all addforce v_x 0 0", &["`v_x` does not fit", "addforce NUMBER NUMBER NUMBER"]),
        ("fix motion all viscous 1", &["`motion` does not fit", "NEW: a name"]),
        ("group all type 1", &["`all` does not fit"]),
        ("", &["no command"]),
        ("# fix one all viscous 1e-6", &["no command"]),
    ];
    for (command, words) in table {
        let commands =
            format!("engine = \"liggghts\"\nliggghts.commands = [\"group a type 1\", \"{command}\"]");
        let words: Vec<&str> =
            ["bad.toml:21:40", "`dem.liggghts.commands.1`"].iter().chain(*words).copied().collect();
        all_refused_of(&with_liggghts(), &[("engine = \"liggghts\"", &commands, &words)]);
    }
}

#[test]
fn what_a_program_would_not_be_told_is_refused_when_the_case_is_read() {
    let program = "engine = { command = [\"true\"] }";
    let place = Place::new(&with_liggghts().replace("engine = \"liggghts\"", program));
    place.well(&["check", "case.toml", "--set", "contact.law=overlap_energy"]);
    place.refused(
        &["check", "case.toml", "--set", "contact.geometry=sampled"],
        &["option --set:1:18", "`contact.geometry` is \"sampled\"", "a program", "dem.engine = \"native\""],
    );
}

#[test]
fn an_engine_of_an_option_is_a_bare_word_and_its_mistakes_are_shown_there() {
    let place = Place::new(SPHERES);
    let with = |option: &'static str| ["check", "case.toml", "--set", option];
    place.well(&with("dem.engine=liggghts"));
    place.refused(
        &with("dem.engine=yade"),
        &["option --set:1:12", "unknown choice `yade`", "native, liggghts, lammps"],
    );
    place.refused(&with("dem.liggghts.process=own"), &["option --set:1:", "`dem.engine` is \"native\""]);
}

/// The way to a program with LIGGGHTS.
#[cfg(not(feature = "liggghts"))]
const RECIPE: [&str; 4] = [
    "built without",
    "apt-get install liggghts libliggghts-dev libopenmpi-dev libclang-dev g++",
    "cargo build --release --features liggghts",
    "TURBID_FEATURES=liggghts ./run.sh",
];

#[cfg(not(feature = "liggghts"))]
#[test]
fn a_program_without_the_second_engine_says_how_to_build_it_and_writes_nothing() {
    let place = Place::new(&with_liggghts());
    place.refused(&["run", "case.toml", "--out", "out"], &RECIPE);
    place.refused(&["bench", "case.toml", "--steps", "1"], &RECIPE);
    place.refused(&["crosscheck"], &RECIPE);
    place.refused(&["crosscheck", "case.toml", "--out", "out"], &RECIPE);
    let said = place.well(&["check", "case.toml"]);
    has(&said, &["warning: `dem.engine = \"liggghts\"`"]);
    has(&said, &RECIPE);
}

#[test]
fn the_cross_check_lists_its_cases_with_and_without_the_second_engine() {
    let said = Place::empty().well(&["crosscheck", "--list"]);
    has(&said, &["static-pair", "settling-box"]);
}

#[test]
fn doctor_says_whether_this_program_has_the_second_engine_and_mpi() {
    let said = words(&Place::empty().output(&["doctor"]));
    let line = said.lines().find(|line| line.trim_start().starts_with("LIGGGHTS")).unwrap();
    let (answer, remark) =
        if cfg!(feature = "liggghts") { ("yes", "turbid crosscheck") } else { ("no", "--features liggghts") };
    assert!(line.contains(answer) && line.contains(remark), "{line}");
    let line = said.lines().find(|line| line.trim_start().starts_with("MPI")).unwrap();
    let answer = if cfg!(feature = "mpi") { "yes" } else { "--features mpi" };
    assert!(line.contains(answer), "{line}");
}

#[cfg(not(feature = "mpi"))]
#[test]
fn several_processes_of_a_program_without_mpi_refuse_to_run_and_one_of_them_says_why() {
    let place = Place::new(SPHERES);
    for rank in ["0", "1"] {
        let mut command = place.limited(&["run", "case.toml", "--out", "out"]);
        command.envs([("OMPI_COMM_WORLD_RANK", rank), ("OMPI_COMM_WORLD_SIZE", "2")]);
        let output = command.output().unwrap();
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.contains("--features mpi"), rank == "0", "{said}");
        assert!(!place.path("out").exists());
    }
}
