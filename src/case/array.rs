//! Flow through bodies that are held, as far as their drag bounds it, and the resistance that the controller of the net flux reckons with.
//!
//! An acceleration `a` of the fluid drives it through bodies of volume fraction `phi` and diameter `D`, until their drag balances it at the
//! mean velocity `U` over fluid and bodies, `Re = U D / nu`:
//!
//! ```text
//! 18 phi nu U F / D^2 = (1 - phi) a
//! F = 10 phi / (1 - phi)^2 + (1 - phi)^2 (1 + 1.5 sqrt(phi))
//!     + 0.413 Re / (24 (1 - phi)^2) (1 / (1 - phi) + 3 phi (1 - phi) + 8.4 Re^-0.343) / (1 + 10^(3 phi) Re^(-1/2 - 2 phi))
//! largest velocity = (2 + 6 phi) U / (1 - phi)
//! ```
//!
//! Arrays of `validation/random_array` and cubic ones have largest velocities of 0.4 to 1.0 of that. It is a bound only where bodies are
//! everywhere: `phi` is the least of parts of the box about two distances of bodies wide, and there is no bound if that is 0, as above a
//! rough bed.
//!
//! References: van der Hoef, Beetstra, Kuipers (2005), doi:10.1017/S0022112004003295; Beetstra, van der Hoef, Kuipers (2007),
//! doi:10.1002/aic.11065.

use super::Setup;
use super::filled::Filled;
use crate::particle::Particle;
use crate::wall::Surface;
use serde::{Deserialize, Serialize};

/// Edge of the parts of the box over the mean distance of bodies.
const PART: f64 = 2.0;

/// Bodies at rest all over the box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FixedArray {
    /// Least volume fraction (-).
    fraction: f64,
    /// Sauter mean of the diameters of spheres of the same volume (m).
    pub(super) diameter: f64,
}

impl FixedArray {
    /// That of a case, by its particles; none if some part of the box has no body at rest. Takes up to seconds.
    pub(super) fn of(setup: &Setup) -> Option<Self> {
        let rests = |p: &&Particle| setup.motions[p.template as usize].rests();
        let bodies = setup.particles.iter().filter(rests);
        let count = bodies.clone().count();
        if count == 0 {
            return None;
        }
        let walls: Vec<Surface> = setup.walls.iter().map(|wall| wall.surface.clone()).collect();
        let filled = Filled::by(&setup.domain, &walls, &setup.templates, bodies.clone());
        let apart = libm::cbrt(setup.domain.volume() / count as f64);
        let size = setup.domain.size();
        let parts = std::array::from_fn(|axis| ((size[axis] / (PART * apart)) as usize).max(1));
        let fraction = filled.least_fraction(parts);
        let diameters = bodies.map(|p| setup.templates[p.template as usize].shape.equivalent_diameter());
        let (cubes, squares) =
            diameters.fold((0.0, 0.0), |(cubes, squares), d| (cubes + d * d * d, squares + d * d));
        (fraction > 0.0 && fraction < 1.0).then_some(Self { fraction, diameter: cubes / squares })
    }

    /// Bound of the velocity (m/s) of a fluid of kinematic viscosity `viscosity` (m^2/s) under an acceleration (m/s^2).
    pub(super) fn largest_speed(&self, acceleration: f64, viscosity: f64) -> f64 {
        let Self { fraction: phi, diameter } = *self;
        let unit = 18.0 * phi * viscosity / (diameter * diameter);
        let driven = (1.0 - phi) * acceleration;
        // With the drag of creeping flow it is fastest; the drag rises with the velocity.
        let (mut low, mut high) = (0.0, driven / (unit * drag(phi, 0.0)));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if unit * middle * drag(phi, middle * diameter / viscosity) < driven {
                low = middle;
            } else {
                high = middle;
            }
        }
        (2.0 + 6.0 * phi) * high / (1.0 - phi)
    }
}

/// Bodies that are held along an axis, wherever they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct HeldBodies {
    /// Volume fraction (-).
    pub(super) fraction: f64,
    /// Sauter mean of the diameters of spheres of the same volume (m).
    diameter: f64,
    /// Bound of their speed along the axis (m/s).
    speed: f64,
}

