//! LIGGGHTS in this process: one instance, commands and arrays.
//!
//! A step under constant loads `F`, the ones before being `F'`:
//!
//! 1. `f += F - F'`, as the first half kick takes the force that the last step has left;
//! 2. `F` goes to the fix `couple/cfd/force`, which adds it to every force that is computed anew;
//! 3. `run n pre no post no`: a set-up in between would recompute damped contacts at another velocity.
//!
//! So the motion under loads alone is the exact parabola of each step.
//!
//! LIGGGHTS has the moment of inertia of a homogeneous sphere of the contact radius. Where that is not the one of the
//! particle, `q` times too large (contacts of grown surfaces), the torque of the first half kick is multiplied by `q`
//! and the second one is made up for, `w += (q - 1) dt/2 T / I`: again velocity Verlet, with the right inertia.

use super::instance::{Instance, Outcome, vector};
use super::protocol::{Atom, Plan, Push, Reply, Request, State, Touch, wall_fix};
use super::worker;
use std::fs::File;
use std::os::fd::AsRawFd;

/// Name of the compute of pair contacts; its columns are position (6), ids (3), force (3), its parts across and along
/// the surfaces (3 each).
pub(crate) const PAIRS: &str = "contacts";

/// The fixes that hold the loads, made by `couple/cfd/force`.
const FORCE: &str = "dragforce";
const TORQUE: &str = "hdtorque";

/// The moment of inertia of a sphere over `m r^2`, as LIGGGHTS has it.
const SPHERE: f64 = 0.4;

/// One simulation in LIGGGHTS.
#[derive(Debug)]
pub(crate) struct Session {
    instance: Option<Instance>,
    /// By index.
    atoms: Vec<Atom>,
    walls: usize,
    /// Loads of the last step, by index.
    pub(super) loads: Vec<Push>,
    /// The present time step (s); nothing before the first step.
    pub(super) time_step: f64,
    /// Where the spheres were last, to say where one was lost.
    pub(super) last: Vec<[f64; 3]>,
    /// Their ids, by index.
    names: Vec<u64>,
}

impl Drop for Session {
    fn drop(&mut self) {
        if let Some(instance) = self.instance.take() {
            instance.put_back();
        }
    }
}

impl Session {
    /// A session that waits for [`Request::Open`].
    pub(super) fn new() -> Self {
        Self {
            instance: None,
            atoms: Vec::new(),
            walls: 0,
            loads: Vec::new(),
            time_step: 0.0,
            last: Vec::new(),
            names: Vec::new(),
        }
    }

    /// Does what is asked.
    pub(super) fn serve(&mut self, request: Request) -> Reply {
        let outcome = match request {
            Request::Open(plan, atoms) => self.open(&plan, atoms).map(|()| Reply::Done),
            Request::Resume(plan, atoms, saved) => self.resume(&plan, atoms, &saved).map(|()| Reply::Done),
            Request::Advance { step, substeps, loads } => {
                self.advance(step, substeps, &loads).map(Reply::States)
            }
            Request::Touches => self.touches().map(Reply::Touches),
            Request::Save => self.save().map(Reply::Saved),
        };
        outcome.unwrap_or_else(Reply::Failed)
    }

    pub(super) fn instance(&self) -> Outcome<&Instance> {
        self.instance.as_ref().ok_or_else(|| "LIGGGHTS has not been set up".to_owned())
    }

    fn open(&mut self, plan: &Plan, atoms: Vec<Atom>) -> Outcome<()> {
        self.begin(plan, atoms)?;
        let instance = self.instance()?;
        instance.commands(plan.space.iter().chain(&plan.after))?;
        // At random, to be put in their places; the seed has no meaning.
        instance.command(&format!("create_atoms 1 random {} 49979687 NULL", self.atoms.len()))?;
        self.write_atoms()?;
        self.finish(plan, false)
    }

    /// Everything before the box.
    pub(super) fn begin(&mut self, plan: &Plan, atoms: Vec<Atom>) -> Outcome<()> {
        if self.instance.is_none() {
            self.instance = Some(Instance::take()?);
        }
        self.walls = plan.walls;
        self.loads = vec![Push::default(); atoms.len()];
        self.last = atoms.iter().map(|atom| atom.position).collect();
        self.names = atoms.iter().map(|atom| atom.id).collect();
        self.atoms = atoms;
        self.time_step = 0.0;
        let instance = self.instance()?;
        if let Some(path) = &plan.log_file {
            let log = worker::open_log(path)?;
            instance.command(&format!("log {} append", path_of(&log)))?;
        }
        instance.commands(&plan.before)
    }

    /// Everything after the atoms are there, to the first evaluation of forces.
    /// LIGGGHTS's restart file holds the groups; a region would put other particles into them now.
    pub(super) fn finish(&self, plan: &Plan, resumes: bool) -> Outcome<()> {
        let instance = self.instance()?;
        instance.commands(&plan.last)?;
        instance.commands(plan.user.iter().filter(|c| !(resumes && c.starts_with("group "))))?;
        // Sets the loads to zero, and finds out whatever is wrong.
        instance.command("run 0")?;
        // What follows would be a line for every step.
        instance.command("log none")?;
        self.indices()?;
        Ok(())
    }

