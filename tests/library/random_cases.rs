//! Random small cases, each on one rank and on random numbers of ranks: the same bits.

use crate::common::case::octahedron;
use rand::{Rng, SeedableRng, seq::IndexedRandom, seq::IteratorRandom};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::OnceLock;
use turbid::case::{self, Setup};
use turbid::comm::on_threads;
use turbid::coupling::SolidOperator;
use turbid::domain::Decomposition;
use turbid::simulation::Simulation;

const CASES: u32 = 200;
const STEPS: u64 = 24;

const SHAPES: [&str; 13] = [
    "sphere = { diameter = 5e-4 }",
    "cube = { edge = 4e-4 }",
    "cuboid = { edges = [5e-4, 4e-4, 3e-4] }",
    "ellipsoid = { axes = [6e-4, 5e-4, 4e-4] }",
    "cylinder = { diameter = 4e-4, length = 5e-4 }",
    "capsule = { diameter = 4e-4, length = 6e-4 }",
    "polyhedron = { vertices = [[3e-4, 0, 0], [-3e-4, 0, 0], [0, 3e-4, 0], [0, -3e-4, 0], [0, 0, 3e-4], [0, 0, -3e-4]] }",
    "sphere = { diameter = 6e-4 }",
    "cube = { edge = 5e-4 }",
    "superellipsoid = { axes = [5e-4, 5e-4, 4e-4], exponents = [0.6, 0.8] }",
    "composite = { parts = [{ shape = { sphere = { diameter = 4e-4 } }, position = [-1.2e-4, 0, 0] }, \
     { shape = { sphere = { diameter = 4e-4 } }, position = [1.2e-4, 0, 0] }, \
     { shape = { sphere = { diameter = 3e-4 } }, position = [0, 1.8e-4, 5e-5] }] }",
    "composite = { parts = [{ shape = { cuboid = { edges = [6e-4, 2e-4, 2e-4] } } }, \
     { shape = { cuboid = { edges = [2e-4, 6e-4, 2e-4] } } }] }",
    "composite = { parts = [{ shape = { cylinder = { diameter = 3e-4, length = 4e-4 } } }, \
     { shape = { cube = { edge = 3e-4 } }, position = [1e-4, 2e-4, 1e-4] }] }",
];

/// Bodies that fill most of a box, the first two known to lubrication.
const LARGE: [&str; 4] = [
    "sphere = { diameter = 1.38e-3 }",
    "ellipsoid = { axes = [1.35e-3, 1.2e-3, 1e-3] }",
    "cuboid = { edges = [1e-3, 8e-4, 4e-4] }",
    "cylinder = { diameter = 9e-4, length = 9e-4 }",
];

/// Those that lubrication knows, the last ones beside the first three.
const LUBRICATED: [&str; 6] = [SHAPES[0], SHAPES[3], SHAPES[7], SHAPES[1], SHAPES[2], SHAPES[6]];

/// Those without edges, which have a radius to roll on.
const ROUND: [&str; 5] = [SHAPES[0], SHAPES[3], SHAPES[5], SHAPES[7], SHAPES[10]];

const MOTIONS: [&str; 4] = [
    "motion = \"fixed\"\n",
    "motion = { velocity = [0.02, -0.01, 0.0], angular_velocity = [0, 40, 0], free = [\"z\"] }\n",
    "motion = { velocity = { oscillation = { amplitude = [0, 0.03, 0.01], frequency = 120, phase = 30 } } }\n",
    "motion = { velocity = { table = [[0, 0, 0, 0.02], [0.004, 0.03, 0, 0]] }, free = [\"y\", \"rotation\"] }\n",
];

