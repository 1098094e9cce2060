//! Saving a session and resuming it: LIGGGHTS's own restart file, and what it leaves out.

use super::deck::HELD;
use super::instance::{Instance, Outcome};
use super::session::Session;
use bytemuck::{bytes_of, cast_slice, pod_collect_to_vec};
use std::io::{Read, Write};
use turbid_process::{LoadedState, exchange_file, id_of, path_of};

/// Parts of the results of [`Session::save`] of all processes.
pub(super) struct Saved<'a> {
    /// LIGGGHTS's own file.
    restart: &'a [u8],
    time_step: f64,
    /// Ascending by id, loads with the weight.
    states: Vec<LoadedState>,
}

impl Session {
    /// LIGGGHTS's own restart file, which has the history of contacts, from the first process; and what it leaves out: forces, torques, loads
    /// of the spheres of this process.
    ///
    /// To write it LIGGGHTS sorts its particles into the box again, but does not make its lists of neighbours again, so these
    /// are made here: the run continues as one that is resumed from what was saved.
    pub(super) fn save(&mut self) -> Outcome<Vec<u8>> {
        let states = self.states()?;
        let mut file = exchange_file()?;
        self.hold_forces()?;
        self.instance.command(&format!("write_restart {}", path_of(&file)))?;
        let mut restart = Vec::new();
        file.read_to_end(&mut restart).map_err(|e| format!("cannot read back what LIGGGHTS saved: {e}"))?;
        self.set_up_again()?;
        let lengths = [restart.len() as u64, states.len() as u64].map(u64::to_le_bytes).concat();
        Ok([&lengths, bytes_of(&self.time_step), &restart, cast_slice(&states)].concat())
    }

    /// Has fixes hold forces and torques: spheres may come to other processes, which does not take those along.
    fn hold_forces(&mut self) -> Outcome<()> {
        let arrays = self.instance.arrays()?;
        let now = [arrays.force.to_vec(), arrays.torque.to_vec()];
        for (name, values) in HELD.iter().zip(now) {
            self.instance.property(name, values.len())?.copy_from_slice(&values);
        }
        Ok(())
    }

    /// Makes LIGGGHTS's lists again, at the present positions, with the forces and torques that are held: the velocities of half a step before
    /// have determined them.
    fn set_up_again(&mut self) -> Outcome<()> {
        self.instance.command("run 0")?;
        let n = self.instance.arrays()?.id.len();
        let [forces, torques] = HELD.map(|name| self.instance.property(name, n).map(|held| held.to_vec()));
        let (forces, torques) = (forces?, torques?);
        let arrays = self.instance.arrays()?;
        arrays.force.copy_from_slice(&forces);
        arrays.torque.copy_from_slice(&torques);
        Ok(())
    }

    /// The rest of a session that has read LIGGGHTS's own file.
    pub(super) fn restore(&mut self, saved: &Saved) -> Outcome<()> {
        if saved.time_step > 0.0 {
            self.instance.command(&format!("timestep {:e}", saved.time_step))?;
        }
        self.time_step = saved.time_step;
        self.set_forces(&saved.states)?;
        self.hold_forces()?;
        self.set_up_again()
    }

    /// Makes forces, torques and loads those of `states`.
    fn set_forces(&mut self, states: &[LoadedState]) -> Outcome<()> {
        let ids: Vec<u64> = self.instance.arrays()?.id.iter().map(|&tag| id_of(tag)).collect();
        let of = |id: &u64| {
            let at = states.binary_search_by_key(id, |loaded| loaded.state.id);
            at.map(|at| states[at]).map_err(|_| format!("LIGGGHTS has particle {id}, which was not saved"))
        };
        let own: Vec<LoadedState> = ids.iter().map(of).collect::<Outcome<_>>()?;
        let arrays = self.instance.arrays()?;
        for (k, LoadedState { state, force, torque }) in own.iter().enumerate() {
            arrays.force[k] = std::array::from_fn(|i| state.contact_force[i] + force[i]);
            arrays.torque[k] = std::array::from_fn(|i| state.contact_torque[i] + torque[i]);
        }
        let held = self.instance.property("dragforce", own.len())?;
        held.iter_mut().zip(&own).for_each(|(held, loaded)| *held = loaded.force);
        let held = self.instance.property("hdtorque", own.len())?;
        held.iter_mut().zip(&own).for_each(|(held, loaded)| *held = loaded.torque);
        Ok(())
    }
}

impl<'a> Saved<'a> {
    /// Those that the processes have saved, one after the other.
    pub(super) fn of(mut saved: &'a [u8]) -> Option<Self> {
        let mut all = Self { restart: &[], time_step: 0.0, states: Vec::new() };
        while !saved.is_empty() {
            let (head, rest) = saved.split_at_checked(24)?;
            let numbers: Vec<u64> = pod_collect_to_vec(head);
            let time_step = f64::from_bits(numbers[2]);
            let (restart, rest) = rest.split_at_checked(usize::try_from(numbers[0]).ok()?)?;
            let length = usize::try_from(numbers[1]).ok()?.checked_mul(size_of::<LoadedState>())?;
            let (states, rest) = rest.split_at_checked(length)?;
            // All numbers but those of LIGGGHTS's own file, which it checks itself.
            let values: Vec<f64> = pod_collect_to_vec(states);
            if !(time_step >= 0.0 && time_step.is_finite() && values.iter().all(|x| x.is_finite())) {
                return None;
            }
            if !restart.is_empty() {
                all.restart = restart;
            }
            all.time_step = time_step;
            all.states.extend(pod_collect_to_vec::<u8, LoadedState>(states));
            saved = rest;
        }
        all.states.sort_unstable_by_key(|loaded| loaded.state.id);
        Some(all)
    }

    /// Reads LIGGGHTS's own file, which the first of all processes opens.
    pub(super) fn read_restart(&self, instance: &Instance, is_first: bool) -> Outcome<()> {
        let mut file = exchange_file()?;
        let bytes = if is_first { self.restart } else { &[] };
        file.write_all(bytes).map_err(|e| format!("cannot give back what LIGGGHTS saved: {e}"))?;
        instance.command(&format!("read_restart {}", path_of(&file)))
    }
}
