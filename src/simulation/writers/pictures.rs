//! Pictures of a run: the quantities that they show, and colours that mean the same in all of them.

use super::vtk::parsed;
use super::{FileEstimate, Need, RootOutput, Writer, WriterState, slice_planes, threads_and_cores};
use crate::case::{BodyColour, Insertion, PicturePlan, Quantity, Setup, SlicePlan, ViewPlan};
use crate::error::Result;
use crate::math::Vec3;
use crate::output::Numbered;
use crate::output::directory::PICTURES;
use crate::output::picture::{
    Chains, Colours, KINDS, Plane, Scale, Scene, Slice, Snapshot, round_up, write_slice, write_view,
};
use crate::particle::Particle;
use crate::simulation::observe::PICTURES as PICTURES_STAGE;
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes of a picture.
const BYTES: f64 = 3e5;
/// Time of a slice (s), and that of a view on one thread (s): of each pixel, and of each particle. Processor time of
/// `turbid run --threads 1` (release, a shared 4-core virtual machine) less that without pictures: slices of `hindered_settling` 0.09 s,
/// its views of 1200 x 900 pixels 1.07 and 1.36 s, of 600 x 450 0.37 s, both views of `dry_box` together 4.3 s. Of very many particles most are
/// behind others: views of 64 000 take 3.6 s, of 1e6 24 s.
const SLICE: f64 = 0.09;
const PIXEL: f64 = 1.1e-6;
const BODY: f64 = 0.4e-3;
const MANY: f64 = 4000.0;
const BEHIND: f64 = 3e-5;
/// Colours of particles that have none, and of those that are seen through.
const PLAIN: [u8; 3] = [226, 216, 200];
const PALE: [u8; 3] = [240, 238, 234];
/// Width and height of a view of the start, if the case has none (pixels).
const SIZE: [u32; 2] = [1200, 900];
/// Values of the flow and of motion that a picture shows are rounding below this (SI units). Without a contact, its force is zero.
const LEAST: f64 = 1e-12;

/// The particles and walls of a case at a time (s).
fn snapshot<'a>(setup: &'a Setup, time: f64, particles: &'a [Particle]) -> Snapshot<'a> {
    Snapshot {
        case: &setup.provenance.name,
        time,
        stokes_time: setup.stokes_time(),
        domain: setup.domain,
        diameter: setup.diameter,
        gravity: setup.gravity,
        templates: &setup.templates,
        particles,
        walls: &setup.walls,
    }
}

/// Writes a view of the particles of a case at the start, as PNG, from where its first view is seen; in the colours of their kinds, if there are
/// several.
pub fn write_start(path: &Path, setup: &Setup) -> Result<()> {
    let view = setup.plan.output.pictures.iter().find_map(|plan| plan.view.as_ref());
    let kinds: Vec<usize> = setup.particles.iter().map(|p| setup.sections[p.template as usize]).collect();
    let several = kinds.iter().any(|kind| *kind != kinds[0]);
    let colour = |kind: &usize| if several { KINDS[kind % KINDS.len()] } else { PLAIN };
    let scene = Scene {
        from: view.and_then(|view| view.from),
        zoom: view.map_or(1.0, |view| view.zoom),
        size: view.map_or(SIZE, |view| view.size),
        bodies: kinds.iter().map(colour).collect(),
        scale: None,
        slice: None,
        chains: None,
        threads: threads_and_cores(setup)[0],
    };
    write_view(path, &snapshot(setup, 0.0, &setup.particles), &scene)
}

