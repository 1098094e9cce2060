//! `turbid check`.

use super::terminal::{say, table, warn};
use super::{CheckArguments, costs, load, preflight};
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
        let factors = arguments.costs.as_deref().map(costs::read).transpose()?;
        let forecast = simulation::forecast(&setup, ranks as usize, factors.unwrap_or_default())?;
        say(&preflight::ranks::text(&setup, &forecast));
    }
    Ok(())
}
