//! Saving a session and going on from it: LIGGGHTS's own restart file, and what it leaves out.

use super::instance::{Outcome, vector};
use super::protocol::{Atom, Plan, Push, State};
use super::session::{Session, path_of};
use std::fs::File;
use std::io::{Read, Write};

impl Session {
    /// LIGGGHTS's own restart file, which has the history of contacts, and what it leaves out: forces, torques, loads.
    ///
    /// To write it LIGGGHTS sorts its particles into the box anew, but not its lists of neighbours, so these are made again: the
    /// run goes on as one that goes on from what was saved.
    pub(super) fn save(&self) -> Outcome<Vec<u8>> {
        let states = self.states()?;
        let instance = self.instance()?;
        let mut file = passing()?;
        instance.command(&format!("write_restart {}", path_of(&file)))?;
        let mut restart = Vec::new();
        (file.read_to_end(&mut restart)).map_err(|e| format!("cannot read back what LIGGGHTS saved: {e}"))?;
        self.set_up_again(&states)?;
        let mut saved = (restart.len() as u64).to_le_bytes().to_vec();
        saved.extend_from_slice(&restart);
        saved.extend_from_slice(bytemuck::bytes_of(&self.time_step));
        saved.extend_from_slice(bytemuck::cast_slice(&self.loads));
        saved.extend_from_slice(bytemuck::cast_slice(&states));
        Ok(saved)
    }

    pub(super) fn resume(&mut self, plan: &Plan, atoms: Vec<Atom>, saved: &[u8]) -> Outcome<()> {
        let count = atoms.len();
        let Saved { restart, step, loads, states } =
            Saved::of(saved, count).ok_or("what LIGGGHTS saved is not whole, or of another case")?;
        self.begin(plan, atoms)?;
        let instance = self.instance()?;
        let mut file = passing()?;
        (file.write_all(restart)).map_err(|e| format!("cannot give back what LIGGGHTS saved: {e}"))?;
        instance.command(&format!("read_restart {}", path_of(&file)))?;
        instance.commands(&plan.after)?;
        self.finish(plan, true)?;
        if step > 0.0 {
            self.instance()?.command(&format!("timestep {step:e}"))?;
        }
        self.time_step = step;
        self.last = states.iter().map(|state| state.position).collect();
        self.loads = loads;
        self.set_up_again(&states)
    }

    /// Makes LIGGGHTS's lists again, at the present positions; then forces and torques are made those of `states`, which the
    /// velocities of half a step before have determined.
    fn set_up_again(&self, states: &[State]) -> Outcome<()> {
        self.instance()?.command("run 0")?;
        let indices = self.indices()?;
        let arrays = self.instance()?.atoms()?;
        for (k, &index) in indices.iter().enumerate() {
            let (state, load) = (&states[index], &self.loads[index]);
            // SAFETY: the arrays have one vector for each of the `local` atoms, and nothing else uses them now.
            unsafe {
                *vector(arrays.force, k) = std::array::from_fn(|i| state.contact_force[i] + load.force[i]);
                *vector(arrays.torque, k) = std::array::from_fn(|i| state.contact_torque[i] + load.torque[i]);
            }
        }
        Ok(())
    }
}

/// What [`Session::save`] has saved.
struct Saved<'a> {
    /// LIGGGHTS's own file.
    restart: &'a [u8],
    /// Time step (s).
    step: f64,
    loads: Vec<Push>,
    states: Vec<State>,
}

impl<'a> Saved<'a> {
    /// The parts of what was saved for `count` spheres.
    fn of(saved: &'a [u8], count: usize) -> Option<Self> {
        let (length, rest) = saved.split_first_chunk::<8>()?;
        let (restart, rest) = rest.split_at_checked(u64::from_le_bytes(*length) as usize)?;
        let (step, rest) = rest.split_first_chunk::<8>()?;
        let (loads, states) = rest.split_at_checked(count * size_of::<Push>())?;
        // All numbers but those of LIGGGHTS's own file, which it checks itself.
        let numbers = bytemuck::pod_collect_to_vec::<u8, f64>(&[&step[..], loads, states].concat());
        let is_sound = numbers[0] >= 0.0 && numbers.iter().all(|x| x.is_finite());
        (is_sound && states.len() == count * size_of::<State>()).then(|| Self {
            restart,
            step: numbers[0],
            loads: bytemuck::pod_collect_to_vec(loads),
            states: bytemuck::pod_collect_to_vec(states),
        })
    }
}

/// A file that LIGGGHTS and turbid hand each other. It has no name, so that nobody else finds it, and ends with its handle.
fn passing() -> Outcome<File> {
    tempfile::tempfile()
        .map_err(|e| format!("cannot make a file in {}: {e}; set TMPDIR", std::env::temp_dir().display()))
}