pub(super) struct Pictures<'a> {
    setup: &'a Setup,
    planes: Vec<Plane>,
    /// Value at the upper end of the colours of each quantity for which the case gives no range, once there is one.
    tops: BTreeMap<String, f64>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(setup: &'a Setup) -> Self {
        Self { setup, planes: slice_planes(setup), tops: BTreeMap::new() }
    }

    fn plans(&self) -> &'a [PicturePlan] {
        &self.setup.plan.output.pictures
    }

    /// Estimated time (s) to draw a picture.
    fn seconds(&self, plan: &PicturePlan) -> f64 {
        plan.view.as_ref().map_or(SLICE, |view| {
            let pixels = f64::from(view.size[0]) * f64::from(view.size[1]);
            let bodies = self.setup.expected_particles() as f64;
            let one_thread = PIXEL * pixels + BODY * bodies.min(MANY) + BEHIND * (bodies - MANY).max(0.0);
            let [threads, cores] = threads_and_cores(self.setup);
            one_thread / threads.min(cores) as f64
        })
    }

    /// Colours of a quantity in all pictures: the range that the case gives, or else up to what is expected in the run, or else to
    /// what is `seen` in its first picture that shows some of it.
    fn scale(&mut self, measure: &Measure, given: Option<[f64; 2]>, seen: impl FnOnce() -> f64) -> Scale {
        let least = if measure.name == FORCE.name { 0.0 } else { LEAST };
        let is_some = |top: &f64| *top > least && top.is_finite();
        let known = self.tops.get(measure.name).copied();
        let found = known.or_else(|| Some(measure.expected(self.setup)).filter(is_some));
        let found = found.or_else(|| given.is_none().then(seen).filter(is_some));
        if let (Some(top), None) = (found, given) {
            self.tops.insert(measure.name.to_owned(), top);
        }
        let top = found.map_or(1.0, round_up);
        let range = given.unwrap_or([if measure.signed { -top } else { 0.0 }, top]);
        let colours = if measure.signed { Colours::Diverging } else { measure.colours };
        Scale { label: measure.label, unit: measure.unit, range: (range[0], range[1]), colours }
    }

    fn slice(&mut self, plan: &SlicePlan, output: &RootOutput) -> Option<Slice> {
        let plane = Plane::new(&self.setup.domain, self.setup.gravity, plan.cut);
        let flow = output.slices.get(self.planes.iter().position(|other| *other == plane)?)?;
        let of = |value: fn(&[f32; 4]) -> f32| flow.iter().map(value).collect();
        let values: Vec<f32> = match plan.quantity {
            Quantity::Speed => of(|u| (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt()),
            Quantity::VelocityX => of(|u| u[0]),
            Quantity::VelocityY => of(|u| u[1]),
            Quantity::VelocityZ => of(|u| u[2]),
            Quantity::Vorticity => plane.vorticity(flow),
            Quantity::Pressure => of(|u| u[3]),
        };
        let largest = || f64::from(values.iter().fold(0.0, |most: f32, value| most.max(value.abs())));
        let scale = self.scale(&Measure::of_flow(plan.quantity), plan.range, largest);
        Some(Slice { plane, values, scale })
    }

    /// Colours of all particles, and values that they mean.
    fn bodies(&mut self, plan: &ViewPlan, particles: &[Particle]) -> (Vec<[u8; 3]>, Option<Scale>) {
        let speed = Measure { label: "speed of particles", ..Measure::of_flow(Quantity::Speed) };
        let (measure, value): (Measure, fn(&Particle) -> f64) = match plan.colour {
            BodyColour::Plain => {
                return (vec![if plan.chains { PALE } else { PLAIN }; particles.len()], None);
            }
            BodyColour::Kind => {
                let kind = |p: &Particle| KINDS[self.setup.sections[p.template as usize] % KINDS.len()];
                return (particles.iter().map(kind).collect(), None);
            }
            BodyColour::Speed => (speed, |p| p.velocity().norm()),
            BodyColour::VelocityX => (Measure::of_flow(Quantity::VelocityX), |p| p.velocity[0]),
            BodyColour::VelocityY => (Measure::of_flow(Quantity::VelocityY), |p| p.velocity[1]),
            BodyColour::VelocityZ => (Measure::of_flow(Quantity::VelocityZ), |p| p.velocity[2]),
            BodyColour::AngularSpeed => (ANGULAR_SPEED, |p| p.angular_velocity().norm()),
            BodyColour::ContactForce => (FORCE, |p| Vec3::from(p.contact_force).norm()),
        };
        let values: Vec<f64> = particles.iter().map(value).collect();
        let largest = || values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let scale = self.scale(&Measure { colours: Colours::Warm, ..measure }, plan.range, largest);
        (values.iter().map(|&value| scale.colour(value)).collect(), Some(scale))
    }
}

