//! Cohesion that a case cannot have.

use super::all_refused_of;
use crate::common::case::{SPHERE, SPHERES, changed};
use crate::common::{Place, has};

/// [`SPHERES`] with these keys of `[contact]`, from line 20 on.
fn with(keys: &str) -> String {
    changed(SPHERES, &[("[run]", &format!("[contact]\n{keys}\n[run]"))])
}

fn refused(keys: &str, words: &[&str]) {
    let place = Place::new(&with(keys));
    place.refused(&["check", "case.toml"], words);
}

#[test]
fn cohesion_without_its_parameter_or_with_an_impossible_one_is_refused() {
    for (law, name, unit) in [
        ("dmt", "work_of_adhesion", "J/m2"),
        ("sjkr", "cohesion_density", "J/m3"),
        ("jkr", "work_of_adhesion", "J/m2"),
    ] {
        let hertz = if law == "jkr" { "\nlaw = \"hertz\"" } else { "" };
        let is = format!("`contact.cohesion` is \"{law}\", but the case gives no `{name}`");
        refused(
            &format!("cohesion = \"{law}\""),
            &["case.toml:20:12", &is, &format!("give contact.{name} in {unit}")],
        );
        for (value, shown) in [("-0.05", "-0.05"), ("inf", "inf"), ("nan", "NaN")] {
            let is = format!("`contact.{name}` is {shown}");
            let line = format!("case.toml:21:{}", name.len() + 4);
            refused(
                &format!("cohesion = \"{law}\"\n{name} = {value}"),
                &[&line, &is, "must be a finite number of at least 0", unit],
            );
            let is = format!("`contact.pairs.0.{name}` is {shown}");
            let pair = format!("pairs = [{{ materials = [\"default\", \"default\"], {name} = {value} }}]");
            refused(
                &format!("cohesion = \"{law}\"\n{pair}"),
                &["case.toml:21:", &is, "must be a finite number of at least 0"],
            );
        }
        // None between all of them, as a run that others are compared with has it; or that of one pair alone.
        let pair = format!("pairs = [{{ materials = [\"default\", \"default\"], {name} = 1e-5 }}]");
        for keys in [format!("{name} = 0"), pair] {
            Place::new(&with(&format!("cohesion = \"{law}\"\n{keys}{hertz}"))).well(&["check", "case.toml"]);
        }
    }
    refused("cohesion = \"kr\"", &["case.toml:20:12", "unknown choice `kr`", "none, dmt, sjkr, jkr"]);
}

#[test]
fn a_parameter_that_the_law_of_cohesion_does_not_read_is_refused() {
    let other = |law: &str, name: &str, reader: &str| {
        let pair = format!("pairs = [{{ materials = [\"default\", \"default\"], {name} = 1e-3 }}]");
        for (keys, key) in [(format!("{name} = 1e-3"), "contact."), (pair, "contact.pairs.0.")] {
            let given = format!("`{key}{name}` is given, but the contact law of the case reads no `{name}`");
            let remedy = format!("`{name}` with contact.cohesion = \"{reader}\"");
            refused(&format!("{law}{keys}"), &["case.toml:2", &given, "has no effect", "remove it", &remedy]);
        }
    };
    other("", "work_of_adhesion", "dmt");
    other("", "cohesion_density", "sjkr");
    other("cohesion = \"none\"\n", "work_of_adhesion", "dmt");
    other("cohesion = \"sjkr\"\ncohesion_density = 1.0\n", "work_of_adhesion", "dmt");
    other("cohesion = \"dmt\"\nwork_of_adhesion = 1e-5\n", "cohesion_density", "sjkr");
}

/// The number behind a key in the remedy of a message.
fn remedy(text: &str, key: &str) -> String {
    let (_, rest) = text.split_once(&format!("take {key} = ")).unwrap_or_else(|| panic!("{text}"));
    rest.split(' ').next().unwrap().to_owned()
}

