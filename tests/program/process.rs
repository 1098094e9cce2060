//! Runs with a program that moves the particles: the engine in Python end to end, and programs that break the protocol.

use crate::common::child::{Guard, poll, rows};
use crate::common::{Place, column, has, has_lammps, in_tree};
use std::fs;
use std::io::Read;
use std::time::Duration;
use turbid::output::SeriesTable;

/// A folder with the engine in Python and its case, which has this many steps.
fn place(steps: u64) -> Place {
    let read = |name: &str| fs::read_to_string(in_tree("ffi/engines/python").join(name)).unwrap();
    let case = read("settling.toml").replace("out/python_engine", "out");
    let place = Place::new(&case.replace("steps = 400", &format!("steps = {steps}")));
    place.write("spheres.py", read("spheres.py"));
    place
}

/// The same with another program in its place: this text, after the names of messages and the functions of the real one.
fn with_program(body: &str) -> Place {
    let place = place(16);
    let head = place.text("spheres.py");
    let (head, _) = head.split_once("def contacts").unwrap();
    place.write("spheres.py", format!("{head}\n{body}\n"));
    place
}

/// A program that answers all messages, some of them as `answers` says: `kind: lambda: send(...)`.
fn answering(answers: &str) -> Place {
    with_program(&format!(
        r#"
hello = {{"name": "odd 1", "shapes": ["sphere"], "walls": ["plane"], "contacts": True, "saves": True}}

def greet(magic=b"turbidEP", version=1, **more):
    send(HELLO, struct.pack("<8sII", magic, version, 0) + json.dumps(hello | more).encode())

def states(change=lambda n, state: None, count=None):
    records = []
    for n, s in enumerate(spheres[:count]):
        state = [s[0], *s[4], 0, 0, 0, 1, *s[5], *s[6], *s[7], *s[8]]
        change(n, state)
        records.append(struct.pack("<Q19d", *state))
    send(STATES, b"".join(records))

def put(at, value):
    def change(n, state):
        if n == 3:
            state[at] = value
    return change

answers = {{{answers}}}
while True:
    kind, payload = receive()
    if kind == GOODBYE:
        break
    if kind == SET_UP:
        case, spheres = set_up(payload)
    if kind in answers:
        answers[kind]()
    elif kind == HELLO:
        greet()
    elif kind == SET_UP or kind == RESTORE:
        send(READY)
    elif kind == ADVANCE:
        states()
    else:
        send(kind + 1)
"#
    ))
}

const RUN: [&str; 4] = ["run", "case.toml", "--allow-engine", "--quiet"];

#[test]
fn a_case_runs_no_program_unless_it_is_allowed() {
    let place = with_program("open('ran', 'w')");
    let said = place.ends(2, &["run", "case.toml"]);
    has(&said, &["case.toml:25:", "`dem.engine`", "python3 spheres.py", "--allow-engine"]);
    place.ends(2, &["bench", "case.toml", "--steps", "1"]);
    has(&place.well(&["check", "case.toml"]), &["python3 spheres.py"]);
    assert!(!place.path("ran").exists() && !place.path("out").exists());
    for (key, words) in
        [("timeout=0", "above 0"), ("command=[]", "`dem.engine.command`"), ("comand=[]", "comand")]
    {
        let key = format!("dem.engine.{key}");
        has(&place.ends(2, &["run", "case.toml", "--allow-engine", "--set", &key]), &[words]);
    }
}

#[test]
fn a_run_with_the_engine_in_python_is_near_the_native_one_and_the_same_on_any_number_of_threads() {
    let run = |more: &[&str]| {
        let place = place(400);
        place.well(&[&RUN[..], more].concat());
        let settling = column(&place.path("out/series.csv"), "settling_velocity_over_stokes (-)");
        (settling, place.summary("out")["state_hash"].clone())
    };
    let (native, _) = run(&["--set", "dem.engine=native"]);
    let (python, hash) = run(&["--threads", "1"]);
    assert_eq!(hash, run(&["--threads", "2"]).1, "2 threads");
    assert_eq!(hash, run(&["--threads", "3"]).1, "3 threads");
    assert_eq!(native.len(), python.len());
    for (a, b) in native.iter().zip(&python).skip(1) {
        assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
    }
}

