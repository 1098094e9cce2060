//! Claims about what a case resolves to.

use super::*;
use crate::contact::{Body, Geometry, GrownShape, overlap, overlap_wall};
use crate::engine::{EngineChoice, EngineProcess, LiggghtsOptions};
use crate::fluid::Collision;
use crate::math::{Quat, Vec3};

const TEXT: &str = r"
    [domain]
    size = { diameters = [4, 5, 6] }
    [fluid]
    density = 1000
    archimedes = 1000
    [lattice]
    cells_per_diameter = 8
    relaxation_time = 0.55
    [[particles]]
    shape = { sphere = { diameter = 1.5e-3 } }
    density = 3300
    volume_fraction = 0.1
    [run]
    end = { stokes_times = 30 }
";

fn setup(options: &[&str]) -> Setup {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let source = Source::new("case.toml".to_string(), TEXT.to_string(), &options);
    resolve(&source, "case", Files::on_disk(Path::new("")), Places::Here(&mut Unfollowed))
        .unwrap_or_else(|e| panic!("{e}"))
}

fn close(a: f64, b: f64) {
    assert!((a / b - 1.0).abs() < 1e-12, "{a} is not {b}");
}

#[test]
fn all_ways_to_give_the_viscosity_and_the_time_step_agree() {
    let one = setup(&[]);
    close(one.expect_fluid().viscosity, (9.80665 * 2.3 * 1.5e-3_f64.powi(3) / 1000.0).sqrt());
    close(
        setup(&["fluid.galileo=31.622776601683793"]).expect_fluid().viscosity,
        one.expect_fluid().viscosity,
    );
    let two = setup(&[
        &format!("fluid.viscosity={:?}", one.expect_fluid().viscosity),
        &format!("lattice.time_step={:?}", one.time_step),
    ]);
    close(two.expect_fluid().scales.archimedes, 1000.0);
    close(two.expect_fluid().relaxation_time, 0.55);
}

#[test]
fn the_box_in_metres_is_that_in_diameters_and_any_rounding_is_said() {
    let one = setup(&[]);
    assert_eq!(one.domain.cells, [32, 40, 48]);
    let metres = setup(&["domain.size=[6e-3, 7.5e-3, 9e-3]"]);
    assert_eq!((metres.domain, metres.provenance.warnings.len()), (one.domain, 0));
    let rounded = setup(&["domain.size=[6.05e-3, 7.5e-3, 9e-3]"]);
    assert_eq!(rounded.domain, one.domain);
    assert!(rounded.provenance.warnings[0].contains("32 x 40 x 48"), "{}", rounded.provenance.warnings[0]);
}

#[test]
fn lengths_of_time_become_steps() {
    let one = setup(&[]);
    let per_stokes_time = one.expect_fluid().scales.stokes_time / one.time_step;
    assert_eq!(one.plan.end_step, (30.0 * per_stokes_time).round() as u64);
    assert_eq!(one.plan.average_from_step, one.plan.end_step / 3);
    assert_eq!(one.plan.output.fields_every, one.plan.end_step / 5);
    let seconds = format!("run.end.time={:?}", 1000.0 * one.time_step);
    let two = setup(&[
        &seconds,
        "output.series_every.steps=7",
        "output.fields_every=never",
        "run.average_from.steps=0",
    ]);
    assert_eq!((two.plan.end_step, two.plan.average_from_step), (1000, 0));
    assert_eq!((two.plan.output.series_every, two.plan.output.fields_every), (7, 0));
    assert_eq!(two.plan.output.directory, Path::new("out/case"));
}

#[test]
fn a_case_without_weight_has_no_stokes_time_and_still_resolves() {
    let setup = setup(&["driving.gravity=0", "fluid.viscosity=1e-6", "run.end.steps=10"]);
    assert!(
        setup.expect_fluid().scales.stokes_time.is_infinite()
            && setup.expect_fluid().scales.schiller_naumann_velocity == 0.0
    );
    assert_eq!(setup.plan.output.picture_every, 1);
}

