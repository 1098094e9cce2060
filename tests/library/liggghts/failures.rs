//! Cases that LIGGGHTS refuses, that crash it, and that must never reach it.

use super::{DOMAIN, REST, advanced, contact, engine, moving, params, tank, templates, three, with_commands};
use std::os::unix::fs::PermissionsExt;
use std::sync::Arc;
use turbid::comm::Comm;
use turbid::dem::{DemEngine, Native, NativeParams};
use turbid::domain::{Decomposition, Domain};
use turbid::engine::liggghts::{Liggghts, LiggghtsParams};
use turbid::math::{Quat, Vec3};
use turbid::particle::Template;
use turbid::shape::{Composite, Cuboid, Part, Shape, Sphere};
use turbid::wall::{Motion, Surface};

/// Message of LIGGGHTS about a case that it does not take.
fn refusal(params: LiggghtsParams) -> String {
    match engine(params, &three()) {
        Ok(lgg) => advanced(lgg, 1, 1e-6).err().map_or_else(String::new, |e| e.to_string()),
        Err(error) => {
            assert_eq!(error.exit_code(), 2, "{error}");
            error.to_string()
        }
    }
}

#[test]
fn what_liggghts_refuses_comes_back_in_its_own_words_with_the_command() {
    for (commands, words) in [
        (&["fix extra nobody viscous 1"][..], "Could not find fix group ID"),
        (&["group some region nowhere"], "Group region ID does not exist"),
        (&["fix a all viscous 1 scale 2 1"], "Illegal fix viscous command"),
        (&["fix a all viscous 1", "fix a all drag 0 0 0 1 1"], "Replacing a fix, but new style"),
        (&["region r sphere 0 0 0 -1"], "Illegal region sphere command"),
        (&["neigh_modify one 1000 page 1000"], "page size"),
    ] {
        let text = refusal(with_commands(commands));
        assert!(text.contains("LIGGGHTS") && text.contains(words), "{commands:?}: {text}");
    }
    let text = refusal(params(Some(contact(1e7, 0.05, 0.3))));
    assert!(text.contains("0.05 < coefficientRestitution <= 1"), "{text}");
}

#[test]
fn a_crash_of_liggghts_is_an_error_with_its_signal_and_the_end_of_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("liggghts.log");
    // No command that is passed on crashes LIGGGHTS: another program in its place does.
    let program = folder.path().join("crashes.sh");
    std::fs::write(&program, "#!/bin/sh\necho the last words >&2\nkill -SEGV $$\n").unwrap();
    std::fs::set_permissions(&program, PermissionsExt::from_mode(0o755)).unwrap();
    let crashing = LiggghtsParams { log: Some(log.clone()), program: Some(program), ..params(None) };
    let text = refusal(crashing);
    assert!(text.contains("SIGSEGV") && text.contains("the last words"), "{text}");
    let next = engine(params(Some(contact(1e7, 0.7, 0.3))), &three()).unwrap();
    advanced(next, 3, 1e-6).unwrap();
}

#[test]
fn stiffness_beyond_the_usual_bounds_of_liggghts_is_accepted() {
    for modulus in [5e3, 7e10] {
        let lgg = engine(params(Some(contact(modulus, 0.9, 0.3))), &three()).unwrap();
        advanced(lgg, 2, 1e-9).unwrap();
    }
}

#[test]
fn in_this_process_an_error_leaves_the_next_case_as_it_would_have_been() {
    let own = |params: LiggghtsParams| LiggghtsParams { in_this_process: true, ..params };
    let model = Some(contact(1e7, 0.7, 0.3));
    let run = || advanced(engine(own(params(model.clone())), &three()).unwrap(), 600, 1e-6).unwrap();
    let first = run().particles().owned().to_vec();
    let in_worker = advanced(engine(params(model.clone()), &three()).unwrap(), 600, 1e-6).unwrap();
    assert_eq!(first, in_worker.particles().owned(), "here and there");
    for commands in [&["fix extra nobody viscous 1"], &["fix extra all viscous 1 scale 2 1"]] {
        let error = engine(own(with_commands(commands)), &three()).unwrap_err();
        assert!(error.to_string().contains("LIGGGHTS refuses"), "{error}");
        assert_eq!(run().particles().owned(), first, "after {commands:?}");
    }
    let holder = run();
    let error = engine(own(params(model)), &three()).unwrap_err();
    assert!(error.to_string().contains("in use"), "{error}");
    drop(holder);
    // The one after this is broken for good, and says so.
    engine(own(with_commands(&["fix a all viscous 1", "fix a all viscous 1 scale 2 1"])), &three())
        .unwrap_err();
    let error = engine(own(with_commands(&[])), &three()).unwrap_err();
    assert!(error.to_string().contains("broken"), "{error}");
}

