//! `turbid check`: what each rank would have to do, before a run; populations in 16 bits; and results that cannot be printed.

use crate::common::Place;

const CASE: &str = r"
[domain]
size = { diameters = [6, 6, 10] }
periodic = [true, true, false]

[fluid]
density = 1000.0
viscosity = 1e-6

[lattice]
cells_per_diameter = 8
relaxation_time = 0.55

[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
list = [
    [0.6e-3, 1e-3, 0.6e-3], [1.7e-3, 1e-3, 0.6e-3], [2.8e-3, 1e-3, 0.6e-3], [3.9e-3, 1e-3, 0.6e-3], [5e-3, 1e-3, 0.6e-3],
    [0.6e-3, 3e-3, 0.6e-3], [1.7e-3, 3e-3, 0.6e-3], [2.8e-3, 3e-3, 0.6e-3], [3.9e-3, 3e-3, 0.6e-3], [5e-3, 3e-3, 0.6e-3],
    [0.6e-3, 5e-3, 0.6e-3], [1.7e-3, 5e-3, 0.6e-3], [2.8e-3, 5e-3, 0.6e-3], [3.9e-3, 5e-3, 0.6e-3], [5e-3, 5e-3, 0.6e-3],
]

[driving]
gravity = 0

[run]
end = { steps = 1 }
";
const CELLS: usize = 48 * 48 * 80;

/// The lines about `ranks` ranks.
fn said(ranks: &str) -> Vec<String> {
    let text = Place::new(CASE).well(&["check", "case.toml", "--ranks", ranks]);
    let start = text
        .find(&format!("{ranks} ranks, blocks"))
        .unwrap_or_else(|| panic!("nothing of the ranks: {text}"));
    text[start..].lines().map(str::to_owned).collect()
}

/// The number after a name, without its unit.
fn percent(lines: &[String], name: &str) -> f64 {
    let line = lines
        .iter()
        .find(|line| line.trim().starts_with(name))
        .unwrap_or_else(|| panic!("no {name}: {lines:?}"));
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn of_populations_in_16_bits_it_is_said_where_they_are_good_enough() {
    let place = Place::new(CASE);
    for (precision, warned) in [("f16", true), ("f32", false)] {
        let set = format!("fluid.precision={precision:?}");
        let said = place.well(&["check", "case.toml", "--set", &set]);
        assert_eq!(said.contains("creeping flows are slowed"), warned, "{said}");
        assert!(said.contains(&format!("MLUPS in {precision}")), "{said}");
    }
}

#[test]
fn each_of_a_few_ranks_is_listed_with_its_cells_particles_and_neighbours() {
    for ranks in [1, 2, 5, 8] {
        let lines = said(&ranks.to_string());
        // rank, x, "x", y, "x", z, cells, covered, particles, ghosts, contacts, memory, "MB", work, "ms", sends, "kB", to ...
        let rows: Vec<Vec<String>> = lines[2..2 + ranks]
            .iter()
            .map(|line| line.split_whitespace().map(str::to_owned).collect())
            .collect();
        let column = |n: usize| -> Vec<usize> { rows.iter().map(|row| row[n].parse().unwrap()).collect() };
        assert_eq!(column(0), (0..ranks).collect::<Vec<_>>());
        assert_eq!(column(6).iter().sum::<usize>(), CELLS);
        assert_eq!(column(8).iter().sum::<usize>(), 15);
        let edges: usize = [1, 3, 5].map(|n| column(n)[0]).into_iter().product();
        assert_eq!(edges, column(6)[0]);
        for (rank, row) in rows.iter().enumerate() {
            // "1: 12.3 + 0.4, 3: ..."
            let to = row[17..].join(" ");
            let mut total = 0.0;
            for entry in to.split(", ").filter(|entry| !entry.is_empty()) {
                let (peer, bytes) = entry.split_once(": ").unwrap();
                let peer: usize = peer.parse().unwrap();
                assert!(peer < ranks && peer != rank);
                let there = rows[peer][17..].join(" ");
                assert!(there.contains(&format!("{rank}: ")), "{rank} -> {peer}: {there}");
                total += bytes.split(" + ").map(|n| n.parse::<f64>().unwrap()).sum::<f64>();
            }
            let sends: f64 = row[15].parse().unwrap();
            assert!(row[11].parse::<f64>().unwrap() > 0.0, "{row:?}");
            assert!((total - sends).abs() < 0.11 * ranks as f64, "{total} {sends}");
            assert_eq!(ranks == 1, to.is_empty());
        }
        let (balance, efficiency) = (percent(&lines, "balance"), percent(&lines, "efficiency"));
        assert!((80.0..=100.0).contains(&balance) && efficiency <= 100.0, "{lines:?}");
        assert!(efficiency <= balance);
    }
}

#[test]
fn of_many_ranks_the_least_the_mean_and_the_most_are_said() {
    let lines = said("40");
    let cells: Vec<f64> = lines
        .iter()
        .find(|line| line.trim().starts_with("cells"))
        .unwrap()
        .split_whitespace()
        .skip(1)
        .map(|number| number.parse().unwrap())
        .collect();
    let [least, mean, most, rank] = cells[..] else { panic!("{cells:?}") };
    assert!(least <= mean && mean <= most && rank < 40.0);
    assert!((mean - CELLS as f64 / 40.0).abs() < 1.0);
    assert!(lines.len() < 20, "{lines:?}");
}

#[test]
fn costs_that_a_benchmark_measures_are_those_of_the_forecast() {
    let place = Place::new(CASE);
    place.well(&["bench", "case.toml", "--steps", "8", "--threads", "2", "--calibrate", "costs.toml"]);
    let costs = place.text("costs.toml");
    for name in ["cell = ", "covered_cell = ", "particles = ", "message = ", "byte = "] {
        assert!(costs.contains(name), "{costs}");
    }
    let efficiency = |costs: &str| {
        let text = place.well(&["check", "case.toml", "--ranks", "4", "--costs", costs]);
        text.lines().find(|line| line.starts_with("  efficiency")).unwrap().to_owned()
    };
    place.write("slow.toml", "cell = 1\ncovered_cell = 1\nparticles = 1\nmessage = 50\nbyte = 1\n");
    assert!(efficiency("slow.toml").contains("with 100.00 us per message and 10.0 GB/s"));
    assert_ne!(efficiency("slow.toml"), efficiency("costs.toml"));
    place.write("odd.toml", "cell = \"fast\"\n");
    place.refused(
        &["check", "case.toml", "--ranks", "4", "--costs", "odd.toml"],
        &["odd.toml:1: ", "--calibrate odd.toml"],
    );
}

#[test]
fn too_many_ranks_are_refused_with_the_largest_number_that_fits() {
    let most = format!("use --ranks {}", 12 * 12 * 20);
    Place::new(CASE)
        .refused(&["check", "case.toml", "--ranks", "100000"], &["100000 ranks are too many", &most]);
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_printed_are_an_error_and_those_that_nobody_reads_are_none() {
    let place = Place::new(CASE);
    let verbs: [&[&str]; 9] = [
        &["check", "case.toml"],
        &["check", "--schema"],
        &["run", "case.toml"],
        &["pack", "case.toml", "--out", "positions.csv"],
        &["bench", "case.toml", "--steps", "1"],
        &["validate", "--list"],
        &["doctor"],
        &["--help"],
        &["--version"],
    ];
    for verb in verbs {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = place.limited(verb).stdout(full).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{verb:?}: {said}");
        let words = "error: cannot write to standard output: No space left";
        assert_eq!(said.matches(words).count(), 1, "{verb:?}: {said}");
    }
    assert!(place.path("out/case/summary.json").exists(), "the run itself went well");
    for verb in [verbs[0], verbs[7]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = place.limited(verb).stdout(writer).output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }
}
