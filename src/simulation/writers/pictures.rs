//! Pictures of a run: which plane they show, and colours that mean the same in all of them.

use super::vtk::parsed;
use super::{FileEstimate, Need, RootOutput, Writer, WriterState, slice_plane};
use crate::case::Setup;
use crate::error::Result;
use crate::math::Vec3;
use crate::output::Numbered;
use crate::output::directory::PICTURES;
use crate::output::picture::{Plane, Snapshot, write_side_view, write_slice};
use crate::particle::Particle;

/// Bytes of a picture.
const BYTES: f64 = 3e5;

/// Writes a slice through the fluid with the particles that it cuts; without a fluid all particles from the side.
pub(super) struct Pictures<'a> {
    setup: &'a Setup,
    plane: Plane,
    /// Speed at the upper end of the colours of all pictures (m/s), once there is one.
    range: Option<f64>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(setup: &'a Setup) -> Self {
        Self { setup, plane: slice_plane(setup), range: setup.plan.output.picture_range }
    }
}

impl Writer for Pictures<'_> {
    fn name(&self) -> &'static str {
        "pictures"
    }

    fn every(&self) -> u64 {
        self.setup.plan.output.picture_every
    }

    fn due(&self, step: u64, last: bool) -> bool {
        let every = self.every();
        // There is nothing to see of a fluid at rest.
        let shows = step > 0 || self.setup.fluid.is_none();
        shows && every > 0 && (last || step.is_multiple_of(every))
    }

    fn needs(&self) -> Vec<Need> {
        vec![Need::Slice, Need::Selected]
    }

    fn selects(&self, particle: &Particle) -> bool {
        let shape = &self.setup.templates[particle.template as usize].shape;
        self.setup.fluid.is_none() || self.plane.cuts(particle.position(), shape.circumradius())
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let setup = self.setup;
        self.range = self.range.or_else(|| range(setup, output));
        let snapshot = Snapshot {
            case: &setup.provenance.name,
            time: output.time,
            stokes_time: setup.stokes_time(),
            plane: self.plane,
            templates: &setup.templates,
            particles: &output.selected,
            walls: &setup.walls,
            largest_speed: self.range,
        };
        let path = PICTURES.file(&setup.plan.output.directory, output.step);
        match output.slice {
            Some(velocity) => write_slice(&path, &snapshot, velocity),
            None => write_side_view(&path, &snapshot),
        }
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(PICTURES)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(self.range))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        self.range = self.range.or(parsed("pictures", state)?);
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        Some(FileEstimate::of(self, end_step, "pictures", BYTES, ""))
    }
}

/// Speed at the upper end of the colours of all pictures of a run (m/s), if the case does not give it: the expected one, or else
/// the largest in this picture, the first; none if nothing moves there.
fn range(setup: &Setup, picture: &RootOutput) -> Option<f64> {
    let largest = |speeds: &mut dyn Iterator<Item = f64>| speeds.fold(0.0, f64::max);
    let seen = || match picture.slice {
        Some(velocity) => largest(&mut velocity.iter().map(|u| Vec3::from(u.map(f64::from)).norm())),
        None => largest(&mut picture.selected.iter().map(|p| p.velocity().norm())),
    };
    let moves = |speed: &f64| *speed > 0.0 && speed.is_finite();
    (Some(expected(setup)).filter(moves)).or_else(|| Some(seen()).filter(moves))
}

/// The largest speed that is expected in a run (m/s): of one particle that settles, of walls, of particles at the start or prescribed, of a
/// fluid that is driven, of a fall without fluid; zero if nothing is known.
fn expected(setup: &Setup) -> f64 {
    let size = setup.domain.size();
    let walls = setup.walls.iter().map(|wall| {
        let turning = wall.motion.angular_velocity.norm() * 0.5 * size.norm();
        wall.motion.velocity.norm() + turning
    });
    let particles = (setup.particles.iter())
        .map(|p| p.velocity().norm().max(setup.prescribed_speed(p.template as usize)));
    let (settling, driven) = if let Some(fluid) = &setup.fluid {
        // Poiseuille's flow in the narrowest closed direction, unless it has no time to develop.
        let width = (0..3).filter(|&i| !setup.domain.periodic[i]).map(|i| size[i]);
        let width = width.fold(f64::INFINITY, f64::min);
        let time = setup.end_time().min(width * width / (8.0 * fluid.viscosity));
        let settling = fluid.scales.schiller_naumann_velocity;
        (settling, fluid.body_acceleration.norm() * time)
    } else {
        let drop: f64 = (setup.gravity.iter().zip(&size)).map(|(g, length)| g.abs() * length).sum();
        (0.0, (2.0 * drop).sqrt())
    };
    walls.chain(particles).chain([settling, driven]).filter(|speed| speed.is_finite()).fold(0.0, f64::max)
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
        let picture = RootOutput {
            step: 1,
            time: 0.0,
            row: None,
            selected: Vec::new(),
            slice: Some(&[[0.0, seen, 0.0]]),
            pieces: None,
        };
        Pictures::new(&setup).range.or_else(|| range(&setup, &picture))
    }

    #[test]
    fn colours_end_at_what_is_asked_for_or_expected_whatever_the_picture_shows() {
        let settling = first(0.0, &[]).unwrap();
        assert!((0.05..0.2).contains(&settling), "u* of a millimetre: {settling}");
        assert_eq!(first(7.0, &[]), Some(settling));
        assert_eq!(first(7.0, &["output.picture_range=0.5"]), Some(0.5));
        assert_eq!(first(7.0, &["particles.0.density=1000"]), Some(1e-3), "how it starts");
        let wall =
            ["domain.periodic=[true, true, false]", "domain.faces={ \"z+\" = { velocity = [0.4, 0, 0] } }"];
        assert_eq!(first(0.0, &wall), Some(0.4));
    }

    #[test]
    fn where_nothing_is_expected_the_first_picture_that_shows_motion_decides() {
        let still = ["particles.0.density=1000", "particles.0.list=[[1e-3, 1e-3, 1e-3]]"];
        assert_eq!((first(0.0, &still), first(0.25, &still)), (None, Some(0.25)));
    }
}
