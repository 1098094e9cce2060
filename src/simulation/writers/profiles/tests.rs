use super::*;
use crate::case::from_text;
use std::f64::consts::PI;

/// Bodies of all kinds of cuts askew in a periodic dry box, the first across its faces.
const BODIES: &str = r#"
domain = { size = [6e-3, 6e-3, 8e-3], periodic = [true, true, true] }
dry.time_step = 1e-6
run.end.steps = 1
output.profiles = [{ axis = "x", bins = 7 }, { axis = "y", bins = 24 }, { axis = "z", bins = 5 }]
output.directory = "out"
contact.enabled = false
[[particles]]
shape.sphere.diameter = 2e-3
density = 2000
list = [[0.2e-3, 1e-3, 7.9e-3]]
[[particles]]
shape.cuboid.edges = [1e-3, 1.5e-3, 2.5e-3]
density = 2000
list = [{ position = [3e-3, 1e-3, 2e-3], orientation = { axis = [1, 2, 3], angle = 40 } }]
[[particles]]
shape.ellipsoid.axes = [1e-3, 1.5e-3, 2.5e-3]
density = 2000
list = [{ position = [3e-3, 4e-3, 5e-3], orientation = { axis = [3, 2, 1], angle = 70 } }]
[[particles]]
shape.cylinder = { diameter = 1.6e-3, length = 2e-3 }
density = 2000
list = [{ position = [1e-3, 4e-3, 2e-3], orientation = { axis = [1, 0, 1], angle = 30 } }]
[[particles]]
shape.cylinder = { diameter = 1e-3, length = 6e-3 }
through = "x"
density = 2000
list = [[5e-3, 2.4e-3, 6e-3]]
"#;

#[test]
fn bodies_of_any_shape_are_cut_at_the_ends_of_bins_as_points_inside_say() {
    let setup = from_text(BODIES, "bodies", &[]).unwrap_or_else(|e| panic!("{e}"));
    let profiles = Profiles::of(&setup).unwrap();
    let size = setup.domain.size();
    for particle in &setup.particles {
        let template = &setup.templates[particle.template as usize];
        let (volume, reach) = (template.shape.volume(), template.shape.circumradius());
        // Points of a fine lattice about the centre; of a body through the box those in it.
        let n = 96_u32;
        let step = 2.0 * reach / f64::from(n);
        let along = template.shape.passage().map(|passage| passage.axis);
        let points: Vec<Vec3> = (0..n * n * n)
            .map(|k| [k % n, k / n % n, k / n / n].map(|k| (f64::from(k) + 0.5) * step - reach))
            .filter(|at| along.is_none_or(|axis| at[axis].abs() < 0.5 * size[axis]))
            .filter(|at| {
                let at = particle.orientation().inverse_transform_vector(&Vec3::from(*at));
                template.shape.signed_distance(at) < 0.0
            })
            .map(|at| particle.position() + Vec3::from(at))
            .collect();
        for (_, profile) in profiles.all() {
            let mut found = vec![0.0; profile.bins];
            profiles.cut(particle, profile, |bin, volume| found[bin] += volume);
            assert!((found.iter().sum::<f64>() / volume - 1.0).abs() < 1e-12);
            let mut expected = vec![0.0; profile.bins];
            for at in &points {
                // Each stands for a cell of the lattice, which may be cut, too.
                for part in [-0.375, -0.125, 0.125, 0.375] {
                    let at = at[profile.axis] + part * step;
                    let bin = profiles.bin(profile, at * profile.bins as f64 / size[profile.axis]);
                    expected[bin] += 0.25 * volume / points.len() as f64;
                }
            }
            for (bin, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert!(
                    (found - expected).abs() < 0.012 * volume,
                    "{} of {:?} {bin}: {found:e} {expected:e} of {volume:e}",
                    template.shape.kind(),
                    profile
                );
            }
        }
    }
}

#[test]
fn bins_at_the_cut_of_a_sphere_have_the_volume_of_its_cap() {
    let text = BODIES.replace("[0.2e-3, 1e-3, 7.9e-3]", "[3e-3, 3e-3, 2e-3]").replace("bins = 5", "bins = 4");
    let setup = from_text(&text, "cap", &[]).unwrap_or_else(|e| panic!("{e}"));
    let profiles = Profiles::of(&setup).unwrap();
    // Half of the sphere is below 2 mm, where a bin ends.
    let mut found = [0.0; 4];
    let profile = Profile { axis: 2, bins: 4, rings: None, hydrodynamic_stress: false };
    profiles.cut(&setup.particles[0], &profile, |bin, volume| found[bin] += volume);
    let half = 2.0 / 3.0 * PI * 1e-9;
    assert!((found[0] / half - 1.0).abs() < 1e-12 && (found[1] / half - 1.0).abs() < 1e-12, "{found:?}");
    assert!(found[2..] == [0.0; 2]);
}

#[test]
fn rings_hold_what_is_in_a_sphere_by_its_caps_and_turn_vectors() {
    let text = BODIES.replace("[0.2e-3, 1e-3, 7.9e-3]", "[3e-3, 3e-3, 2e-3]").replace(
        "{ axis = \"z\", bins = 5 }",
        "{ axis = \"z\", bins = 4, about = [3e-3, 3e-3, 0], radius = 1.2e-3 }",
    );
    let setup = from_text(&text, "rings", &[]).unwrap_or_else(|e| panic!("{e}"));
    let profiles = Profiles::of(&setup).unwrap();
    let profile = setup.plan.output.profiles[2];
    let mut found = [0.0; 4];
    profiles.divide(&setup.particles[0], &profile, |bin, volume| found[bin] += volume);
    // In a cylinder of radius r through the middle of a sphere of radius R: 4 pi / 3 (R^3 - (R^2 - r^2)^(3/2)).
    let within = |r: f64| 4.0 / 3.0 * PI * (1.0 - (1.0 - r.min(1.0).powi(2)).powf(1.5)) * 1e-9;
    for (bin, found) in found.iter().enumerate() {
        let [inner, outer] = [0.0, 1.0].map(|more| within(0.3 * (bin as f64 + more)));
        let exact = outer - inner;
        assert!((found - exact).abs() < 0.01 * within(1.0), "{bin}: {found:e} {exact:e}");
    }
    assert!((found.iter().sum::<f64>() / within(1.0) - 1.0).abs() < 1e-12);
    // Volumes of the rings fill the cylinder; at 90 degrees radial is y and azimuthal is against x.
    let all: f64 = (0..4).map(|bin| profiles.extent(&profile, bin)[0]).sum();
    assert!((all / (PI * 1.44e-6 * setup.domain.size()[2]) - 1.0).abs() < 1e-12);
    let (bin, axes) = profiles.place(&profile, Vec3::new(3e-3, 3.5e-3, 7e-3)).unwrap();
    let axes = axes.unwrap();
    let vector = turned(Some(&axes), Vec3::new(1.0, 2.0, 3.0));
    assert!(bin == 1 && (vector - Vec3::new(2.0, -1.0, 3.0)).norm() < 1e-12, "{bin} {vector:?}");
    let tensor = turned_tensor(&axes, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let expected = [2.0, 1.0, 3.0, -4.0, 6.0, -5.0];
    assert!(tensor.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{tensor:?}");
    assert!(profiles.place(&profile, Vec3::new(3e-3, 4.3e-3, 0.0)).is_none());
}
