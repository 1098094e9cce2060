use super::*;
use crate::domain::Domain;
use crate::particle::Particle;
use crate::shape::{Capsule, Cuboid, Cylinder, Ellipsoid, Polyhedron, Sphere, Superellipsoid};
use std::sync::Arc;
use turbid_plot::Colours;

const BOX: Domain = Domain { faces: Domain::faces([false; 3]), cells: [10; 3], dx: 0.1 };
const SPEED: Scale = Scale { label: "speed", unit: "m/s", range: (0.0, 1.0), colours: Colours::Viridis };

fn shapes() -> Vec<Arc<dyn Shape>> {
    let corners = [[0.0, 0.0, 0.4], [0.2, 0.0, -0.2], [-0.2, 0.2, -0.2], [-0.2, -0.2, -0.2]].map(Vec3::from);
    vec![
        Arc::new(Sphere { radius: 0.2 }),
        Arc::new(Ellipsoid::new(Vec3::new(0.1, 0.15, 0.2)).unwrap()),
        Arc::new(Cuboid::new(Vec3::new(0.1, 0.2, 0.3)).unwrap()),
        Arc::new(Polyhedron::hull(&corners, 1e-9).unwrap().0),
        Arc::new(Cylinder::new(0.1, 0.3).unwrap()),
        Arc::new(Capsule::new(0.1, 0.2).unwrap()),
        Arc::new(Superellipsoid::new(Vec3::new(0.2, 0.15, 0.1), [0.4, 0.6]).unwrap()),
    ]
}

fn snapshot<'a>(templates: &'a [Template], particles: &'a [Particle]) -> Snapshot<'a> {
    Snapshot {
        case: "",
        time: 0.0,
        stokes_time: None,
        domain: BOX,
        diameter: 0.4,
        gravity: -Vec3::z(),
        templates,
        particles,
        walls: &[],
    }
}

fn scene<'a>(bodies: Vec<[u8; 3]>, scale: Option<Scale>) -> Scene<'a> {
    Scene { from: None, zoom: 1.0, size: [500, 400], bodies, scale, slice: None, chains: None, threads: 1 }
}

/// Particles with these speeds.
fn coloured<'a>(speeds: &[f64]) -> Scene<'a> {
    scene(speeds.iter().map(|&speed| SPEED.colour(speed)).collect(), Some(SPEED))
}

#[test]
fn every_triangle_of_a_body_lies_on_its_surface_and_its_normals_are_those_of_the_surface() {
    for shape in shapes() {
        let mesh = mesh(&*shape, FINEST);
        let size = shape.circumradius();
        let vector = |v: [f32; 3]| Vec3::from(v.map(f64::from));
        for triangle in &mesh.triangles {
            let corners = triangle.corners.map(|i| vector(mesh.points[i as usize]));
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            assert!(shape.signed_distance(middle).abs() < 2e-3 * size, "{} {middle}", shape.kind());
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            for normal in triangle.normals.map(vector) {
                assert!((normal.norm() - 1.0).abs() < 1e-5, "{}", shape.kind());
                assert!(normal.dot(&across) > 0.0 || across.norm() < 1e-9, "{} outwards", shape.kind());
            }
        }
    }
}

#[test]
fn a_body_covers_the_pixels_whose_lines_of_sight_hit_it() {
    for shape in shapes() {
        let template = [Template { shape: shape.clone(), density: 1.0, material: 0 }];
        let mut particle = Particle::at(0, 0, Vec3::repeat(0.5));
        let turn = Quat::from_euler_angles(0.3, 0.8, -0.4);
        particle.set_orientation(&turn);
        let particles = [particle];
        let view = view(&snapshot(&template, &particles), &scene(vec![[200, 40, 40]], None));
        let image = view.figure().image();
        let is_red = |x: u32, y: u32| {
            let [r, g, _] = image.colour(x, y);
            i32::from(r) - i32::from(g) > 15
        };
        // The exact surface, by steps of the distance to it.
        let hits = |x: u32, y: u32| {
            let [start, end] =
                view.line_of_sight([x as f32 + 0.5, y as f32 + 0.5]).map(|p| Vec3::from(p.map(f64::from)));
            let along = (end - start).normalize();
            let mut way = 0.0;
            // Many steps, as those towards a face that is seen at a flat angle are short.
            for _ in 0..2000 {
                let point = turn.inverse() * (start + way * along - Vec3::repeat(0.5));
                let distance = shape.signed_distance(point);
                if distance < 1e-6 || way > 10.0 {
                    return distance < 1e-6;
                }
                way += distance;
            }
            false
        };
        let pixels = (0..400).flat_map(|y| (0..500).map(move |x| (x, y)));
        let hit: &[bool] = &pixels.map(|(x, y)| hits(x, y)).collect::<Vec<_>>();
        // Pixels on the outline are covered in part.
        let (mut inside, mut outside) = (0, 0);
        for (x, y) in (1..399).flat_map(|y| (1..499).map(move |x| (x, y))) {
            let around =
                (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| hit[(500 * y + x) as usize]));
            let count = around.filter(|hit| *hit).count();
            if count == 9 || count == 0 {
                assert_eq!(is_red(x, y), count == 9, "{} {x} {y}", shape.kind());
            }
            inside += u32::from(count == 9);
            outside += u32::from(count == 0);
        }
        assert!(inside > 500 && outside > 100_000, "{}: {inside} {outside}", shape.kind());
    }
}