#[test]
fn kinds_of_particles_share_the_box_without_overlap_and_have_numbers_of_their_own() {
    let kind = "{ shape = { sphere = { diameter = 0.75e-3 } }, density = 2500, count = 40, seed = 5 }";
    let moving = "[[1e-3, 1e-3, 1e-3], { position = [3e-3, 3e-3, 9e-3], velocity = [0, 0, -0.1], \
                  angular_velocity = [2, 0, 0] }]";
    let listed = format!("{{ shape.sphere.diameter = 1.5e-3, density = 3300, list = {moving} }}");
    let setup = setup(&[&format!("particles=[{listed}, {kind}]")]);
    assert_eq!(setup.particles.len(), 42);
    for (i, p) in setup.particles.iter().enumerate() {
        assert_eq!((p.id, p.template), (i as u64, u64::from(i >= 2)));
        let radius =
            |p: &crate::particle::Particle| setup.templates[p.template as usize].shape.circumradius();
        for q in &setup.particles[..i] {
            let apart = setup.domain.nearest_image(p.position() - q.position()).norm();
            assert!(apart > radius(p) + radius(q));
        }
    }
    let spinning = &setup.particles[1];
    close(spinning.angular_momentum[0], 2.0 * setup.templates[0].inertia().x);
    assert_eq!(spinning.velocity(), Vec3::new(0.0, 0.0, -0.1));
    let offset = setup.domain.nearest_image(spinning.position() - Vec3::new(3e-3, 3e-3, 0.0));
    assert!(offset.norm() < 1e-12, "the upper face is the lower one");
}

#[test]
fn contacts_can_be_left_out_and_are_those_of_the_paper_otherwise() {
    assert!(setup(&["contact.enabled=false"]).contact.is_none());
    let contact = setup(&["contact.geometry=sampled"]).contact.unwrap();
    assert_eq!(contact.geometry, Geometry::Sampled { samples: 8 });
    close(contact.enlargement, 0.2 * 1.5e-3 / 8.0);
    close(contact.pairs[0].restitution, 0.926);
}

#[test]
fn the_native_engine_moves_the_particles_unless_the_case_asks_for_liggghts_in_a_process_of_its_own() {
    assert_eq!(setup(&[]).engine, EngineChoice::Native);
    assert_eq!(setup(&["dem.engine=native"]).engine, EngineChoice::Native);
    let bare = setup(&["dem.engine=liggghts"]).engine;
    assert_eq!(bare, EngineChoice::Liggghts(LiggghtsOptions::default()));
    let full = setup(&[
        "dem.engine=liggghts",
        "dem.liggghts.process=own",
        "dem.liggghts.commands=[\" group a type 1\", \"fix slow a viscous 1e-6  # drag\"]",
    ]);
    let options = LiggghtsOptions {
        process: EngineProcess::Own,
        commands: vec!["group a type 1".to_string(), "fix slow a viscous 1e-6".to_string()],
        timeout: None,
    };
    assert_eq!(full.engine, EngineChoice::Liggghts(options));
    assert_eq!(bare.name(), "liggghts");
}

#[test]
fn a_saved_case_passes_on_no_other_commands_than_one_that_is_read() {
    let with = |command: &str| {
        let dem = format!("[dem]\nengine = \"liggghts\"\nliggghts.commands = ['{command}']\n");
        from_saved("case", &format!("{TEXT}{dem}"), &[], &[])
    };
    assert!(with("fix slow all viscous 1e-6").is_ok());
    for command in ["print x file y", "write_data y", "group \"x y\" type 1"] {
        let text = with(command).unwrap_err().to_string();
        assert!(text.contains("`dem.liggghts.commands.0`"), "{text}");
    }
}

const SHAPE: &str = "particles.0.shape";

#[test]
fn every_shape_has_the_volume_that_its_equivalent_diameter_asks_for() {
    for shape in [
        "cube = {",
        "cuboid = { edges = [1, 2, 3],",
        "ellipsoid = { axes = [2, 1, 1],",
        "cylinder = { diameter = 1, length = 2,",
        "capsule = { diameter = 1, length = 2,",
        "superellipsoid = { axes = [1, 1, 1], exponents = [0.5, 0.5],",
        "polyhedron = { vertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],",
    ] {
        let option = format!("{SHAPE}={{ {shape} equivalent_diameter = 1.2e-3 }} }}");
        let size = "domain.size.diameters=[5, 5, 6]";
        let setup = setup(&[&option, "particles.0.count=2", size]);
        close(setup.diameter, 1.2e-3);
        close(setup.templates[0].shape.volume(), std::f64::consts::PI / 6.0 * 1.2e-3_f64.powi(3));
        assert_eq!(setup.domain.cells, [40, 40, 48], "{shape}");
    }
}

