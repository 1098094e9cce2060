//! Contacts through the faces, edges and corners of a periodic box.

use super::theory::Hertz;
use super::tools::{GLASS, RADIUS, SAME, Scene, given, worst};
use super::{Findings, statics};
use std::path::Path;
use turbid::domain::Domain;
use turbid::error::Result;
use turbid::math::Vec3;

const FORCE: &str = "relative, to Hertz with the depth of the nearest image: rounding of positions as large as the box, 1e-18 m \
                     of a depth of 5e-6 m";
const PAIRWISE: &str = "relative to the force: LIGGGHTS works out either side with an image of the other sphere, each rounded to \
                        1e-18 m, of a depth of 5e-6 m";
const IMPACT: &str = "largest difference of velocities and spins after, over those inside the box, in the same engine: rounding \
                      of the positions, some 1e-12 of the depth";

const BOX: Domain = Domain { cells: [20; 3], dx: 0.5e-3, periodic: [true; 3] };

/// Where the point of contact lies: in a face, an edge, a corner.
const PLACES: [(&str, Vec3, Vec3); 3] = [
    ("face", Vec3::new(0.0, 4e-3, 6e-3), Vec3::new(1.0, 0.0, 0.0)),
    ("edge", Vec3::new(0.0, 0.0, 6e-3), Vec3::new(0.6, 0.8, 0.0)),
    ("corner", Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.48, 0.6, 0.64)),
];

/// Two spheres on either side of `point`, `distance` (m) apart.
fn scene(name: String, friction: f64, point: Vec3, normal: Vec3, distance: f64) -> Scene {
    let mut scene = Scene::glass(name, 1.0, friction, SAME);
    scene.domain = BOX;
    for side in [-0.5, 0.5] {
        let at = BOX.wrap(point + normal * (side * distance));
        scene.add(0, at, Vec3::zeros(), Vec3::zeros());
    }
    scene
}

/// H16: force at rest, and an oblique impact, through all kinds of borders.
pub(super) fn contacts(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    let inside = impact("periodic-inside", Vec3::repeat(5e-3), PLACES[2].2, directory)?;
    for (name, point, normal) in PLACES {
        let label = format!("periodic-{name}");
        let scene = scene(label.clone(), 0.0, point, normal, 2.0 * RADIUS - 0.01 * RADIUS);
        let tracks = scene.record(directory, statics::STEP, 1, |_| false)?;
        let [a, b] = [0, 1].map(|id| scene.particles[id].position());
        let offset = BOX.nearest_image(b - a);
        let hertz = Hertz::pair([1.0; 2], [RADIUS; 2], [&GLASS; 2]);
        let expected = hertz.force(2.0 * RADIUS - offset.norm());
        let forces = [0, 1].map(|engine| [0, 1].map(|id| tracks[engine].resting_force(id)));
        let pushes = forces.map(|[on_a, _]| on_a.dot(&-offset.normalize()));
        let off = worst(forces.map(|[on_a, _]| (on_a + offset.normalize() * expected).norm() / expected));
        let values = [Some(pushes[0]), Some(pushes[1]), Some(expected)];
        let quantity = format!("force through a {name}, d/R = 0.01 (N)");
        findings.push(given(quantity, values, off, 1e-12, FORCE));
        let sums = forces.map(|[on_a, on_b]| (on_a + on_b).norm() / expected);
        let values = [Some(sums[0]), Some(sums[1]), Some(0.0)];
        let quantity = format!("sum of both forces over one, {name} (-)");
        findings.push(given(quantity, values, worst(sums), 1e-12, PAIRWISE));
    }
    let (_, corner, normal) = PLACES[2];
    let through = impact("periodic-through", corner, normal, directory)?;
    let apart = [0, 1].map(|engine| {
        let pairs = through[engine].iter().zip(&inside[engine]);
        worst(
            pairs.map(|((v, w), (v0, w0))| worst([(v - v0).norm() / v0.norm(), (w - w0).norm() / w0.norm()])),
        )
    });
    let values = [Some(apart[0]), Some(apart[1]), Some(0.0)];
    let quantity = "oblique impact through a corner against inside the box (-)";
    findings.push(given(quantity, values, worst(apart), 1e-9, IMPACT));
    Ok(findings)
}

/// Velocities and spins after an impact about `point`, in both engines.
fn impact(name: &str, point: Vec3, normal: Vec3, directory: Option<&Path>) -> Result<[Vec<(Vec3, Vec3)>; 2]> {
    let mut scene = scene(name.into(), 0.1, point, normal, 2.0 * RADIUS);
    let across = Vec3::new(0.8, 0.0, -0.6);
    scene.particles[0].velocity = (normal + across * 2.0).into();
    let mass = scene.mass(0);
    let dt = Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2]).duration(1.0) / 200.0;
    let tracks = scene.record(directory, dt, 300, |_| false)?;
    let ends = |engine: usize| {
        let last = tracks[engine].last().iter();
        last.map(|p| (p.velocity(), p.angular_velocity())).collect()
    };
    Ok([ends(0), ends(1)])
}