#[test]
fn a_run_is_resumed_from_what_the_program_saved_with_the_same_bits_and_from_another_folder() {
    let whole = place(48);
    whole.well(&RUN);
    let half = place(24);
    let program = half.text("spheres.py");
    half.write("spheres.py", format!("import sys\nprint('started', file=sys.stderr)\n{program}"));
    half.well(&[&RUN[..], &["--set", "output.checkpoint_every={ steps = 24 }"]].concat());
    let resume = ["resume", "out", "--set", "run.end={ steps = 48 }"];
    has(&half.ends(2, &resume), &["--allow-engine"]);
    fs::create_dir(half.path("elsewhere")).unwrap();
    fs::rename(half.path("out"), half.path("elsewhere/out")).unwrap();
    let mut elsewhere = half.turbid(&resume);
    elsewhere.arg("--allow-engine").current_dir(half.path("elsewhere"));
    crate::common::well(&mut elsewhere);
    let hash = |place: &Place, out: &str| place.summary(out)["state_hash"].clone();
    assert_eq!(hash(&whole, "out"), hash(&half, "elsewhere/out"));
    let starts = half.text("elsewhere/out/process.log").matches("started").count();
    assert_eq!(starts, 1, "starts of the program by the resumed run, whose log it is");
}

/// The case with the engines in Python of one process and of several, which has this many steps.
fn in_parts(steps: u64) -> Place {
    of_engine("python", &["spheres.py", "parts.py"], steps)
}

#[test]
fn an_engine_in_two_and_three_processes_moves_the_particles_as_one_does_and_resumes() {
    let command = |name: &str, more: &str| {
        format!("dem.engine={{ command = [\"python3\", \"{name}\"], timeout = 20{more} }}")
    };
    let run = ["run", "python/case.toml", "--allow-engine", "--quiet", "--set"];
    let places = |place: &Place| {
        let series = place.path("out/series.csv");
        ["settling_velocity_over_stokes (-)", "contacts (-)"].map(|name| column(&series, name))
    };
    let alone = in_parts(400);
    alone.well(&[&run[..], &[&command("spheres.py", "")]].concat());
    let [expected, contacts] = places(&alone);
    assert!(contacts.iter().any(|count| *count > 0.0));
    for (processes, threads) in [(2, "2"), (2, "3"), (3, "3")] {
        let place = in_parts(400);
        let parts = command("parts.py", &format!(", processes = {processes}"));
        place.well(&[&run[..], &[&parts, "--threads", threads]].concat());
        let [found, of_parts] = places(&place);
        assert_eq!(contacts, of_parts, "{processes} processes, {threads} threads");
        for (a, b) in expected.iter().zip(&found).skip(1) {
            assert!((b / a - 1.0).abs() < 1e-9, "{processes} processes, {threads} threads: {a} {b}");
        }
    }
    let two = command("parts.py", ", processes = 2");
    let hash = |place: &Place| place.summary("out")["state_hash"].clone();
    let every = ["--set", "output.checkpoint_every={ steps = 24 }", "--threads", "2"];
    let (whole, half) = (in_parts(48), in_parts(24));
    whole.well(&[&run[..], &[&two], &every].concat());
    half.well(&[&run[..], &[&two], &every].concat());
    half.well(&["resume", "out", "--allow-engine", "--threads", "3", "--set", "run.end={ steps = 48 }"]);
    assert_eq!(hash(&whole), hash(&half), "resumed");
    let said = half.ends(2, &[&run[..], &[&two, "--threads", "1", "--overwrite"]].concat());
    has(&said, &["has 2 processes, and there are 1 ranks", "--threads 2"]);
    // A program of version 1.
    let old = command("spheres.py", ", processes = 2");
    let said = half.ends(2, &[&run[..], &[&old, "--threads", "2", "--overwrite"]].concat());
    has(&said, &["field `version` is 1", "2 processes need version 2"]);
}