#[test]
fn lengths_of_shapes_are_from_end_to_end() {
    for (shape, half) in [
        ("cuboid = { edges = [1e-3, 1.2e-3, 1.4e-3] }", [0.5e-3, 0.6e-3, 0.7e-3]),
        ("ellipsoid = { axes = [1e-3, 1.2e-3, 1.4e-3] }", [0.5e-3, 0.6e-3, 0.7e-3]),
        ("cylinder = { diameter = 1e-3, length = 1.4e-3 }", [0.5e-3, 0.5e-3, 0.7e-3]),
        ("capsule = { diameter = 1e-3, length = 1.4e-3 }", [0.5e-3, 0.5e-3, 0.7e-3]),
    ] {
        let setup = setup(&[&format!("{SHAPE}={{ {shape} }}"), "particles.0.count=1"]);
        let (low, high) = setup.templates[0].shape.bounds(&Quat::identity());
        assert!((high - Vec3::from(half)).norm() < 1e-9 && (low + high).norm() < 1e-9, "{shape}");
    }
}

#[test]
fn a_polyhedron_is_turned_as_it_was_drawn_wherever_its_principal_axes_are() {
    let vertices = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.2, 0.1, 0.7], [1.0, 0.9, 0.6]];
    let list = "[{ position = [3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 2], angle = 90 } }]";
    let setup = setup(&[
        &format!("{SHAPE}={{ polyhedron = {{ vertices = {vertices:?}, equivalent_diameter = 1.5e-3 }} }}"),
        &format!("particles.0.list={list}"),
        "domain.size.diameters=[6, 6, 6]",
    ]);
    let (shape, particle) = (&setup.templates[0].shape, &setup.particles[0]);
    let corners: Vec<Vec3> =
        (shape.as_polyhedron().unwrap().vertices.iter()).map(|v| particle.orientation() * v).collect();
    // Differences of the drawn corners, by a quarter turn about z, each found among those of the body.
    let drawn: Vec<Vec3> = vertices.iter().map(|v| Vec3::new(-v[1], v[0], v[2])).collect();
    let spread = |points: &[Vec3]| {
        let middle = points.iter().sum::<Vec3>() / points.len() as f64;
        let longest = points.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
        points.iter().map(|p| (p - middle) / longest).collect::<Vec<_>>()
    };
    let (here, there) = (spread(&corners), spread(&drawn));
    for corner in &there {
        let nearest = here.iter().map(|p| (p - corner).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-9, "{nearest}");
    }
}

#[test]
fn the_angular_momentum_of_a_turned_body_is_that_of_its_turned_inertia() {
    let list = "[{ position = [3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 1], angle = 90 }, \
                angular_velocity = [5, 0, 0] }]";
    let setup = setup(&[
        &format!("{SHAPE}={{ cuboid = {{ edges = [1e-3, 1.2e-3, 1.4e-3] }} }}"),
        &format!("particles.0.list={list}"),
    ]);
    // The y axis of the body lies along the x axis of the box.
    let momentum = setup.particles[0].angular_momentum;
    close(momentum[0], 5.0 * setup.templates[0].inertia().y);
    assert!(momentum[1].abs() + momentum[2].abs() < 1e-12 * momentum[0]);
}

#[test]
fn sizes_have_their_shares_of_the_particles_and_the_volume_fraction_holds_for_all() {
    let setup = setup(&[
        "particles.0.sizes=[{ scale = 1, share = 1 }, { scale = 0.5, share = 3 }]",
        "particles.0.count=21",
    ]);
    let count = |template: u64| setup.particles.iter().filter(|p| p.template == template).count();
    assert_eq!((count(0), count(1)), (5, 16));
    close(setup.templates[1].shape.circumradius(), 0.375e-3);
    close(setup.diameter, 1.5e-3);
    let spread = super::tests::setup(&["particles.0.sizes={ uniform = [0.5, 1], steps = 4 }"]);
    let radii: Vec<f64> = spread.templates.iter().map(|t| t.shape.circumradius() / 0.75e-3).collect();
    for (radius, factor) in radii.iter().zip([0.5625, 0.6875, 0.8125, 0.9375]) {
        close(*radius, factor);
    }
    let fraction = spread.volume_fraction;
    assert!((0.095..0.11).contains(&fraction), "{fraction}");
}

