//! A sphere that rolls down an incline in a viscous fluid: `validation/rolling`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/rolling/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/rolling/reference.csv");

pub(super) const CASE: Case = Case {
    name: "rolling",
    question: "a sphere on an incline in a viscous fluid, with a film below it: velocity and spin, rolling and without friction",
    source: "bispherical series (O'Neill 1964; Goldman, Cox and Brenner 1967, doi:10.1016/0009-2509(67)80047-2) with the images of the box",
    parts: &[
        Part::quick(8.0, |context, found| descend(context, found, 8, true)),
        Part::quick(8.0, |context, found| descend(context, found, 8, false)),
        Part::full(60.0, |context, found| descend(context, found, 12, true)),
        Part::full(60.0, |context, found| descend(context, found, 12, false)),
    ],
};

/// Of velocity and spin of a sphere that rolls, and of one without friction.
const ROLLING: f64 = 0.05;
const FREE: [f64; 2] = [0.05, 0.08];
/// Time after which the flow between the plates is steady, in units of `a^2 / nu`; averages are of its last third.
const END: f64 = 30.0;

fn descend(context: &SuiteContext, found: &mut Findings, cells: u32, rolls: bool) -> Result<()> {
    let given = [format!("lattice.cells_per_diameter={cells}")];
    let setup = context.setup(TEXT, CASE.name, &given)?;
    let (radius, fluid) = (0.5 * setup.diameter, setup.expect_fluid());
    let submerged = (setup.templates[0].mass() / setup.fluid_density() - setup.templates[0].shape.volume())
        * setup.gravity.x;
    let volume: f64 = (0..3).map(|axis| setup.domain.size()[axis]).product();
    let friction = f64::from(u8::from(rolls));
    let own = [
        given[0].clone(),
        format!("particles.0.list=[[1.98e-3, 2.01e-3, {:e}]]", radius + 0.5 * setup.domain.dx),
        format!("contact.friction_static={friction:.1}"),
        format!("contact.friction_kinetic={friction:.1}"),
        // What balances the weight in periodic directions would drag the fluid back.
        format!("driving.body_acceleration=[{:e}, 0.0, 0.0]", submerged / volume),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let viscous = radius * radius / fluid.viscosity;
    run.run_until(2.0 / 3.0 * END * viscous)?;
    let (mut sums, mut samples) = ([0.0; 2], 0.0);
    while run.time() < END * viscous {
        run.advance(10)?;
        let sphere = &run.particles()[0];
        for (sum, value) in sums.iter_mut().zip([sphere.velocity().x, radius * sphere.angular_velocity().y]) {
            *sum += value;
        }
        samples += 1.0;
    }
    let force = |name| Table::new(REFERENCE).at("n", f64::from(cells), name);
    let [slide, couple, turn] = ["shear_force", "shear_torque", "spin_torque"].map(force);
    // Over 6 pi mu a; the sphere touches the wall at this distance of its centre, in radii.
    let [couple, turn, lever] = [couple * 4.0 / 3.0, turn * 4.0 / 3.0, 1.0 + 0.5 * setup.domain.dx / radius];
    let (ratio, drag) = if rolls {
        let ratio = 1.0 / lever;
        (ratio, slide - couple * ratio + (turn * ratio - couple) / lever)
    } else {
        (couple / turn, slide - couple * couple / turn)
    };
    let velocity = submerged / (6.0 * PI * fluid.viscosity * radius * drag);
    let how = format!("{}, {cells} cells", if rolls { "rolling" } else { "no friction" });
    let [moved, turned] = sums.map(|sum| sum / samples / velocity);
    let tolerances = if rolls { [ROLLING; 2] } else { FREE };
    found.relative(format!("U over that of theory, {how} (-)"), moved, 1.0, tolerances[0]);
    found.relative(format!("a omega over U of theory, {how} (-)"), turned, ratio, tolerances[1]);
    Ok(())
}
