//! Front of a settling suspension: `validation/settling_front`.

use super::context::{Written, written};
use super::prelude::*;
use turbid::output::directory::{FRONTS, PROFILES};
use turbid::output::fronts::VELOCITY;
use turbid::simulation::{Law, Suspension};

const TEXT: &str = include_str!("../../../../validation/settling_front/case.toml");

pub(super) const CASE: Case = Case {
    name: "settling_front",
    question: "velocity of the front of a suspension that settles in a closed column, and the particles in its profile",
    source: "Garside and Al-Dibouni (1977), doi:10.1021/i260062a008, with the prefactor of Yao et al. (2021)",
    parts: &[Part::quick(12.0, front)],
};

const ZAKI: &str =
    "Richardson and Zaki (1954), Trans. Inst. Chem. Eng. 32, 35, who have no prefactor below one";
/// Of the velocity of the front, as parts.
const TOLERANCE: f64 = 0.1;
const OFF_ZAKI: f64 = 0.25;

fn front(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let Written { tables, summary } = written(&setup, context.threads, &[FRONTS, PROFILES])?;
    let phi = setup.volume_fraction;
    let fluid = setup.expect_fluid();
    let [law, zaki] = [Law::GarsideAlDibouniYao, Law::RichardsonZaki]
        .map(|law| law.over_stokes(Suspension::of(&fluid.scales, phi)));
    let average = summary.averages.get(VELOCITY);
    let over = |speed: f64| speed / fluid.scales.stokes_velocity;
    let velocity = average.map_or(f64::NAN, |average| over(average.mean));
    let quantity = format!("velocity of the front over that of Stokes, volume fraction {phi:.3} (-)");
    found.relative(quantity.clone(), velocity, law, TOLERANCE);
    let quantity = format!("{quantity}, Richardson and Zaki");
    found.relative(quantity, velocity, zaki, OFF_ZAKI).source(ZAKI);
    let error = average.and_then(|average| average.standard_error).map_or(f64::NAN, over);
    found.notes.push(("standard error of the velocity of the front by regression (-)".into(), error));
    // At all times the profile has all particles.
    let column = |name: &str| tables[1].get(name).unwrap_or_default();
    let (step, number) = (column("step"), column("number_density"));
    let count = step.iter().take_while(|of| **of < 0.5).count().max(1);
    let volume = setup.domain.volume() / count as f64;
    let off = number
        .chunks(count)
        .map(|bins| (bins.iter().sum::<f64>() * volume / setup.particles.len() as f64 - 1.0).abs());
    let off = off.fold(0.0, f64::max);
    found
        .absolute("particles in the profile over all of them, minus 1 (-)", off, 0.0, 1e-12)
        .source("exact: each particle counts once");
    let column = |name: &str| tables[0].get(name).unwrap_or_default();
    let (time, unit) = (column("t"), setup.stokes_time().unwrap_or(1.0));
    let heights = |name: &str| -> Vec<[f64; 2]> {
        time.iter().zip(column(name)).map(|(t, z)| [t / unit, z / setup.diameter]).collect()
    };
    let top = column("front_height").first().map_or(f64::NAN, |z| z / setup.diameter);
    let end = time.last().map_or(0.0, |t| t / unit);
    let line = |law: f64| [[0.0, top], [end, top - end * law]];
    found.plot(
        "heights",
        format!("Front and bed of a suspension that settles, volume fraction {phi:.3}"),
        ["time over D / u_Stokes (-)", "height over diameter (-)"],
        [
            reference("Garside, Al-Dibouni and Yao", line(law)),
            reference("Richardson and Zaki", line(zaki)),
            measured("front", heights("front_height")),
            measured("bed", heights("bed_height")),
        ],
    );
    Ok(())
}
