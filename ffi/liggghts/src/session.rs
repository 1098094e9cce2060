//! LIGGGHTS in this process: one instance, commands and arrays.
//!
//! A step under constant loads `F`, the ones before being `F'`:
//!
//! 1. `f += F - F'`, as the first half kick uses the force of the last step;
//! 2. `F` goes to the fix `couple/cfd/force`, which adds it to every force that is computed;
//! 3. `run n pre no post no`: a set-up in between would recompute damped contacts at another velocity.
//!
//! So the motion under loads alone is the exact parabola in each step.
//!
//! LIGGGHTS takes the moment of inertia of a homogeneous sphere of the contact radius. Where that is `q` times that of the
//! particle (contacts of enlarged surfaces), the torque of the first half kick is multiplied by `q` and the second one is
//! corrected by `w += (q - 1) dt/2 T / I`: again velocity Verlet, with the particle's inertia.

use super::deck::{self, Plan, wall_fix};
use super::instance::{Arrays, Instance, Outcome};
use super::restart::Saved;
use std::f64::consts::PI;
use turbid_core::dem::ContactState;
use turbid_core::math::Vec3;
use turbid_process::{
    AppliedLoad, Body, ContactForce, ContactSection, Hello, LoadedState, Order, Seat, Served, SetUp,
    SphereKind, State, id_of, kinds, open_log, path_of, tag,
};

/// Name of the compute of pair contacts; its columns are position (6), ids (3), force (3), its parts across and along
/// the surfaces (3 each).
pub(crate) const PAIRS: &str = "contacts";

/// The moment of inertia of a homogeneous sphere over `m r^2`.
const SPHERE: f64 = 0.4;

/// LIGGGHTS as an engine.
#[derive(Debug)]
pub(crate) struct Engine {
    seat: Seat,
    plan: Plan,
    kinds: Vec<SphereKind>,
    bodies: Vec<Body>,
    gravity: Vec3,
    contact: Option<ContactSection>,
    session: Option<Session>,
}

impl Engine {
    pub(crate) fn new(seat: Seat) -> Self {
        Self {
            seat,
            plan: Plan::default(),
            kinds: Vec::new(),
            bodies: Vec::new(),
            gravity: Vec3::zeros(),
            contact: None,
            session: None,
        }
    }

    fn opened(&mut self) -> Outcome<&mut Session> {
        self.session.as_mut().ok_or_else(|| "LIGGGHTS has not been set up".to_owned())
    }

    /// A session with the particles of the set-up, or those that were saved.
    fn open(&mut self, saved: &[u8]) -> Outcome<()> {
        // The instance of this process must be free before it is taken again.
        self.session = None;
        let instance = Instance::take(self.seat.communicator)?;
        let start = (&self.bodies[..], saved, self.seat.part == 0);
        self.session = Some(Session::open(instance, &self.plan, &self.kinds, start)?);
        Ok(())
    }
}

impl Served for Engine {
    fn hello(&self) -> Hello {
        Hello {
            name: "LIGGGHTS".to_owned(),
            shapes: vec!["sphere".to_owned()],
            walls: ["plane", "pipe", "rod"].map(String::from).to_vec(),
            orientations: false,
            contacts: true,
            overlaps: false,
            saves: true,
        }
    }

    fn set_up(&mut self, case: SetUp, bodies: Vec<Body>) -> Outcome<()> {
        self.kinds = kinds(&case)?;
        let smallest = self.kinds.iter().map(|kind| kind.radius).fold(f64::INFINITY, f64::min);
        let grid = self.seat.blocks();
        (self.plan, self.gravity) = (deck::plan(&case, smallest, grid)?, case.gravity.into());
        (self.bodies, self.contact) = (bodies, case.contact);
        self.open(&[])
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<()> {
        let gravity = self.gravity;
        self.opened()?.advance(step, substeps, loads, gravity)
    }

    fn states(&mut self) -> Outcome<Vec<LoadedState>> {
        let gravity = self.gravity;
        let session = self.opened()?;
        let mut all = session.states()?;
        let masses = session.instance.arrays()?.mass;
        for (loaded, &k) in all.iter_mut().zip(&session.order.places) {
            loaded.force = (Vec3::from(loaded.force) - gravity * masses[k as usize]).into();
        }
        Ok(all)
    }

    fn contacts(&mut self) -> Outcome<Vec<ContactForce>> {
        let contact = self.contact.take();
        let contacts = self.opened().and_then(|session| session.contacts(contact.as_ref()));
        self.contact = contact;
        contacts
    }

    fn save(&mut self) -> Outcome<Vec<u8>> {
        self.opened()?.save()
    }

    fn restore(&mut self, saved: &[u8]) -> Outcome<()> {
        self.open(saved)
    }
}

/// One simulation in LIGGGHTS.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) instance: Instance,
    kinds: Vec<SphereKind>,
    walls: usize,
    pub(super) order: Order,
    /// The present time step (s); 0 before the first step.
    pub(super) time_step: f64,
}

