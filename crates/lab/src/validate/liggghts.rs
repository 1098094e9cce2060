//! The quick part of the cross-check of both engines: `validation/liggghts`.

use super::prelude::*;
use crate::checks::Ending;
use crate::checks::suite::{Level, run};
use crate::crosscheck::{Against, CASES};
use turbid::engine::HAS_LIGGGHTS;
use turbid::error::Error;

pub(super) const CASE: Case = Case {
    name: "liggghts",
    question: "the native engine against LIGGGHTS and theory: forces, impacts, sliding, free flight",
    source: "LIGGGHTS 3.8.0: Kloss et al. (2012), doi:10.1504/PCFD.2012.047457",
    parts: if HAS_LIGGGHTS { &[Part::quick(10.0, engines)] } else { &[] },
};

const IDS: [&str; 5] = ["static-pair", "head-on", "restitution", "sliding", "free-flight"];

/// Differences of both engines, and of each from theory.
fn engines(_: &SuiteContext, found: &mut Findings) -> Result<()> {
    for id in IDS {
        let case = CASES.iter().find(|case| case.name == id).expect("a case of the suite");
        let mut outcomes = run(&[case], Level::Quick, &Against::liggghts(), |_| {});
        let checks = match outcomes.remove(0).ending {
            Ending::Found(found) => found.checks,
            Ending::Failed(error) => return Err(error),
            Ending::Stopped | Ending::Missing(_) => return Err(Error::Interrupted),
        };
        for check in checks.into_iter().filter(|check| check.tolerance.is_finite()) {
            let quantity = format!("{id}: difference of {}", check.quantity);
            found.absolute(quantity, check.measured, 0.0, check.tolerance);
        }
    }
    Ok(())
}
