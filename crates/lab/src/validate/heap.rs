//! Columns of grains behind a gate, and the heaps that they leave: for `column_collapse` and `repose`.

use super::prelude::*;
use std::f64::consts::PI;
use std::fmt::Write;

/// Solid volume fraction of grains at rest, by which the height of a column follows from their number (-).
const FRACTION: f64 = 0.6;
/// Steps between two looks at a run.
const EVERY: u64 = 500;

/// A column at rest against the wall x = 0. Lengths are in diameters of the sphere of equal volume.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Diameter (m).
    pub(super) diameter: f64,
    pub(super) grains: u32,
    /// Height over length when it is at rest (-).
    pub(super) aspect: f64,
    /// Length of the box.
    pub(super) box_length: f64,
    /// Distance between grains at the start.
    pub(super) spacing: f64,
    /// True for grains that start in orientations of all kinds.
    pub(super) turned: bool,
    /// Number of the start: another one has other positions and orientations.
    pub(super) start: u32,
}

/// Width of the periodic box (diameters).
const WIDTH: f64 = 5.3;

impl Column {
    /// Length of the column.
    pub(super) fn length(&self) -> f64 {
        (f64::from(self.grains) * PI / 6.0 / (FRACTION * WIDTH * self.aspect)).sqrt()
    }

    /// Changes to a case that make the box and the grains, which start a little apart, each up to a fortieth of a diameter from a point
    /// of a grid; and those with the gate.
    pub(super) fn with_gate(&self) -> Vec<String> {
        let mut changes = self.released();
        changes.push(format!("walls.0.plane.point=[{:e}, 0.0, 0.0]", self.length() * self.diameter));
        changes
    }

    pub(super) fn released(&self) -> Vec<String> {
        let d = self.diameter;
        let along = (self.length() / self.spacing).floor().max(1.0);
        let across = (WIDTH / self.spacing).floor();
        let pitch = [self.length() / along, WIDTH / across, self.spacing];
        let mut list = String::new();
        for n in 0..self.grains {
            let layer = along as u32 * across as u32;
            let at = [n % layer / across as u32, n % across as u32, n / layer];
            let mut grain = [0.0; 3];
            for (axis, x) in grain.iter_mut().enumerate() {
                let jitter = 0.05 * (self.spread(n, axis) - 0.5);
                *x = d * ((f64::from(at[axis]) + 0.5) * pitch[axis] + jitter);
            }
            let [x, y, z] = grain;
            let position = format!("[{x:.9e}, {y:.9e}, {z:.9e}]");
            let _ = if self.turned {
                let [a, b, c, angle] = [3, 4, 5, 6].map(|at| self.spread(n, at) - 0.5);
                write!(
                    list,
                    "{{ position = {position}, orientation = {{ axis = [{a:.6}, {b:.6}, {c:.6}], angle = {:.6} }} }},",
                    360.0 * angle
                )
            } else {
                write!(list, "{position},")
            };
        }
        let layers = self.grains.div_ceil(along as u32 * across as u32);
        let top = (f64::from(layers) + 1.0) * self.spacing;
        vec![
            format!("domain.size=[{:e}, {:e}, {:e}]", self.box_length * d, WIDTH * d, top * d),
            format!("particles.0.list=[{list}]"),
        ]
    }

    /// The heap at the end of the case.
    pub(super) fn heap(&self, context: &SuiteContext, setup: &Setup) -> Result<Heap> {
        let end = setup.plan.end_step;
        let watch = Watch { context, setup, threads: 1, every: EVERY };
        let rows = watch.rows(|run, rows: &mut Vec<[f64; 4]>| {
            if run.steps_done()? >= end {
                let own = |body: &Particle| {
                    let x = body.position() / self.diameter;
                    [x.x, x.y, x.z, body.velocity().norm()]
                };
                rows.extend(run.particles()?.iter().map(own));
            }
            Ok(false)
        })?;
        Ok(Heap { grains: rows, length: self.length() })
    }

    /// Number from 0 to 1 of a grain, evenly spread over the grains.
    fn spread(&self, grain: u32, axis: usize) -> f64 {
        // Fractional parts of square roots of primes.
        const STEP: [f64; 7] = [
            0.414_213_562,
            0.732_050_808,
            0.236_067_977,
            0.645_751_311,
            0.316_624_790,
            0.605_551_275,
            0.123_105_626,
        ];
        let number = grain + self.start * self.grains;
        ((f64::from(number) + 1.0) * STEP[axis]).fract()
    }
}

/// Grains that have come to rest; lengths in diameters.
#[derive(Debug)]
pub(super) struct Heap {
    /// Centre and speed (m/s) of each.
    grains: Vec<[f64; 4]>,
    /// Length of the column.
    length: f64,
}

impl Heap {
    /// Number of grains with their centre in each slice of this thickness, and the height of the highest.
    fn slices(&self, thickness: f64) -> Vec<(f64, f64)> {
        let mut slices: Vec<(f64, f64)> = Vec::new();
        for grain in &self.grains {
            let at = (grain[0] / thickness).max(0.0) as usize;
            if slices.len() <= at {
                slices.resize(at + 1, (0.0, 0.0));
            }
            let slice = &mut slices[at];
            *slice = (slice.0 + 1.0, slice.1.max(grain[2] + 0.5));
        }
        slices
    }

    /// Surface: middle of each slice of one diameter, and the top of its highest grain.
    pub(super) fn surface(&self) -> Vec<[f64; 2]> {
        let slices = self.slices(1.0);
        slices.iter().enumerate().map(|(n, slice)| [n as f64 + 0.5, slice.1]).collect()
    }

    /// Length of the heap: as far as it is one diameter thick, the volume of the grains in slices of two diameters over the solid
    /// volume fraction. Single grains go further.
    fn front(&self) -> f64 {
        let thickness = 2.0;
        let unit = PI / 6.0 / (FRACTION * thickness * WIDTH);
        let height: Vec<f64> =
            self.slices(thickness).iter().map(|slice| slice.0 * unit).chain([0.0]).collect();
        let end = height.iter().position(|&height| height < 1.0).unwrap_or(0).max(1);
        let (before, after) = (height[end - 1], height[end]);
        thickness * (end as f64 - 0.5 + (before - 1.0) / (before - after))
    }

    /// Largest speed (m/s).
    pub(super) fn fastest(&self) -> f64 {
        self.grains.iter().map(|grain| grain[3]).fold(0.0, f64::max)
    }

    /// Run-out over the length of the column.
    pub(super) fn run_out(&self) -> f64 {
        self.front() / self.length - 1.0
    }

    /// Height over the length of the column, at the wall: mean of three slices.
    pub(super) fn height(&self) -> f64 {
        let surface = self.surface();
        surface.iter().take(3).map(|point| point[1]).sum::<f64>() / 3.0 / self.length
    }

    /// Slope of the surface (degrees): line of least squares through its points between 0.2 and 0.8 of the largest height.
    pub(super) fn slope(&self) -> f64 {
        let surface = self.surface();
        let top = surface.iter().map(|point| point[1]).fold(0.0, f64::max);
        let points: Vec<[f64; 2]> =
            surface.into_iter().filter(|point| (0.2 * top..0.8 * top).contains(&point[1])).collect();
        let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
        let [x, z] = [mean(0), mean(1)];
        let both: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - z)).sum();
        let square: f64 = points.iter().map(|point| (point[0] - x).powi(2)).sum();
        (-both / square).atan().to_degrees()
    }
}