#[test]
fn closed_faces_are_walls_that_bear_the_weight_and_particles_stay_between_them() {
    let setup = setup(&[
        "domain.periodic=[true, true, false]",
        "domain.faces.z+={ velocity = [1e-3, 2e-3, 0], material = \"steel\" }",
        "materials=[{ name = \"steel\", youngs_modulus = 2e6 }]",
        "contact.pairs=[{ materials = [\"default\", \"steel\"], restitution = 0.5 }]",
        "lattice.coupling=paper",
        "lattice.collision=trt",
        "particles.0.volume_fraction=0.25",
    ]);
    let size = setup.domain.size();
    let [low, high] = &setup.walls[..] else { panic!("{:?}", setup.walls) };
    assert_eq!((low.name.as_str(), high.name.as_str()), ("z-", "z+"));
    assert_eq!(low.motion.pivot, Vec3::new(0.5 * size.x, 0.5 * size.y, 0.0));
    assert_eq!(high.motion.velocity, Vec3::new(1e-3, 2e-3, 0.0).into());
    assert!((high.surface.distance(Vec3::zeros()) - size.z).abs() < 1e-15);
    let contact = setup.contact.as_ref().unwrap();
    close(contact.materials[high.material].youngs_modulus, 2e6);
    close(contact.materials[high.material].poisson_ratio, contact.materials[0].poisson_ratio);
    close(contact.pair(high.material, 0).restitution, 0.5);
    close(contact.pair(0, 0).restitution, 0.926);
    close(contact.pair(high.material, high.material).restitution, 0.926);
    assert_eq!(setup.expect_fluid().collision, Collision::Trt { magic: 0.1875 });
    assert_eq!(setup.expect_fluid().net_flux, [None; 3]);
    for particle in &setup.particles {
        assert!((0.75e-3..=size.z - 0.75e-3).contains(&particle.position[2]));
    }
}

#[test]
fn a_pipe_leaves_its_inside_to_fluid_and_particles() {
    let pipe =
        "[{ name = \"pipe\", pipe = { point = [3e-3, 3.75e-3, 0], axis = [0, 0, 2], diameter = 6e-3 } }]";
    let setup = setup(&[&format!("walls={pipe}"), "particles.0.volume_fraction=0.2"]);
    let inside = std::f64::consts::PI / 4.0 * 36e-6 * setup.domain.size().z;
    let solid = setup.particles.len() as f64 * setup.templates[0].shape.volume();
    assert!((setup.volume_fraction * inside / solid - 1.0).abs() < 0.02);
    for particle in &setup.particles {
        assert!(setup.walls[0].surface.distance(particle.position()) >= 0.75e-3);
    }
}

#[test]
fn bodies_of_all_kinds_share_a_closed_box_without_overlap() {
    let kind = |shape: &str| format!("{{ shape = {{ {shape} }}, density = 2500, volume_fraction = 0.1 }}");
    let kinds = [
        kind("cube = { equivalent_diameter = 0.9e-3 }"),
        kind("cuboid = { edges = [2, 1, 1], equivalent_diameter = 0.9e-3 }"),
        kind("sphere = { diameter = 0.9e-3 }"),
    ];
    let setup = setup(&[
        &format!("particles=[{}]", kinds.join(", ")),
        "domain.size=[5e-3, 5e-3, 5e-3]",
        "domain.periodic=[true, false, false]",
        "lattice.cells_per_diameter=9",
    ]);
    assert!(setup.volume_fraction > 0.3);
    let contours: Vec<GrownShape> =
        (setup.templates.iter()).map(|t| GrownShape::new(t.shape.clone(), 0.0)).collect();
    let body = |p: &crate::particle::Particle| Body {
        grown: &contours[p.template as usize],
        orientation: p.orientation(),
    };
    for (i, a) in setup.particles.iter().enumerate() {
        for b in &setup.particles[..i] {
            let offset = setup.domain.nearest_image(b.position() - a.position());
            let overlap = overlap(Geometry::Exact, &body(a), &body(b), offset);
            assert!(overlap.is_none(), "{a:?} {b:?}");
        }
        for wall in &setup.walls {
            let seen = wall.surface.seen_from(a.position());
            assert!(overlap_wall(Geometry::Exact, &body(a), &seen).is_none());
        }
    }
}

const DRY: &str = r"
    [domain]
    size = [0.1, 0.05, 0.2]
    periodic = [false, false, false]
    [dry]
    impact_speed = 0.5
    [[particles]]
    shape = { cube = { edge = 3e-3 } }
    density = 2500
    count = 50
    [run]
    end = { time = 0.1 }
";

#[test]
fn a_dry_run_has_a_box_of_its_exact_size_and_a_step_that_is_a_part_of_a_contact() {
    let source = Source::new("case.toml".to_string(), DRY.to_string(), &[]);
    let setup = resolve(&source, "case", Files::on_disk(Path::new("")), Places::Here(&mut Unfollowed))
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(setup.fluid.is_none() && setup.provenance.warnings.is_empty());
    assert!((setup.domain.size() - Vec3::new(0.1, 0.05, 0.2)).norm() < 1e-12);
    assert!(setup.domain.dx <= 0.25 * setup.diameter);
    close(50.0 * setup.time_step, setup.spheres(0).unwrap().duration(0.5));
    assert_eq!((setup.walls.len(), setup.fluid_density().to_bits()), (6, 0));
    assert!(setup.stokes_time().is_none() && setup.contact.unwrap().enlargement.abs() < 1e-300);
}