impl Writer for Pictures<'_> {
    fn name(&self) -> &'static str {
        PICTURES_STAGE
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
        let chains = |plan: &PicturePlan| plan.view.as_ref().is_some_and(|view| view.chains);
        let contacts = self.plans().iter().any(chains).then_some(Need::AllContacts);
        [Need::Slices, Need::Selected].into_iter().chain(contacts).collect()
    }

    fn selects(&self, particle: &Particle) -> bool {
        let radius = self.setup.templates[particle.template as usize].shape.circumradius();
        self.plans().iter().any(|plan| plan.view.is_some())
            || self.planes.iter().any(|plane| plane.cuts(particle.position(), radius))
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let setup = self.setup;
        let snapshot = snapshot(setup, output.time, &output.selected);
        for plan in self.plans() {
            let path = PICTURES.named_file(&setup.plan.output.directory, &plan.name, output.step);
            let slice = plan.slice.as_ref().and_then(|slice| self.slice(slice, output));
            let Some(view) = &plan.view else {
                if let Some(slice) = &slice {
                    write_slice(&path, &snapshot, slice)?;
                }
                continue;
            };
            let (bodies, scale) = self.bodies(view, &output.selected);
            let chains = view.chains.then(|| {
                let contacts = output.contacts;
                let forces = contacts.iter().map(|contact| Vec3::from(contact.force).norm());
                let range = view.force_range.map(|top| [0.0, top]);
                Chains { contacts, scale: self.scale(&FORCE, range, || forces.fold(0.0, f64::max)) }
            });
            let scene = Scene {
                from: view.from,
                zoom: view.zoom,
                size: view.size,
                bodies,
                scale,
                slice,
                chains,
                threads: threads_and_cores(self.setup)[0],
            };
            write_view(&path, &snapshot, &scene)?;
        }
        Ok(())
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(PICTURES)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(self.tops))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        // Checkpoints of older versions have none.
        if !state.is_null() {
            self.tops = parsed(self.name(), state)?;
        }
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let bytes = BYTES * self.plans().len() as f64;
        let seconds = self.plans().iter().map(|plan| self.seconds(plan)).sum();
        Some(FileEstimate { seconds, ..FileEstimate::of(self, end_step, "pictures", bytes, "") })
    }
}

/// A quantity that colours stand for.
struct Measure {
    name: &'static str,
    label: &'static str,
    unit: &'static str,
    signed: bool,
    /// Of one without a sign.
    colours: Colours,
}

const ANGULAR_SPEED: Measure = Measure {
    name: "angular_speed",
    label: "angular speed of particles",
    unit: "1/s",
    signed: false,
    colours: Colours::Warm,
};
const FORCE: Measure =
    Measure { name: "force", label: "contact force", unit: "N", signed: false, colours: Colours::Warm };

impl Measure {
    fn of_flow(quantity: Quantity) -> Self {
        let (name, label, unit) = match quantity {
            Quantity::Speed => ("speed", "speed |u|", "m/s"),
            Quantity::VelocityX => ("velocity", "velocity u_x", "m/s"),
            Quantity::VelocityY => ("velocity", "velocity u_y", "m/s"),
            Quantity::VelocityZ => ("velocity", "velocity u_z", "m/s"),
            Quantity::Vorticity => ("vorticity", "vorticity", "1/s"),
            Quantity::Pressure => ("pressure", "pressure", "Pa"),
        };
        Self { name, label, unit, signed: quantity != Quantity::Speed, colours: Colours::Viridis }
    }

