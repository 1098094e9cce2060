//! Pictures of a run: which plane they show, and colours that mean the same in all of them.

use super::Picture;
use crate::case::Setup;
use crate::error::Result;
use crate::math::Vec3;
use crate::output::picture::{Clock, Cut, Plane, Scene, write_side_view, write_slice};
use std::path::Path;

/// The plane that pictures of a case show.
pub(super) fn plane(setup: &Setup) -> Plane {
    let cut = setup.plan.output.picture_plane;
    let cut = cut.map(|(normal, position)| Cut { normal, position });
    Plane::of(&setup.domain, setup.gravity, cut)
}

/// Writes a picture whose colours end at the speed `range` (m/s).
pub(super) fn write(
    setup: &Setup,
    path: &Path,
    time: f64,
    picture: &Picture,
    range: Option<f64>,
) -> Result<()> {
    let scene = Scene {
        case: &setup.provenance.name,
        clock: Clock {
            time,
            stokes_time: setup.stokes_time(),
        },
        plane: plane(setup),
        templates: &setup.templates,
        particles: &picture.particles,
        walls: &setup.walls,
        largest_speed: range,
    };
    match &picture.velocity {
        Some(velocity) => write_slice(path, &scene, velocity),
        None => write_side_view(path, &scene),
    }
}

/// Speed at the upper end of the colours of all pictures of a run (m/s): as the case says, or expects, or else that of the
/// fastest in this picture, its first; none if nothing moves there.
pub(super) fn range(setup: &Setup, picture: &Picture) -> Option<f64> {
    let largest = |speeds: &mut dyn Iterator<Item = f64>| speeds.fold(0.0, f64::max);
    let seen = || match &picture.velocity {
        Some(velocity) => largest(&mut velocity.iter().map(|u| Vec3::from(u.map(f64::from)).norm())),
        None => largest(&mut picture.particles.iter().map(|p| p.velocity().norm())),
    };
    let moves = |speed: &f64| *speed > 0.0 && speed.is_finite();
    (setup.plan.output.picture_range)
        .or_else(|| Some(expected(setup)).filter(moves))
        .or_else(|| Some(seen()).filter(moves))
}

/// The largest speed that is expected in a run (m/s): of one particle that settles, of walls, of particles at the start, of a
/// fluid that is driven, of a fall without fluid; zero if nothing is known.
fn expected(setup: &Setup) -> f64 {
    let size = setup.domain.size();
    let walls = setup.walls.iter().map(|wall| {
        let turning = wall.motion.angular_velocity.norm() * 0.5 * size.norm();
        wall.motion.velocity.norm() + turning
    });
    let particles = setup.particles.iter().map(|p| p.velocity().norm());
    let (settling, driven) = if let Some(fluid) = &setup.fluid {
        // Poiseuille's flow in the narrowest closed direction, unless it has no time to develop.
        let width = (0..3).filter(|&i| !setup.domain.periodic[i]).map(|i| size[i]);
        let width = width.fold(f64::INFINITY, f64::min);
        let time = setup.end_time().min(width * width / (8.0 * fluid.viscosity));
        let settling = fluid.scales.schiller_naumann_velocity;
        (settling, fluid.body_acceleration.norm() * time)
    } else {
        let drop: f64 = (setup.gravity.iter().zip(&size))
            .map(|(g, length)| g.abs() * length)
            .sum();
        (0.0, (2.0 * drop).sqrt())
    };
    walls
        .chain(particles)
        .chain([settling, driven])
        .filter(|speed| speed.is_finite())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;

    const TEXT: &str = r"
        [domain]
        size = { diameters = [6, 6, 6] }
        [fluid]
        density = 1000
        viscosity = 1e-6
        [lattice]
        cells_per_diameter = 4
        relaxation_time = 0.505
        [[particles]]
        shape = { sphere = { diameter = 1e-3 } }
        density = 2000
        list = [{ position = [1e-3, 1e-3, 1e-3], velocity = [0, 1e-3, 0] }]
        [run]
        end = { steps = 60 }
    ";

    /// The range of the first picture of a case, with this speed in it.
    fn first(seen: f32, options: &[&str]) -> Option<f64> {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        let setup = from_text(TEXT, "case", &options).unwrap();
        let picture = Picture {
            velocity: Some(vec![[0.0, seen, 0.0]]),
            particles: Vec::new(),
        };
        range(&setup, &picture)
    }

    #[test]
    fn colours_end_at_what_is_asked_for_or_expected_whatever_the_picture_shows() {
        let settling = first(0.0, &[]).unwrap();
        assert!((0.05..0.2).contains(&settling), "u* of a millimetre: {settling}");
        assert_eq!(first(7.0, &[]), Some(settling));
        assert_eq!(first(7.0, &["output.picture_range=0.5"]), Some(0.5));
        assert_eq!(
            first(7.0, &["particles.0.density=1000"]),
            Some(1e-3),
            "how it starts"
        );
        let wall = [
            "domain.periodic=[true, true, false]",
            "domain.faces={ \"z+\" = { velocity = [0.4, 0, 0] } }",
        ];
        assert_eq!(first(0.0, &wall), Some(0.4));
    }

    #[test]
    fn where_nothing_is_expected_the_first_picture_that_shows_motion_decides() {
        let still = [
            "particles.0.density=1000",
            "particles.0.list=[[1e-3, 1e-3, 1e-3]]",
        ];
        assert_eq!((first(0.0, &still), first(0.25, &still)), (None, Some(0.25)));
    }
}
