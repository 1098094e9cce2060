//! Prescribed motion of the particles of each section, and the vectors over time of a case.

use super::Setup;
use super::checks::Document;
use super::file::{Case, Entry, Freedom, MotionSection, NamedMotion, PrescribedSection, VectorSection};
use crate::error::Result;
use crate::math::{TimeFunction, Vec3};
use crate::particle::PrescribedMotion;

/// Least number of time steps in a period of an oscillation.
const STEPS_PER_PERIOD: f64 = 10.0;

/// The motion of each `[[particles]]` section.
pub(super) fn motions(document: &Document) -> Result<Vec<PrescribedMotion>> {
    let sections = document.case.particles.iter().enumerate();
    sections
        .map(|(index, section)| {
            let key = format!("particles.{index}");
            let motion = match &section.motion {
                None | Some(MotionSection::Named(NamedMotion::Free)) => {
                    return Ok(PrescribedMotion::default());
                }
                Some(MotionSection::Named(NamedMotion::Fixed)) => PrescribedMotion::fixed(),
                Some(MotionSection::Prescribed(given)) => {
                    prescribed(document, &format!("{key}.motion"), given)?
                }
            };
            for (n, entry) in section.list().iter().enumerate() {
                refuse_velocities(document, &format!("{key}.list.{n}"), entry, &motion)?;
            }
            Ok(motion)
        })
        .collect()
}

/// Constant force (N) and torque (N m) on the bodies of each `[[particles]]` section, refused where nothing would follow from them.
pub(super) fn applied(document: &Document, motions: &[PrescribedMotion]) -> Result<Vec<[Vec3; 2]>> {
    let sections = document.case.particles.iter().zip(motions).enumerate();
    sections
        .map(|(index, (section, motion))| {
            let [force, torque] = [section.force, section.torque].map(Vec3::from);
            let held = (0..3).any(|axis| force[axis] != 0.0 && !motion.free[axis]);
            let kept = torque != Vec3::zeros() && !motion.free_rotation;
            let name = match (held, kept) {
                (true, _) => "force",
                (false, true) => "torque",
                (false, false) => return Ok([force, torque]),
            };
            let [key, motion] = [name, "motion"].map(|name| format!("particles.{index}.{name}"));
            let title = format!("`{key}` acts where `{motion}` prescribes the motion");
            let marks = [(&*key, "has no effect here"), (&*motion, "prescribes the motion")];
            Err(document.error_at(
                &marks,
                &title,
                "set it to 0 there, or name what is free in `free` of `motion`",
            ))
        })
        .collect()
}

/// Says that the force of the fluid on bodies with prescribed motion includes their buoyancy, and where it is without.
pub(super) fn buoyancy(setup: &Setup) -> Option<String> {
    let density = setup.fluid_density();
    let of = |section: usize| -> f64 {
        let own = setup.particles.iter().map(|particle| particle.template as usize);
        own.filter(|&template| setup.sections[template] == section)
            .map(|template| density * setup.templates[template].shape.volume() * setup.gravity.norm())
            .sum()
    };
    let forces = setup.prescribed_sections().into_iter().map(|section| (section, of(section)));
    let forces: Vec<String> = forces
        .filter(|(_, force)| *force > 0.0)
        .map(|(section, force)| format!("{force:.4e} N on `particles.{section}`"))
        .collect();
    (!forces.is_empty()).then(|| {
        format!(
            "`hydrodynamic_force` of bodies with prescribed motion includes buoyancy, {}; `drag` of series.csv and summary.json is without \
             (driving.gravity = 0 leaves buoyancy out)",
            forces.join(", ")
        )
    })
}

