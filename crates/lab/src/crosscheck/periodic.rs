//! Contacts through the faces, edges and corners of a periodic box.

use super::prelude::*;
use super::statics::STEP;

const FORCE: Limit =
    (1e-12, "relative, to Hertz at the nearest image: rounding of 1e-18 m of a depth of 5e-6 m");
const PAIRWISE: Limit =
    (1e-12, "relative: OTHER rounds the images of both sides, 1e-18 m of a depth of 5e-6 m");
const IMPACT: Limit = (1e-9, "relative, to the same engine inside the box: rounding, 1e-12 of the depth");

const BOX: Domain = Domain { cells: [20; 3], dx: 0.5e-3, faces: Domain::faces([true; 3]) };

const POINTS: [(&str, Vec3, Vec3); 3] = [
    ("face", Vec3::new(0.0, 4e-3, 6e-3), Vec3::new(1.0, 0.0, 0.0)),
    ("edge", Vec3::new(0.0, 0.0, 6e-3), Vec3::new(0.6, 0.8, 0.0)),
    ("corner", Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.48, 0.6, 0.64)),
];

/// Two spheres on either side of `point`, `distance` (m) apart.
fn system(name: &str, friction: f64, point: Vec3, normal: Vec3, distance: f64) -> Setup {
    let mut system = glass(format!("periodic-{name}"), 1.0, friction, SAME);
    system.domain = BOX;
    for side in [-0.5, 0.5] {
        add(&mut system, 0, BOX.wrap(point + normal * (side * distance)), Vec3::zeros());
    }
    system
}

/// Force at rest, and an oblique impact, through faces, edges and corners.
pub(super) fn contacts(against: &Against, findings: &mut Findings) -> Result<()> {
    let (_, corner, askew) = POINTS[2];
    let inside = impact("inside", Vec3::repeat(5e-3), askew, against)?;
    for (name, point, normal) in POINTS {
        let system = system(name, 0.0, point, normal, 2.0 * RADIUS - 0.01 * RADIUS);
        let tracks = record(&system, against, STEP, 1)?;
        let [a, b] = [0, 1].map(|id| system.particles[id].position());
        let offset = BOX.nearest_image(b - a);
        let hertz = Hertz::pair([1.0; 2], [RADIUS; 2], [&GLASS; 2]);
        let expected = hertz.force(2.0 * RADIUS - offset.norm());
        let forces = tracks.map(|track| [0, 1].map(|id| track.resting_force(id)));
        let pushes = forces.map(|[on_a, _]| on_a.dot(&-offset.normalize()));
        let off = worst(forces.map(|[on_a, _]| (on_a + offset.normalize() * expected).norm() / expected));
        let quantity = format!("force through a {name}, d/R = 0.01 (N)");
        findings.given(quantity, [pushes[0], pushes[1], expected].map(Some), off, FORCE);
        let sums = forces.map(|[on_a, on_b]| (on_a + on_b).norm() / expected);
        let quantity = format!("sum of both forces over one, {name} (-)");
        findings.given(quantity, [sums[0], sums[1], 0.0].map(Some), worst(sums), PAIRWISE);
    }
    let through = impact("through", corner, askew, against)?;
    let apart = [0, 1].map(|engine| {
        let both = through[engine].iter().zip(&inside[engine]);
        worst(both.map(|(there, here)| (there - here).norm() / here.norm()))
    });
    let quantity = "oblique impact through a corner against inside the box (-)";
    findings.given(quantity, [apart[0], apart[1], 0.0].map(Some), worst(apart), IMPACT);
    Ok(())
}

/// Velocities and spins after an impact about `point`, in both engines.
fn impact(name: &str, point: Vec3, normal: Vec3, against: &Against) -> Result<[Vec<Vec3>; 2]> {
    let mut system = system(name, 0.1, point, normal, 2.0 * RADIUS);
    let across = Vec3::new(0.8, 0.0, -0.6);
    system.particles[0].velocity = (normal + across * 2.0).into();
    let mass = mass(&system, 0);
    let dt = Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2]).duration(1.0) / 200.0;
    let tracks = record(&system, against, dt, 300)?;
    Ok(tracks.map(|track| track.last().iter().flat_map(|p| [p.velocity(), p.angular_velocity()]).collect()))
}
