//! Claims about the files of a cross-check, and the list of its cases.

use super::*;
use crate::checks::{Check, Findings, Moment, write_tables};
use crate::crosscheck::{Against, CASES};
use std::fs;
use std::sync::Arc;
use turbid::math::Vec3;
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;

#[test]
fn a_case_leaves_its_plots_and_trajectories() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path().join("out");
    crate::checks::prepare(&directory).unwrap();
    let sphere = |radius| Template { shape: Arc::new(Sphere { radius }), density: 1.0, material: 0 };
    let particle = |template, x| Particle::at(template as u64, template, Vec3::new(x, 0.0, 3.0));
    let moment = |time| Moment {
        time,
        particles: [vec![particle(0, -1.0), particle(1, 0.0)], vec![particle(0, -1.0)]],
        templates: [sphere(0.5), sphere(0.25)].into(),
    };
    let mut found = Findings {
        checks: vec![Check::new("good", 0.0, 0.0, 0.0, "")],
        moments: vec![moment(0.0), moment(0.5)],
        ..Findings::default()
    };
    let line = vec![[0.0, 0.0], [1.0, 1.0]];
    found.plot_both("force", "force", ["d (m)", "F (N)"], [line.clone(), line], None);
    let outcomes = [Outcome::new("impact", "", Some(Against::liggghts().name), 0.0, Ok(found).into())];
    write_case(&directory, &outcomes[0]).unwrap();
    write_tables(&directory, "crosscheck", &outcomes).unwrap();
    let own = [
        "impact_force.png",
        "impact_force.svg",
        "impact_native.pvd",
        "impact_liggghts.pvd",
        "impact_native/0000.vtp",
        "impact_liggghts/0001.vtp",
    ];
    for name in own {
        assert!(directory.join(name).metadata().unwrap().len() > 100, "{name}");
    }
    let pvd = fs::read_to_string(directory.join("impact_native.pvd")).unwrap();
    assert!(pvd.contains("timestep=\"0.5\"") && pvd.contains("file=\"impact_native/0001.vtp\""));
}

#[test]
fn the_list_names_every_case_with_what_it_shows() {
    let text = crate::crosscheck::list();
    assert_eq!(text.lines().count(), CASES.len());
    for (line, case) in text.lines().zip(CASES) {
        assert!(line.trim_start().starts_with(case.name) && line.ends_with(case.question), "{line}");
    }
}