fn prescribed(document: &Document, key: &str, given: &PrescribedSection) -> Result<PrescribedMotion> {
    let function = |velocity: &Option<VectorSection>| velocity.clone().unwrap_or_default().function();
    let is_free = |freedom: Freedom| given.free.contains(&freedom);
    let motion = PrescribedMotion {
        velocity: function(&given.velocity),
        angular_velocity: function(&given.angular_velocity),
        free: [Freedom::X, Freedom::Y, Freedom::Z].map(is_free),
        free_rotation: is_free(Freedom::Rotation),
    };
    let largest = motion.velocity.largest();
    let both = (0..3).find(|&axis| motion.free[axis] && largest[axis] > 0.0);
    let both = match both {
        Some(axis) => Some(("velocity", ["x", "y", "z"][axis])),
        None => (motion.free_rotation && given.angular_velocity.is_some())
            .then_some(("angular_velocity", "rotation")),
    };
    let Some((name, free)) = both else {
        return Ok(motion);
    };
    let (velocity, freedom) = (format!("{key}.{name}"), format!("{key}.free"));
    Err(document.error_at(
        &[(&velocity, "prescribed"), (&freedom, "free")],
        &format!("`{velocity}` prescribes what `{freedom}` leaves free: \"{free}\""),
        "a free direction begins with the velocity in `list` or `file`: set it to 0 here, or take it off `free`",
    ))
}

/// All vectors and pressures of a case over time, with their keys, and the rows of their tables in words.
fn functions(case: &Case) -> Vec<(String, TimeFunction, &'static str)> {
    let of_vector = "rows are [t, x, y, z], e.g. [0, 0, 0, 1e-3]";
    let vectors = vectors(case).into_iter().map(|(key, vector)| (key, vector.function(), of_vector));
    let outlets = case.domain.faces.iter().filter_map(|(name, face)| Some((name, face.outlet.as_ref()?)));
    let pressures = outlets.map(|(name, outlet)| {
        let key = format!("domain.faces.{name}.outlet.pressure");
        (key, outlet.pressure.function(), "rows are [t, p], e.g. [0, 100]")
    });
    vectors.chain(pressures).collect()
}

/// Every vector over time of a case, with its key.
fn vectors(case: &Case) -> Vec<(String, &VectorSection)> {
    let mut all = vec![("driving.body_acceleration".to_string(), &case.driving.body_acceleration)];
    for (name, face) in &case.domain.faces {
        all.push((format!("domain.faces.{name}.velocity"), &face.velocity));
        all.extend(
            face.inlet.iter().map(|inlet| (format!("domain.faces.{name}.inlet.velocity"), &inlet.velocity)),
        );
    }
    for (index, wall) in case.walls.iter().enumerate() {
        all.push((format!("walls.{index}.velocity"), &wall.velocity));
        all.push((format!("walls.{index}.angular_velocity"), &wall.angular_velocity));
    }
    for (index, section) in case.particles.iter().enumerate() {
        let Some(MotionSection::Prescribed(given)) = &section.motion else { continue };
        let named = [("velocity", &given.velocity), ("angular_velocity", &given.angular_velocity)];
        let given = named.into_iter().filter_map(|(name, vector)| Some((name, vector.as_ref()?)));
        all.extend(given.map(|(name, vector)| (format!("particles.{index}.motion.{name}"), vector)));
    }
    all
}

/// Refuses oscillations that are too fast for a time step (s), and tables without an order.
pub(super) fn refuse_vectors(document: &Document, time_step: f64) -> Result<()> {
    for (key, function, rows) in functions(&document.case) {
        let table = match function {
            TimeFunction::Constant(_) => continue,
            TimeFunction::Oscillation { frequency, .. } => {
                let most = 1.0 / (STEPS_PER_PERIOD * time_step);
                if frequency <= most {
                    continue;
                }
                let key = format!("{key}.oscillation.frequency");
                let wanted = format!("at most {most:.4e}");
                let remedy = format!("in Hz; a period has {STEPS_PER_PERIOD} time steps or more");
                return Err(document.out_of_range(&key, frequency, &wanted, &remedy));
            }
            TimeFunction::Table(table) => table,
        };
        let times: Vec<f64> = table.iter().map(|(time, _)| *time).collect();
        if times.is_empty() {
            let key = format!("{key}.table");
            return Err(document.error(&key, &format!("`{key}` is empty"), "no row", rows));
        }
        if let Some(n) = (1..times.len()).find(|&n| times[n] <= times[n - 1]) {
            let (wanted, key) = (format!("later than {} s", times[n - 1]), format!("{key}.table.{n}"));
            let remedy = "the first number of a row is its time (s); rows are in the order of time";
            return Err(document.out_of_range(&key, times[n], &wanted, remedy));
        }
    }
    Ok(())
}