    /// Puts the atoms in their places.
    fn write_atoms(&self) -> Outcome<()> {
        let arrays = self.instance()?.atoms()?;
        if arrays.local as usize != self.atoms.len() {
            return Err(format!("LIGGGHTS made {} particles instead of {}", arrays.local, self.atoms.len()));
        }
        for (k, index) in self.indices()?.into_iter().enumerate() {
            let atom = &self.atoms[index];
            // SAFETY: the arrays have `local` entries, and nothing else uses them now.
            unsafe {
                *arrays.type_.add(k) = atom.material as i32 + 1;
                *arrays.radius.add(k) = atom.radius;
                *arrays.mass.add(k) = atom.mass;
                let volume = 4.0 / 3.0 * std::f64::consts::PI * atom.radius * atom.radius * atom.radius;
                *arrays.density.add(k) = atom.mass / volume;
                *vector(arrays.position, k) = atom.position;
                *vector(arrays.velocity, k) = atom.velocity;
                *vector(arrays.angular_velocity, k) = atom.angular_velocity;
            }
        }
        Ok(())
    }

    /// The index of every atom of LIGGGHTS in its order; an error if one is not there.
    pub(super) fn indices(&self) -> Outcome<Vec<usize>> {
        let arrays = self.instance()?.atoms()?;
        let mut there = vec![false; self.atoms.len()];
        let mut indices = Vec::with_capacity(self.atoms.len());
        for k in 0..arrays.local as usize {
            // SAFETY: the array has `local` entries.
            let index = unsafe { *arrays.id.add(k) } as usize - 1;
            *there.get_mut(index).ok_or("LIGGGHTS has a particle that it was not given")? = true;
            indices.push(index);
        }
        match there.iter().position(|there| !there) {
            None => Ok(indices),
            Some(lost) => {
                let [x, y, z] = self.last[lost];
                let others = there.iter().filter(|there| !**there).count() - 1;
                let more = if others > 0 { format!(" and {others} more") } else { String::new() };
                Err(format!(
                    "LIGGGHTS has lost particle {}, last seen at ({x:.6e}, {y:.6e}, {z:.6e}) m{more}: it has left the box, or \
                     moved too far in one step",
                    self.names[lost]
                ))
            }
        }
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[Push]) -> Outcome<Vec<State>> {
        if loads.len() != self.atoms.len() {
            return Err("as many loads as particles are needed".to_owned());
        }
        if self.time_step.to_bits() != step.to_bits() {
            // LIGGGHTS takes note of another time step in a set-up only.
            self.instance()?.command(&format!("timestep {step:e}"))?;
            self.instance()?.command("run 0")?;
            self.time_step = step;
        }
        self.hand_over(loads)?;
        let instance = self.instance()?;
        let plain = (self.atoms.iter()).all(|atom| atom.inertia_ratio.to_bits() == 1.0_f64.to_bits());
        if plain {
            instance.command(&format!("run {substeps} pre no post no"))?;
        } else {
            for _ in 0..substeps {
                self.scale_torques()?;
                instance.command("run 1 pre no post no")?;
                self.make_up_for_inertia(step)?;
            }
        }
        let states = self.states()?;
        for (index, state) in states.iter().enumerate() {
            let numbers = [state.position, state.velocity, state.angular_velocity];
            if !numbers.iter().flatten().all(|x| x.is_finite()) {
                let [x, y, z] = self.last[index];
                return Err(format!(
                    "the state of particle {}, last seen at ({x:.6e}, {y:.6e}, {z:.6e}) m, is not finite",
                    self.names[index]
                ));
            }
        }
        self.last.clear();
        self.last.extend(states.iter().map(|state| state.position));
        Ok(states)
    }

    /// Gives the loads of the coming step.
    fn hand_over(&mut self, loads: &[Push]) -> Outcome<()> {
        let indices = self.indices()?;
        let instance = self.instance()?;
        let arrays = instance.atoms()?;
        let (forces, torques) = (instance.property(FORCE)?, instance.property(TORQUE)?);
        for (k, &index) in indices.iter().enumerate() {
            let (load, last) = (&loads[index], &self.loads[index]);
            // SAFETY: the arrays have one vector for each of the `local` atoms, and nothing else uses them now.
            let [f, t, drag, twist] =
                unsafe { [arrays.force, arrays.torque, forces, torques].map(|base| vector(base, k)) };
            for i in 0..3 {
                f[i] += load.force[i] - last.force[i];
                t[i] += load.torque[i] - last.torque[i];
            }
            (*drag, *twist) = (load.force, load.torque);
        }
        self.loads.copy_from_slice(loads);
        Ok(())
    }

