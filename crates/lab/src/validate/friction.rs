//! Oblique impacts with friction: `validation/friction`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/friction/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/friction/reference.csv");

pub(super) const CASE: Case = Case {
    name: "friction",
    question: "oblique impacts of a sphere on a plate: tangential restitution and spin",
    source: "Kharaz, Gorham and Salman (2001), doi:10.1016/S0032-5910(01)00283-2",
    parts: &[Part::quick(1.0, throws)],
};

const THEORY: &str = "impulses of rigid bodies that slide to the end: mu (1 + e) of the normal momentum";
/// Speed before the impact (m/s).
const SPEED: f64 = 3.9;
/// Measured.
const FRICTION: f64 = 0.092;
const RESTITUTION: f64 = 0.98;
/// Of the tangential restitution: against theory and against the experiment, absolute.
const TANGENTIAL: [f64; 2] = [2e-3, 0.02];
/// Of the angular velocity: against theory and against the experiment, as a part.
const SPIN: [f64; 2] = [5e-3, 0.1];

fn throws(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let table = Table::new(REFERENCE);
    let columns = ["angle", "value"];
    let [tangential, spin] =
        ["tangential_restitution", "omega_rad_s"].map(|word| table.points(Some(word), columns));
    let angles: Vec<f64> = tangential.iter().chain(&spin).map(|point| point[0]).collect();
    let list: Vec<String> = (0..)
        .zip(&angles)
        .map(|(n, degrees)| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (x, along, down) = (0.02 + 0.03 * f64::from(n), SPEED * sin, -SPEED * cos);
            format!("{{ position = [{x:e}, 0.01, 2.5000001e-3], velocity = [{along:e}, 0.0, {down:e}] }}")
        })
        .collect();
    let own = [format!("particles.0.list=[{}]", list.join(", "))];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let contacts = run.dem().contacts();
    if (contacts.begun, contacts.count) != (angles.len() as u64, 0) {
        return Err(unsteady("contacts that have not ended", contacts.count as f64));
    }
    let radius = 0.5 * setup.diameter;
    let slide = |angle: f64| 1.0 - FRICTION * (1.0 + RESTITUTION) / angle.to_radians().tan();
    let turn = |angle: f64| 2.5 * FRICTION * (1.0 + RESTITUTION) * SPEED * angle.to_radians().cos() / radius;
    let (mut slid, mut turned) = (Vec::new(), Vec::new());
    for (n, after) in run.particles().iter().enumerate() {
        let (angle, before) = (angles[n], setup.particles[n].velocity());
        let normal = -after.velocity().z / before.z;
        let quantity = format!("normal restitution at {angle:.1} degrees (-)");
        found.absolute(quantity, normal, RESTITUTION, 2e-3).source("as set");
        if let Some(&[_, experiment]) = tangential.get(n) {
            let measured = after.velocity().x / before.x;
            let quantity = format!("tangential restitution at {angle:.1} degrees (-)");
            found.absolute(quantity.clone(), measured, slide(angle), TANGENTIAL[0]).source(THEORY);
            let quantity = format!("{quantity}, experiment");
            found.absolute(quantity, measured, experiment, TANGENTIAL[1]);
            slid.push([angle, measured]);
        } else {
            let experiment = spin[n - tangential.len()][1];
            let measured = after.angular_velocity().y;
            let quantity = format!("angular velocity at {angle:.1} degrees (1/s)");
            found.relative(quantity.clone(), measured, turn(angle), SPIN[0]).source(THEORY);
            let quantity = format!("{quantity}, experiment");
            found.relative(quantity, measured, experiment, SPIN[1]);
            turned.push([angle, measured]);
        }
    }
    let over = |law: &dyn Fn(f64) -> f64| (34..=65).map(|a| [f64::from(a), law(f64::from(a))]).collect();
    let mut plot = |name, title, axis, law: Vec<[f64; 2]>, experiment: Vec<_>, points: Vec<_>| {
        let curves = [
            reference("rigid bodies", law),
            measured("experiment, Kharaz et al. (2001)", experiment),
            overlaid("measured", points),
        ];
        found.plot(name, title, ["angle from the normal (degrees)", axis], curves);
    };
    let title = "Tangential restitution of spheres on a plate";
    plot("tangential", title, "tangential restitution (-)", over(&slide), tangential, slid);
    let title = "Spin of spheres after the impact on a plate";
    plot("spin", title, "angular velocity (1/s)", over(&turn), spin, turned);
    Ok(())
}
