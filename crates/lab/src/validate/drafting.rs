//! Two spheres that settle one behind the other: `validation/drafting`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/drafting/case.toml");

pub(super) const CASE: Case = Case {
    name: "drafting",
    question: "drafting, kissing and tumbling of two spheres that settle one behind the other",
    source: "Fortes, Joseph and Lundgren (1987), doi:10.1017/S0022112087001046",
    parts: &[Part::wide(9.0, pair)],
};

/// Gap to the floor (diameters) at which it ends.
const UNTIL: f64 = 2.0;

fn pair(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let (dt, diameter) = (setup.time_step, setup.diameter);
    let watch = Watch { context, setup: &setup, threads: context.threads, every: 1 };
    // Positions and velocities of both spheres after every step, the leading one at the start first.
    let steps: Vec<[[Vec3; 2]; 2]> = watch.rows(|run, rows: &mut Vec<_>| {
        let spheres = run.particles()?;
        rows.push([0, 1].map(|id| [spheres[id].position(), spheres[id].velocity()]));
        Ok(spheres.iter().any(|sphere| sphere.position().z / diameter - 0.5 < UNTIL))
    })?;
    // Contacts begin where the enlarged surfaces meet.
    let touching = setup.contact.as_ref().map_or(0.0, |contact| 2.0 * contact.enlargement / diameter);
    let (mut drafting, mut nearest, mut kissed) = (0.0_f64, f64::INFINITY, None);
    let (mut tilt, mut apart) = (0.0_f64, 0.0_f64);
    let mut curves = [Vec::new(), Vec::new()];
    for (step, [leading, trailing]) in (1..).zip(steps) {
        let time = f64::from(step) * dt;
        let line = setup.domain.nearest_image(trailing[0] - leading[0]);
        let gap = line.norm() / diameter - 1.0;
        nearest = nearest.min(gap);
        let angle = (line.xy().norm()).atan2(line.z).to_degrees();
        if kissed.is_none() {
            // Once both move.
            if -leading[1].z > 0.2 * setup.expect_fluid().scales.schiller_naumann_velocity {
                drafting = drafting.max(trailing[1].z / leading[1].z);
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
    found.plot(
        "course",
        "Two spheres that settle one behind the other",
        ["time (s)", "gap over diameter, angle over 90 degrees (-)"],
        [
            measured("gap between the surfaces", gap),
            overlaid("angle of the line of centres from the vertical", angle),
        ],
    );
    Ok(())
}