#[test]
fn one_of_four_processes_that_dies_stalls_or_errs_ends_the_run_with_its_number() {
    for (fault, code, expected) in [
        ("sys.exit(5)", 3, &["part 2 of 4", "exit code 5"][..]),
        ("time.sleep(1000)", 3, &["part 2 of 4", "has not answered for 1.0 s"]),
        ("protocol.exchange({})", 3, &["sent the message `exchange`, and another part did not"]),
        (
            "protocol.exchange({9: b''} if self.part == 1 else {})",
            3,
            &["part 2 of 4", "message `exchange`: field `part`"],
        ),
        ("self.spheres.pop()", 3, &["24 records for 25 particles; particle", "is lost"]),
        ("self.spheres[0][0] += 100", 3, &["message `states`: particle 1"]),
        ("self.spheres.append(self.spheres[0])", 3, &["for the second time"]),
        ("self.spheres[0][X][1] = math.nan", 3, &["part 2 of 4", "field `position`"]),
    ] {
        let place = in_parts(100_000);
        let who = if fault.contains("else") { "True" } else { "self.part == 1" };
        let text = place.text("python/parts.py").replace("import json", "import json\nimport time").replace(
            "        return self.particles()\n\n    def particles",
            &format!(
                "        self.steps = getattr(self, 'steps', 0) + 1\n        if {who} and self.steps == 20:\n            {fault}\n        \
                 return self.particles()\n\n    def particles"
            ),
        );
        place.write("python/parts.py", text);
        let command = "dem.engine={ command = [\"python3\", \"parts.py\"], timeout = 1, processes = 4 }";
        let run =
            ["run", "python/case.toml", "--allow-engine", "--quiet", "--threads", "4", "--set", command];
        let said = place.ends(code, &run);
        has(&said, expected);
        assert_eq!(said.matches("error:").count(), 1, "{said}");
        let rows = column(&place.path("out/series.csv"), "t (s)");
        assert!(rows.len() > 1 && rows.is_sorted(), "{rows:?}");
    }
}

#[test]
fn a_cross_check_takes_any_program_and_knows_that_the_template_is_half_a_step_ahead() {
    let place = place(1);
    let check = ["crosscheck", "--case", "free-flight", "--out", "out"];
    let said = place.well(&[&check[..], &["--engine", "python"]].concat());
    has(&said, &["Python template", "12 of 12 checks passed"]);
    let table = place.text("out/crosscheck.csv");
    assert!(
        table.starts_with("case,quantity,measured,reference,tolerance,pass,source,native,other,analytic\n"),
        "{table}"
    );
    has(&table, &["half a step ahead"]);
    assert!(place.path("out/crosscheck.svg").exists() && place.path("out/logs").is_dir());
    let said = place.ends(3, &[&check[..], &["--engine-command", "python3", "spheres.py"]].concat());
    has(&said, &["position (m), constant loads, sub-steps: 1"]);
    has(&place.ends(2, &[&check[..], &["--engine", "odd"]].concat()), &["lammps", "yade"]);
}

#[test]
fn a_cross_check_of_a_case_without_a_contact_says_so_and_does_not_pass() {
    let place = Place::new(
        r"
[domain]
size = [0.01, 0.01, 0.01]
[dry]
time_step = 2e-5
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
list = [{ position = [2e-3, 5e-3, 5e-3], velocity = [0.1, 0.0, 0.0] }, { position = [5e-3, 5e-3, 5e-3] }]
[contact]
youngs_modulus = 1e6
friction_static = 0.0
friction_kinetic = 0.0
restitution = 1.0
[driving]
gravity = 0.0
[run]
end = { time = 0.03 }
",
    );
    let check = ["crosscheck", "case.toml", "--engine", "python", "--out", "out"];
    has(&place.well(&check), &["2 of 2 checks passed", "contacts that began", "until the first contact"]);
    let said = place.ends(3, &[&check[..], &["--time", "0.01"]].concat());
    has(&said, &["2 of 3 checks passed", "no contact in either engine"]);
}