impl HeldBodies {
    /// Those of a case; none if all are free along the axis.
    pub(super) fn of(setup: &Setup, axis: usize) -> Option<Self> {
        let held = |p: &&Particle| !setup.motions[p.template as usize].free[axis];
        let (mut cubes, mut squares, mut volume, mut speed) = (0.0, 0.0, 0.0, 0.0_f64);
        for body in setup.particles.iter().filter(held) {
            let shape = &setup.templates[body.template as usize].shape;
            let d = shape.equivalent_diameter();
            (cubes, squares, volume) = (cubes + d * d * d, squares + d * d, volume + shape.volume());
            speed = speed.max(setup.motions[body.template as usize].velocity.largest()[axis]);
        }
        // Bodies that overlap fill less; a bed has fluid in it.
        let fraction = (volume / setup.domain.volume()).min(0.75);
        (volume > 0.0).then_some(Self { fraction, diameter: cubes / squares, speed })
    }

    /// Rate (1/s) at which their drag would stop a fluid of kinematic viscosity `viscosity` (m^2/s) with a net flux (m/s).
    pub(super) fn resistance(&self, viscosity: f64, flux: f64) -> f64 {
        let Self { fraction, diameter, speed } = *self;
        let reynolds = flux.abs().max(speed) * diameter / viscosity;
        18.0 * fraction * viscosity / (diameter * diameter) * drag(fraction, reynolds)
    }
}

/// `F`: drag of a sphere of an array over `3 pi mu D U`.
fn drag(phi: f64, reynolds: f64) -> f64 {
    let open = 1.0 - phi;
    let creeping = 10.0 * phi / (open * open) + open * open * (1.0 + 1.5 * phi.sqrt());
    if reynolds <= 0.0 {
        return creeping;
    }
    let above = 1.0 / open + 3.0 * phi * open + 8.4 * libm::pow(reynolds, -0.343);
    let below = 1.0 + libm::pow(10.0, 3.0 * phi) * libm::pow(reynolds, -0.5 - 2.0 * phi);
    creeping + 0.413 * reynolds / (24.0 * open * open) * above / below
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;

    fn of(option: &str) -> Option<FixedArray> {
        let text = "domain.size.diameters = [6, 6, 12]\n\
                    fluid = { density = 1000, viscosity = 1e-5 }\n\
                    lattice = { cells_per_diameter = 4, relaxation_time = 0.8 }\n\
                    run.end.steps = 10\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1e-3\n\
                    density = 2500.0\n\
                    motion = \"fixed\"\n\
                    volume_fraction = 0.2\n";
        FixedArray::of(&from_text(text, "array", &[option.to_string()]).unwrap_or_else(|e| panic!("{e}")))
    }

    #[test]
    fn the_drag_is_that_of_the_published_simulations() {
        // Creeping flow: table of validation/random_array. Re 100 at 0.2: figure 5 of Beetstra et al. (2007), 13.6.
        assert!((drag(0.1, 0.0) - 2.429).abs() < 1e-3 && (drag(0.3, 0.0) - 7.015).abs() < 1e-3);
        assert!((drag(0.2, 1e-9) - drag(0.2, 0.0)).abs() < 1e-6);
        assert!(drag(0.2, 100.0) > 2.0 * drag(0.2, 0.0));
    }

    #[test]
    fn bodies_at_rest_bound_the_flow_only_where_they_are_everywhere() {
        let all = of("particles.0.seed=2").unwrap();
        assert!(all.fraction > 0.1 && all.fraction < 0.21, "{all:?}");
        assert!((all.diameter - 1e-3).abs() < 1e-12);
        assert_eq!(of("particles.0.motion=free"), None);
        let bed: Vec<String> = (0..16)
            .map(|n| {
                format!("[{}e-3, {}e-3, 1e-3]", 0.75 + 1.5 * f64::from(n % 4), 0.75 + 1.5 * f64::from(n / 4))
            })
            .collect();
        let listed = format!(
            "particles=[{{ shape.sphere.diameter = 1e-3, density = 2500, motion = \"fixed\", list = [{}] }}]",
            bed.join(", ")
        );
        assert_eq!(of(&listed), None, "the fluid flows above a bed");
    }

    #[test]
    fn the_flow_through_an_array_is_bounded_by_its_drag_and_inertia_slows_it() {
        let array = FixedArray { fraction: 0.1, diameter: 1e-3 };
        let creeping = array.largest_speed(1e-3, 1e-5);
        let expected = 2.6 * 1e-3 * 1e-6 / (18.0 * 0.1 * 1e-5 * drag(0.1, 0.0));
        assert!((creeping / expected - 1.0).abs() < 1e-3, "{creeping} is not {expected}");
        assert!(array.largest_speed(10.0, 1e-5) < 0.7e4 * creeping);
    }
}