/// Velocities of a wall, and accelerations of the fluid.
const WALLS: [&str; 3] = [
    "[0.01, -0.02, 0.0]",
    "{ oscillation = { amplitude = [0.02, 0, 0], frequency = 150, mean = [0, 0.01, 0] } }",
    "{ table = [[0, 0, 0.02, 0], [0.003, 0.01, 0, 0]] }",
];
const DRIVES: [&str; 5] = [
    "",
    "",
    "body_acceleration = { oscillation = { amplitude = [3, 0, 1], frequency = 100, phase = 40 } }\n",
    "body_acceleration = { table = [[0, 0, 2, 0], [0.004, -1, 0, 0]] }\n",
    "net_flux = [0.002, 0, 0]\n",
];
/// Adhesion of spheres.
const SPHERICAL: [&str; 2] = [
    "cohesion = \"jkr\"\nwork_of_adhesion = 1e-4\n",
    "van_der_waals = { hamaker_constant = 1e-14, smallest_gap = 2e-6, cut_off = 5e-5 }\n",
];
/// Keys of free particles.
const PUSHES: [&str; 3] =
    ["", "force = [1e-7, 0, -2e-7]\n", "torque = [0, 1e-11, 0]\ngranular_temperature = 1e-5\n"];

/// The words that the schema of cases allows for a type: those of a new law are drawn without a change here.
fn words(of: &str) -> &'static [String] {
    static ALL: OnceLock<BTreeMap<&str, Vec<String>>> = OnceLock::new();
    let all = ALL.get_or_init(|| {
        let schema: Value = serde_json::from_str(&case::schema()).unwrap();
        let read = |of: &'static str| {
            let words =
                schema["$defs"][of]["oneOf"].as_array().unwrap_or_else(|| panic!("the schema has {of}"));
            (of, words.iter().map(|word| word["const"].as_str().unwrap().to_owned()).collect())
        };
        ["ElasticLaw", "DampingLaw", "FrictionLaw", "RollingLaw", "TwistingLaw", "GeometryKind"]
            .map(read)
            .into()
    });
    &all[of]
}

