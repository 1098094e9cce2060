//! Gravity, viscosity, time step and collision of a case.

use super::FluidSetup;
use super::checks::{Alternative, at};
use super::file::{Case, CollisionKind, Coupling, DrivingSection, FluidSection, LatticeSection};
use super::forms::Gravity;
use super::kinds::Kinds;
use super::located::Located;
use super::scales::Reference;
use super::source::Source;
use super::walls::PlacedWall;
use crate::coupling::{Homogenised, Method, Saturated};
use crate::domain::Domain;
use crate::error::Result;
use crate::fluid::Collision;
use crate::math::Vec3;
use crate::units::Units;
use crate::wall::Motion;

/// Gravity as a vector (m/s^2).
pub(super) fn gravity(source: &Source, case: &Case) -> Result<Vec3> {
    let gravity = &case.driving.gravity;
    let vector = match gravity.value {
        Gravity::Downwards(g) => {
            let remedy = "a number is the magnitude and points along -z; give [x, y, z] for other directions";
            let wanted = "a finite number of at least 0";
            source.satisfies("driving.gravity", &at(&gravity.span, g), |g| g >= 0.0, wanted, remedy)?;
            [0.0, 0.0, -g]
        }
        Gravity::Vector(vector) => source.finite("driving.gravity", &gravity.span, vector)?,
    };
    Ok(vector.into())
}

/// The time step (s) and the fluid.
pub(super) fn fluid(
    source: &Source,
    case: &Case,
    (section, lattice): (&Located<FluidSection>, &Located<LatticeSection>),
    kinds: &Kinds,
    domain: &Domain,
    walls: &[PlacedWall],
    gravity: Vec3,
) -> Result<(f64, FluidSetup)> {
    let (density, diameter) = (section.value.density.value, kinds.diameter);
    let reference =
        Reference { diameter, density_ratio: kinds.templates[0].density / density, gravity: gravity.norm() };
    let viscosity = viscosity(source, section, &reference)?;
    let (units, relaxation_time) = time_step(source, lattice, domain.dx, viscosity, density)?;
    let collision = collision(source, &lattice.value)?;
    let coupling = method(source, &lattice.value)?;
    let (body_acceleration, zero_net_flux) =
        driven(source, &case.driving, domain.periodic, || flux_is_known_to_vanish(domain, walls, gravity))?;
    let force_balance = case.driving.force_balance.as_ref();
    let scales = reference.scales(viscosity);
    let fluid = FluidSetup {
        density,
        viscosity,
        relaxation_time,
        collision,
        coupling,
        force_balance: force_balance.map_or_else(Default::default, |b| b.value),
        zero_net_flux,
        control_rate: (scales.stokes_velocity.abs() / diameter).max(viscosity / (diameter * diameter)),
        body_acceleration,
        scales,
    };
    Ok((units.dt, fluid))
}

/// Whether nothing but the controller keeps the fluid from falling or rising, and nothing drags it along.
fn flux_is_known_to_vanish(domain: &Domain, walls: &[PlacedWall], gravity: Vec3) -> bool {
    let closed = (0..3).any(|i| !domain.periodic[i] && gravity[i] != 0.0);
    let still = Vec3::zeros();
    let moves = |motion: &Motion| motion.velocity != still || motion.angular_velocity != still;
    let moving = walls.iter().any(|placed| moves(&placed.wall.motion));
    !closed && !moving
}

/// Body acceleration (m/s^2), and the directions in which the net flux is controlled: periodic ones along which no body
/// acceleration drives a flow, if the case asks for it, or by default if the flux is known to `vanish`.
fn driven(
    source: &Source,
    driving: &DrivingSection,
    periodic: [bool; 3],
    vanishes: impl Fn() -> bool,
) -> Result<(Vec3, [bool; 3])> {
    let acceleration = &driving.body_acceleration;
    let (key, span) = ("driving.body_acceleration", &acceleration.span);
    let vector = source.finite(key, span, acceleration.value)?;
    let drives = |i: usize| periodic[i] && vector[i] != 0.0;
    let wanted = match &driving.zero_net_flux {
        Some(Located { value: true, span: flux }) if (0..3).any(drives) => {
            let axis = ["x", "y", "z"][(0..3).find(|&i| drives(i)).unwrap_or_default()];
            return Err(source.error_at(
                &[
                    (flux, "removes the flow"),
                    (span, &format!("drives a flow along {axis}")),
                ],
                &format!(
                    "`driving.zero_net_flux` = true takes away the flow that `{key}` drives along {axis}"
                ),
                "leave `zero_net_flux` out: the net flux is then controlled only where nothing drives it; or remove \
                 `body_acceleration`",
            ));
        }
        Some(given) => given.value,
        None => vanishes(),
    };
    let controlled = std::array::from_fn(|i| wanted && periodic[i] && !drives(i));
    Ok((vector.into(), controlled))
}

