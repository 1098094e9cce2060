//! Faces of the box that are no walls for the fluid: inlets, outlets, and planes of symmetry.

mod patch;
mod profile;

use super::Setup;
use super::checks::Document;
use super::file::{
    FACES, FaceSection, GivenProfile, InletProfileSection, InletSection, ProfileKind, VariableVector,
    VectorSection,
};
use super::walls::PlacedWall;
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::math::{Patch, Profile, TimeFunction};
use crate::units::Units;
use crate::wall::Inlet;
use patch::{parabola_of, patch};
use profile::{parabola, table};
use std::collections::BTreeMap;

/// Largest density of an outlet over the reference, minus 1: the pressure is linear in the density.
const LARGEST_EXCESS: f64 = 0.1;

/// Rate at which the pressure of an outlet that absorbs sound returns to its value, over the speed of sound divided by the length of the box.
///
/// Reference: Poinsot, Lele (1992), doi:10.1016/0021-9991(92)90046-2: 0.25 reflects little and lets the mean pressure drift little.
const RELAXATION: f64 = 0.25;

/// Sets the kinds of the faces, outlets at the reference density; returns the inlets by numbers of walls.
pub(super) fn open_faces(
    document: &Document,
    domain: &mut Domain,
    walls: &[PlacedWall],
) -> Result<BTreeMap<usize, Inlet>> {
    let sections = FACES.map(|name| document.case.domain.faces.get(name));
    for (n, section) in sections.iter().enumerate() {
        let Some(section) = section.filter(|_| domain.faces[n] != Face::Periodic) else { continue };
        domain.faces[n] = kind(document, &format!("domain.faces.{}", FACES[n]), section)?;
    }
    let key = |n: usize, of: &str| format!("domain.faces.{}.{of}", FACES[n]);
    let inlet = (0..6).find(|&n| domain.faces[n] == Face::Inlet);
    if let Some(n) = inlet.filter(|_| !domain.faces.iter().any(|face| matches!(face, Face::Outlet { .. }))) {
        let title = format!("the face \"{}\" lets fluid in, but no face lets it out", FACES[n]);
        let remedy = "give another face an outlet, e.g. \"x+\" = { outlet = { pressure = 0 } }";
        return Err(document.error(&key(n, "inlet"), &title, "mass would pile up", remedy));
    }
    let special = (0..6).find(|&n| !domain.faces[n].is_plain());
    if let (Some(n), true) = (special, document.case.contact.lubrication.is_some()) {
        let face = format!("domain.faces.{}", FACES[n]);
        let marks = [("contact.lubrication", "knows no-slip walls"), (&*face, "no such wall")];
        let title = "`contact.lubrication` has no law for films at inlets, outlets and faces with free slip";
        return Err(document.error_at(
            &marks,
            title,
            "remove `contact.lubrication`, or make the face a wall",
        ));
    }
    for n in 0..6 {
        let section = sections[n].and_then(|section| section.outlet.as_ref()?.patch.as_ref());
        let Some(section) = section else { continue };
        let found = patch(document, domain, walls, (n, &key(n, "outlet.patch")), section)?;
        if let Face::Outlet { patch, .. } = &mut domain.faces[n] {
            // For good: a few bytes, of a list some kB, of each case that has one.
            *patch = Some(Box::leak(Box::new(found.scaled(1.0 / domain.dx))));
        }
    }
    let mut inlets = BTreeMap::new();
    for (number, placed) in walls.iter().enumerate().filter(|(_, placed)| placed.is_face) {
        let Some(n) = Setup::face_of(&placed.wall) else { continue };
        let Some(section) = sections[n].and_then(|section| section.inlet.as_ref()) else { continue };
        let of_patch = |section| patch(document, domain, walls, (n, &key(n, "inlet.patch")), section);
        let patch = section.patch.as_ref().map(of_patch).transpose()?;
        let profile = match (&section.profile, &patch) {
            (InletProfileSection::Named(ProfileKind::Uniform), _) => Profile::Uniform,
            (InletProfileSection::Named(ProfileKind::Parabolic), None) => {
                parabola(document, domain, walls, n)?
            }
            (InletProfileSection::Named(ProfileKind::Parabolic), Some(patch)) => parabola_of(domain, patch),
            (InletProfileSection::Given(GivenProfile::Table(rows)), _) => {
                table(document, domain, &key(n, "inlet.profile.table"), n, rows)?
            }
        };
        let velocity = velocity(document, &key(n, "inlet.velocity"), section, n)?;
        inlets.insert(number, Inlet { velocity, profile, patch });
    }
    Ok(inlets)
}