#[test]
fn cohesion_that_presses_bodies_deeper_into_each_other_than_a_run_allows_is_refused_and_its_remedy_is_not() {
    for (law, name, value) in [
        ("dmt", "work_of_adhesion", "20"),
        ("sjkr", "cohesion_density", "2e7"),
        ("jkr", "work_of_adhesion", "20"),
    ] {
        let hertz = if law == "jkr" { "\nlaw = \"hertz\"" } else { "" };
        let place = Place::new(&with(&format!("cohesion = \"{law}\"\n{name} = {value}{hertz}")));
        let number: f64 = value.parse().unwrap();
        let is = format!("`contact.{name}` is {number} J/m");
        let words =
            ["case.toml:21:", &is, "`particles.0`", "deep into another body", "too strong", "Young's moduli"];
        place.refused(&["check", "case.toml"], &words);
        let said = place.output(&["check", "case.toml"]);
        let said = String::from_utf8_lossy(&said.stderr).replace('\n', " ");
        let least = remedy(&said, name);
        let option = format!("contact.{name}={least}");
        place.well(&["check", "case.toml", "--set", &option]);
        // The other remedy is as good.
        let (before, _) = said.split_once(" times as large").unwrap();
        let stiffer: f64 = before.rsplit(' ').next().unwrap().parse().unwrap();
        let option = format!("contact.youngs_modulus={:e}", 5e3 * stiffer);
        place.well(&["check", "case.toml", "--set", &option]);
    }
    // A wall is flatter than a sphere.
    let closed = SPHERES.replace("size = {", "periodic = [true, true, false]\nsize = {");
    let contact = "[contact]\ncohesion = \"dmt\"\nwork_of_adhesion = 0.18\n[run]";
    let place = Place::new(&changed(&closed, &[("[run]", contact)]));
    place.refused(&["check", "case.toml"], &["`contact.work_of_adhesion` is 0.18", "deep into a wall"]);
}

#[test]
fn cohesion_of_bodies_and_engines_that_lack_the_law_is_refused() {
    let dmt = with("cohesion = \"dmt\"\nwork_of_adhesion = 1e-5");
    let round = "`contact.cohesion` \"dmt\" is the cohesion of round bodies, but `particles.0.shape` is a";
    all_refused_of(
        &dmt,
        &[
            (
                SPHERE,
                "{ cube = { edge = 1e-3 } }",
                &["bad.toml:14:", round, "work_of_adhesion = 0", "take \"sjkr\""],
            ),
            (
                "[run]",
                "[dem]\nengine = \"liggghts\"\n[run]",
                &[
                    "bad.toml:20:12",
                    "`contact.cohesion` is \"dmt\", which LIGGGHTS",
                    "\"sjkr\"",
                    "\"native\"",
                ],
            ),
            (
                "[run]",
                "[dem]\nengine = { command = [\"true\"] }\n[run]",
                &[
                    "bad.toml:20:12",
                    "`contact.cohesion` is \"dmt\", of which a program",
                    "dem.engine = \"native\"",
                ],
            ),
        ],
    );
    let sjkr = with("cohesion = \"sjkr\"\ncohesion_density = 1.0");
    all_refused_of(
        &sjkr,
        &[(
            "[run]",
            "[dem]\nengine = { command = [\"true\"] }\n[run]",
            &["bad.toml:20:12", "`contact.cohesion` is \"sjkr\", of which a program"],
        )],
    );
    for good in [
        changed(&sjkr, &[(SPHERE, "{ cube = { edge = 1e-3 } }")]),
        changed(&sjkr, &[("[run]", "[dem]\nengine = \"liggghts\"\n[run]")]),
        changed(&dmt, &[(SPHERE, "{ ellipsoid = { axes = [1e-3, 1.5e-3, 2e-3] } }")]),
    ] {
        let said = Place::new(&good).well(&["check", "case.toml"]);
        has(&said, &["and cohesion"]);
    }
}

#[test]
fn a_program_that_a_cross_check_starts_refuses_the_cohesion_that_it_lacks() {
    let place = Place::new(&with("cohesion = \"sjkr\"\ncohesion_density = 1.0"));
    let said = place.ends(2, &["crosscheck", "case.toml", "--engine", "python", "--out", "out"]);
    has(&said, &["this engine has no contact.cohesion"]);
}