/// Kinematic viscosity (m^2/s), from whichever number the case gives.
fn viscosity(source: &Source, section: &Located<FluidSection>, reference: &Reference) -> Result<f64> {
    let fluid = &section.value;
    let (viscosity, archimedes, galileo) = (&fluid.viscosity, &fluid.archimedes, &fluid.galileo);
    let choices: [(_, &dyn Alternative); 3] =
        [("viscosity", viscosity), ("archimedes", archimedes), ("galileo", galileo)];
    let name = source.exactly_one("fluid", &section.span, &choices)?;
    let value = (viscosity.as_ref()).or(archimedes.as_ref()).or(galileo.as_ref());
    let value = value.expect("checked by exactly_one");
    let number = value.value;
    if name == "viscosity" {
        return Ok(number);
    }
    if reference.buoyancy() <= 0.0 {
        return Err(source.error(
            &value.span,
            &format!("`fluid.{name}` cannot give the viscosity of this case"),
            "it is zero for any viscosity: gravity is zero or the densities are equal",
            "give `viscosity` (m^2/s) instead",
        ));
    }
    Ok(if name == "galileo" {
        reference.buoyancy().sqrt() / number
    } else {
        (reference.buoyancy() / number).sqrt()
    })
}

/// The units of the lattice, and the relaxation time (time steps).
fn time_step(
    source: &Source,
    section: &Located<LatticeSection>,
    dx: f64,
    viscosity: f64,
    density: f64,
) -> Result<(Units, f64)> {
    let lattice = &section.value;
    let choices: [(_, &dyn Alternative); 2] =
        [("relaxation_time", &lattice.relaxation_time), ("time_step", &lattice.time_step)];
    source.exactly_one("lattice", &section.span, &choices)?;
    if let Some(tau) = &lattice.relaxation_time {
        let units = Units::from_relaxation_time(dx, tau.value, viscosity, density);
        return Ok((units, tau.value));
    }
    let dt = lattice.time_step.as_ref().expect("checked by exactly_one");
    let units = Units { dx, dt: dt.value, density };
    Ok((units, units.relaxation_time(viscosity)))
}

/// Solid fraction and collision of cells that particles cover.
fn method(source: &Source, lattice: &LatticeSection) -> Result<Method> {
    match (lattice.coupling, &lattice.solid_operator, &lattice.solid_ramp_width) {
        (Coupling::Paper, Some(operator), _) => Err(source.error(
            &operator.span,
            "`lattice.solid_operator` belongs to the coupling \"saturated\", but this case has \"paper\"",
            "has no effect here",
            "add `coupling = \"saturated\"`, or remove it",
        )),
        (Coupling::Saturated, _, Some(width)) => Err(source.error(
            &width.span,
            "`lattice.solid_ramp_width` belongs to the coupling \"paper\", but this case has \"saturated\"",
            "has no effect here",
            "add `coupling = \"paper\"`, or remove it",
        )),
        (Coupling::Paper, None, width) => {
            Ok(Method::Homogenised(Homogenised { ramp: width.as_ref().map_or(0.5, |width| width.value) }))
        }
        (Coupling::Saturated, operator, None) => {
            let operator = operator.as_ref().map_or_else(Default::default, |o| o.value);
            Ok(Method::Saturated(Saturated::new(operator)))
        }
    }
}

/// Magic parameter with which the drag of partially saturated cells depends least on the relaxation time and the resolution
/// (validation/drag).
const SATURATED_MAGIC: f64 = 0.125;

/// The collision operator.
fn collision(source: &Source, lattice: &LatticeSection) -> Result<Collision> {
    let key = "lattice.magic_parameter";
    let (usual, usual_magic) = match lattice.coupling {
        Coupling::Paper => (CollisionKind::Bgk, 0.1875),
        Coupling::Saturated => (CollisionKind::Trt, SATURATED_MAGIC),
    };
    match (lattice.collision.unwrap_or(usual), &lattice.magic_parameter) {
        (CollisionKind::Bgk, None) => Ok(Collision::Bgk),
        (CollisionKind::Bgk, Some(magic)) => Err(source.error(
            &magic.span,
            &format!("`{key}` belongs to the collision \"trt\", but this case has \"bgk\""),
            "has no effect here",
            "add `collision = \"trt\"`, or remove it",
        )),
        (CollisionKind::Trt, magic) => {
            let magic = magic.as_ref().map_or(usual_magic, |magic| magic.value);
            Ok(Collision::Trt { magic })
        }
    }
}