impl Session {
    /// With these bodies, or with what was saved; the first process of all reads LIGGGHTS's own file.
    fn open(
        instance: Instance,
        plan: &Plan,
        kinds: &[SphereKind],
        (bodies, saved, is_first): (&[Body], &[u8], bool),
    ) -> Outcome<Self> {
        let saved = match saved {
            [] => None,
            saved => Some(Saved::of(saved).ok_or("what LIGGGHTS saved is not whole")?),
        };
        let kinds = kinds.to_vec();
        let mut session =
            Self { instance, kinds, walls: plan.walls, order: Order::default(), time_step: 0.0 };
        // One file for all.
        if let Some(path) = plan.options.log_file.as_ref().filter(|_| is_first) {
            let log = open_log(path)?;
            session.instance.command(&format!("log {} append", path_of(&log)))?;
        } else {
            session.instance.command("log none")?;
        }
        session.instance.commands(&plan.before)?;
        if let Some(saved) = &saved {
            saved.read_restart(&session.instance, is_first)?;
            session.instance.commands(&plan.after)?;
        } else {
            session.instance.commands(plan.space.iter().chain(&plan.after))?;
            session.create(bodies)?;
        }
        session.instance.commands(&plan.last)?;
        // A restart file has the groups; a region would put other particles into them now.
        let kept = |command: &&String| saved.is_none() || !command.starts_with("group ");
        session.instance.commands(plan.options.commands.iter().filter(kept))?;
        // Sets the loads to zero, and finds out whatever is wrong.
        session.instance.command("run 0")?;
        // What follows would be a line for every step.
        session.instance.command("log none")?;
        if let Some(saved) = saved {
            session.restore(&saved)?;
        }
        Ok(session)
    }