/// A random case, in words; some are none, as their particles do not fit.
fn draw(random: &mut ChaCha8Rng) -> String {
    let size: [f64; 3] = std::array::from_fn(|_| 1e-4 * f64::from(random.random_range(14..31_u8)));
    let (contained, dry) = (random.random_bool(0.15), random.random_bool(0.2));
    let periodic: [bool; 3] = std::array::from_fn(|_| !contained && random.random_bool(0.7));
    let mut text = format!("[domain]\nsize = {size:?}\nperiodic = {periodic:?}\n");
    if !periodic[2] && random.random_bool(0.5) {
        let velocity = WALLS.choose(random).unwrap();
        writeln!(text, "faces = {{ \"z-\" = {{ velocity = {velocity} }} }}").unwrap();
    }
    let precision = ["f16", "f32", "f64"].choose(random).unwrap();
    let tau = random.random_range(0.53..0.8);
    let operator = SolidOperator::ALL.choose(random).unwrap().name();
    let saturated = format!("\"saturated\"\nsolid_operator = \"{operator}\"");
    let coupling = if random.random_bool(0.3) { "\"paper\"" } else { &saturated };
    let eddies = "\"recursive_regularised\"\nsmagorinsky = 0.15";
    let operators = ["\"bgk\"", "\"trt\"", "\"recursive_regularised\"", eddies];
    let collision = operators[..if coupling == "\"paper\"" { 2 } else { 4 }].choose(random).unwrap();
    if dry {
        text += "[dry]\nimpact_speed = 0.3\n";
    } else {
        write!(
            text,
            "[fluid]\ndensity = 1000.0\nviscosity = 2e-6\nprecision = \"{precision}\"\n\
             [lattice]\ncells_per_diameter = 5\nrelaxation_time = {tau}\ncollision = {collision}\n\
             coupling = {coupling}\n"
        )
        .unwrap();
    }
    let lubricated = !dry && random.random_bool(0.25);
    let round = !lubricated && random.random_bool(0.4);
    if random.random_bool(0.3) {
        // A rod that turns, anywhere between the cells, in the middle.
        let [y, z] = [1, 2].map(|a| 0.5 * size[a] + random.random_range(-5e-5..5e-5));
        let (diameter, rate) = (random.random_range(2e-4..4e-4), random.random_range(-20.0..20.0));
        let steady = format!("[{rate}, 0, 0]");
        let varying = format!("{{ oscillation = {{ amplitude = {steady}, frequency = 150 }} }}");
        let rate = [steady, varying].into_iter().choose(random).unwrap();
        write!(
            text,
            "[[walls]]\nname = \"rod\"\nrod = {{ point = [0, {y}, {z}], axis = [1, 0, 0], diameter = {diameter} }}\n\
             angular_velocity = {rate}\n"
        )
        .unwrap();
    }
    if contained || random.random_bool(0.3) {
        text += &mesh_wall(size, contained, random);
    }
    for section in 0..random.random_range(1..4_u8) {
        let known = if section == 0 { &LUBRICATED[..3] } else { &LUBRICATED };
        let any = if round { &ROUND[..] } else { &SHAPES };
        let shape = if lubricated { known.choose(random) } else { any.choose(random) }.unwrap();
        let (density, count) = (random.random_range(500.0..5000.0), random.random_range(1..12_u8));
        let seed = random.random_range(0..1000_u32);
        write!(
            text,
            "[[particles]]\nshape = {{ {shape} }}\ndensity = {density}\ncount = {count}\nseed = {seed}\n"
        )
        .unwrap();
        if random.random_bool(0.3) {
            text += MOTIONS.choose(random).unwrap();
        } else {
            text += PUSHES.choose(random).unwrap();
        }
    }
    if random.random_bool(0.25) {
        let shape = LARGE[..if lubricated || round { 2 } else { 4 }].choose(random).unwrap();
        let place: [f64; 3] = std::array::from_fn(|_| random.random_range(0.0..1.4e-3));
        writeln!(text, "[[particles]]\nshape = {{ {shape} }}\ndensity = 2000\nlist = [{place:?}]").unwrap();
    }
    if !round && random.random_bool(0.1) {
        let axis = random.random_range(0..3_usize);
        let (length, name) = (size[axis], ["x", "y", "z"][axis]);
        let side = format!("cuboid = {{ edges = [5e-4, 4e-4, {length}] }}");
        let round = format!("cylinder = {{ diameter = 5e-4, length = {length} }}");
        let shape = if lubricated || random.random_bool(0.5) { side } else { round };
        writeln!(
            text,
            "[[particles]]\nshape = {{ {shape} }}\nthrough = \"{name}\"\ndensity = 2000\nlist = [[3.5e-4, 3.5e-4, 3.5e-4], [1.05e-3, 1.05e-3, 1.05e-3]]"
        )
        .unwrap();
        // Some move freely.
        if random.random_bool(0.5) {
            text += "motion = { velocity = [0.01, -0.02, 0.03] }\n";
        }
    }
    let drive = if dry { "" } else { DRIVES.choose(random).unwrap() };
    let substeps = random.random_range(1..4_u8);
    let gravity: [f64; 3] = std::array::from_fn(|_| random.random_range(-8.0..8.0));
    let balance = ["mixture", "fluid_only"].choose(random).unwrap();
    let balance = if dry { String::new() } else { format!("force_balance = \"{balance}\"\n") };
    let mut contact =
        if lubricated { "lubrication = { roughness = 1e-6 }\n".to_string() } else { String::new() };
    for (key, of) in [
        ("law", "ElasticLaw"),
        ("damping", "DampingLaw"),
        ("friction", "FrictionLaw"),
        ("rolling", "RollingLaw"),
        ("twisting", "TwistingLaw"),
        ("geometry", "GeometryKind"),
    ] {
        // Lubrication knows closed forms only.
        let known = |word: &&String| match key {
            "geometry" => !lubricated || *word != "sampled",
            "rolling" => round || *word == "none",
            _ => true,
        };
        let word = words(of).iter().filter(known).choose(random).unwrap();
        writeln!(contact, "{key} = \"{word}\"").unwrap();
    }
    if contact.contains("sampled") {
        contact += "samples = 4\n";
    }
    if round {
        contact += "rolling_friction = 0.2\n";
    }
    if round && random.random_bool(0.3) {
        contact += "cohesion = \"dmt\"\nwork_of_adhesion = 1e-5\n";
    } else if substeps == 2 {
        contact += "cohesion = \"sjkr\"\ncohesion_density = 50\n";
    } else if text.matches("shape = {").count() == text.matches("shape = { sphere").count()
        && !text.contains("composite")
    {
        // Of spheres with Hertz's force alone.
        let law = contact.lines().find(|line| line.starts_with("law")).unwrap().to_owned();
        contact = contact.replace(&law, "law = \"hertz\"");
        contact += SPHERICAL[usize::from(substeps == 3)];
    }
    write!(
        text,
        "[contact]\nsubsteps = {substeps}\n{contact}[driving]\ngravity = {gravity:?}\n{balance}{drive}\
         [run]\nend = {{ steps = {STEPS} }}\n"
    )
    .unwrap();
    text
}

