//! Claims about pages.

use super::*;
use turbid::output::picture::Format::{Png, Svg};
use turbid::output::{SeriesRow, SeriesWriter, Summary};
use turbid_lab::checks::Check;
use turbid_lab::study::document::{self, Document, Runs, Table};
use turbid_plot::{Chart, Panel, Point, Series, Style};

/// The table of a run that accelerates.
fn write_series(directory: &Path) {
    fs::create_dir_all(directory).unwrap();
    let mut series = SeriesWriter::create(&directory.join("series.csv"), &[], &[], &[], &[]).unwrap();
    for step in 0..50 {
        let t_star = 0.1 * step as f64;
        let row = SeriesRow {
            step,
            time: 1e-3 * t_star,
            t_star,
            settling_velocity: 1.0 - (-t_star).exp(),
            kinetic_energy_fluid: 1e-6 * t_star,
            max_overlap: 0.01,
            ..SeriesRow::default()
        };
        series.write(&[row]).unwrap();
    }
}

fn write_study(directory: &Path, title: &str) {
    fs::create_dir_all(directory).unwrap();
    let check = |quantity: &str, pass| Check {
        pass,
        ..Check::new(quantity, 0.21, 0.2, 0.02, "Marquardt et al. (2024)")
    };
    let series = Series {
        label: "spheres".into(),
        style: Style::Measured,
        points: vec![Point { x: 0.1, y: 0.2, error: Some(0.01) }],
    };
    let figure = document::Figure {
        name: "velocity/phi".into(),
        chart: Chart {
            title: "Velocity".into(),
            panels: vec![Panel { series: vec![series], ..Panel::default() }],
            note: "Two seeds.".into(),
            ..Chart::default()
        },
    };
    let table = Table {
        name: "table".into(),
        title: "Table 1".into(),
        columns: vec!["Ar".into(), "a | b".into()],
        rows: vec![vec!["500".into(), "0.3".into()], vec!["1000".into()]],
        ..Table::default()
    };
    let document = Document {
        title: title.into(),
        version: "0.1.0".into(),
        command: "turbid study study.toml".into(),
        figures: vec![figure],
        tables: vec![table],
        checks: vec![check("u / u_Stokes", true), check("scatter", false)],
        runs: Runs { done: 3, total: 4, seconds_spent: 30.0, seconds_left: 10.0 },
        unsettled: vec!["phi0.3-seed1".into()],
    };
    document.write(directory).unwrap();
}

/// The page, after a look whether every file that it links to is there.
fn page(done: &Report) -> String {
    let text = fs::read_to_string(&done.page).unwrap();
    let mut links = 0;
    for rest in text.split("](").skip(1) {
        let file = done.page.with_file_name(rest.split(')').next().unwrap());
        assert!(fs::metadata(&file).unwrap().len() > 500, "{}", file.display());
        links += 1;
    }
    assert!(links >= done.figures);
    text
}

#[test]
fn a_run_without_a_summary_is_drawn_from_its_series_and_what_never_moves_is_left_out() {
    let place = tempfile::tempdir().unwrap();
    write_series(place.path());
    let done = report(place.path(), place.path(), &[Svg, Png]).unwrap();
    assert_eq!(done.checks, [0, 0]);
    let text = page(&done);
    assert!(text.contains("no summary"));
    let shown: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("### ")).collect();
    assert_eq!(shown, ["Settling velocity", "Kinetic energy", "Largest overlap over the diameter"]);
    assert!(place.path().join("figures/kinetic_energy.svg").is_file());
    assert!(place.path().join("figures/kinetic_energy.png").is_file());
}

#[test]
fn a_study_has_its_checks_figures_and_tables_on_its_page() {
    let place = tempfile::tempdir().unwrap();
    write_study(place.path(), "A study");
    let rows = format!("run,phi\n{}", "a,0.1\n".repeat(100));
    fs::write(place.path().join("result.csv"), &rows).unwrap();
    let out = place.path().join("pages");
    let done = report(place.path(), &out, &[Svg]).unwrap();
    assert_eq!((done.figures, done.checks), (1, [1, 2]));
    let text = page(&done);
    for part in [
        "# A study\n",
        "3 of 4 runs done in 30 s, about 10 s left",
        "turbid study study.toml",
        "1 of 2 checks passed.",
        "`run.average_from`: phi0.3-seed1.",
        "| u / u_Stokes | 0.21000 | 0.20000 | +5.00 % | 10 % | ok | Marquardt et al. (2024) |",
        "**FAIL**",
        "![Velocity](figures/velocity_phi.svg)",
        "Two seeds.",
        "| Ar | a \\| b |",
        "| 1000 |  |",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let html = fs::read_to_string(&done.html).unwrap();
    for part in [
        "<h1>A study</h1>",
        "<td>u / u_Stokes</td>",
        "<strong>FAIL</strong>",
        "./figures/velocity_phi.svg",
        "data-filters",
    ] {
        assert!(html.contains(part), "{part}\n{html}");
    }
    for loads in ["src=\"http", "href=\"http", "url(", "@import", "fetch("] {
        assert!(!html.contains(loads), "{loads}");
    }
    let files: Vec<_> = fs::read_dir(out.join(FIGURES)).unwrap().collect();
    assert_eq!(files.len(), 1, "only the format that was asked for");
    let name = format!("{}.csv", place.path().file_name().unwrap().to_str().unwrap());
    assert!(text.contains(&format!("All runs: [{name}]({name}).")), "{text}");
    assert_eq!(fs::read_to_string(out.join(name)).unwrap(), rows);
}

#[test]
fn a_directory_of_several_becomes_one_page_whose_figures_bear_their_names() {
    let place = tempfile::tempdir().unwrap();
    write_study(&place.path().join("grid"), "Grid convergence");
    write_study(&place.path().join("box"), "Box size");
    write_series(&place.path().join("largest"));
    fs::create_dir(place.path().join("unrelated")).unwrap();
    let done = report(place.path(), place.path(), &[Png]).unwrap();
    assert_eq!(done.checks, [2, 4]);
    let text = page(&done);
    let headings: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("## ")).collect();
    assert_eq!(headings, ["Box size (`box`)", "Grid convergence (`grid`)", "largest"]);
    assert!(text.contains("| Box size | 3 of 4 | 30 s | 1 of 2 |"), "{text}");
    assert!(place.path().join("figures/box_velocity_phi.png").is_file());
    assert!(place.path().join("figures/largest_kinetic_energy.png").is_file());
}