#[test]
fn what_lies_between_a_slice_and_the_eye_is_left_out_and_what_the_slice_cuts_is_not() {
    let templates = [Template { shape: Arc::new(Sphere { radius: 0.1 }), density: 1.0, material: 0 }];
    let particles: Vec<Particle> =
        [0.2, 0.45, 0.55, 0.8].iter().map(|&y| Particle::at(0, 0, Vec3::new(0.5, y, 0.5))).collect();
    let plane = Plane::new(&BOX, -Vec3::z(), None);
    let values = vec![0.5; plane.values()];
    let slice = Some(Slice { plane, values, scale: SPEED });
    for (from, expected) in [(-1.0, [0.45, 0.55, 0.8]), (1.0, [0.2, 0.45, 0.55])] {
        let scene =
            Scene { from: Some(Vec3::new(0.3, from, 0.2)), slice: slice.clone(), ..coloured(&[0.1; 4]) };
        let view = view(&snapshot(&templates, &particles), &scene);
        let bodies = view.items.iter().filter(|item| item.shade.is_some());
        let seen: Vec<f32> = bodies.map(|item| item.at[1]).collect();
        assert_eq!(seen, expected.map(|y: f64| y as f32));
        assert_eq!(view.bars.len(), 1, "one bar for what has the same colours");
    }
}

#[test]
fn the_lines_of_a_contact_meet_at_its_point_and_faint_forces_are_left_out() {
    let templates = [Template { shape: Arc::new(Sphere { radius: 0.1 }), density: 1.0, material: 0 }];
    let at = |id: u64, x: f64| Particle::at(id, 0, Vec3::new(x, 0.5, 0.5));
    let particles = [at(3, 0.3), at(7, 0.5)];
    let contact = |force: f64| ContactState {
        first: 3,
        second: 7,
        parts: [0; 2],
        point: [0.4, 0.5, 0.5],
        normal: [1.0, 0.0, 0.0],
        force: [-force, 0.0, 0.0],
        depth: 1e-3,
        volume: 1e-9,
    };
    let scale = Scale { label: "force", unit: "N", range: (0.0, 1.0), colours: Colours::Warm };
    let contacts = [contact(0.5), contact(0.01)];
    let chains = Some(Chains { contacts: &contacts, scale });
    let scene = Scene { chains, ..scene(vec![[200; 3]; 2], None) };
    let view = view(&snapshot(&templates, &particles), &scene);
    let ends: Vec<[f32; 2]> =
        view.seen_through.iter().map(|item| [item.at[0], item.at[0] + item.axes[2][0]]).collect();
    assert_eq!(ends.len(), 2);
    assert!(
        ends.iter()
            .zip([0.3, 0.5])
            .all(|(ends, x)| (ends[0] - x).abs() < 1e-6 && (ends[1] - 0.4).abs() < 1e-6)
    );
}

/// Prints the time of a picture of 1200 by 900 pixels of 2000 bodies, by threads:
/// `cargo test --workspace --all-features --release --lib time_of_a_picture -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn time_of_a_picture() {
    let cube = Cuboid::new(Vec3::repeat(0.032)).unwrap();
    let shapes: [Arc<dyn Shape>; 2] = [Arc::new(Sphere { radius: 0.02 }), Arc::new(cube)];
    for shape in shapes {
        let templates = [Template { shape: shape.clone(), density: 1.0, material: 0 }];
        // A grid in disorder.
        let at = |id: u64| {
            let site = [id % 12, id / 12 % 12, id / 144].map(|i| i as f64 + 0.5);
            let shift = [7, 11, 13].map(|n| (id * n % 17) as f64 / 17.0 - 0.5);
            let mut particle = Particle::at(id, 0, (Vec3::from(site) + 0.4 * Vec3::from(shift)) / 14.0);
            particle.set_orientation(&Quat::from_euler_angles(id as f64, 2.0 * id as f64, 0.0));
            particle
        };
        let particles: Vec<Particle> = (0..2000).map(at).collect();
        let speeds: Vec<f64> = particles.iter().map(|p| p.position().z).collect();
        for threads in [1, 2] {
            let scene = Scene { size: [1200, 900], threads, ..coloured(&speeds) };
            let start = std::time::Instant::now();
            let bytes = view(&snapshot(&templates, &particles), &scene).figure().encode(Format::Png);
            let (seconds, size) = (start.elapsed().as_secs_f64(), bytes.len() / 1000);
            println!("{}, {threads} threads: {seconds:.2} s, {size} kB", shape.kind());
            if let Some(folder) = std::env::var_os("TURBID_SAMPLE_OUTPUT") {
                std::fs::write(Path::new(&folder).join(format!("{}.png", shape.kind())), bytes).unwrap();
            }
        }
    }
}
