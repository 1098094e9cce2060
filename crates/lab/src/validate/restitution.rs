//! Head-on impacts rebound with the restitution that is set: `validation/restitution`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/restitution/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/restitution/reference.csv");

pub(super) const CASE: Case = Case {
    name: "restitution",
    question: "rebound of spheres from a wall and from each other, restitution 0.5 to 1, both laws of damping",
    source: "Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028",
    parts: &[Part::quick(1.0, impacts)],
};

const TOLERANCE: f64 = 2e-3;
/// Restitution that is set.
const SET: [f64; 5] = [0.5, 0.7, 0.8, 0.926, 1.0];
/// Elastic law, damping, and where the latter is from.
const LAWS: [(&str, &str, &str); 2] = [
    ("paper", "hunt_crossley", CASE.source),
    ("hertz", "tsuji", "Tsuji, Tanaka and Ishida (1992), doi:10.1016/0032-5910(92)88030-L"),
];

fn impacts(context: &SuiteContext) -> Result<Findings> {
    let table = Table::new(REFERENCE);
    let mut found = Findings::default();
    let mut curves = vec![("reference: as set".to_string(), vec![[SET[0], SET[0]], [SET[4], SET[4]]])];
    for (law, damping, source) in LAWS {
        let mut measured = Vec::new();
        for set in SET {
            let own = [
                format!("contact.law={law:?}"),
                format!("contact.damping={damping:?}"),
                format!("contact.restitution={set:?}"),
            ];
            let setup = context.setup(TEXT, CASE.name, &own)?;
            let before = &setup.particles;
            let mut run = Simulation::solo(&setup)?;
            run.advance(setup.plan.end_step)?;
            let contacts = run.dem().contacts();
            if (contacts.begun, contacts.count) != (2, 0) {
                return Err(unsteady("contacts that have not ended", contacts.count as f64));
            }
            let after = run.particles();
            let wall = -after[0].velocity().z / before[0].velocity().z;
            let along = (before[2].position() - before[1].position()).normalize();
            let apart =
                |all: &[turbid::particle::Particle]| along.dot(&(all[2].velocity() - all[1].velocity()));
            let pair = -apart(after) / apart(before);
            let reference = table.at("e", set, damping);
            for (what, value) in [("wall", wall), ("pair", pair)] {
                let quantity = format!("restitution set to {set}, {damping}, {what} (-)");
                found.absolute(quantity, value, reference, TOLERANCE);
                found.from(source);
            }
            measured.push([set, wall]);
        }
        curves.push((format!("{damping}, wall"), measured));
    }
    found.overlays.push(Overlay::new(
        "restitution",
        "Restitution of a sphere on a wall",
        ["restitution set (-)", "restitution measured (-)"],
        curves,
    ));
    Ok(found)
}
