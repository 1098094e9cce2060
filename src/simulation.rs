//! A whole run: ranks, the time step, and what is observed on the way.
//!
//! [`run()`] does all of it and writes files; [`Simulation`] is for programs that step themselves.

mod alone;
mod analyse;
mod branch;
mod caller;
mod checkpointer;
mod engine;
mod entrances;
mod failure;
mod identity;
mod insertion;
mod measure;
mod observe;
mod population;
mod recut;
mod references;
mod run;
mod saved;
mod session;
mod together;
mod work;
mod writers;

use crate::case::{FluidSetup, Setup};
use crate::comm::Comm;
use crate::coupling::{
    AnyFluid, CONTROL_INTERVAL, Control, ControlRecord, Coupling, CouplingParams, Driving, DrivingParams,
    LatticeWalls, MeanFlow,
};
use crate::dem::{ContactState, DemEngine, Load};
use crate::device::Device;
use crate::domain::{Block, Decomposition, Domain};
use crate::error::{Error, Result};
use crate::fluid::{Asked, Boundary, Flow, FlowRow, FlowState, FluidParams};
use crate::math::Vec3;
pub use crate::output::Fields;
use crate::particle::{Particle, ParticleStore, Template};
use crate::timing::Timings;
use crate::units::Units;
use crate::wall::Wall;
#[doc(hidden)]
pub use alone::Alone;
pub use analyse::{Analysis, analyse, particles_in};
pub use branch::Branch;
use caller::ExternalLoads;
use checkpointer::Requests;
pub use checkpointer::saved_head;
use engine::Context;
#[doc(hidden)]
pub use engine::engine_of;
use entrances::refuse_endless;
pub use identity::identity;
pub use measure::Measurement;
#[doc(hidden)]
pub use observe::device_name;
pub use observe::{Sums, Totals, instruction_set};
use population::Counts;
use recut::{Busy, Watch};
pub use references::{Law, Suspension, settling_references};
#[doc(hidden)]
pub use run::on_ranks;
pub use run::{
    MoreWriters, Progress, RunOptions, agreed, branch, decompose, finished, forecast, resume, resume_with,
    run, run_with, saved_setup,
};
pub use session::Session;
use std::rc::Rc;
use std::sync::Arc;
pub use together::read_together;
pub use work::{CostFactors, Forecast, RankForecast, TimeEstimate, Traffic, bytes_per_cell, time_estimate};
#[doc(hidden)]
pub use writers::FlowOfRows;
#[cfg(feature = "pictures")]
pub use writers::write_start;
pub use writers::{
    FileEstimate, Need, RankOutput, RankState, RootOutput, Writer, WriterState, file_estimates,
    seconds_of_files, slice_planes,
};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// One rank's part of a run: its block of fluid and the particles that touch it.
///
/// Quantities are in SI units, but for [`fluid`](Self::fluid). What is *collective* must be called on all ranks, in the same order.
///
/// ```text
///   Builder, case::load -> Setup -> solo            one rank, in this thread
///                                   on_ranks        one rank per thread or MPI process
///                                   new             a rank of a Decomposition
///                                   with_engine     with a DemEngine of the caller
///                                   caller_driven   with particles that the caller moves
///                                   Session         on threads of its own, for other languages
///                                         |
///   read_checkpoint --------------------->+<-------------------------------+
///                                         v                                |
///   step   map       solid volume fractions of the cells    Coupling       |
///          sweep     collide, force, stream                 AnyFluid       |
///          loads     momentum exchanged in covered cells    Coupling       |
///          external  loads of the caller                    ExternalLoads  |
///          advance   contacts, motion, migration            DemEngine      |
///          halo      populations of neighbouring blocks     AnyFluid       |
///                                         |                                |
///                                         v                                |
///   particles  loads  fields  measure  wall_loads  write_checkpoint -------+
///   set_particles  insert  remove
/// ```
///
/// ```
/// use turbid::{Builder, Particles};
/// let spheres = Particles::spheres(1e-3, 2500.0).at([2e-3, 2e-3, 3e-3]);
/// let builder = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(4.0, 0.6).particles(spheres);
/// let mut simulation = builder.build()?;
/// simulation.run_until(0.02)?;
/// assert!(simulation.particles()[0].position().z < 3e-3);
/// # Ok::<(), turbid::Error>(())
/// ```
pub struct Simulation {
    comm: Rc<Comm>,
    units: Units,
    /// `None` without a fluid.
    system: Option<FluidSystem>,
    dem: Box<dyn DemEngine>,
    timings: Timings,
    step: u64,
    walls: Arc<[Wall]>,
    /// Causes and remedies of a divergence of this case, for its message.
    hint: String,
    /// A failure of this rank that the others do not know of yet.
    failure: Option<Error>,
    /// The failures of all ranks, once they have agreed on one: no step follows it.
    agreed: Option<Vec<Vec<u8>>>,
    /// Requests to this rank; after a control step, and only then, to any.
    requests: Requests,
    block: Block,
    cut: Decomposition,
    /// Step of the last checkpoint that was written or read.
    checkpoint: Option<u64>,
    external: Option<ExternalLoads>,
    /// Constant loads on the bodies of each template; empty if there is none.
    applied: Vec<Load>,
    caller_moves: bool,
    /// A step, and the states before it of particles that a caller sets after it.
    before: Option<(u64, Vec<Particle>)>,
    contacts: bool,
    templates: Arc<[Template]>,
    domain: Domain,
    counts: Counts,
    plan: Rc<insertion::Plan>,
    record: insertion::Record,
    /// Time that this rank has worked, if it is measured.
    busy: Option<Busy>,
    /// Gets the rows of the flow in the coming sweep, or before it.
    rows: Option<Box<VisitRow>>,
}

