use crate::case::{Setup, from_text};
use crate::contact::{Body, Geometry, GrownShape, overlap, overlap_wall};
use crate::math::{Quat, Vec3};
use crate::particle::Particle;

/// A dry case in a box of 1 m with closed floor and lid, with these sections of particles.
fn case(particles: &str) -> crate::error::Result<Setup> {
    let text = format!(
        "domain = {{ size = [1, 1, 1], periodic = [true, true, false] }}\ndry.time_step = 1e-4\nrun.end.steps = 1\n{particles}"
    );
    from_text(&text, "case", &[])
}

fn section(shape: &str, list: &str, more: &str) -> String {
    format!("[[particles]]\nshape = {shape}\ndensity = 2500\nlist = [{list}]\n{more}\n")
}

const BALL: &str = "{ sphere = { diameter = 0.2 } }";
const RELAX: &str = "overlaps = \"relax\"";

fn distance(setup: &Setup, a: &Particle, b: &Particle) -> f64 {
    setup.domain.nearest_image(a.position() - b.position()).norm()
}

/// Depth of the deepest overlap of two bodies, or of a body and a wall (m).
fn deepest(setup: &Setup) -> f64 {
    let shapes: Vec<GrownShape> =
        setup.templates.iter().map(|template| GrownShape::new(template.shape.clone(), 0.0)).collect();
    let body = |p: &Particle| Body { grown: &shapes[p.template as usize], orientation: p.orientation() };
    let mut deepest = 0.0_f64;
    for (i, a) in setup.particles.iter().enumerate() {
        for b in &setup.particles[..i] {
            let offset = setup.domain.nearest_image(b.position() - a.position());
            let found = overlap(Geometry::Exact, &body(a), &body(b), offset);
            deepest = deepest.max(found.map_or(0.0, |overlap| overlap.depth));
        }
        for wall in &setup.walls {
            let found = overlap_wall(Geometry::Exact, &body(a), &wall.surface.seen_from(a.position()));
            deepest = deepest.max(found.map_or(0.0, |overlap| overlap.depth));
        }
    }
    deepest
}

#[test]
fn two_spheres_move_apart_by_the_same_way_and_a_third_stays() {
    let list = "[0.4, 0.5, 0.5], [0.59, 0.5, 0.5], [0.5, 0.2, 0.5]";
    let setup = case(&section(BALL, list, RELAX)).unwrap();
    let [a, b, c] = &setup.particles[..] else { panic!() };
    let apart = b.position[0] - a.position[0];
    assert!((0.2..0.2005).contains(&apart), "{apart}");
    assert!((a.position[0] + b.position[0] - 0.99).abs() < 1e-15, "{:?} {:?}", a.position, b.position);
    assert_eq!((a.position[1], c.position), (0.5, [0.5, 0.2, 0.5]));
    assert!(setup.particles.iter().all(|p| p.orientation() == Quat::identity()));
    let way = 0.5 * (apart - 0.19);
    let [note] = &setup.provenance.notes[..] else { panic!("{:?}", setup.provenance.notes) };
    let words =
        format!("2 of 3 particles were moved apart, by {way:.3e} m in the mean and {way:.3e} m at most");
    assert!(note.contains(&words) && note.contains("turns of up to 0.00 degrees"), "{note}");
}

#[test]
fn nothing_moves_where_nothing_overlaps() {
    let list = "[0.4, 0.5, 0.5], [0.6, 0.5, 0.5], [0.5, 0.2, 0.1]";
    let [plain, relaxed] = ["", RELAX].map(|more| case(&section(BALL, list, more)).unwrap());
    assert_eq!(plain.particles, relaxed.particles);
    assert!(plain.provenance.notes.is_empty());
    assert!(relaxed.provenance.notes[0].contains("none of 3 particles overlaps"));
}

#[test]
fn spheres_move_apart_through_periodic_faces_and_out_of_walls() {
    let list = "[0.02, 0.5, 0.09], [0.84, 0.5, 0.09], [0.5, 0.98, 0.915]";
    let setup = case(&section(BALL, list, RELAX)).unwrap();
    let [a, b, c] = &setup.particles[..] else { panic!() };
    assert!(distance(&setup, a, b) >= 0.2);
    for p in [a, b] {
        assert!((0.1..0.101).contains(&p.position[2]), "{:?}", p.position);
    }
    assert!((0.899..=0.9).contains(&c.position[2]), "{:?}", c.position);
    assert!(deepest(&setup) <= 0.0);
}