    /// The magnitude that is expected in a run, 0 if nothing is known: of the [speed](expected) `U`, and for particles of diameter `D`
    /// of a vorticity of `4 U / D`, an angular speed of `2 U / D`, a pressure of `rho U^2 / 2 + 3 mu U / D` (that on a sphere in Stokes
    /// flow) and the [weight] on the lowest particles.
    fn expected(&self, setup: &Setup) -> f64 {
        let (speed, diameter) = (expected(setup), setup.diameter);
        match (self.name, &setup.fluid) {
            ("speed" | "velocity", _) => speed,
            ("vorticity", _) => 4.0 * speed / diameter,
            ("angular_speed", _) => 2.0 * speed / diameter,
            ("pressure", Some(fluid)) => {
                fluid.density * speed * (0.5 * speed + 3.0 * fluid.viscosity / diameter)
            }
            ("force", _) => weight(setup),
            _ => 0.0,
        }
    }
}

/// Weight, less buoyancy, of all particles that rests on each of the lowest, if these cover the floor (N).
fn weight(setup: &Setup) -> f64 {
    let (gravity, size) = (setup.gravity, setup.domain.size());
    let down = gravity.iamax();
    let weight = |(template, count): (usize, usize)| {
        let template = &setup.templates[template];
        let each =
            (template.density - setup.fluid_density()).abs() * template.shape.volume() * gravity.norm();
        count as f64 * each
    };
    let floor = size.product() / size[down];
    setup.expected_counts().map(weight).sum::<f64>() * setup.diameter * setup.diameter / floor
}

