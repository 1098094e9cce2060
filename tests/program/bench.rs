//! `turbid bench --compare`.

use crate::common::case::SPHERES;
use crate::common::{Place, has};
use serde_json::{Value, json};

const BENCH: [&str; 6] = ["bench", "case.toml", "--steps", "2", "--threads", "1"];

#[test]
fn ratios_are_compared_with_those_of_an_earlier_benchmark() {
    let place = Place::new(SPHERES);
    let output = place.output(&[&BENCH[..], &["--json"]].concat());
    let mut found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let compare = [&BENCH[..], &["--compare", "a.json", "--tolerance", "0.9"]].concat();
    place.write("a.json", found.to_string());
    has(&place.well(&compare), &["compared with a.json", "four-way over fluid only", "reported"]);
    found["four_way_over_fluid_only"] = json!(1000.0);
    place.write("a.json", found.to_string());
    has(&place.ends(3, &compare), &["1000.0", "FAIL"]);
    found["conditions"]["cells"] = json!(7);
    place.write("a.json", found.to_string());
    place.refused(
        &compare,
        &["a.json: another benchmark: `conditions.cells` is 7 there and 32768 here", "--json"],
    );
    place.refused(
        &[&BENCH[..], &["--compare", "case.toml"]].concat(),
        &["case.toml: no result of `turbid bench"],
    );
    place.refused(&[&BENCH[..], &["--compare", "b.json"]].concat(), &["cannot read b.json"]);
}