/// Gives outlets their densities, once the units of the lattice are known; returns the pressures (Pa, along x) that vary, by numbers of
/// walls.
pub(super) fn set_pressures(
    document: &Document,
    domain: &mut Domain,
    walls: &[PlacedWall],
    units: &Units,
) -> Result<BTreeMap<usize, TimeFunction>> {
    let mut varying = BTreeMap::new();
    for (n, name) in FACES.into_iter().enumerate() {
        let length = domain.cells[n / 2] as f64;
        let Face::Outlet { excess, relaxation, .. } = &mut domain.faces[n] else { continue };
        let section = document.case.domain.faces.get(name).and_then(|face| face.outlet.as_ref());
        let absorbs = section.is_some_and(|outlet| outlet.absorbs_sound);
        *relaxation = absorbs.then(|| RELAXATION / (3.0_f64.sqrt() * length));
        let pressure = section.map_or_else(TimeFunction::default, |outlet| outlet.pressure.function());
        let largest = pressure.largest().x;
        if let Some(pressure) = pressure.constant() {
            *excess = pressure.x / units.pressure();
        } else if let Some(number) = walls.iter().position(|placed| placed.wall.name == name) {
            varying.insert(number, pressure.clone());
        }
        if largest > LARGEST_EXCESS * units.pressure() {
            let most = LARGEST_EXCESS * units.pressure();
            let remedy = "a smaller time step raises the limit: the lattice stores pressure as density";
            let key = format!("domain.faces.{name}.outlet.pressure");
            let wanted = format!("from {:.4e} to {most:.4e}", -most);
            let found = pressure.constant().map_or(largest, |pressure| pressure.x);
            return Err(document.out_of_range(&key, found, &wanted, remedy));
        }
    }
    Ok(varying)
}

impl Setup {
    /// Description of a closed face of the box, given by its number among the walls, that is no wall for the fluid.
    pub fn passage(&self, wall: usize) -> Option<String> {
        let face = Self::face_of(&self.walls[wall])?;
        match self.domain.faces[face] {
            Face::Inlet => {
                let Inlet { velocity, profile, patch } = self.inlets.get(&wall)?;
                let (v, varies) = match velocity.constant() {
                    Some(v) => (v, ""),
                    None => (velocity.largest(), "varying, at most "),
                };
                let profile = match profile {
                    Profile::Uniform => "uniform".to_string(),
                    Profile::Parabolic(_) | Profile::Round { .. } | Profile::Each(_) => {
                        "parabolic".to_string()
                    }
                    Profile::Table { grid, .. } => {
                        let [width, height] = grid.points.each_ref().map(Vec::len);
                        format!(
                            "table of {width} x {height} points with factors up to {:.3e}",
                            profile.largest()
                        )
                    }
                };
                let of = self.part_of_face(
                    face,
                    patch.as_ref().map(|patch| patch.scaled(1.0 / self.domain.dx)).as_ref(),
                );
                Some(format!("inlet{of}, {profile}, {varies}({:.3e}, {:.3e}, {:.3e}) m/s", v.x, v.y, v.z))
            }
            Face::Outlet { excess, relaxation, patch } => {
                let absorbs = if relaxation.is_some() { ", absorbs sound" } else { "" };
                let (pressure, varies) = match self.pressures.get(&wall) {
                    Some(varying) => (varying.largest().x, "varying, at most "),
                    None => (excess * self.units().pressure(), ""),
                };
                let of = self.part_of_face(face, patch);
                Some(format!("outlet{of}, pressure {varies}{pressure:.3e} Pa{absorbs}"))
            }
            Face::FreeSlip => Some("free slip".to_string()),
            Face::Periodic | Face::Wall => None,
        }
    }
}

impl Setup {
    /// Says that an inlet or outlet has only a part of its face, lengths in cells.
    fn part_of_face(&self, face: usize, patch: Option<&Patch>) -> String {
        let count = patch.map(|patch| patch::cells(&self.domain, face, patch).count());
        count.map_or_else(String::new, |count| format!(", {count} cells of the face"))
    }