#[test]
fn loads_and_states_that_are_no_numbers_never_reach_liggghts() {
    let mut lgg = engine(params(None), &three()).unwrap();
    let mut loads = [REST; 3];
    loads[1].torque.y = f64::NAN;
    let error = lgg.advance(&Comm::Solo, &loads, 1e-6).unwrap_err();
    assert!(error.to_string().contains("particle 10"), "{error}");
    assert_eq!(error.exit_code(), 3);
    let mut spoilt = three();
    spoilt[2].position[0] = f64::INFINITY;
    let error = engine(params(None), &spoilt).unwrap_err();
    assert!(error.to_string().contains("particle 12"), "{error}");
}

#[test]
fn a_particle_that_leaves_through_an_open_face_ends_the_run_at_once() {
    let (domain, _) = tank(Vec3::zeros());
    let cut = Decomposition::new(domain, 1).unwrap();
    let all = [moving(4, [8e-3, 8e-3, 1e-3], [0.0, 0.0, -1.0]), moving(5, [8e-3, 8e-3, 8e-3], [0.0; 3])];
    let mut lgg = Liggghts::new(params(None), cut, &Comm::Solo, templates(), &all).unwrap();
    let native = NativeParams { substeps: 1, ..NativeParams::default() };
    let cut = Decomposition::new(domain, 1).unwrap();
    let mut native = Native::new(native, cut, 0, templates(), &all).unwrap();
    let left = |engine: &mut dyn DemEngine| {
        let mut steps = 0;
        loop {
            if let Err(error) = engine.advance(&Comm::Solo, &[REST; 2], 1e-4) {
                assert_eq!(error.exit_code(), 3);
                return (steps, error.to_string());
            }
            steps += 1;
            assert!(steps < 100, "the particle has left");
        }
    };
    let text = left(&mut lgg);
    let of_native = left(&mut native);
    assert_eq!(text.0, of_native.0, "at the step of the native engine");
    assert!(text.1.contains("particle 4") && of_native.1.contains("particle 4"), "{text:?}");
}

#[test]
fn coinciding_centres_which_liggghts_passes_over_end_the_run() {
    let mut all = three();
    all[1].position = all[0].position;
    let lgg = engine(params(Some(contact(1e7, 0.7, 0.3))), &all).unwrap();
    // They come out with a state that is not finite, or as they went in: too deep in each other.
    let error = advanced(lgg, 1, 1e-9).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("deep") || text.contains("not finite"), "{text}");
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn a_box_too_large_for_its_particles_is_refused_with_liggghts_words() {
    let domain = Domain { cells: [8; 3], dx: 1.0, ..DOMAIN };
    let cut = Decomposition::new(domain, 1).unwrap();
    let params = params(Some(contact(1e7, 0.7, 0.3)));
    let error = Liggghts::new(params, cut, &Comm::Solo, templates(), &three()).unwrap_err();
    assert!(error.to_string().contains("bins"), "{error}");
}

#[test]
fn shapes_and_walls_that_liggghts_has_not_are_unsupported() {
    let half = |x: f64| Part {
        shape: Arc::new(Sphere { radius: 1e-3 }),
        position: Vec3::x() * x,
        orientation: Quat::identity(),
    };
    let shapes: [(Arc<dyn Shape>, &str); 2] = [
        (Arc::new(Cuboid::new(Vec3::repeat(1e-3)).unwrap()), "cuboid"),
        (Arc::new(Composite::new(vec![half(-1e-3), half(1e-3)]).unwrap().0), "composite"),
    ];
    for (shape, kind) in shapes {
        let template = Template { shape, density: 2500.0, material: 0 };
        let cut = Decomposition::new(DOMAIN, 1).unwrap();
        let error =
            Liggghts::new(params(None), cut, &Comm::Solo, Arc::new([template]), &three()).unwrap_err();
        assert!(error.to_string().contains(kind), "{error}");
    }
    let (_, mut walls) = tank(Vec3::new(0.0, 0.0, 0.1));
    let error =
        engine(LiggghtsParams { walls: walls.clone(), ..params(Some(contact(1e7, 0.7, 0.3))) }, &three())
            .unwrap_err();
    assert!(error.to_string().contains("`z-`"), "{error}");
    walls[0].motion = Motion::default();
    walls[0].surface = Surface::Plane { point: Vec3::zeros(), normal: Vec3::new(0.6, 0.0, 0.8) };
    let tilted = LiggghtsParams { walls, ..params(Some(contact(1e7, 0.7, 0.3))) };
    assert!(engine(tilted, &three()).unwrap_err().to_string().contains("across x, y or z"));
}

#[test]
fn no_particles_are_no_trouble() {
    advanced(engine(params(Some(contact(1e7, 0.7, 0.3))), &[]).unwrap(), 3, 1e-6).unwrap();
}