#[test]
fn a_message_that_breaks_the_protocol_is_an_error_that_names_the_program_the_message_and_the_field() {
    for (answers, code, expected) in [
        ("HELLO: lambda: greet(version=2)", 2, &["message `hello`", "field `version` is 2"][..]),
        ("HELLO: lambda: greet(magic=b'other   ')", 2, &["message `hello`", "field `magic`"]),
        ("HELLO: lambda: greet(shapes=3)", 2, &["message `hello`", "JSON"]),
        (
            "HELLO: lambda: greet(shapes=['polyhedron'])",
            2,
            &["a particle that is a sphere", "has polyhedron"],
        ),
        ("HELLO: lambda: send(READY)", 2, &["answered `hello` with the message `ready`"]),
        ("HELLO: lambda: send(99)", 2, &["field `kind` of a message is 99"]),
        ("SET_UP: lambda: send(ERROR, b'I cannot')", 2, &["refuses the set-up: I cannot"]),
        ("SET_UP: lambda: send(READY, b'more')", 2, &["message `ready`", "field `length` is 4"]),
        ("ADVANCE: lambda: send(ERROR, b'no more')", 3, &["failed at step 0", "no more"]),
        ("ADVANCE: lambda: send(STATES, bytes(161))", 3, &["message `states`", "161 bytes", "160"]),
        (
            "ADVANCE: lambda: send(STATES, bytes(160 * 99))",
            3,
            &["message `states`", "field `length` is 15840"],
        ),
        ("ADVANCE: lambda: states(count=3)", 3, &["3 records for"]),
        ("ADVANCE: lambda: states(put(0, 2))", 3, &["field `id`", "particle 2 for the second time"]),
        ("ADVANCE: lambda: states(put(0, 77))", 3, &["field `id`", "no particle 77"]),
        ("ADVANCE: lambda: states(put(8, math.nan))", 3, &["field `velocity` of particle 3", "NaN"]),
        ("ADVANCE: lambda: states(put(1, math.inf))", 3, &["field `position` of particle 3", "inf"]),
        (
            "ADVANCE: lambda: states(put(14, 1e300))",
            3,
            &["field `contact_force`", "particle 3", "is more than"],
        ),
        ("ADVANCE: lambda: states(put(18, 1e300))", 3, &["`contact_torque` of particle 3", "is more than"]),
        ("ADVANCE: lambda: sys.exit(5)", 3, &["exit code 5"]),
        ("ADVANCE: lambda: 1 / 0", 3, &["exit code 1", "ZeroDivisionError", "process.log"]),
        ("SAVE: lambda: 1 / 0", 3, &["exit code 1"]),
        (
            "SAVE: lambda: (sys.stdout.buffer.write(struct.pack('<IIQ', SAVED, 0, 1 << 39)), sys.stdout.buffer.flush())",
            3,
            &["message `saved`", "field `length` is 549755813888, above the "],
        ),
        (
            "LIST: lambda: send(CONTACTS, struct.pack('<QQ3d', 1, 2, 0, -1e300, 0))",
            3,
            &["message `contacts`", "field `force` of record 0: 1e300 is more than"],
        ),
        (
            "LIST: lambda: send(CONTACTS, struct.pack('<QQ3d', 3, 2, 0, 0, 0))",
            3,
            &["message `contacts`", "above `first`"],
        ),
        ("LIST: lambda: send(CONTACTS, struct.pack('<QQ3d', 1, 99, 0, 0, 0))", 3, &["field `second`", "99"]),
    ] {
        let place = answering(answers);
        let every = "{ steps = 8 }";
        let set = [format!("output.checkpoint_every={every}"), format!("output.contacts_every={every}")];
        let said = place.ends(code, &[&RUN[..], &["--set", &set[0], "--set", &set[1]]].concat());
        has(&said, &[expected, &["python3 spheres.py"]].concat());
    }
}

#[test]
fn a_particle_that_an_engine_makes_too_fast_for_the_fluid_ends_the_run() {
    for (at, value, words) in [(9, "10", "particle 3 would move by"), (12, "1e9", "particle 3 would turn by")]
    {
        let place = answering(&format!("ADVANCE: lambda: states(put({at}, {value}))"));
        has(&place.ends(3, &RUN), &["diverged at step 0", words]);
    }
}

#[test]
fn of_several_errors_of_an_engine_the_first_is_told() {
    let place = answering("LIST: lambda: send(ERROR, words.pop(0))");
    let text = place.text("spheres.py");
    let words = "words = [b'the first', b'the second', b'the third', b'the fourth']";
    place.write("spheres.py", text.replace("answers = {", &format!("{words}\nanswers = {{")));
    let said = place.ends(3, &[&RUN[..], &["--set", "output.contacts_every={ steps = 1 }"]].concat());
    has(&said, &["the first"]);
    assert!(!said.contains("the second"), "{said}");
}

