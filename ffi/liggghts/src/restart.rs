//! Saving a session and resuming it: LIGGGHTS's own restart file, and what it leaves out.

use super::instance::{Instance, Outcome};
use super::session::{Session, path_of};
use bytemuck::{bytes_of, cast_slice, pod_collect_to_vec};
use std::fs::File;
use std::io::{Read, Write};
use turbid_process::{AppliedLoad, State};

/// Parts of the result of [`Session::save`].
pub(super) struct Saved<'a> {
    /// LIGGGHTS's own file.
    restart: &'a [u8],
    time_step: f64,
    loads: Vec<AppliedLoad>,
    states: Vec<State>,
}

impl Session {
    /// LIGGGHTS's own restart file, which has the history of contacts, and what it leaves out: forces, torques, loads.
    ///
    /// To write it LIGGGHTS sorts its particles into the box again, but does not make its lists of neighbours again, so these
    /// are made here: the run continues as one that is resumed from what was saved.
    pub(super) fn save(&mut self) -> Outcome<Vec<u8>> {
        let states = self.states()?;
        let mut file = exchange_file()?;
        self.instance.command(&format!("write_restart {}", path_of(&file)))?;
        let mut restart = Vec::new();
        file.read_to_end(&mut restart).map_err(|e| format!("cannot read back what LIGGGHTS saved: {e}"))?;
        self.set_up_again(&states)?;
        let length = (restart.len() as u64).to_le_bytes();
        let (loads, states) = (cast_slice(&self.loads), cast_slice(&states));
        Ok([&length, &restart[..], bytes_of(&self.time_step), loads, states].concat())
    }

    /// The rest of a session that has read LIGGGHTS's own file.
    pub(super) fn restore(&mut self, saved: Saved) -> Outcome<()> {
        if saved.time_step > 0.0 {
            self.instance.command(&format!("timestep {:e}", saved.time_step))?;
        }
        self.time_step = saved.time_step;
        self.loads = saved.loads;
        for (atom, state) in self.atoms.iter_mut().zip(&saved.states) {
            atom.position = state.position;
        }
        self.set_up_again(&saved.states)
    }

    /// Makes LIGGGHTS's lists again, at the present positions; then forces and torques are made those of `states`, which the
    /// velocities of half a step before have determined.
    fn set_up_again(&mut self, states: &[State]) -> Outcome<()> {
        self.instance.command("run 0")?;
        let indices = self.indices()?;
        let arrays = self.instance.arrays()?;
        for (k, &index) in indices.iter().enumerate() {
            let (state, load) = (&states[index], &self.loads[index]);
            arrays.force[k] = std::array::from_fn(|i| state.contact_force[i] + load.force[i]);
            arrays.torque[k] = std::array::from_fn(|i| state.contact_torque[i] + load.torque[i]);
        }
        Ok(())
    }
}

impl<'a> Saved<'a> {
    /// The parts of what was saved for `count` spheres.
    pub(super) fn of(saved: &'a [u8], count: usize) -> Option<Self> {
        let (length, rest) = saved.split_first_chunk::<8>()?;
        let (restart, rest) = rest.split_at_checked(u64::from_le_bytes(*length) as usize)?;
        // All numbers but those of LIGGGHTS's own file, which it checks itself.
        let numbers: Vec<f64> = pod_collect_to_vec(rest);
        let (loads, states) = rest.get(8..)?.split_at_checked(count * size_of::<AppliedLoad>())?;
        let is_sound = numbers[0] >= 0.0 && numbers.iter().all(|x| x.is_finite());
        (is_sound && states.len() == count * size_of::<State>()).then(|| Self {
            restart,
            time_step: numbers[0],
            loads: pod_collect_to_vec(loads),
            states: pod_collect_to_vec(states),
        })
    }

    pub(super) fn read_restart(&self, instance: &Instance) -> Outcome<()> {
        let mut file = exchange_file()?;
        file.write_all(self.restart).map_err(|e| format!("cannot give back what LIGGGHTS saved: {e}"))?;
        instance.command(&format!("read_restart {}", path_of(&file)))
    }
}

/// A file that LIGGGHTS and turbid exchange. It has no name, so that nobody else finds it, and ends with its handle.
fn exchange_file() -> Outcome<File> {
    tempfile::tempfile()
        .map_err(|e| format!("cannot make a file in {}: {e}; set TMPDIR", std::env::temp_dir().display()))
}