#[test]
fn necks_of_bodies_laws_and_engines_that_lack_them_are_refused() {
    let jkr = with("cohesion = \"jkr\"\nwork_of_adhesion = 1e-5\nlaw = \"hertz\"");
    all_refused_of(
        &jkr,
        &[
            (
                SPHERE,
                "{ ellipsoid = { axes = [1e-3, 1.5e-3, 2e-3] } }",
                &[
                    "bad.toml:14:",
                    "`contact.cohesion` \"jkr\" is the cohesion of spheres, but `particles.0.shape` is a",
                    "work_of_adhesion = 0",
                    "take \"dmt\"",
                ],
            ),
            (
                "law = \"hertz\"",
                "law = \"overlap_energy\"",
                &[
                    "bad.toml:22:7",
                    "`contact.law` is \"overlap_energy\", but",
                    "\"jkr\"",
                    "take contact.law = \"hertz\"",
                ],
            ),
            (
                "law = \"hertz\"",
                "",
                &[
                    "bad.toml:20:12",
                    "`contact.law` is \"overlap_volume\", but",
                    "take contact.law = \"hertz\"",
                ],
            ),
            (
                "[run]",
                "[dem]\nengine = \"liggghts\"\n[run]",
                &["bad.toml:20:12", "`contact.cohesion` is \"jkr\", which LIGGGHTS", "\"native\""],
            ),
            (
                "[run]",
                "[dem]\nengine = { command = [\"true\"] }\n[run]",
                &["bad.toml:20:12", "`contact.cohesion` is \"jkr\", of which a program"],
            ),
        ],
    );
    has(&Place::new(&jkr).well(&["check", "case.toml"]), &["and cohesion"]);
}

#[test]
fn van_der_waals_forces_that_a_case_cannot_have_are_refused() {
    let force = "van_der_waals = { hamaker_constant = 1e-15, smallest_gap = 1e-6, cut_off = 1e-4 }";
    let case = with(force);
    let is = "`contact.van_der_waals`";
    all_refused_of(
        &case,
        &[
            (
                SPHERE,
                "{ ellipsoid = { axes = [1e-3, 1.5e-3, 2e-3] } }",
                &["bad.toml:14:", is, "is a force of spheres, but `particles.0.shape` is a", "\"dmt\""],
            ),
            (
                "cut_off = 1e-4",
                "cut_off = 1e-6",
                &["bad.toml:20:", "`contact.van_der_waals.cut_off` is 1e-6 m, not above", "1.0e-5 m"],
            ),
            (
                "van_der_waals",
                "cohesion = \"jkr\"\nwork_of_adhesion = 1e-5\nlaw = \"hertz\"\nvan_der_waals",
                &["bad.toml:20:12", "`contact.cohesion` is \"jkr\", but", is, "count twice"],
            ),
            (
                "hamaker_constant = 1e-15",
                "hamaker_constant = 0",
                &["`contact.van_der_waals.hamaker_constant` is 0", "above 0"],
            ),
            ("hamaker_constant = 1e-15, ", "", &["bad.toml:20:", "hamaker_constant"]),
            (
                "hamaker_constant = 1e-15",
                "hamaker_constant = 1e-9",
                &["`contact.van_der_waals.hamaker_constant` is 1e-9 J, which alone presses", "or less"],
            ),
            ("van_der_waals", "enabled = false\nvan_der_waals", &[is, "needs contacts, which are off"]),
            (
                "[run]",
                "[dem]\nengine = \"liggghts\"\n[run]",
                &["bad.toml:20:", is, "which LIGGGHTS", "remove it", "\"native\""],
            ),
            (
                "[run]",
                "[dem]\nengine = { command = [\"true\"] }\n[run]",
                &["bad.toml:20:", is, "of which a program"],
            ),
        ],
    );
    let said = Place::new(&case).well(&["check", "case.toml"]);
    has(&said, &["and cohesion", "pull-off force", "van der Waals"]);
}