#[test]
fn an_outline_has_the_numbers_of_the_case_without_its_random_particles() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("case.toml");
    std::fs::write(&path, TEXT).unwrap();
    let whole = load(&path, &[]).unwrap();
    let outline = outline(&path, &[]).unwrap();
    assert!(whole.particles.len() > 20 && outline.particles.is_empty());
    close(outline.volume_fraction, whole.volume_fraction);
    assert_eq!(
        (outline.plan.end_step, outline.provenance.text),
        (whole.plan.end_step, whole.provenance.text)
    );
    // Two hundred million particles.
    let huge = ["domain.size={ diameters = [1e3, 1e3, 1e3] }".to_string()];
    let fraction = super::outline(&path, &huge).unwrap().volume_fraction;
    assert!((fraction - 0.1).abs() < 1e-8, "{fraction}");
}

/// Smallest distance between the surfaces of spheres (m).
fn smallest_gap(setup: &Setup) -> f64 {
    let radius = setup.templates[0].shape.as_sphere().unwrap();
    let mut least = f64::INFINITY;
    for (i, a) in setup.particles.iter().enumerate() {
        for b in &setup.particles[..i] {
            let offset = setup.domain.nearest_image(a.position() - b.position());
            least = least.min(offset.norm() - 2.0 * radius);
        }
    }
    least
}

#[test]
fn random_particles_do_not_begin_in_contact_on_any_grid() {
    for cells in [5, 8, 12, 18] {
        let cells = format!("lattice.cells_per_diameter={cells}");
        let dense = setup(&[&cells, "particles.0.volume_fraction=0.3"]);
        let grown = 2.0 * dense.contact.as_ref().unwrap().enlargement;
        assert!(dense.particles.len() > 60);
        assert!(smallest_gap(&dense) > grown, "{} of {grown}", smallest_gap(&dense));
        assert!(dense.provenance.warnings.is_empty(), "{:?}", dense.provenance.warnings);
    }
}

#[test]
fn random_particles_that_begin_in_contact_are_said() {
    let asked = setup(&["particles.0.minimum_gap=1e-5"]);
    assert!(asked.provenance.warnings[0].contains("begin in contact"), "{:?}", asked.provenance.warnings);
    // There is no room for gaps of a third of a diameter at this volume fraction.
    let crowded = setup(&["particles.0.volume_fraction=0.3", "contact.enlargement=1.5"]);
    let grown = 2.0 * crowded.contact.as_ref().unwrap().enlargement;
    assert!(smallest_gap(&crowded) < grown);
    assert!(crowded.provenance.warnings[0].contains("begin in contact"), "{:?}", crowded.provenance.warnings);
    let none = setup(&["particles.0.minimum_gap=1e-5", "contact.enabled=false"]);
    assert!(none.provenance.warnings.is_empty(), "{:?}", none.provenance.warnings);
}

#[test]
fn a_volume_fraction_that_whole_particles_miss_is_said_with_the_numbers_on_both_sides() {
    let box_of = |edge: &str, fraction: f64| {
        setup(&[
            &format!("domain.size.diameters=[{edge}, {edge}, {edge}]"),
            &format!("particles.0.volume_fraction={fraction}"),
        ])
    };
    let rounded = box_of("4", 0.05);
    close(rounded.volume_fraction, 7.0 * std::f64::consts::PI / 6.0 / 64.0);
    close(rounded.requested_volume_fraction, 0.05);
    let [warning] = &rounded.provenance.warnings[..] else { panic!("{:?}", rounded.provenance.warnings) };
    assert!(warning.contains("is 0.05, but 7 whole particles make it 0.0573"), "{warning}");
    assert!(warning.contains("`count = 6` makes it 0.0491"), "{warning}");
    let one = &box_of("4", 0.006).provenance.warnings[0];
    assert!(one.contains("1 whole particle makes it 0.0082") && !one.contains("`count = 0`"), "{one}");
    assert!(box_of("8", 0.1).provenance.warnings.is_empty());
    let counted = setup(&["particles.0={ shape.sphere.diameter = 1.5e-3, density = 3300, count = 5 }"]);
    assert_eq!(counted.requested_volume_fraction.to_bits(), counted.volume_fraction.to_bits());
}