    /// Bound of the magnitude (Pa) of the pressure over time of an outlet that varies it; 0 of other faces.
    pub(super) fn largest_change_of_pressure(&self, face: usize) -> f64 {
        let wall = self.walls.iter().position(|wall| Self::face_of(wall) == Some(face));
        wall.and_then(|wall| self.pressures.get(&wall)).map_or(0.0, |pressure| pressure.largest().x)
    }
}

/// The kind of a closed face.
fn kind(document: &Document, key: &str, section: &FaceSection) -> Result<Face> {
    let given = [
        ("inlet", section.inlet.is_some(), Face::Inlet),
        ("outlet", section.outlet.is_some(), Face::Outlet { excess: 0.0, relaxation: None, patch: None }),
        ("free_slip", section.free_slip, Face::FreeSlip),
    ];
    let given: Vec<_> = given.into_iter().filter(|(_, is_given, _)| *is_given).collect();
    let &[(name, _, face)] = &given[..] else {
        let [(first, ..), (second, ..), ..] = given[..] else { return Ok(Face::Wall) };
        let [first, second] = [first, second].map(|name| format!("{key}.{name}"));
        let marks = [(&*first, "one kind"), (&*second, "another kind")];
        let title = format!("`{first}` and `{second}` contradict each other");
        return Err(document.error_at(&marks, &title, "remove one of them"));
    };
    let of_face = format!("{key}.{name}");
    let moves = !section.velocity.function().is_zero();
    if moves || section.rotation != 0.0 {
        let motion = format!("{key}.{}", if moves { "velocity" } else { "rotation" });
        let marks = [(&*motion, "of a wall"), (&*of_face, "no wall")];
        let title = format!("`{motion}` moves a wall, but `{of_face}` makes the face another kind");
        let remedy = match face {
            Face::Inlet => "remove it; the fluid has the velocity in `inlet`",
            _ => "remove one of them",
        };
        return Err(document.error_at(&marks, &title, remedy));
    }
    if document.case.dry.is_some() {
        let title = format!("`{of_face}` is of the fluid, but this case is dry");
        return Err(document.error(&of_face, &title, "no fluid", "remove it: bodies meet a wall there"));
    }
    Ok(face)
}