type VisitRow = dyn FnMut(&FlowRow);

/// The fluid, and what couples it to the particles.
struct FluidSystem {
    fluid: AnyFluid,
    coupling: Coupling,
    driving: Driving,
    /// Cells of the box that are in no wall.
    cells: f64,
    /// The walls, if one of them varies its motion.
    moving: Option<LatticeWalls>,
}

impl FluidSystem {
    /// Gives walls that vary their motion that of the step after `step` steps, or of the last one before the start.
    fn move_walls(&mut self, step: Option<u64>) {
        if let Some(walls) = &self.moving {
            self.fluid.move_walls(&walls.motions(step));
        }
    }

    /// The fluid as it starts, round the particles of a case; errors on every rank if one has not the memory. Collective.
    fn new(
        setup: &Setup,
        of: &FluidSetup,
        decomposition: &Decomposition,
        comm: &Comm,
        particles: &ParticleStore,
    ) -> Result<Self> {
        let simd = setup.plan.instruction_set();
        let params = FluidParams { relaxation_time: of.relaxation_time, collision: of.collision, simd };
        let walls = LatticeWalls::new(&setup.walls, &setup.units(), &setup.domain)
            .with_open(&setup.inlets, &setup.pressures);
        let boundary = Boundary {
            motions: &walls.motions(None),
            wall_of: &|cell| walls.wall_of(cell),
            part_of_link: &|wall, cell, way| walls.part_of_link(wall, cell, way),
            between: &|cell| walls.between(cell),
        };
        let mut fluid = AnyFluid::new(setup.plan.precision, decomposition, comm, &params, &boundary)?;
        let mut cells = [fluid.fluid_cells() as i64];
        comm.sum(&mut cells);
        let cells = cells[0] as f64;
        let (mut coupling, driving) = Self::acting(setup, of, decomposition, comm.rank(), cells);
        if let Some(flow) = of.start {
            let units = setup.units();
            let middle = |cell: [usize; 3]| Vec3::from_fn(|i, _| (cell[i] as f64 + 0.5) * units.dx);
            let squared = units.velocity() * units.velocity();
            // A flow has its velocity in the middle of a collision, when half the acceleration of the step has been added.
            let half = 0.5 * units.dt * driving.acceleration(0);
            fluid.set_flow(|cell| {
                let at = middle(cell);
                FlowState {
                    // The pressure is a third of the density.
                    density: 1.0 + 3.0 * flow.pressure(at) / squared,
                    velocity: ((flow.velocity(at) - half) / units.velocity()).into(),
                    strain: flow.strain(at).map(|rate| rate * units.dt),
                }
            });
            coupling.begin_moving(particles, |body| {
                [flow.velocity(body.position()), flow.angular_velocity(body.position())]
            });
        }
        if let Some(&number) = setup.plan.devices.iter().cycle().nth(comm.rank()) {
            comm.agree(Device::open(number).and_then(|device| fluid.use_device(&device, &mut coupling)))?;
            comm.agree(fluid.connect_on_device(comm))?;
        }
        let moving = walls.vary().then_some(walls);
        Ok(Self { fluid, coupling, driving, cells, moving })
    }