/// The largest speed that is expected in a run (m/s): of one particle that settles, of walls, of particles at the start or prescribed, of a
/// fluid that is driven, of a fall without fluid; zero if nothing is known.
fn expected(setup: &Setup) -> f64 {
    let size = setup.domain.size();
    let walls = setup.walls.iter().map(|wall| {
        let turning = wall.motion.angular_velocity.largest().norm() * 0.5 * size.norm();
        wall.motion.velocity.largest().norm() + turning
    });
    let totals = setup.totals();
    let present = (0..).zip(&totals.counts).filter(|(_, count)| **count > 0);
    let particles = present.map(|(template, _)| setup.prescribed_speed(template)).chain([totals.fastest]);
    let (settling, driven) = if let Some(fluid) = &setup.fluid {
        // Poiseuille's flow in the narrowest closed direction, unless it has no time to develop.
        let width = (0..3).filter(|&i| !setup.domain.is_periodic(i)).map(|i| size[i]);
        let width = width.fold(f64::INFINITY, f64::min);
        let time = setup.end_time().min(width * width / (8.0 * fluid.viscosity));
        let settling = fluid.scales.schiller_naumann_velocity;
        let flux = Vec3::from(fluid.net_flux.map(Option::unwrap_or_default)).norm();
        (settling, fluid.body_acceleration.largest_integral(time).norm().max(flux))
    } else {
        let drop: f64 = (setup.gravity.iter().zip(&size)).map(|(g, length)| g.abs() * length).sum();
        (0.0, (2.0 * drop).sqrt())
    };
    walls
        .chain(particles)
        .chain(setup.insertions.iter().map(Insertion::speed))
        .chain([settling, driven])
        .filter(|speed| speed.is_finite())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;
    use crate::simulation::Totals;

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

    /// Ends of the colours of the slice in the first picture of a case, with this velocity along y in it.
    fn first(seen: f32, options: &[&str]) -> (f64, f64) {
        let setup = setup(options);
        shown(&mut Pictures::new(&setup), seen)
    }

    fn setup(options: &[&str]) -> Setup {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        from_text(TEXT, "case", &options).unwrap()
    }

    fn shown(pictures: &mut Pictures, seen: f32) -> (f64, f64) {
        let slices = [vec![[0.0, seen, 0.0, 0.0]; pictures.planes[0].values()]];
        let plan = pictures.plans()[0].slice.clone().unwrap();
        pictures.slice(&plan, &output(&slices)).unwrap().scale.range
    }

    fn output(slices: &[Vec<[f32; 4]>]) -> RootOutput<'_> {
        static NONE: Totals = Totals { sums: Vec::new(), fixed: Vec::new(), maxima: Vec::new() };
        RootOutput {
            step: 1,
            time: 0.0,
            row: None,
            totals: &NONE,
            selected: Vec::new(),
            slices,
            contacts: &[],
            pieces: None,
        }
    }

    #[test]
    fn colours_end_at_what_is_asked_for_or_expected_whatever_the_picture_shows() {
        let (lo, settling) = first(0.0, &[]);
        assert!(lo == 0.0 && (0.05..0.2).contains(&settling), "u* of a millimetre: {settling}");
        assert_eq!(first(7.0, &[]), (0.0, settling));
        let asked = "output.pictures=[{ slice = { range = [-0.1, 0.513] } }]";
        assert_eq!(first(7.0, &[asked]), (-0.1, 0.513));
        assert_eq!(first(7.0, &["particles.0.density=1000"]), (0.0, 1e-3), "how it starts");
        let wall =
            ["domain.periodic=[true, true, false]", "domain.faces={ \"z+\" = { velocity = [0.4, 0, 0] } }"];
        assert_eq!(first(0.0, &wall), (-0.4, 0.4));
        let signed = "output.pictures=[{ slice = { quantity = \"velocity_y\" } }]";
        assert_eq!(first(0.0, &[signed]), (-settling, settling));
    }

    #[test]
    fn where_nothing_is_expected_the_first_picture_that_shows_motion_decides_also_after_a_resume() {
        let still = ["particles.0.density=1000", "particles.0.list=[[1e-3, 1e-3, 1e-3]]"];
        let setup = setup(&still);
        let mut pictures = Pictures::new(&setup);
        let ends = [0.0, 0.25, 7.0].map(|seen| shown(&mut pictures, seen));
        assert_eq!(ends, [(0.0, 1.0), (0.0, 0.25), (0.0, 0.25)]);
        let state = pictures.state().unwrap();
        let mut resumed = Pictures::new(&setup);
        resumed.resume(&state).unwrap();
        assert_eq!(shown(&mut resumed, 7.0), (0.0, 0.25));
    }

    #[test]
    fn lengths_and_expected_values_do_not_depend_on_the_order_of_the_sizes() {
        let list = r"list = [{ position = [1e-3, 1e-3, 1e-3], velocity = [0, 1e-3, 0] }]";
        let drawn = |sizes: &str| {
            let place = tempfile::tempdir().unwrap();
            let sized = format!("count = 0\nsizes = [{sizes}]\n[output]\ndirectory = {:?}\n", place.path());
            let setup = from_text(&TEXT.replace(list, &sized), "case", &[]).unwrap();
            let mut pictures = Pictures::new(&setup);
            let slices = [vec![[0.0, 0.01, 0.0, 0.0]; pictures.planes[0].values()]];
            pictures.complete(&output(&slices)).unwrap();
            let expected = ["vorticity", "angular_speed", "pressure"].map(|name| {
                let measure = Measure { name, ..Measure::of_flow(Quantity::Speed) };
                measure.expected(&setup)
            });
            (std::fs::read(place.path().join("pictures/speed_0000000001.png")).unwrap(), expected)
        };
        let [small, large] = ["{ scale = 0.5, share = 1 }", "{ scale = 1, share = 1 }"];
        let first = drawn(&format!("{large}, {small}"));
        assert!(first == drawn(&format!("{small}, {large}")));
    }

    #[test]
    fn contact_forces_of_the_smallest_grains_have_colours_of_their_own_size() {
        let setup = setup(&["particles.0.density=1000", "particles.0.list=[[1e-3, 1e-3, 1e-3]]"]);
        let mut pictures = Pictures::new(&setup);
        let tops = [0.0, 2e-15].map(|seen| pictures.scale(&FORCE, None, || seen).range.1);
        assert!((0.999..1.001).contains(&tops[0]) && (2e-15..2.6e-15).contains(&tops[1]), "{tops:?}");
    }
}
