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
const SET: [f64; 5] = [0.5, 0.7, 0.8, 0.926, 1.0];
/// Elastic law, damping, and where the latter is from.
const LAWS: [(&str, &str, &str); 2] = [
    ("paper", "hunt_crossley", CASE.source),
    ("hertz", "tsuji", "Tsuji, Tanaka and Ishida (1992), doi:10.1016/0032-5910(92)88030-L"),
];

fn impacts(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let table = Table::new(REFERENCE);
    let mut curves = vec![reference("as set", [SET[0], SET[4]].map(|set| [set, set]))];
    for (law, damping, source) in LAWS {
        let mut points = Vec::new();
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
            let apart = |all: &[Particle]| along.dot(&(all[2].velocity() - all[1].velocity()));
            let pair = -apart(after) / apart(before);
            let reference = table.at("e", set, damping);
            for (what, value) in [("wall", wall), ("pair", pair)] {
                let quantity = format!("restitution set to {set}, {damping}, {what} (-)");
                found.absolute(quantity, value, reference, TOLERANCE).source(source);
            }
            points.push([set, wall]);
        }
        let curve = if curves.len() > 1 { overlaid } else { measured };
        curves.push(curve(format!("{damping}, wall"), points));
    }
    let axes = ["restitution set (-)", "restitution measured (-)"];
    found.plot("restitution", "Restitution of a sphere on a wall", axes, curves);
    Ok(())
}