    /// Acceleration of a fluid of `cells` cells that are in no wall.
    fn acting(
        setup: &Setup,
        of: &FluidSetup,
        decomposition: &Decomposition,
        rank: usize,
        cells: f64,
    ) -> (Coupling, Driving) {
        let (units, templates) = (setup.units(), &setup.templates);
        let coupling = CouplingParams {
            units,
            method: of.coupling,
            gravity: setup.gravity,
            force_balance: of.force_balance,
            simd: setup.plan.instruction_set(),
        };
        let reach = templates.iter().map(|template| template.shape.circumradius()).fold(0.0, f64::max);
        let (submerged_weight, particle_volume) = Counts::of(setup).weight_and_volume();
        let driving = DrivingParams {
            units,
            volume: cells * (units.dx * units.dx * units.dx),
            periodic: setup.domain.periodic(),
            submerged_weight,
            particle_volume,
            balance: of.force_balance,
            control: std::array::from_fn(|axis| {
                let resistance = setup.resistance(of, axis);
                of.net_flux[axis].map(|target| Control { target, resistance })
            }),
            body_acceleration: of.body_acceleration.clone(),
        };
        let mut coupling = Coupling::new(coupling, decomposition, rank, reach);
        let masses = (0..templates.len()).map(|n| setup.virtual_mass(of, n)).collect();
        coupling.set_virtual_masses(masses);
        coupling.set_applied(applied(setup));
        (coupling, Driving::new(driving))
    }
}

/// Constant loads on the bodies of each template; none at all if there is none.
fn applied(setup: &Setup) -> Vec<Load> {
    let loads = setup.applied.iter().map(|&[force, torque]| Load { force, torque });
    let loads: Vec<Load> = loads.collect();
    if loads.iter().all(|load| *load == Load::default()) { Vec::new() } else { loads }
}

impl Simulation {
    /// The case at rest, with the engine it asks for. Errors: [`Error::Input`] if this program was built without that engine, or
    /// what the engine says. Collective.
    pub fn new(setup: &Setup, decomposition: &Decomposition, comm: Comm) -> Result<Self> {
        let dem = engine::engine(setup, decomposition, &comm, &Context::default())?;
        Self::with_engine(setup, decomposition, comm, dem)
    }