/// The velocity of an inlet, which must be along its normal and not out of the box all the time.
fn velocity(
    document: &Document,
    key: &str,
    section: &InletSection,
    face: usize,
) -> Result<crate::math::TimeFunction> {
    let (axis, name, function) = (face / 2, ["x", "y", "z"][face / 2], section.velocity.function());
    let largest = function.largest();
    if let Some(other) = (0..3).find(|&a| a != axis && largest[a] != 0.0) {
        let title = format!(
            "`{key}` has a component along {}, but fluid comes in along the normal, {name}",
            ["x", "y", "z"][other]
        );
        return Err(document.error(key, &title, "not along the normal", &format!("take 0 but for {name}")));
    }
    let inwards = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let highest = match &section.velocity {
        VectorSection::Constant(velocity) => velocity[axis] * inwards,
        VectorSection::Variable(VariableVector::Table(rows)) => {
            rows.iter().map(|row| row[axis + 1] * inwards).fold(f64::NEG_INFINITY, f64::max)
        }
        VectorSection::Variable(VariableVector::Oscillation(of)) => {
            of.mean[axis] * inwards + of.amplitude[axis].abs()
        }
    };
    if highest < 0.0 {
        let title = format!("`{key}` points out of the box at all times");
        let remedy =
            format!("a velocity into the box has the other sign along {name}; fluid leaves by an outlet");
        return Err(document.error(key, &title, "out of the box", &remedy));
    }
    Ok(function)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;
    use crate::math::Vec3;

    fn setup(faces: &str, more: &str) -> Setup {
        let text = format!(
            "domain = {{ size = [8e-3, 4e-3, 4e-3], periodic = [false, true, false] }}\n\
             fluid = {{ density = 1000, viscosity = 1e-6 }}\n\
             lattice = {{ cells_per_diameter = 5, relaxation_time = 0.6 }}\n\
             run.end.steps = 10\n\
             particles = [{{ shape.sphere.diameter = 1e-3, density = 2000, list = [] }}]\n{more}"
        );
        from_text(&text, "open", &[format!("domain.faces={faces}")]).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn each_kind_of_face_is_what_the_case_says_in_units_of_the_lattice() {
        let setup = setup(
            "{ x-.inlet = { velocity = [1e-3, 0, 0], profile = \"parabolic\" }, \"x+\".outlet.pressure = 0.02, \
             \"z+\".free_slip = true }",
            "",
        );
        let [left, right, _, _, floor, top] = setup.domain.faces;
        assert_eq!([left, floor, top], [Face::Inlet, Face::Wall, Face::FreeSlip]);
        let Face::Outlet { excess, relaxation: None, .. } = right else { panic!("{right:?}") };
        // p = c_s^2 rho' with c_s^2 = (dx / dt)^2 / 3.
        let speed = setup.domain.dx / setup.time_step;
        assert!((excess * 1000.0 * speed * speed / 3.0 - 0.02).abs() < 1e-12);
        // Half of the profile between walls 8 mm apart.
        assert_eq!(setup.inlets[&0].profile, Profile::Parabolic([None, None, Some([0.0, 8e-3])]));
        assert_eq!(setup.inlets[&0].velocity.at(0.0), Vec3::new(1e-3, 0.0, 0.0));
        assert_eq!(setup.open_faces(), [0, 1]);
        let absorbing = super::tests::setup("{ \"x+\".outlet.absorbs_sound = true }", "");
        let Face::Outlet { relaxation: Some(rate), .. } = absorbing.domain.faces[1] else {
            panic!("{absorbing:?}")
        };
        // A quarter of the speed of sound over the 40 cells along x.
        assert!((rate * 160.0 * 3.0_f64.sqrt() - 1.0).abs() < 1e-12);
        let described: Vec<_> = (0..setup.walls.len()).map(|wall| setup.passage(wall)).collect();
        let starts = ["inlet, parabolic, (1.000e-3", "outlet, pressure 2.000e-2 Pa", "", "free slip"];
        for (text, start) in described.iter().zip(starts) {
            assert!(text.clone().unwrap_or_default().starts_with(start), "{described:?}");
        }
        // Fluid may leave along y as well: nothing holds its flux at zero.
        assert_eq!(setup.expect_fluid().net_flux, [None; 3]);
    }

    #[test]
    fn parts_of_faces_and_pressures_over_time_are_those_of_the_case() {
        let faces = "{ x-.inlet = { velocity = [1e-3, 0, 0], profile = \"parabolic\", \
                     patch.disc = { centre = [7, 2e-3, 2e-3], diameter = 2e-3 } }, \
                     \"x+\".outlet = { pressure.table = [[0, 0], [2, 0.02]], \
                     patch.rectangle = { lower = [0, 0, 0], upper = [0, 4e-3, 1e-3] } } }";
        let setup = setup(faces, "");
        let inlet = &setup.inlets[&0];
        let centre = [7.0, 2e-3, 2e-3];
        assert_eq!(inlet.profile, Profile::Round { centre, axis: 0, radius: 1e-3 });
        assert_eq!(inlet.patch, Some(Patch::Disc { centre, axis: 0, radius: 1e-3 }));
        // Of cells of 0.2 mm.
        let Face::Outlet { excess: 0.0, patch: Some(patch), .. } = setup.domain.faces[1] else { panic!() };
        assert!(patch.has([0.0, 19.9, 4.9]) && !patch.has([0.0, 10.0, 5.1]), "{patch:?}");
        assert!((setup.pressures[&1].at(1.0).x - 0.01).abs() < 1e-15);
        let described = [0, 1].map(|wall| setup.passage(wall).unwrap());
        // 80 centres of cells lie in a circle of 10 cells.
        assert!(described[0].starts_with("inlet, 80 cells of the face, parabolic"), "{described:?}");
        assert!(
            described[1].starts_with("outlet, 100 cells of the face, pressure varying, at most 2.000e-2")
        );
    }

    #[test]
    fn an_inlet_has_a_table_over_its_face_or_a_parabola_in_each_of_several_parts() {
        let faces = "{ x-.inlet = { velocity = [2e-3, 0, 0], \
                     profile.table = [[0, 4e-3, 1.2], [0, 0, 0.4], [4e-3, 0, 0], [4e-3, 4e-3, -2]] }, \
                     \"x+\".outlet.patch = [{ disc = { centre = [8e-3, 1e-3, 2e-3], diameter = 1.2e-3 } }, \
                     { rectangle = { lower = [8e-3, 2e-3, 0], upper = [8e-3, 4e-3, 1e-3] } }], \
                     \"z+\".inlet = { velocity = [0, 0, -1e-3], profile = \"parabolic\", patch = [\
                     { rectangle = { lower = [0, 1e-3, 4e-3], upper = [2e-3, 2e-3, 4e-3] } }, \
                     { disc = { centre = [6e-3, 2e-3, 4e-3], diameter = 2e-3 } }] } }";
        let mut setup = setup(faces, "");
        let factors = [[0.0, 0.0], [4e-3, 4e-3], [2e-3, 1e-3]]
            .map(|[y, z]| setup.inlets[&0].profile.at([9.0, y, z], [0.0; 3]));
        for (factor, expected) in factors.into_iter().zip([0.4, -2.0, 0.05]) {
            assert!((factor - expected).abs() < 1e-14, "{factor} {expected}");
        }
        let described: Vec<_> = setup.walls.iter().enumerate().map(|(n, _)| setup.passage(n)).collect();
        let text = |n: usize| described[n].clone().unwrap_or_default();
        assert!(
            text(0).starts_with("inlet, table of 2 x 2 points with factors up to 2.000e0, (2.000e-3"),
            "{}",
            text(0)
        );
        // 32 centres of cells in a circle of 6 cells, and 10 x 5 cells.
        assert!(text(1).starts_with("outlet, 82 cells of the face, "), "{}", text(1));
        assert!(text(3).starts_with("inlet, 130 cells of the face, parabolic"), "{}", text(3));
        let top = &setup.inlets[&3].profile;
        for (at, expected) in [
            ([1e-3, 1.5e-3, 0.0], 2.25),
            ([6e-3, 2e-3, 0.0], 2.0),
            ([6e-3, 2.5e-3, 0.0], 1.5),
            ([4e-3, 2e-3, 0.0], 0.0),
        ] {
            assert!((top.at(at, at) - expected).abs() < 1e-12, "{at:?}");
        }
        let identity = |setup: &Setup| crate::simulation::identity(setup).to_string();
        let before = identity(&setup);
        setup.inlets.get_mut(&0).unwrap().profile = Profile::Uniform;
        assert_ne!(before, identity(&setup));
    }

    #[test]
    fn the_profile_of_an_inlet_in_a_pipe_is_that_of_the_pipe() {
        let faces = "{ x-.inlet = { velocity = [1e-3, 0, 0], profile = \"parabolic\" }, \"x+\".outlet = {} }";
        let pipe = "walls = [{ name = \"pipe\", pipe = { point = [0, 2e-3, 2e-3], axis = [1, 0, 0], diameter = 3e-3 } }]";
        let centre = [0.0, 2e-3, 2e-3];
        let expected = Profile::Round { centre, axis: 0, radius: 1.5e-3 };
        assert_eq!(setup(faces, pipe).inlets[&0].profile, expected);
    }

    #[test]
    fn a_rod_across_the_flow_has_no_part_in_the_profile_of_an_inlet_that_it_does_not_reach() {
        let faces = "{ x-.inlet = { velocity = [1e-3, 0, 0], profile = \"parabolic\" }, \"x+\".outlet = {} }";
        let rod = |x: f64| {
            format!(
                "walls = [{{ name = \"rod\", rod = {{ point = [{x}, 0, 2e-3], axis = [0, 1, 0], diameter = 1e-3 }} }}]"
            )
        };
        let expected = Profile::Parabolic([None, None, Some([0.0, 4e-3])]);
        assert_eq!(setup(faces, &rod(2e-3)).inlets[&0].profile, expected);
        let text = format!(
            "domain = {{ size = [8e-3, 4e-3, 4e-3], periodic = [false, true, false], faces = {faces} }}\n\
             fluid = {{ density = 1000, viscosity = 1e-6 }}\n\
             lattice = {{ cells_per_diameter = 5, relaxation_time = 0.6 }}\n\
             run.end.steps = 10\n\
             particles = [{{ shape.sphere.diameter = 1e-3, density = 2000, list = [] }}]\n{}",
            rod(4e-4)
        );
        let error = from_text(&text, "open", &[]).unwrap_err().to_string();
        assert!(error.contains("not one pipe along its normal"), "{error}");
    }
}