    /// For the first half kick of a sub-step.
    fn scale_torques(&self) -> Outcome<()> {
        let indices = self.indices()?;
        let arrays = self.instance()?.atoms()?;
        for (k, &index) in indices.iter().enumerate() {
            let ratio = self.atoms[index].inertia_ratio;
            // SAFETY: the array has one vector for each of the `local` atoms.
            unsafe { vector(arrays.torque, k) }.iter_mut().for_each(|t| *t *= ratio);
        }
        Ok(())
    }

    /// What the second half kick of a sub-step of `step` (s) has left out.
    fn make_up_for_inertia(&self, step: f64) -> Outcome<()> {
        let indices = self.indices()?;
        let arrays = self.instance()?.atoms()?;
        for (k, &index) in indices.iter().enumerate() {
            let atom = &self.atoms[index];
            let part =
                (atom.inertia_ratio - 1.0) * 0.5 * step / (SPHERE * atom.mass * atom.radius * atom.radius);
            // SAFETY: the arrays have one vector for each of the `local` atoms.
            let (torque, spin) = unsafe { (vector(arrays.torque, k), vector(arrays.angular_velocity, k)) };
            for i in 0..3 {
                spin[i] += part * torque[i];
            }
        }
        Ok(())
    }

    /// The spheres now, by index.
    pub(super) fn states(&self) -> Outcome<Vec<State>> {
        let indices = self.indices()?;
        let arrays = self.instance()?.atoms()?;
        let mut states = vec![State::default(); self.atoms.len()];
        for (k, &index) in indices.iter().enumerate() {
            // SAFETY: the arrays have one vector for each of the `local` atoms.
            let [x, v, w, f, t] = unsafe {
                [arrays.position, arrays.velocity, arrays.angular_velocity, arrays.force, arrays.torque]
                    .map(|base| *vector(base, k))
            };
            let load = &self.loads[index];
            states[index] = State {
                position: x,
                velocity: v,
                angular_velocity: w,
                contact_force: std::array::from_fn(|i| f[i] - load.force[i]),
                contact_torque: std::array::from_fn(|i| t[i] - load.torque[i]),
            };
        }
        Ok(states)
    }

    /// The forces of the contacts as they acted: LIGGGHTS works them out anew when asked, so the velocities are those of
    /// half a step before in the meantime. (Those of periodic images are that all the time.) What it cannot repeat is that a
    /// contact slid: then its tangential dashpot is in the friction although it did not act.
    fn touches(&self) -> Outcome<Vec<Touch>> {
        let instance = self.instance()?;
        let indices = self.indices()?;
        let arrays = instance.atoms()?;
        let mut full = Vec::with_capacity(indices.len());
        for (k, &index) in indices.iter().enumerate() {
            let atom = &self.atoms[index];
            let push = 0.5 * self.time_step / atom.mass;
            let twist = push * atom.inertia_ratio / (SPHERE * atom.radius * atom.radius);
            // SAFETY: the arrays have one vector for each of the `local` atoms, and nothing else uses them now.
            let [v, w, f, t] = unsafe {
                [arrays.velocity, arrays.angular_velocity, arrays.force, arrays.torque]
                    .map(|base| vector(base, k))
            };
            full.push((*v, *w));
            for i in 0..3 {
                v[i] -= push * f[i];
                w[i] -= twist * t[i];
            }
        }
        let rows = instance.rows(PAIRS);
        let arrays = instance.atoms()?;
        for (k, (v, w)) in full.into_iter().enumerate() {
            // SAFETY: as above; to ask for contacts does not sort the particles.
            unsafe {
                *vector(arrays.velocity, k) = v;
                *vector(arrays.angular_velocity, k) = w;
            }
        }
        let mut touches = Vec::new();
        for row in rows? {
            let part = |at: usize| -> [f64; 3] { [row[at], row[at + 1], row[at + 2]] };
            let (force, friction) = (part(12), part(15));
            let [a, b] = [row[6] as u64 - 1, row[7] as u64 - 1];
            let turned = a > b;
            touches.push(Touch {
                first: a.min(b),
                second: a.max(b),
                is_wall: 0,
                force: if turned { force.map(|f| -f) } else { force },
                friction: if turned { friction.map(|f| -f) } else { friction },
            });
        }
        for wall in 0..self.walls {
            let forces = instance.property(&format!("force_{}", wall_fix(wall)))?;
            for (k, &index) in indices.iter().enumerate() {
                // SAFETY: the fix holds one vector for each of the `local` atoms.
                let force = *unsafe { vector(forces, k) };
                if force.iter().any(|component| *component != 0.0) {
                    touches.push(Touch {
                        first: index as u64,
                        second: wall as u64,
                        is_wall: 1,
                        force,
                        friction: [0.0; 3],
                    });
                }
            }
        }
        touches.sort_by_key(|touch| (touch.first, touch.is_wall, touch.second));
        Ok(touches)
    }
}

/// A path to an open file of this process, for LIGGGHTS: one plain word, whatever the file is called and even if it has no name.
pub(crate) fn path_of(file: &File) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}
