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
use std::fs::File;
use std::os::fd::AsRawFd;
use turbid_core::dem::ContactState;
use turbid_core::math::Vec3;
use turbid_process::{
    AppliedLoad, Body, ContactForce, ContactSection, Hello, Served, SetUp, ShapeSection, State, open_log,
};

/// Name of the compute of pair contacts; its columns are position (6), ids (3), force (3), its parts across and along
/// the surfaces (3 each).
pub(crate) const PAIRS: &str = "contacts";

/// The moment of inertia of a homogeneous sphere over `m r^2`.
const SPHERE: f64 = 0.4;

/// A sphere as LIGGGHTS is given it, SI units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Atom {
    /// Id of the particle; LIGGGHTS counts from 1.
    pub(super) id: u64,
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    /// Of contacts.
    pub(super) radius: f64,
    pub(super) mass: f64,
    /// Moment of inertia of LIGGGHTS's sphere over that of the particle (-).
    pub(super) inertia_ratio: f64,
    /// Index of the material.
    pub(super) material: usize,
}

impl Atom {
    fn of(body: &Body, case: &SetUp) -> Outcome<Self> {
        let template = &case.templates[body.template as usize];
        let ShapeSection::Sphere { radius } = template.shape else {
            return Err("it has spheres only".to_owned());
        };
        let grown = radius + case.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        // Without an enlargement exactly one.
        let ratio = grown / radius;
        Ok(Self {
            id: body.id,
            position: body.position,
            velocity: body.velocity,
            angular_velocity: body.angular_velocity,
            radius: grown,
            mass: template.mass,
            inertia_ratio: ratio * ratio,
            material: template.material,
        })
    }
}

/// LIGGGHTS as an engine.
#[derive(Debug, Default)]
pub(crate) struct Engine {
    plan: Plan,
    atoms: Vec<Atom>,
    gravity: Vec3,
    contact: Option<ContactSection>,
    session: Option<Session>,
}

impl Engine {
    fn opened(&mut self) -> Outcome<&mut Session> {
        self.session.as_mut().ok_or_else(|| "LIGGGHTS has not been set up".to_owned())
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
        let atoms: Outcome<Vec<Atom>> = bodies.iter().map(|body| Atom::of(body, &case)).collect();
        self.atoms = atoms?;
        let smallest = self.atoms.iter().map(|atom| atom.radius).fold(f64::INFINITY, f64::min);
        (self.plan, self.gravity) = (deck::plan(&case, smallest)?, case.gravity.into());
        self.contact = case.contact;
        self.session = Some(Session::open(&self.plan, self.atoms.clone(), &[])?);
        Ok(())
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<Vec<State>> {
        let (mut loads, gravity) = (loads.to_vec(), self.gravity);
        for (load, atom) in loads.iter_mut().zip(&self.atoms) {
            load.force = (Vec3::from(load.force) + gravity * atom.mass).into();
        }
        self.opened()?.advance(step, substeps, &loads)
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
        // The instance of this process must be free before it is taken again.
        self.session = None;
        self.session = Some(Session::open(&self.plan, self.atoms.clone(), saved)?);
        Ok(())
    }
}

/// One simulation in LIGGGHTS.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) instance: Instance,
    /// By index; positions are those of the last step, to say where one was lost.
    pub(super) atoms: Vec<Atom>,
    walls: usize,
    /// Loads of the last step, weight included, by index.
    pub(super) loads: Vec<AppliedLoad>,
    /// The present time step (s); 0 before the first step.
    pub(super) time_step: f64,
}

impl Session {
    fn open(plan: &Plan, atoms: Vec<Atom>, saved: &[u8]) -> Outcome<Self> {
        let saved = match saved {
            [] => None,
            saved => Some(
                Saved::of(saved, atoms.len())
                    .ok_or("what LIGGGHTS saved is not whole, or of another case")?,
            ),
        };
        let (instance, loads) = (Instance::take()?, vec![AppliedLoad::default(); atoms.len()]);
        let mut session = Self { instance, atoms, walls: plan.walls, loads, time_step: 0.0 };
        if let Some(path) = &plan.options.log_file {
            let log = open_log(path)?;
            session.instance.command(&format!("log {} append", path_of(&log)))?;
        }
        session.instance.commands(&plan.before)?;
        if let Some(saved) = &saved {
            saved.read_restart(&session.instance)?;
            session.instance.commands(&plan.after)?;
        } else {
            session.instance.commands(plan.space.iter().chain(&plan.after))?;
            // At random, to be put in their places; the seed has no meaning.
            let create = format!("create_atoms 1 random {} 49979687 NULL", session.atoms.len());
            session.instance.command(&create)?;
            session.write_atoms()?;
        }
        session.instance.commands(&plan.last)?;
        // A restart file has the groups; a region would put other particles into them now.
        let kept = |command: &&String| saved.is_none() || !command.starts_with("group ");
        session.instance.commands(plan.options.commands.iter().filter(kept))?;
        // Sets the loads to zero, and finds out whatever is wrong.
        session.instance.command("run 0")?;
        // What follows would be a line for every step.
        session.instance.command("log none")?;
        session.indices()?;
        if let Some(saved) = saved {
            session.restore(saved)?;
        }
        Ok(session)
    }