/// Refuses an initial velocity of a listed particle where its section prescribes the velocity.
fn refuse_velocities(document: &Document, key: &str, entry: &Entry, motion: &PrescribedMotion) -> Result<()> {
    let Entry::Moving(moving) = entry else {
        return Ok(());
    };
    let moves = (0..3).any(|axis| !motion.free[axis] && moving.velocity[axis] != 0.0);
    let turns = !motion.free_rotation && Vec3::from(moving.angular_velocity) != Vec3::zeros();
    let name = match (moves, turns) {
        (true, _) => "velocity",
        (false, true) => "angular_velocity",
        (false, false) => return Ok(()),
    };
    let key = format!("{key}.{name}");
    let title = format!("`{key}` is given, but the `motion` of its section prescribes it");
    Err(document.error(&key, &title, "has no effect here", "set it to 0 in the prescribed directions"))
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};
    use crate::math::{TimeFunction, Vec3};
    use crate::particle::PrescribedMotion;

    fn setup(motion: &str) -> Setup {
        let text = "domain.size = [4e-3, 4e-3, 4e-3]\n\
                    fluid = { density = 1000, viscosity = 1e-6 }\n\
                    lattice = { cells_per_diameter = 5, relaxation_time = 0.6 }\n\
                    run.end.steps = 10\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1e-3\n\
                    density = 2000.0\n\
                    list = [[1e-3, 1e-3, 1e-3]]\n";
        let options = [format!("particles.0.motion={motion}"), "driving.gravity=[1, 0, -2]".to_string()];
        from_text(text, "motion", &options).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn each_form_of_a_motion_is_the_function_of_time_that_it_says() {
        let motion = |text: &str| setup(text).motions[0].clone();
        assert_eq!(motion("free"), PrescribedMotion::default());
        assert_eq!(motion("fixed"), PrescribedMotion::fixed());
        assert_eq!(motion("{}"), PrescribedMotion::fixed());
        let constant = motion("{ velocity = [0, 2e-3, 0], angular_velocity = [0, 0, 3], free = [\"x\"] }");
        assert_eq!(constant.velocity, TimeFunction::Constant(Vec3::new(0.0, 2e-3, 0.0)));
        assert_eq!(constant.angular_velocity, TimeFunction::Constant(Vec3::new(0.0, 0.0, 3.0)));
        assert_eq!((constant.free, constant.free_rotation), ([true, false, false], false));
        let oscillation =
            "{ oscillation = { amplitude = [0, 0, 2e-3], frequency = 4, phase = 90, mean = [1e-3, 0, 0] } }";
        let oscillating = motion(&format!("{{ velocity = {oscillation} }}")).velocity;
        for (time, expected) in [(0.0, 2e-3), (0.125, -2e-3), (0.0625, 0.0)] {
            assert!((oscillating.at(time) - Vec3::new(1e-3, 0.0, expected)).norm() < 1e-15, "{time}");
        }
        let table = motion("{ velocity = { table = [[0, 0, 0, 0], [2, 0, 4e-3, 0]] } }").velocity;
        assert!((table.at(0.5) - Vec3::new(0.0, 1e-3, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn the_weight_of_a_body_counts_in_its_free_directions_alone() {
        let excess = 1000.0 * std::f64::consts::PI / 6.0 * 1e-9;
        for (motion, expected) in [
            ("free", Vec3::new(1.0, 0.0, -2.0)),
            ("{ free = [\"x\", \"rotation\"] }", Vec3::new(1.0, 0.0, 0.0)),
            ("fixed", Vec3::zeros()),
        ] {
            assert!((setup(motion).submerged_weight() - excess * expected).norm() < 1e-18, "{motion}");
        }
    }
}