/// Changes to a fluid between two plates that pass each other.
const SHEARED: [&str; 4] = [
    "--set",
    "domain.periodic=[true, true, false]",
    "--set",
    r#"domain.faces={ "z-" = { velocity = [0.0, 0.0, 0.0] }, "z+" = { velocity = [1e-3, 0.0, 0.0] } }"#,
];

#[test]
fn what_only_contacts_give_is_empty_if_an_engine_does_not_tell_them() {
    let table = |contacts: &str| {
        let place = answering(&format!("HELLO: lambda: greet(contacts={contacts})"));
        place.well(&[&RUN[..], &SHEARED].concat());
        let series = SeriesTable::read(&place.path("out/series.csv")).unwrap();
        (series, place.summary("out")["relative_viscosity"].clone(), place)
    };
    let (told, viscosity, _) = table("True");
    let (untold, none, place) = table("False");
    assert!(viscosity.is_number() && none.is_null(), "{viscosity} {none}");
    let of_contacts = |name: &str| {
        ["wall_force", "contact_stress", "shear_stress", "contact_force_z"]
            .iter()
            .any(|of| name.starts_with(of))
    };
    for (a, b) in told.columns.iter().zip(&untold.columns) {
        assert!(a.values.len() == 3 && a.values.iter().all(|x| x.is_finite()), "{}", a.name);
        if of_contacts(&a.name) {
            assert!(b.values.iter().all(|x| x.is_nan()), "{}", a.name);
        } else {
            assert_eq!(a.values, b.values, "{}", a.name);
        }
    }
    place.well(&["report", "out"]);
    let page = place.text("out/REPORT.md");
    assert!(page.contains("net_flux") && !page.contains("hear stress") && !page.contains("NaN"), "{page}");
}

/// True if a process is there and has not ended.
fn lives(process: i32) -> bool {
    let state = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    state.rsplit(") ").next().is_some_and(|rest| !rest.is_empty() && !rest.starts_with('Z'))
}

#[test]
fn what_an_engine_has_started_ends_with_the_run() {
    for (end, code) in [("GOODBYE: lambda: None", 0), ("ADVANCE: lambda: sys.exit(5)", 3)] {
        let place = answering(end);
        let program = place.text("spheres.py");
        let child =
            "import subprocess\nopen('child', 'w').write(str(subprocess.Popen(['sleep', '1000']).pid))";
        place.write("spheres.py", format!("{child}\n{program}"));
        place.ends(code, &RUN);
        let child = place.text("child").parse().unwrap();
        poll("the end of the child", || (!lives(child)).then_some(()));
    }
}

/// The process that this run has started and that has made some steps.
fn engine_of(run: &Guard, place: &Place) -> i32 {
    poll("the engine", || {
        let found =
            fs::read_to_string(format!("/proc/{0}/task/{0}/children", run.0.id())).unwrap_or_default();
        let child = found.split_whitespace().next().and_then(|child| child.parse().ok());
        child.filter(|_| rows(&place.path("out/series.csv")) > 3)
    })
}

#[test]
fn a_program_that_is_stopped_or_killed_ends_the_run_in_time_with_its_files_intact() {
    for (signal, expected) in
        [(libc::SIGSTOP, "has not answered for 1.0 s (see `dem.engine.timeout`)"), (libc::SIGKILL, "SIGKILL")]
    {
        let place = place(1_000_000);
        let mut run = Guard::of(
            place.turbid(&[&RUN[..], &["--set", "dem.engine.timeout=1", "--threads", "1"]].concat()),
        );
        let engine = engine_of(&run, &place);
        // SAFETY: sends a signal to a process that this test has started.
        assert_eq!(unsafe { libc::kill(engine, signal) }, 0);
        let start = std::time::Instant::now();
        let status = poll("the end of the run", || run.0.try_wait().unwrap());
        assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
        let mut said = String::new();
        run.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert_eq!(status.code(), Some(3), "{said}");
        has(&said, &["process engine failed at step", expected]);
        let rows = column(&place.path("out/series.csv"), "t (s)");
        assert!(rows.len() > 2 && rows.is_sorted(), "{rows:?}");
        // SAFETY: asks whether the process is there.
        assert_ne!(unsafe { libc::kill(engine, 0) }, 0, "the engine lives on");
    }
}