    /// Puts the atoms in their places.
    fn write_atoms(&mut self) -> Outcome<()> {
        let made = self.instance.arrays()?.id.len();
        if made != self.atoms.len() {
            return Err(format!("LIGGGHTS made {made} particles instead of {}", self.atoms.len()));
        }
        let indices = self.indices()?;
        let arrays = self.instance.arrays()?;
        for (k, index) in indices.into_iter().enumerate() {
            let atom = &self.atoms[index];
            arrays.kind[k] = atom.material as i32 + 1;
            arrays.radius[k] = atom.radius;
            arrays.mass[k] = atom.mass;
            arrays.density[k] = atom.mass / (4.0 / 3.0 * PI * atom.radius * atom.radius * atom.radius);
            arrays.position[k] = atom.position;
            arrays.velocity[k] = atom.velocity;
            arrays.angular_velocity[k] = atom.angular_velocity;
        }
        Ok(())
    }

    /// The index of every atom of LIGGGHTS in its order; an error if one is not there.
    pub(super) fn indices(&mut self) -> Outcome<Vec<usize>> {
        let mut there = vec![false; self.atoms.len()];
        let indices: Vec<usize> = self.instance.arrays()?.id.iter().map(|&id| id as usize - 1).collect();
        for &index in &indices {
            *there.get_mut(index).ok_or("LIGGGHTS has a particle that it was not given")? = true;
        }
        let Some(lost) = there.iter().position(|there| !there) else {
            return Ok(indices);
        };
        let others = there.iter().filter(|there| !**there).count() - 1;
        let more = if others > 0 { format!(" and {others} more") } else { String::new() };
        Err(format!(
            "LIGGGHTS has lost {}{more}: it has left the box, or moved too far in one step",
            self.describe(lost)
        ))
    }