#[test]
fn spheres_at_the_same_place_come_apart_where_the_distance_allows() {
    let list = "[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]";
    let near = format!("{RELAX}\nrelax_distance = {{ diameters = 0.49 }}");
    let error = case(&section(BALL, list, &near)).unwrap_err().to_string();
    assert!(error.contains("relaxing them by up to 9.800e-2 m did not suffice"), "{error}");
    // The default is half a diameter, which is what they need.
    let setup = case(&section(BALL, list, RELAX)).unwrap();
    assert!((distance(&setup, &setup.particles[0], &setup.particles[1]) - 0.2).abs() < 1e-12);
}

#[test]
fn relaxed_particles_keep_the_gap_that_the_case_asks_for() {
    let list = "[0.4, 0.5, 0.5], [0.605, 0.5, 0.5], [0.5, 0.2, 0.104]";
    let gap = format!("{RELAX}\nminimum_gap = 0.01");
    let setup = case(&section(BALL, list, &gap)).unwrap();
    let [a, b, c] = &setup.particles[..] else { panic!() };
    assert!((0.21..0.2105).contains(&distance(&setup, a, b)));
    // Half a gap to walls, which have none.
    assert!((0.105..0.1055).contains(&c.position[2]), "{:?}", c.position);
    let near = format!("{gap}\nrelax_distance = 0.001");
    let error = case(&section(BALL, list, &near)).unwrap_err().to_string();
    for words in
        ["1 pair of particles overlap", "surfaces touch at 2.100000e-1 m, a gap of 1.000000e-2 m included"]
    {
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn particles_of_sections_that_are_not_relaxed_stay() {
    let stays = section("{ cube = { edge = 0.2 } }", "[0.5, 0.5, 0.5], [0.3, 0.5, 0.5]", "");
    let moves = section(BALL, "[0.69, 0.5, 0.5], [0.5, 0.5, 0.31]", RELAX);
    for (text, moved) in [(format!("{stays}{moves}"), [2, 3]), (format!("{moves}{stays}"), [0, 1])] {
        let setup = case(&text).unwrap();
        let places: Vec<[f64; 3]> = setup.particles.iter().map(|p| p.position).collect();
        let cubes = (0..4).filter(|n| !moved.contains(n)).map(|n| places[n]);
        assert_eq!(cubes.collect::<Vec<_>>(), [[0.5, 0.5, 0.5], [0.3, 0.5, 0.5]]);
        assert!((0.7..0.701).contains(&places[moved[0]][0]), "{places:?}");
        assert!((0.299..=0.3).contains(&places[moved[1]][2]), "{places:?}");
        assert!(deepest(&setup) <= 0.0);
    }
    // A pair of which none may move.
    let pair = section(BALL, "[0.2, 0.2, 0.5], [0.3, 0.2, 0.5]", "");
    let error = case(&format!("{moves}{pair}")).unwrap_err().to_string();
    assert!(error.contains("particles 2 and 3") && error.contains("set `overlaps = \"relax\"`"), "{error}");
}

#[test]
fn a_distance_that_does_not_suffice_is_refused_with_pair_overlap_and_remedy() {
    let list = "[0.4, 0.5, 0.5], [0.55, 0.5, 0.5], [0.5, 0.2, 0.5]";
    // Each of them needs 0.025 m.
    let near = format!("{RELAX}\nrelax_distance = {{ diameters = 0.1 }}");
    let error = case(&section(BALL, list, &near)).unwrap_err().to_string();
    for words in [
        "1 pair of particles overlap",
        "particles 0 and 1: centres 1.900000e-1 m apart, surfaces touch at 2.000000e-1 m",
        "relaxing them by up to 2.000e-2 m did not suffice: raise `relax_distance`",
    ] {
        assert!(error.contains(words), "{words} is not in {error}");
    }
    let enough = format!("{RELAX}\nrelax_distance = 0.0252");
    assert!(case(&section(BALL, list, &enough)).is_ok());
    let walls = case(&section(BALL, "[0.5, 0.5, 0.05]", &near)).unwrap_err().to_string();
    for words in ["1 particle overlaps a wall", "3.0", "the wall \"z-\"", "raise `relax_distance`"] {
        assert!(walls.contains(words), "{words} is not in {walls}");
    }
}

/// Pseudo-random poses of bodies.
fn crowd(count: usize) -> String {
    let mut state = 5_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    };
    let entry = |_| {
        let [x, y, z, i, j, k, w] = std::array::from_fn(|_| random());
        let quaternion = [i - 0.5, j - 0.5, k - 0.5, w - 0.5];
        format!(
            "{{ position = [{x}, {y}, {z}], orientation = {{ quaternion = {quaternion:?} }}, angular_velocity = [1, -2, 3] }}, "
        )
    };
    (0..count).map(entry).collect()
}

#[test]
fn polyhedra_and_rods_come_apart_within_the_distance_beside_random_ones() {
    let stone = "{ polyhedron = { vertices = [[0, 0, 0], [2, 0, 0], [0.3, 1.5, 0], [0.2, 0.1, 1.2], [1, 0.9, 1]], \
                 equivalent_diameter = 0.13 } }";
    let rod = "{ capsule = { diameter = 0.08, length = 0.2 } }";
    let far = format!("{RELAX}\nrelax_distance = 0.2");
    let listed =
        |more: &str| format!("{}{}", section(stone, &crowd(40), more), section(rod, &crowd(10), more));
    let random = "[[particles]]\nshape = { sphere = { diameter = 0.1 } }\ndensity = 2500\ncount = 20\n";
    let refused = case(&listed("")).unwrap_err().to_string();
    assert!(refused.contains("pairs of particles overlap"), "{refused}");
    let setup = case(&format!("{}{random}", listed(&far))).unwrap();
    assert_eq!(setup.particles.len(), 70);
    assert!(deepest(&setup) <= 0.0, "{}", deepest(&setup));
    let alone = case(&listed(&far)).unwrap();
    assert_eq!(alone.particles[..], setup.particles[..50]);
    for particle in &setup.particles[..50] {
        // The angular velocity is that of the case, and the momentum that of the body as it lies now.
        assert_eq!(particle.angular_velocity(), Vec3::new(1.0, -2.0, 3.0));
        let template = &setup.templates[particle.template as usize];
        let turn = particle.orientation();
        let in_body = turn.inverse_transform_vector(&particle.angular_velocity());
        let momentum = turn * template.inertia().component_mul(&in_body);
        assert!((momentum - Vec3::from(particle.angular_momentum)).norm() < 1e-12 * momentum.norm());
    }
}

#[test]
fn keys_of_relaxing_are_refused_where_they_have_no_effect() {
    let random = "[[particles]]\nshape = { sphere = { diameter = 0.1 } }\ndensity = 2500\ncount = 5\n";
    let list = "[0.5, 0.5, 0.5]";
    for (text, key) in [
        (format!("{random}{RELAX}\n"), "particles.0.overlaps"),
        (section(BALL, list, "relax_distance = 0.1"), "particles.0.relax_distance"),
        (section(BALL, list, "overlaps = \"refuse\"\nrelax_distance = 0.1"), "particles.0.relax_distance"),
        (section(BALL, list, "minimum_gap = 0.1"), "particles.0.minimum_gap"),
        (section(BALL, list, "overlaps = \"move\""), "particles.0.overlaps"),
        (section(BALL, list, &format!("{RELAX}\nrelax_distance = 0")), "particles.0.relax_distance"),
        (
            section(BALL, list, &format!("{RELAX}\nrelax_distance.diameters = -1")),
            "particles.0.relax_distance.diameters",
        ),
        (section(BALL, list, &format!("{RELAX}\nseed = 1")), "particles.0.seed"),
    ] {
        let Err(crate::error::Error::Case { key: found, text, .. }) = case(&text) else { panic!("{text}") };
        assert_eq!(found, key, "{text}");
    }
}
