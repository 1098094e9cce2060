//! Two spheres that settle one behind the other: `validation/drafting`.

use super::prelude::*;
use std::collections::BTreeMap;

const TEXT: &str = include_str!("../../../../validation/drafting/case.toml");

pub(super) const CASE: Case = Case {
    name: "drafting",
    question: "drafting, kissing and tumbling of two spheres that settle one behind the other",
    source: "Fortes, Joseph and Lundgren (1987), doi:10.1017/S0022112087001046",
    parts: &[Part::wide(9.0, pair)],
};

/// Gap to the floor (diameters) at which it ends.
const UNTIL: f64 = 2.0;

fn pair(context: &SuiteContext) -> Result<Findings> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let (dt, diameter) = (setup.time_step, setup.diameter);
    let watch = Watch { context, setup: &setup, threads: context.threads, every: 1 };
    let rows: Vec<(u64, u64, Vec3, Vec3)> = watch.rows(|run, rows| {
        let mut low = [f64::NEG_INFINITY];
        for sphere in run.particles() {
            rows.push((run.steps_done(), sphere.id, sphere.position(), sphere.velocity()));
            low[0] = low[0].max(0.5 - sphere.position().z / diameter);
        }
        run.comm().max(&mut low);
        Ok(-low[0] < UNTIL)
    })?;
    // Both spheres of every step, the leading one at the start first.
    let mut steps: BTreeMap<u64, [Option<(Vec3, Vec3)>; 2]> = BTreeMap::new();
    for (step, id, position, velocity) in rows {
        steps.entry(step).or_default()[id as usize] = Some((position, velocity));
    }
    // Contacts begin where the enlarged surfaces meet.
    let touching = setup.contact.as_ref().map_or(0.0, |contact| 2.0 * contact.enlargement / diameter);
    let (mut drafting, mut nearest, mut kissed) = (0.0_f64, f64::INFINITY, None);
    let (mut tilt, mut apart) = (0.0_f64, 0.0_f64);
    let mut curves = [Vec::new(), Vec::new()];
    for (&step, both) in &steps {
        let [Some(leading), Some(trailing)] = *both else {
            return Err(unsteady("a sphere is lost in step", step as f64));
        };
        let time = step as f64 * dt;
        let line = setup.domain.nearest_image(trailing.0 - leading.0);
        let gap = line.norm() / diameter - 1.0;
        nearest = nearest.min(gap);
        let angle = (line.xy().norm()).atan2(line.z).to_degrees();
        if kissed.is_none() {
            // Once both move.
            if -leading.1.z > 0.2 * setup.expect_fluid().scales.schiller_naumann_velocity {
                drafting = drafting.max(trailing.1.z / leading.1.z);
            }
            if gap < touching {
                kissed = Some(time);
            }
        } else {
            tilt = tilt.max(angle);
            apart = apart.max(gap);
        }
        if step % 10 == 0 {
            curves[0].push([time, gap]);
            curves[1].push([time, angle / 90.0]);
        }
    }
    let mut found = Findings::default();
    let quantity = "drafting: most that the trailing sphere is faster, before contact (-)";
    found.absolute(quantity, drafting, 1.6, 0.5);
    let quantity = "kissing: least gap (D)";
    found.absolute(quantity, nearest, 0.0, 0.1);
    let quantity = "tumbling: largest angle of the line of centres from the vertical (degrees)";
    found.absolute(quantity, tilt, 90.0, 45.0);
    let quantity = "separation: largest gap after contact (D)";
    found.absolute(quantity, apart, 1.2, 1.0);
    found.note("contact at (s)", kissed.unwrap_or(f64::NAN));
    let [gap, angle] = curves;
    found.overlays.push(Overlay::new(
        "course",
        "Two spheres that settle one behind the other",
        ["time (s)", "gap over diameter, angle over 90 degrees (-)"],
        [("gap between the surfaces", gap), ("angle of the line of centres from the vertical", angle)],
    ));
    Ok(found)
}