/// A wall from a mesh in a box of this size: an octahedron, at rest or turning, a bent sheet, or a container, which may turn.
fn mesh_wall(size: [f64; 3], contained: bool, random: &mut ChaCha8Rng) -> String {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("octahedron.obj"), octahedron(3)).unwrap();
        let sheet = "v -4 -3 0\nv 0 -3 1\nv 4 -3 0\nv -4 3 0\nv 0 3 1\nv 4 3 0\nf 1 2 5 4\nf 2 3 6 5\n";
        std::fs::write(folder.path().join("sheet.obj"), sheet).unwrap();
        folder
    });
    let kind = if contained { 3 } else { random.random_range(0..3_u8) };
    let (file, side) = if kind == 2 { ("sheet.obj", "both") } else { ("octahedron.obj", "outside") };
    // The container cuts the corners of the box off.
    let (side, unit) = if kind == 3 { ("inside", 1e-3) } else { (side, 1e-4) };
    let position = size.map(|length| length * if kind == 3 { 0.5 } else { random.random_range(0.3..0.7) });
    let (file, angle) = (folder.path().join(file), random.random_range(0.0..90.0));
    let turns = kind == 1 || contained && random.random_bool(0.5);
    let rate = if turns { random.random_range(-20.0..20.0) } else { 0.0 };
    format!(
        "[[walls]]\nname = \"mesh\"\nangular_velocity = [0, {rate}, 0]\nmesh = {{ file = \"{}\", unit = {unit:e}, \
         position = {position:?}, orientation = {{ axis = [1, 2, 3], angle = {angle} }}, side = \"{side}\" }}\n",
        file.display()
    )
}

/// The case with random velocities, or nothing if it is none.
fn setup(text: &str, random: &mut ChaCha8Rng) -> Option<Setup> {
    let mut setup = match case::from_text(text, "fuzz", &[]) {
        Ok(setup) => setup,
        Err(error) => {
            let why = error.to_string();
            assert!(!why.contains("unknown") && !why.contains("expected"), "{why}\n{text}");
            return None;
        }
    };
    let speed = 0.04 * setup.units().velocity();
    for particle in &mut setup.particles {
        particle.velocity = std::array::from_fn(|_| random.random_range(-speed..speed));
        particle.angular_velocity = std::array::from_fn(|_| random.random_range(-100.0..100.0));
    }
    Some(setup)
}

