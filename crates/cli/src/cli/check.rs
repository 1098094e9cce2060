//! `turbid check`.

use super::terminal::{say, table, warn};
use super::{CheckArguments, load, preflight};
use turbid::case;
use turbid::error::Result;
use turbid::simulation;

pub(super) fn check(arguments: &CheckArguments) -> Result<()> {
    let Some(path) = &arguments.case else {
        say(&case::schema());
        return Ok(());
    };
    let setup = load(path, &arguments.changes)?;
    say(&format!("{}\n{}", setup.provenance.name, table(&preflight::rows(&setup))));
    if let Err(missing) = turbid::engine::refuse_unusable(&setup.engine, false) {
        warn(&missing.to_string());
    }
    for advice in preflight::advice(&setup) {
        warn(&advice);
    }
    if let Some(ranks) = arguments.ranks {
        let forecast = simulation::forecast(&setup, ranks as usize)?;
        say(&preflight::ranks::text(&setup, &forecast));
    }
    Ok(())
}
