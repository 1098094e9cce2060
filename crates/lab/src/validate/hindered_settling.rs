//! One point of the study of hindered settling, with both force balances: `validation/hindered_settling`.

use super::prelude::*;
use turbid::coupling::CONTROL_INTERVAL;
use turbid::output::estimate_settling;

const TEXT: &str = include_str!("../../../../validation/hindered_settling/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/hindered_settling/reference.csv");

pub(super) const CASE: Case = Case {
    name: "hindered_settling",
    question: "settling velocity of a suspension, volume fraction 0.2, Archimedes number 1000, both force balances",
    source: "Marquardt, Hafen and Krause (2024), doi:10.1016/j.cpc.2024.109321, Table 1",
    parts: &[
        Part::wide(38.0, |context, found| settle(context, found, "fluid_only")),
        Part::wide(38.0, |context, found| settle(context, found, "mixture")),
    ],
};

const PHI: f64 = 0.2;
const TOLERANCE: f64 = 0.15;
/// Averages are taken from here on, to the end of the run (Stokes times).
const FROM: f64 = 40.0;
const TO: f64 = 100.0;

fn settle(context: &SuiteContext, found: &mut Findings, balance: &str) -> Result<()> {
    let own = [
        "domain.size={ diameters = [6, 6, 6] }".to_string(),
        format!("particles.0.volume_fraction={PHI}"),
        format!("driving.force_balance={balance:?}"),
        format!("run.end.stokes_times={TO:?}"),
        format!("run.average_from.stokes_times={FROM:?}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let watch = Watch { context, setup: &setup, threads: context.threads, every: 2 * CONTROL_INTERVAL };
    let count = setup.particles.len() as f64;
    let scales = &setup.expect_fluid().scales;
    let interval = 2.0 * CONTROL_INTERVAL as f64 * setup.time_step / scales.stokes_time;
    let course: Vec<[f64; 2]> = watch.rows(|run, rows: &mut Vec<_>| {
        let time = run.steps_done()? as f64 * setup.time_step / scales.stokes_time;
        let sum: f64 = run.particles()?.iter().map(|p| p.velocity().z).sum();
        let mixture = run.on_root(|run| Ok(run.mean_flow().velocity.z))?;
        rows.push([time, (mixture - sum / count) / scales.stokes_velocity]);
        Ok(false)
    })?;
    let steady: Vec<f64> = course.iter().filter(|at| at[0] > FROM).map(|at| at[1]).collect();
    let distance = steady.iter().sum::<f64>() * interval;
    let Some(mean) = estimate_settling(&steady, distance) else {
        return Err(unsteady("time (D / U_Stokes)", course.len() as f64 * interval));
    };
    let table = Table::new(REFERENCE);
    let quantity = format!("U / U_Stokes, phi {PHI}, {balance} (-)");
    let (column, source, name) = if balance == "mixture" {
        (
            "garside_yao",
            "Garside and Al-Dibouni (1977), doi:10.1021/i260062a008; Yao et al. (2021)",
            "Garside and Al-Dibouni, Yao et al.",
        )
    } else {
        ("u_over_stokes", CASE.source, "Marquardt et al. (2024)")
    };
    let expected = table.at("phi", PHI, column);
    found.relative(quantity, mean.mean, expected, TOLERANCE).source(source);
    let error = mean.standard_error.unwrap_or(f64::NAN);
    found.note(format!("its standard error, {balance}"), error);
    found.plot(
        balance,
        format!("Settling velocity at volume fraction {PHI}, {balance}"),
        ["time over D / U_Stokes (-)", "velocity over U_Stokes (-)"],
        [reference(name, [[0.0, expected], [TO, expected]]), measured("measured", course)],
    );
    Ok(())
}