/// The box cut for at most `wanted` ranks, evenly or anyhow.
fn cut(setup: &Setup, wanted: usize, random: &mut ChaCha8Rng) -> Decomposition {
    let ranks = Decomposition::max_ranks(setup.domain, wanted);
    let even = Decomposition::new(setup.domain, ranks).unwrap();
    if random.random_bool(0.4) {
        return even;
    }
    // A block has at least four cells in each direction; the rest goes anywhere.
    let cuts = std::array::from_fn(|a| {
        let (cells, blocks) = (setup.domain.cells[a], even.grid[a]);
        let mut more: Vec<usize> = (1..blocks).map(|_| random.random_range(0..=cells - 4 * blocks)).collect();
        more.sort_unstable();
        let inner = more.iter().zip(1..).map(|(more, block)| more + 4 * block);
        std::iter::once(0).chain(inner).chain([cells]).collect()
    });
    Decomposition::with_cuts(setup.domain, cuts)
}

/// Result of a run on some ranks: the hash of its state and the number of contacts begun, or what ended it and when; where
/// is told by the first rank that has found it.
fn outcome(setup: &Setup, cut: &Decomposition) -> String {
    let ends = on_threads(cut.ranks(), |comm| {
        let mut simulation = Simulation::new(setup, cut, comm).map_err(|error| error.to_string())?;
        for _ in 0..STEPS {
            simulation.step().map_err(|error| error.to_string())?;
        }
        simulation.check().map_err(|error| error.to_string())?;
        let mut begun = [simulation.dem().contacts().begun as i64];
        simulation.comm().sum(&mut begun);
        Ok::<_, String>(format!("{:016x}, {} contacts", simulation.state_hash(), begun[0]))
    });
    assert!(ends.iter().all(|end| *end == ends[0]), "ranks agree: {ends:?}");
    ends[0].clone().unwrap_or_else(|error| {
        let what = error.split(':').next().unwrap_or_default();
        what.to_string()
    })
}

#[test]
fn the_cases_that_are_drawn_have_every_shape_law_and_operator() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let texts: String = (0..200).map(|_| draw(&mut random)).collect();
    let laws = ["ElasticLaw", "DampingLaw", "FrictionLaw", "RollingLaw", "TwistingLaw", "GeometryKind"];
    let laws = laws.into_iter().flat_map(words).map(String::as_str);
    let operators = SolidOperator::ALL.iter().map(|operator| operator.name());
    let quoted = laws.chain(operators).map(|word| format!("\"{word}\""));
    for word in quoted
        .chain(["[dry]", "\"sjkr\"", "\"dmt\"", "\"inside\"", "\"outside\"", "\"both\""].map(str::to_owned))
        .chain(SPHERICAL.map(str::to_owned))
        .chain(SHAPES.into_iter().chain(LARGE).map(str::to_owned))
    {
        assert!(texts.contains(&word), "{word} was never drawn");
    }
}

#[test]
fn two_hundred_random_cases_have_the_same_bits_on_one_and_on_two_to_eight_ranks() {
    let mut random = ChaCha8Rng::seed_from_u64(2024);
    let (mut done, mut refused, mut failed, mut contacts) = (0, 0, 0, 0);
    while done < CASES {
        let text = draw(&mut random);
        let Some(setup) = setup(&text, &mut random) else {
            refused += 1;
            assert!(refused < 10 * CASES, "most cases are cases");
            continue;
        };
        let wanted = random.random_range(2..9);
        let cut = cut(&setup, wanted, &mut random);
        let expected = outcome(&setup, &Decomposition::new(setup.domain, 1).unwrap());
        let found = outcome(&setup, &cut);
        assert_eq!(found, expected, "case {done} cut at {:?}:\n{text}", cut.cuts);
        failed += u32::from(!expected.ends_with("contacts"));
        contacts += u32::from(!expected.ends_with(" 0 contacts"));
        done += 1;
    }
    assert!(failed < CASES / 10, "{failed} of the cases ended early");
    assert!(contacts > CASES / 4, "only {contacts} of the cases have contacts");
}