/// A folder with programs of a folder of `ffi/engines` and its case, which has this many steps.
fn of_engine(name: &str, programs: &[&str], steps: u64) -> Place {
    let read = |file: &str| fs::read_to_string(in_tree("ffi/engines").join(file)).unwrap();
    let place = Place::empty();
    fs::create_dir(place.path(name)).unwrap();
    place.write("protocol.py", read("protocol.py"));
    for program in programs {
        let program = format!("{name}/{program}");
        place.write(&program, read(&program));
    }
    let case = read(&format!("{name}/settling.toml")).replace(&format!("out/{name}_engine"), "out");
    place.write(&format!("{name}/case.toml"), case.replace("steps = 400", &format!("steps = {steps}")));
    place
}

#[test]
fn lammps_settles_as_the_native_engine_does_on_any_number_of_threads_and_resumes() {
    if !has_lammps() {
        return;
    }
    let run = ["run", "lammps/case.toml", "--allow-engine", "--quiet"];
    let outcome = |steps: u64, more: &[&str]| {
        let place = of_engine("lammps", &["engine.py"], steps);
        place.well(&[&run[..], more].concat());
        (column(&place.path("out/series.csv"), "settling_velocity_over_stokes (-)"), place)
    };
    let hash = |place: &Place| place.summary("out")["state_hash"].clone();
    let (native, _) = outcome(400, &["--set", "dem.engine=native"]);
    let (lammps, whole) = outcome(400, &["--threads", "1"]);
    assert_eq!(hash(&whole), hash(&outcome(400, &["--threads", "3"]).1), "3 threads");
    assert_eq!(native.len(), lammps.len());
    for (a, b) in native.iter().zip(&lammps).skip(1) {
        assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
    }
    let every = [
        "--set",
        "output.checkpoint_every={ steps = 200 }",
        "--set",
        "output.contacts_every={ steps = 100 }",
    ];
    let (_, whole) = outcome(400, &every);
    let (_, half) = outcome(200, &every);
    half.well(&["resume", "out", "--allow-engine", "--threads", "2", "--set", "run.end={ steps = 400 }"]);
    assert_eq!(hash(&whole), hash(&half), "resumed");
    let check =
        ["crosscheck", "--engine", "lammps", "--case", "static-wall", "--case", "head-on", "--out", "checks"];
    has(&half.well(&check), &["LAMMPS", "38 of 38 checks passed"]);
}

/// Passes without doing anything where YADE, which takes more than a gigabyte, is not installed.
#[test]
fn yade_settles_spheres_and_cubes_as_the_native_engine_does_on_any_number_of_threads() {
    if !std::path::Path::new("/usr/lib/x86_64-linux-gnu/yade-double/py").exists() {
        return;
    }
    let sphere =
        ["--set", "particles.0.shape.sphere.diameter=1.5e-3", "--set", "particles.0.volume_fraction=0.2"];
    for (shape, tolerance) in [(&sphere[..], 0.01), (&[], 0.02)] {
        let outcome = |more: &[&str]| {
            let place = of_engine("yade", &["engine.py"], 300);
            place.well(&[&["run", "yade/case.toml", "--allow-engine", "--quiet"], shape, more].concat());
            let settling = column(&place.path("out/series.csv"), "settling_velocity_over_stokes (-)");
            (settling, place.summary("out")["state_hash"].clone())
        };
        let (native, _) = outcome(&["--set", "dem.engine=native"]);
        let (yade, hash) = outcome(&["--threads", "1"]);
        assert_eq!(hash, outcome(&["--threads", "3"]).1, "3 threads");
        for (a, b) in native.iter().zip(&yade).skip(1) {
            assert!((a / b - 1.0).abs() < tolerance, "{shape:?}: {a} {b}");
        }
    }
    let check =
        ["crosscheck", "--engine", "yade", "--case", "cube-cube", "--case", "inertia", "--out", "out"];
    has(&Place::empty().well(&check), &["volumes of 280 overlaps, corner on face", "14 of 14 checks passed"]);
}