    /// The case at rest, with an engine of the caller's that holds its particles. Collective.
    ///
    /// ```
    /// use turbid::{Builder, Simulation, comm::Comm, dem::Ballistic, domain::Decomposition};
    /// let setup = Builder::example().setup()?;
    /// let whole = Decomposition::solo(setup.domain);
    /// let engine = Ballistic::new(whole.clone(), 0, setup.templates.clone(), &setup.particles);
    /// let mut simulation = Simulation::with_engine(&setup, &whole, Comm::Solo, Box::new(engine))?;
    /// simulation.step()?;
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Memory`] if a rank has not enough of it, [`Error::OtherRank`] on the others.
    pub fn with_engine(
        setup: &Setup,
        decomposition: &Decomposition,
        comm: Comm,
        dem: Box<dyn DemEngine>,
    ) -> Result<Self> {
        let system = (setup.fluid.as_ref())
            .map(|fluid| FluidSystem::new(setup, fluid, decomposition, &comm, dem.particles()));
        let block = decomposition.block(comm.rank());
        let plan = insertion::Plan::of(setup);
        Ok(Self {
            units: setup.units(),
            system: system.transpose()?,
            dem,
            comm: Rc::new(comm),
            timings: Timings::default(),
            step: 0,
            walls: setup.walls.as_slice().into(),
            hint: failure::hint(setup),
            failure: None,
            agreed: None,
            requests: Requests::default(),
            block,
            cut: decomposition.clone(),
            checkpoint: None,
            external: None,
            applied: applied(setup),
            caller_moves: false,
            before: None,
            contacts: setup.contact.is_some(),
            templates: setup.templates.clone(),
            domain: setup.domain,
            counts: Counts::of(setup),
            record: insertion::Record::new(setup.templates.len(), &plan, 0),
            plan: Rc::new(plan),
            busy: None,
            rows: None,
        })
    }

    /// Advances fluid and particles by one time step, before which particles go and come as the case says. Errors: [`Error::Diverged`] or [`Error::Engine`] on every rank, at most
    /// [`CONTROL_INTERVAL`] steps after it happened on one, and from then on in every step. Collective.
    pub fn step(&mut self) -> Result<()> {
        self.known_failure()?;
        self.come_and_go()?;
        let watch = self.busy.map(|_| Watch::start(&self.comm));
        let done = self.move_all();
        if let Some((watch, busy)) = watch.zip(self.busy.as_mut()) {
            busy.all += watch.work(&self.comm);
        }
        done
    }

    /// A step of the particles that there are.
    fn move_all(&mut self) -> Result<()> {
        let Self { comm, units, system, dem, timings: t, failure, external, applied, busy, rows, .. } = self;
        let measure = self.step.is_multiple_of(CONTROL_INTERVAL);
        let (mut flow, mut rows) = (None, rows.take());
        let asked = Asked { flow: measure, rows: rows.as_mut().map(|visit| &mut **visit as _) };
        let mut loads = if let Some(system) = system {
            system.move_walls(Some(self.step));
            let FluidSystem { fluid, coupling, driving, .. } = system;
            let acceleration = driving.step(self.step);
            let lattice = acceleration / units.acceleration();

            t.stage("map", || coupling.map(dem.particles()));
            flow = t.stage("fluid", || fluid.sweep(lattice.into(), coupling, asked));
            t.stage("loads", || coupling.loads(dem.particles(), acceleration, comm))
        } else {
            vec![Load::default(); dem.particles().owned]
        };
        if !applied.is_empty() {
            for (load, particle) in loads.iter_mut().zip(dem.particles().owned()) {
                *load += applied[particle.template as usize];
            }
        }
        if let Some(external) = external {
            external.add_to(&mut loads, dem.particles().owned(), self.step as f64 * units.dt, comm);
        }
        let moved = t.stage("dem", || Busy::note(busy, comm, || dem.advance(comm, &loads, units.dt)));
        if let Some(FluidSystem { fluid, .. }) = system {
            t.stage("halo", || fluid.exchange());
            if let Some(error) = fluid.take_failure() {
                failure.get_or_insert(error);
            }
        }

        if let Err(mut error) = moved {
            if let Error::Engine { step, .. } | Error::Diverged { step, .. } = &mut error {
                *step = self.step;
            }
            failure.get_or_insert(error);
        }
        self.step += 1;
        match flow {
            Some(flow) => self.control(&flow),
            None if measure => {
                let mut words = self.status_flags();
                self.comm.sum(&mut words);
                self.apply(&words)
            }
            None => Ok(()),
        }
    }

    /// True if the coming sweep finds the particles and the fluid of the processor as they are now.
    fn is_swept_as_it_is(&self) -> bool {
        let on_device = self.system.as_ref().is_some_and(|system| system.fluid.device_traffic().is_some());
        self.plan.is_empty() && !on_device
    }

    /// Advances by `count` time steps; errors as [`step`](Self::step), those of the particles and the engine not after the last of
    /// these steps. Collective.
    pub fn advance(&mut self, count: u64) -> Result<()> {
        refuse_endless(count as f64, self.units.dt)?;
        (0..count).try_for_each(|_| self.step())?;
        self.share_failure()
    }

    /// True if this rank has failed, with the requests to it.
    fn status_flags(&self) -> [i64; 3] {
        let Requests { stop, checkpoint } = self.requests;
        [self.failure.is_some(), stop, checkpoint].map(i64::from)
    }

    /// Applies the sums of the status flags of all ranks. Collective.
    fn apply(&mut self, sums: &[i64]) -> Result<()> {
        self.requests = Requests { stop: sums[1] > 0, checkpoint: sums[2] > 0 };
        if sums[0] > 0 { Err(self.agree_on_failure()) } else { Ok(()) }
    }

    /// Adds up a measurement over all ranks, sets the driving, and agrees on failures. Collective.
    fn control(&mut self, flow: &Flow) -> Result<()> {
        self.note_fault(flow.fault);
        let mut words = measure::words(flow);
        words.extend(self.status_flags());
        self.comm.sum(&mut words);
        self.apply(&words[measure::WORDS..])?;
        let mean = self.mean_of(&words, flow.max_speed);
        if let Some(system) = &mut self.system {
            system.driving.measured(mean);
        }
        Ok(())
    }

    /// Records a cell that is too fast.
    fn note_fault(&mut self, fault: Option<([usize; 3], f64)>) {
        if let Some((cell, speed)) = fault {
            let [x, y, z] = cell.map(|c| (c as f64 + 0.5) * self.units.dx);
            self.failure.get_or_insert(Error::Diverged {
                step: self.step,
                what: format!(
                    "fluid velocity {speed:.3} cells per step at ({x:.4e}, {y:.4e}, {z:.4e}) m is not below {}",
                    crate::fluid::SPEED_LIMIT
                ),
            });
        }
    }

    /// Looks for a failure since the last control, also in the fluid as it is now, and agrees on it. Errors:
    /// [`Error::Diverged`] or [`Error::Engine`] on every rank. Collective.
    pub fn check(&mut self) -> Result<()> {
        self.known_failure()?;
        let (particles, acceleration) = (self.dem.particles(), self.lattice_acceleration());
        let fault = self.system.as_mut().and_then(|FluidSystem { fluid, coupling, .. }| {
            coupling.map(particles);
            fluid.measure(acceleration, coupling).0.fault
        });
        self.note_fault(fault);
        if let Err(error) = self.dem.health() {
            self.failure.get_or_insert(error);
        }
        self.share_failure()
    }

    /// Agrees on a failure since the last control, with the errors of [`check`](Self::check). Collective.
    fn share_failure(&mut self) -> Result<()> {
        self.known_failure()?;
        if self.comm.any(self.failure.is_some()) { Err(self.agree_on_failure()) } else { Ok(()) }
    }

    /// The first failure of all ranks; the same on every rank. Collective.
    fn agree_on_failure(&mut self) -> Error {
        let mine = self.failure.take().map_or_else(Vec::new, |error| failure::to_bytes(error, self.step));
        let all = self.agreed.insert(self.comm.all_gather(mine));
        failure::first(all, self.dem.name(), &self.hint)
    }

    /// The failure on which all ranks have agreed, if they have.
    fn known_failure(&self) -> Result<()> {
        let known = self.agreed.as_ref().map(|all| failure::first(all, self.dem.name(), &self.hint));
        known.map_or(Ok(()), Err)
    }

    /// Steps done.
    pub fn steps_done(&self) -> u64 {
        self.step
    }

    /// The fluid of this rank's block; none without a fluid.
    pub fn fluid(&self) -> Option<&AnyFluid> {
        self.system.as_ref().map(|system| &system.fluid)
    }

    /// The ranks.
    pub fn comm(&self) -> &Comm {
        &self.comm
    }

    /// The contacts at the last sub-step that this rank has evaluated, see [`DemEngine::contact_states`]. Collective.
    pub fn contact_states(&self) -> Vec<ContactState> {
        self.dem.contact_states(&self.comm)
    }

    /// The engine.
    pub fn dem(&self) -> &dyn DemEngine {
        &*self.dem
    }

    /// Volume of all cells that are in no wall (m^3); zero without a fluid.
    pub fn fluid_volume(&self) -> f64 {
        self.system
            .as_ref()
            .map_or(0.0, |system| system.cells * (self.units.dx * self.units.dx * self.units.dx))
    }

    /// Mean values over the box at the last control, up to [`CONTROL_INTERVAL`] steps ago; zeros without a fluid.
    pub fn mean_flow(&self) -> MeanFlow {
        self.system.as_ref().map_or_else(MeanFlow::default, |system| system.driving.mean)
    }

    /// Accelerations by the controller of the net flux since the start; none without a fluid.
    pub fn control_record(&self) -> ControlRecord {
        self.system.as_ref().map_or_else(ControlRecord::default, |system| system.driving.record)
    }

    /// Acceleration of the fluid in the coming step (m/s^2).
    pub fn acceleration(&self) -> Vec3 {
        self.system.as_ref().map_or_else(Vec3::zeros, |system| system.driving.acceleration(self.step))
    }

    /// The same in lattice units.
    fn lattice_acceleration(&self) -> [f64; 3] {
        (self.acceleration() / self.units.acceleration()).into()
    }

    /// Hash over all populations and particle states, the same for any number of ranks. Collective.
    pub fn state_hash(&self) -> u64 {
        let particles = self.dem.particles().owned().iter();
        let particles =
            particles.map(|p| xxh3_64_with_seed(bytemuck::bytes_of(p), p.id)).fold(0, u64::wrapping_add);
        let fluid = self.system.as_ref().map_or(0, |system| system.fluid.state_hash());
        let mut sum = [fluid.wrapping_add(particles) as i64];
        self.comm.sum(&mut sum);
        sum[0] as u64
    }

    /// Seconds spent by stage on this rank.
    pub fn timings(&mut self) -> &mut Timings {
        &mut self.timings
    }
}