#[test]
fn what_cannot_be_drawn_is_told_with_a_remedy() {
    let place = tempfile::tempdir().unwrap();
    let error = |place: &Path| report(place, place, &[Svg]).unwrap_err().to_string();
    assert!(error(place.path()).contains("nothing to report"));
    assert!(error(place.path()).contains("give the output directory"));
    assert!(error(&place.path().join("missing")).contains("missing"));
    fs::write(place.path().join(document::FILE), "{ \"title\": 3 }").unwrap();
    assert!(error(place.path()).contains("study.json") && error(place.path()).contains("line 1"));
    assert!(!place.path().join(FILE).exists(), "an error leaves no page");
    fs::remove_file(place.path().join(document::FILE)).unwrap();
    fs::write(place.path().join("summary.json"), "[]").unwrap();
    assert!(
        error(place.path()).contains("summary.json") && error(place.path()).contains("run the case again")
    );
}

#[test]
fn what_a_study_and_a_case_hold_stays_text_in_the_markdown_page() {
    let place = tempfile::tempdir().unwrap();
    let title = "Evil <img src=x onerror=alert(1)> [link](javascript:x)\n# Heading";
    write_study(&place.path().join("study"), title);
    let run = place.path().join("run");
    write_series(&run);
    let summary = Summary {
        case: title.to_string(),
        input: "# a case\n```\n<script>\n".to_string(),
        warnings: vec!["<b>too fast</b>".to_string(), "in a line\n```\n<i>".to_string()],
        ..Summary::default()
    };
    summary.write(&run.join("summary.json")).unwrap();
    for folder in ["study", "run"] {
        let folder = place.path().join(folder);
        let done = report(&folder, &folder, &[Svg]).unwrap();
        let text = fs::read_to_string(&done.page).unwrap();
        let head = "# Evil &lt;img src=x onerror=alert(1)&gt; \\[link\\](javascript:x) # Heading\n";
        assert!(text.starts_with(head), "{text}");
        assert!(!text.contains("<img") && !text.contains("<b>"), "{text}");
    }
    let text = fs::read_to_string(run.join(FILE)).unwrap();
    assert!(text.contains("````toml\n# a case\n```\n<script>\n````\n"), "{text}");
    assert!(
        text.contains("- &lt;b&gt;too fast&lt;/b&gt;\n\n````text\nin a line\n```\n<i>\n````\n"),
        "{text}"
    );
}

#[test]
fn results_are_not_read_through_a_link() {
    let place = tempfile::tempdir().unwrap();
    let secret = place.path().join("secret");
    fs::write(&secret, "\"a secret\"").unwrap();
    for name in ["summary.json", "series.csv", document::FILE] {
        let folder = place.path().join(name.replace('.', "_"));
        fs::create_dir(&folder).unwrap();
        std::os::unix::fs::symlink(&secret, folder.join(name)).unwrap();
        let said = report(&folder, &folder, &[Svg]).unwrap_err().to_string();
        assert!(said.contains("it is a symbolic link") && !said.contains("a secret"), "{said}");
    }
}

#[test]
fn figures_are_not_written_through_a_link() {
    let place = tempfile::tempdir().unwrap();
    let (run, other) = (place.path().join("run"), place.path().join("other"));
    write_series(&run);
    fs::create_dir(&other).unwrap();
    std::os::unix::fs::symlink(&other, run.join("figures")).unwrap();
    let said = report(&run, &run, &[Format::Svg]).unwrap_err().to_string();
    assert!(said.contains("figures is a symbolic link") && said.contains("--out"), "{said}");
    assert_eq!(fs::read_dir(&other).unwrap().count(), 0);
}