    /// A particle and its last position.
    fn describe(&self, index: usize) -> String {
        let Atom { id, position: [x, y, z], .. } = self.atoms[index];
        format!("particle {id}, last seen at ({x:.6e}, {y:.6e}, {z:.6e}) m")
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<Vec<State>> {
        if loads.len() != self.atoms.len() {
            return Err("as many loads as particles are needed".to_owned());
        }
        if self.time_step.to_bits() != step.to_bits() {
            // LIGGGHTS takes note of another time step in a set-up only.
            self.instance.command(&format!("timestep {step:e}"))?;
            self.instance.command("run 0")?;
            self.time_step = step;
        }
        self.set_loads(loads)?;
        if self.atoms.iter().all(|atom| atom.inertia_ratio.to_bits() == 1.0_f64.to_bits()) {
            self.instance.command(&format!("run {substeps} pre no post no"))?;
        } else {
            for _ in 0..substeps {
                self.each_atom(|atom, arrays, k| {
                    arrays.torque[k] = arrays.torque[k].map(|t| t * atom.inertia_ratio);
                })?;
                self.instance.command("run 1 pre no post no")?;
                self.each_atom(|atom, arrays, k| {
                    let inertia = SPHERE * atom.mass * atom.radius * atom.radius;
                    let factor = (atom.inertia_ratio - 1.0) * 0.5 * step / inertia;
                    for i in 0..3 {
                        arrays.angular_velocity[k][i] += factor * arrays.torque[k][i];
                    }
                })?;
            }
        }
        let states = self.states()?;
        for (index, state) in states.iter().enumerate() {
            let numbers = [state.position, state.velocity, state.angular_velocity];
            if !numbers.iter().flatten().all(|x| x.is_finite()) {
                return Err(format!("the state of {} is not finite", self.describe(index)));
            }
        }
        for (atom, state) in self.atoms.iter_mut().zip(&states) {
            atom.position = state.position;
        }
        Ok(states)
    }

    /// Calls `change` with every atom, the arrays, and its place in them.
    fn each_atom(&mut self, mut change: impl FnMut(&Atom, &mut Arrays, usize)) -> Outcome<()> {
        let indices = self.indices()?;
        let mut arrays = self.instance.arrays()?;
        for (k, index) in indices.into_iter().enumerate() {
            change(&self.atoms[index], &mut arrays, k);
        }
        Ok(())
    }

    /// Sets the loads of the coming step.
    fn set_loads(&mut self, loads: &[AppliedLoad]) -> Outcome<()> {
        let indices = self.indices()?;
        let arrays = self.instance.arrays()?;
        for (k, &index) in indices.iter().enumerate() {
            let (load, last) = (&loads[index], &self.loads[index]);
            for i in 0..3 {
                arrays.force[k][i] += load.force[i] - last.force[i];
                arrays.torque[k][i] += load.torque[i] - last.torque[i];
            }
        }
        // The fixes that hold the loads, made by `couple/cfd/force`.
        let forces = self.instance.property("dragforce", indices.len())?;
        forces.iter_mut().zip(&indices).for_each(|(force, &index)| *force = loads[index].force);
        let torques = self.instance.property("hdtorque", indices.len())?;
        torques.iter_mut().zip(&indices).for_each(|(torque, &index)| *torque = loads[index].torque);
        self.loads.copy_from_slice(loads);
        Ok(())
    }

    /// The spheres now, by index.
    pub(super) fn states(&mut self) -> Outcome<Vec<State>> {
        let indices = self.indices()?;
        let arrays = self.instance.arrays()?;
        let mut states = vec![State::default(); self.atoms.len()];
        for (k, &index) in indices.iter().enumerate() {
            let load = &self.loads[index];
            states[index] = State {
                id: self.atoms[index].id,
                orientation: [0.0, 0.0, 0.0, 1.0],
                position: arrays.position[k],
                velocity: arrays.velocity[k],
                angular_velocity: arrays.angular_velocity[k],
                contact_force: std::array::from_fn(|i| arrays.force[k][i] - load.force[i]),
                contact_torque: std::array::from_fn(|i| arrays.torque[k][i] - load.torque[i]),
            };
        }
        Ok(states)
    }

    /// The forces of the contacts as they acted: LIGGGHTS computes them when asked, so the velocities are those of half a step
    /// before in the meantime. (Those of periodic images are that all the time.) It does not know then that a contact slid: its
    /// tangential dashpot is in the friction although it did not act.
    fn contacts(&mut self, model: Option<&ContactSection>) -> Outcome<Vec<ContactForce>> {
        let indices = self.indices()?;
        let arrays = self.instance.arrays()?;
        let now = (arrays.velocity.to_vec(), arrays.angular_velocity.to_vec());
        for (k, &index) in indices.iter().enumerate() {
            let atom = &self.atoms[index];
            let kick = 0.5 * self.time_step / atom.mass;
            let twist = kick * atom.inertia_ratio / (SPHERE * atom.radius * atom.radius);
            for i in 0..3 {
                arrays.velocity[k][i] -= kick * arrays.force[k][i];
                arrays.angular_velocity[k][i] -= twist * arrays.torque[k][i];
            }
        }
        let rows = self.instance.rows(PAIRS);
        // Asking for contacts does not sort the particles.
        let arrays = self.instance.arrays()?;
        arrays.velocity.copy_from_slice(&now.0);
        arrays.angular_velocity.copy_from_slice(&now.1);
        let mut contacts = Vec::new();
        for row in rows? {
            let [a, b] = [row[6] as usize - 1, row[7] as usize - 1];
            let on_first = |at: usize| {
                let force = Vec3::new(row[at], row[at + 1], row[at + 2]);
                if a > b { -force } else { force }
            };
            let (normal, mut friction) = (on_first(12), on_first(15));
            let [first, second] = [a.min(b), a.max(b)].map(|index| &self.atoms[index]);
            if let Some(model) = model {
                // A contact that slides has Coulomb's friction; the dashpot that LIGGGHTS adds now did not act.
                let pair = model.pair(first.material, second.material);
                let (most, norm) = (deck::friction(pair) * normal.norm(), friction.norm());
                if norm > most {
                    friction *= most / norm;
                }
            }
            contacts.push(ContactForce {
                first: first.id,
                second: second.id,
                force: (normal + friction).into(),
            });
        }
        for wall in 0..self.walls {
            let forces = self.instance.property(&format!("force_{}", wall_fix(wall)), indices.len())?;
            for (&force, &index) in forces.iter().zip(&indices) {
                if force.iter().any(|component| *component != 0.0) {
                    let (first, second) = (self.atoms[index].id, ContactState::of_wall(wall));
                    contacts.push(ContactForce { first, second, force });
                }
            }
        }
        Ok(contacts)
    }
}

/// A path to an open file of this process, for LIGGGHTS: without blanks, whatever the name of the file, and even if it has none.
pub(crate) fn path_of(file: &File) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}
