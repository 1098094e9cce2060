use super::*;

#[test]
fn the_builder_ends_in_the_same_setup_as_a_case_file() {
    let text = "domain.size = [4e-3, 4e-3, 4e-3]\n\
                fluid = { density = 1000.0, viscosity = 1e-5 }\n\
                lattice = { cells_per_diameter = 4.0, relaxation_time = 0.6 }\n\
                run.end.steps = 1\n\
                [[particles]]\n\
                shape.sphere.diameter = 1e-3\n\
                density = 2500.0\n\
                list = [[2e-3, 2e-3, 2e-3]]\n";
    let read = case::from_text(text, NAME, &[]).unwrap();
    let built = Builder::example().setup().unwrap();
    let bare = |mut setup: Setup| {
        setup.provenance.text.clear();
        setup.provenance.warnings.clear();
        format!("{setup:?}")
    };
    assert_eq!(bare(built), bare(read));
}

#[test]
fn an_error_names_the_innermost_key_with_its_value_and_a_remedy() {
    let key = |builder: &Builder| match builder.setup() {
        Err(Error::Case { key, text, .. }) => {
            assert!(text.contains("-->") || text.contains("builder"), "{text}");
            key
        }
        other => panic!("{other:?}"),
    };
    let example = Builder::example;
    assert_eq!(key(&example().fluid(-1.0, 1e-5)), "fluid.density");
    assert_eq!(key(&example().set("fluid.viscositie", 1.0)), "fluid.viscositie");
    let outside = Particles::spheres(1e-3, 2500.0).at([1e-3; 3]).at([5e-3; 3]);
    assert_eq!(key(&example().particles(outside)), "particles.1.list.1");
    let nowhere = Particles::spheres(1e-3, f64::NAN).at([1e-3; 3]);
    assert_eq!(key(&example().particles(nowhere)), "particles.1.density");
    let sideways = Wall::plane("side", [0.0; 3], [0.0; 3]);
    assert!(key(&example().wall(sideways)).starts_with("walls.0.plane"));
    let without_lattice = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5);
    let sphere = Particles::spheres(1e-3, 2500.0).at([1e-3; 3]);
    assert_eq!(key(&without_lattice.particles(sphere)), "lattice");
    assert_eq!(key(&Builder::new([1e-3; 3]).fluid(1.0, 1.0).lattice(4.0, 0.6)), "particles");
}

#[test]
fn what_no_case_can_hold_is_refused_by_its_key() {
    let endless = Particles::spheres(1e-3, 2500.0).count(u64::MAX);
    let Err(Error::Case { key, .. }) = Builder::example().particles(endless).setup() else {
        panic!("accepted")
    };
    assert_eq!(key, "particles.1.count");
}

#[test]
fn a_shape_of_its_own_has_one_size() {
    let own: Arc<dyn Shape> = Arc::new(crate::shape::Sphere { radius: 5e-4 });
    let bodies = Particles::of_shape(own, 2500.0).at([1e-3; 3]);
    let example = Builder::example;
    assert!(example().particles(bodies.clone()).setup().is_ok());
    let scaled = bodies.set("shape.mesh.scale", 2.0);
    let error = example().particles(scaled).setup().unwrap_err();
    assert!(error.to_string().contains("cannot be scaled"), "{error}");
    let text = example().particles(
        Particles::of_shape(Arc::new(crate::shape::Sphere { radius: 5e-4 }), 2500.0).at([1e-3; 3]),
    );
    assert!(case::from_text(&text.to_toml(), "again", &[]).is_err(), "its name alone is no body");
}

#[test]
fn every_method_sets_its_key() {
    let example = Builder::example;
    let closed =
        example().periodic([true, true, false]).face_velocity("z+", [1e-2, 0.0, 0.0]).setup().unwrap();
    assert_eq!((closed.walls.len(), closed.walls[1].motion.velocity.at(0.0).x), (2, 1e-2));
    let wide = example().precision(Precision::F64).coupling(Coupling::Homogenised).setup().unwrap();
    assert_eq!(wide.plan.precision, Precision::F64);
    assert_eq!(wide.expect_fluid().coupling.name(), "homogenised");
    let hard = example().restitution(0.8).friction(0.3, 0.2).setup().unwrap().contact.unwrap();
    assert_eq!((hard.pairs[0].restitution, hard.pairs[0].friction_kinetic), (0.8, 0.2));
    let again = case::from_text(&example().to_toml(), "again", &[]).unwrap();
    assert_eq!(again.particles.len(), 1);
    example().build().unwrap().step().unwrap();
}

#[test]
fn bodies_have_the_shape_that_is_asked_for() {
    let corners = [[0.0; 3], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3]];
    for (bodies, kind, volume) in [
        (Particles::cuboids([1e-3, 1e-3, 4e-4], 2500.0), "cuboid", 4e-10),
        (Particles::polyhedra(&corners, 2500.0), "polyhedron", 1e-9 / 6.0),
    ] {
        let builder = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(12.0, 0.6);
        let setup = builder.particles(bodies.at([2e-3; 3])).setup().unwrap();
        assert_eq!(setup.templates[0].shape.kind(), kind);
        assert!((setup.templates[0].shape.volume() - volume).abs() < 1e-18);
    }
}
