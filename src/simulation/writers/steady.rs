//! Looks whether a run is steady, where the case ends it then.
//!
//! ```text
//! means over the last window, and over that before it:
//!   net flux U and mean velocity <v> of the particles, whose changes are taken over the largest speed
//!     max(|U|, |<v>|, <|v|>, sqrt(2 E_f / (rho V)))
//!   kinetic energies of fluid and of particles, over the larger of them
//! steady: no change is larger than that of the case
//! ```
//!
//! It follows from the rows of `series.csv` alone, so it is the same on any ranks; a checkpoint has the rows of the two windows.

use super::vtk::parsed;
use super::{Need, RootOutput, Writer, WriterState};
use crate::case::{Setup, Steady};
use crate::error::Result;
use crate::math::Vec3;
use crate::output::{SeriesRow, Summary};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

const NAME: &str = "steady";

/// Numbers of a row: net flux, mean velocity of particles, mean speed of particles, kinetic energies of fluid and of particles.
type Numbers = [f64; 9];

/// Follows the rows of a run that ends when it is steady.
pub(super) struct Steadiness<'a> {
    setup: &'a Setup,
    steady: Steady,
    /// Of the two windows, by their steps.
    rows: VecDeque<(u64, Numbers)>,
    is_steady: bool,
}

#[derive(Serialize, Deserialize)]
struct State {
    rows: VecDeque<(u64, Numbers)>,
    is_steady: bool,
}

impl<'a> Steadiness<'a> {
    /// That of a case, if it ends by it.
    pub(super) fn of(setup: &'a Setup) -> Option<Self> {
        let steady = setup.plan.steady?;
        Some(Self { setup, steady, rows: VecDeque::new(), is_steady: false })
    }

    /// Mass of the fluid (kg) with a speed: that of the box, which is as good a measure.
    fn mass(&self) -> f64 {
        self.setup.fluid_density() * self.setup.domain.volume()
    }
}

/// Largest change between the means of two windows, as the head of this file says.
fn change([early, late]: [Numbers; 2], mass: f64) -> f64 {
    let vector = |of: &Numbers, first: usize| Vec3::new(of[first], of[first + 1], of[first + 2]);
    let speed = |of: &Numbers| {
        let rms = if mass > 0.0 { (2.0 * of[7] / mass).sqrt() } else { 0.0 };
        vector(of, 0).norm().max(vector(of, 3).norm()).max(of[6]).max(rms)
    };
    let over = |change: f64, scale: f64| if change == 0.0 { 0.0 } else { change / scale };
    let speeds = speed(&early).max(speed(&late));
    let energy = early[7].max(early[8]).max(late[7]).max(late[8]);
    let velocities = [0, 3].map(|first| over((vector(&late, first) - vector(&early, first)).norm(), speeds));
    let energies = [7, 8].map(|n| over((late[n] - early[n]).abs(), energy));
    velocities.into_iter().chain(energies).fold(0.0, f64::max)
}

impl Writer for Steadiness<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn every(&self) -> u64 {
        self.setup.plan.output.series_every
    }

    fn due(&self, step: u64, _: bool) -> bool {
        step.is_multiple_of(self.every())
    }

    fn needs(&self) -> Vec<Need> {
        vec![Need::Row]
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let Some(SeriesRow { step, net_flux: u, mean_particle_velocity: v, .. }) = output.row else {
            return Ok(());
        };
        let row = output.row.expect("a row");
        let particles = row.kinetic_energy_translation + row.kinetic_energy_rotation;
        let speed = row.mean_particle_speed;
        let numbers = [u[0], u[1], u[2], v[0], v[1], v[2], speed, row.kinetic_energy_fluid, particles];
        self.rows.push_back((*step, numbers));
        // Each window has the rows after its first step, up to its last.
        let window = self.steady.window;
        while self.rows.front().is_some_and(|(first, _)| first + 2 * window <= *step) {
            self.rows.pop_front();
        }
        if *step >= 2 * window {
            let later = self.rows.partition_point(|(at, _)| at + window <= *step);
            let mean = |rows: &mut dyn Iterator<Item = &(u64, Numbers)>| {
                let (mut sum, mut count) = ([0.0; 9], 0.0);
                for (_, numbers) in rows {
                    sum.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
                    count += 1.0;
                }
                sum.map(|sum| sum / count)
            };
            let means = [mean(&mut self.rows.iter().take(later)), mean(&mut self.rows.iter().skip(later))];
            self.is_steady = change(means, self.mass()) <= self.steady.change;
        }
        Ok(())
    }

    fn ends(&self) -> bool {
        self.is_steady
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(serde_json::json!(State { rows: self.rows.clone(), is_steady: self.is_steady }))
    }

    fn fits(&self, state: &WriterState) -> Result<()> {
        parsed::<State>(NAME, state).map(|_| ())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let State { rows, is_steady } = parsed(NAME, state)?;
        (self.rows, self.is_steady) = (rows, is_steady);
        Ok(())
    }

    fn finish(&mut self, summary: &mut Summary) -> Result<()> {
        summary.steady = self.is_steady;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::change;

    /// Flux and energy of a fluid of mass 2.
    fn fluid(flux: f64, energy: f64) -> [f64; 9] {
        [flux, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, energy, 0.0]
    }

    #[test]
    fn a_change_is_that_over_what_is_large_and_rest_is_steady() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        close(change([fluid(0.0, 0.0), fluid(0.0, 0.0)], 2.0), 0.0);
        close(change([fluid(1.0, 1.0), fluid(1.1, 1.0)], 2.0), 0.1 / 1.1);
        // A flux that is kept at zero, beside a flow of an rms speed of 1.
        close(change([fluid(1e-9, 1.0), fluid(-1e-9, 1.0)], 2.0), 2e-9);
        close(change([fluid(0.0, 0.8), fluid(0.0, 1.0)], 2.0), 0.2);
        // Of particles that have next to no energy beside the fluid.
        let with = |energy: f64| {
            let mut numbers = fluid(0.0, 1.0);
            numbers[8] = energy;
            numbers
        };
        close(change([with(1e-9), with(2e-9)], 2.0), 1e-9);
    }
}