    /// Makes the atoms, each in its place.
    fn create(&mut self, bodies: &[Body]) -> Outcome<()> {
        let tags: Vec<i32> = bodies.iter().map(|body| tag(body.id)).collect::<Outcome<_>>()?;
        let positions: Vec<[f64; 3]> = bodies.iter().map(|body| body.position).collect();
        self.instance.create(&tags, &positions)?;
        let arrays = self.instance.arrays()?;
        for (k, body) in bodies.iter().enumerate() {
            let kind = self.kinds[body.template as usize];
            arrays.kind[k] = kind.material as i32 + 1;
            arrays.radius[k] = kind.radius;
            arrays.mass[k] = kind.mass;
            arrays.density[k] = kind.mass / (4.0 / 3.0 * PI * kind.radius * kind.radius * kind.radius);
            arrays.velocity[k] = body.velocity;
            arrays.angular_velocity[k] = body.angular_velocity;
        }
        // Brings them to the processes whose blocks they lie in.
        self.instance.command("displace_atoms all move 0 0 0 units box")
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad], gravity: Vec3) -> Outcome<()> {
        if self.time_step.to_bits() != step.to_bits() {
            // LIGGGHTS takes note of another time step in a set-up only.
            self.instance.command(&format!("timestep {step:e}"))?;
            self.instance.command("run 0")?;
            self.time_step = step;
        }
        let set = self.set_loads(loads, gravity);
        // The others would wait for this process; it says why it has failed.
        if self.instance.any(set.is_err()) {
            return set;
        }
        if self.kinds.iter().all(|kind| kind.inertia_ratio.to_bits() == 1.0_f64.to_bits()) {
            return self.instance.command(&format!("run {substeps} pre no post no"));
        }
        for _ in 0..substeps {
            self.each_atom(|kind, arrays, k| {
                arrays.torque[k] = arrays.torque[k].map(|t| t * kind.inertia_ratio);
            })?;
            self.instance.command("run 1 pre no post no")?;
            self.each_atom(|kind, arrays, k| {
                let inertia = SPHERE * kind.mass * kind.radius * kind.radius;
                let factor = (kind.inertia_ratio - 1.0) * 0.5 * step / inertia;
                for i in 0..3 {
                    arrays.angular_velocity[k][i] += factor * arrays.torque[k][i];
                }
            })?;
        }
        Ok(())
    }

    /// Calls `change` with the kind of every atom, the arrays, and its place in them.
    fn each_atom(&mut self, mut change: impl FnMut(&SphereKind, &mut Arrays, usize)) -> Outcome<()> {
        let mut arrays = self.instance.arrays()?;
        for k in 0..arrays.id.len() {
            let own = (arrays.radius[k].to_bits(), arrays.mass[k].to_bits());
            let kind = self.kinds.iter().find(|kind| (kind.radius.to_bits(), kind.mass.to_bits()) == own);
            change(kind.ok_or("LIGGGHTS has a particle that it was not given")?, &mut arrays, k);
        }
        Ok(())
    }

    /// Sets the loads of the coming step, by ascending id.
    fn set_loads(&mut self, loads: &[AppliedLoad], gravity: Vec3) -> Outcome<()> {
        let arrays = self.instance.arrays()?;
        self.order.note_loaded(arrays.id, loads)?;
        let places = self.order.places.iter().map(|&k| k as usize);
        let mass = arrays.mass.to_vec();
        let weighted = |k: usize, load: &AppliedLoad| -> [f64; 3] {
            (Vec3::from(load.force) + gravity * mass[k]).into()
        };
        let n = loads.len();
        // The fixes that hold the loads, made by `couple/cfd/force`.
        let (mut forces, mut torques) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        let held = self.instance.property("dragforce", n)?;
        for (k, load) in places.clone().zip(loads) {
            let force = weighted(k, load);
            forces[k] = std::array::from_fn(|i| force[i] - held[k][i]);
            held[k] = force;
        }
        let held = self.instance.property("hdtorque", n)?;
        for (k, load) in places.zip(loads) {
            torques[k] = std::array::from_fn(|i| load.torque[i] - held[k][i]);
            held[k] = load.torque;
        }
        let arrays = self.instance.arrays()?;
        for k in 0..n {
            for i in 0..3 {
                arrays.force[k][i] += forces[k][i];
                arrays.torque[k][i] += torques[k][i];
            }
        }
        Ok(())
    }

    /// The spheres of this process now, ascending by id, with their loads, weight included.
    pub(super) fn states(&mut self) -> Outcome<Vec<LoadedState>> {
        let n = self.instance.arrays()?.id.len();
        let forces = self.instance.property("dragforce", n)?.to_vec();
        let torques = self.instance.property("hdtorque", n)?.to_vec();
        let arrays = self.instance.arrays()?;
        self.order.note(arrays.id);
        let state = |k: usize| {
            let (force, torque) = (forces[k], torques[k]);
            let state = State {
                id: id_of(arrays.id[k]),
                orientation: [0.0, 0.0, 0.0, 1.0],
                position: arrays.position[k],
                velocity: arrays.velocity[k],
                angular_velocity: arrays.angular_velocity[k],
                contact_force: std::array::from_fn(|i| arrays.force[k][i] - force[i]),
                contact_torque: std::array::from_fn(|i| arrays.torque[k][i] - torque[i]),
            };
            LoadedState { state, force, torque }
        };
        Ok(self.order.places.iter().map(|&k| state(k as usize)).collect())
    }

    /// The forces of the contacts as they acted: LIGGGHTS computes them when asked, so the velocities are those of half a step
    /// before in the meantime. (Those of periodic images are that all the time.) It does not know then that a contact slid: its
    /// tangential dashpot is in the friction although it did not act.
    fn contacts(&mut self, model: Option<&ContactSection>) -> Outcome<Vec<ContactForce>> {
        let step = self.time_step;
        let arrays = self.instance.arrays()?;
        let now = (arrays.velocity.to_vec(), arrays.angular_velocity.to_vec());
        self.each_atom(|kind, arrays, k| {
            let kick = 0.5 * step / kind.mass;
            let twist = kick * kind.inertia_ratio / (SPHERE * kind.radius * kind.radius);
            for i in 0..3 {
                arrays.velocity[k][i] -= kick * arrays.force[k][i];
                arrays.angular_velocity[k][i] -= twist * arrays.torque[k][i];
            }
        })?;
        let rows = self.instance.rows(PAIRS);
        // Asking for contacts does not sort the particles.
        let arrays = self.instance.arrays()?;
        arrays.velocity.copy_from_slice(&now.0);
        arrays.angular_velocity.copy_from_slice(&now.1);
        let ids: Vec<u64> = arrays.id.iter().map(|&tag| id_of(tag)).collect();
        let mut contacts = Vec::new();
        for row in rows? {
            let [a, b] = [row[6] as i32, row[7] as i32];
            let on_first = |at: usize| {
                let force = Vec3::new(row[at], row[at + 1], row[at + 2]);
                if a > b { -force } else { force }
            };
            let (normal, mut friction) = (on_first(12), on_first(15));
            let [first, second] = [a.min(b), a.max(b)];
            let materials = [first, second].map(|tag| self.instance.kind_of(tag));
            if let (Some(model), [Some(one), Some(other)]) = (model, materials) {
                // A contact that slides has Coulomb's friction; the dashpot that LIGGGHTS adds now did not act.
                let pair = model.pair(one - 1, other - 1);
                let (most, norm) = (deck::friction(pair) * normal.norm(), friction.norm());
                if norm > most {
                    friction *= most / norm;
                }
            }
            let [first, second] = [first, second].map(id_of);
            contacts.push(ContactForce { first, second, force: (normal + friction).into() });
        }
        for wall in 0..self.walls {
            let forces = self.instance.property(&format!("force_{}", wall_fix(wall)), ids.len())?;
            for (&force, &first) in forces.iter().zip(&ids) {
                if force.iter().any(|component| *component != 0.0) {
                    contacts.push(ContactForce { first, second: ContactState::of_wall(wall), force });
                }
            }
        }
        Ok(contacts)
    }
}
