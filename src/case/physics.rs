//! Gravity, viscosity, time step and collision of a case.

use super::checks::Document;
use super::file::{
    CollisionKind, Coupling, DrivingSection, FluidSection, Gravity, LatticeSection, TimeStepBy, ViscosityBy,
};
use super::kinds::Kinds;
use super::scales::Reference;
use super::walls::PlacedWall;
use super::{FluidSetup, StartFlow};
use crate::contact::Lubrication;
use crate::contact::lubrication::Unresolved;
use crate::coupling::{Homogenised, Method, Saturated};
use crate::domain::Domain;
use crate::error::Result;
use crate::fluid::Collision;
use crate::math::{TimeFunction, Vec3};
use crate::particle::Template;
use crate::units::Units;

/// Gravity as a vector (m/s^2).
pub(super) fn gravity(document: &Document) -> Vec3 {
    match document.case.driving.gravity {
        Gravity::Downwards(g) => Vec3::new(0.0, 0.0, -g),
        Gravity::Vector(vector) => vector.into(),
    }
}

/// The time step (s) and the fluid.
pub(super) fn fluid(
    document: &Document,
    (section, lattice): (&FluidSection, &LatticeSection),
    kinds: &Kinds,
    domain: &Domain,
    walls: &[PlacedWall],
    gravity: Vec3,
) -> Result<(f64, FluidSetup)> {
    let driving = &document.case.driving;
    let (density, diameter) = (section.density, kinds.diameter);
    let reference = reference(section, kinds, gravity);
    let viscosity = viscosity(document, section, &reference)?;
    let (units, relaxation_time) = time(lattice, domain.dx, viscosity, density);
    let (collision, coupling) = collision(document, lattice)?;
    let (body_acceleration, net_flux) =
        driven(document, driving, domain.periodic(), || flux_is_known_to_vanish(domain, walls, gravity))?;
    let scales = reference.scales(viscosity);
    let start = StartFlow::of(document, domain, walls)?;
    let fluid = FluidSetup {
        density,
        viscosity,
        relaxation_time,
        collision,
        coupling,
        force_balance: driving.force_balance.unwrap_or_default(),
        net_flux,
        control_rate: (scales.stokes_velocity.abs() / diameter).max(viscosity / (diameter * diameter)),
        body_acceleration,
        start,
        scales,
    };
    Ok((units.dt, fluid))
}

fn reference(section: &FluidSection, kinds: &Kinds, gravity: Vec3) -> Reference {
    let density_ratio = kinds.templates[0].density / section.density;
    Reference { diameter: kinds.diameter, density_ratio, gravity: gravity.norm() }
}

/// Units of the lattice with cells of `dx` (m), and the relaxation time (time steps).
fn time(lattice: &LatticeSection, dx: f64, viscosity: f64, density: f64) -> (Units, f64) {
    match lattice.time {
        TimeStepBy::RelaxationTime(tau) => (Units::from_relaxation_time(dx, tau, viscosity, density), tau),
        TimeStepBy::TimeStep(dt) => {
            let units = Units { dx, dt, density };
            (units, units.relaxation_time(viscosity))
        }
    }
}

/// Roughness over the radius of the smallest particle, if the case does not give it (-).
const ROUGHNESS: f64 = 1e-3;

/// Lubrication in gaps of cells of `dx` (m), if the case asks for it.
pub(super) fn lubrication(
    document: &Document,
    (section, lattice): (&FluidSection, &LatticeSection),
    kinds: &Kinds,
    dx: f64,
    gravity: Vec3,
) -> Result<Option<Lubrication>> {
    let contact = &document.case.contact;
    let Some(wanted) = &contact.lubrication else {
        return Ok(None);
    };
    let key = "contact.lubrication";
    if !contact.enabled {
        let marks = [(key, "acts between particles that may touch"), ("contact.enabled", "off")];
        let title = "`contact.lubrication` needs contacts, which are off";
        return Err(document.error_at(&marks, title, "remove one of them"));
    }
    let is_smooth =
        |Template { shape, .. }: &Template| shape.as_sphere().is_some() || shape.as_ellipsoid().is_some();
    let near_smooth = kinds.templates.iter().any(is_smooth);
    let is_known =
        |template: &Template| is_smooth(template) || near_smooth && template.shape.as_polyhedron().is_some();
    if let Some(index) = kinds.templates.iter().position(|template| !is_known(template)) {
        let shape = format!("particles.{}.shape", kinds.of_each(|section, _| section)[index]);
        let marks = [(&*shape, "neither a sphere nor an ellipsoid"), (key, "lubrication")];
        let kind = kinds.templates[index].shape.kind();
        let title = format!(
            "`{key}` knows the films of spheres and ellipsoids only, also at flat faces, but `{shape}` is a {kind}"
        );
        let remedy = "remove `contact.lubrication`: a film between flat faces, at an edge, or a place without curvature \
                      has another law; or add spheres or ellipsoids to polyhedra, which have films with these alone";
        return Err(document.error_at(&marks, &title, remedy));
    }
    let viscosity = viscosity(document, section, &reference(section, kinds, gravity))?;
    let (_, relaxation_time) = time(lattice, dx, viscosity, section.density);
    let smallest = (kinds.templates.iter())
        .map(|template| template.shape.equivalent_diameter())
        .fold(f64::INFINITY, f64::min);
    let roughness = wanted.roughness.unwrap_or(ROUGHNESS * 0.5 * smallest);
    if roughness >= dx {
        let title = format!("`{key}.roughness` is {roughness} m, and a cell has {dx:.6e} m");
        let remedy = "give a roughness of less than a cell, or remove `contact.lubrication`: a gap of a cell is resolved";
        return Err(document.error(&format!("{key}.roughness"), &title, "not narrower than a cell", remedy));
    }
    let unresolved = match collision(document, lattice)?.1 {
        Method::Saturated(_) => Unresolved::saturated(),
        Method::Homogenised(_) => Unresolved::homogenised(relaxation_time),
    };
    Ok(Some(Lubrication { viscosity: viscosity * section.density, roughness, cell: dx, unresolved }))
}

/// True if nothing but the controller keeps the fluid from falling or rising, no wall drags it along, and it does not pass through faces.
fn flux_is_known_to_vanish(domain: &Domain, walls: &[PlacedWall], gravity: Vec3) -> bool {
    let closed = (0..3).any(|i| !domain.is_periodic(i) && gravity[i] != 0.0);
    let open = domain.faces.iter().any(|face| face.is_open());
    !closed && !open && walls.iter().all(|placed| placed.wall.motion.rests())
}

/// Body acceleration (m/s^2), and the net flux (m/s) in the directions in which it is controlled: periodic ones along which no body
/// acceleration drives a flow, if the case asks for it, or by default at zero if the flux is known to `vanish`.
fn driven(
    document: &Document,
    driving: &DrivingSection,
    periodic: [bool; 3],
    vanishes: impl Fn() -> bool,
) -> Result<(TimeFunction, [Option<f64>; 3])> {
    let (key, zero, target) = ("driving.body_acceleration", "driving.zero_net_flux", "driving.net_flux");
    let (function, axes) = (driving.body_acceleration.function(), ["x", "y", "z"]);
    let drives = |i: usize| periodic[i] && function.largest()[i] != 0.0;
    let driven = (0..3).find(|&i| drives(i));
    if let (Some(true), Some(axis)) = (driving.zero_net_flux, driven) {
        let axis = axes[axis];
        return Err(document.error_at(
            &[(zero, "removes the flow"), (key, &format!("drives a flow along {axis}"))],
            &format!("`{zero}` = true removes the flow that `{key}` drives along {axis}"),
            "leave `zero_net_flux` out: the net flux is then controlled only where nothing drives it; or remove \
             `body_acceleration`",
        ));
    }
    if let Some(flux) = driving.net_flux {
        if driving.zero_net_flux.is_some() {
            let marks = [(target, "the flux that is kept"), (zero, "keeps none, or lets it go")];
            let title = format!("`{target}` and `{zero}` both say what the net flux is");
            return Err(document.error_at(&marks, &title, "remove one of them"));
        }
        if let Some(axis) = (0..3).find(|&i| flux[i] != 0.0 && !periodic[i]) {
            let title =
                format!("`{target}` is {} m/s along {}, which is not periodic", flux[axis], axes[axis]);
            let remedy = "take 0 there, or open the direction by `domain.periodic`";
            return Err(document.error(&format!("{target}.{axis}"), &title, "no way through", remedy));
        }
        if let Some(axis) = (0..3).find(|&i| flux[i] != 0.0 && drives(i)) {
            let axis = axes[axis];
            let marks =
                [(target, "the flux that is kept"), (key, &*format!("drives a flow along {axis} too"))];
            let title = format!("`{target}` and `{key}` both drive the flow along {axis}");
            return Err(document.error_at(&marks, &title, "give one of them along a direction"));
        }
    }
    let wanted = driving.net_flux.is_some() || driving.zero_net_flux.unwrap_or_else(vanishes);
    let flux = driving.net_flux.unwrap_or_default();
    let controlled = std::array::from_fn(|i| (wanted && periodic[i] && !drives(i)).then_some(flux[i]));
    Ok((function, controlled))
}

/// Kinematic viscosity (m^2/s), from whichever number the case gives.
fn viscosity(document: &Document, fluid: &FluidSection, reference: &Reference) -> Result<f64> {
    let buoyancy = reference.buoyancy();
    let (name, viscosity) = match fluid.viscosity {
        ViscosityBy::Viscosity(viscosity) => return Ok(viscosity),
        ViscosityBy::Galileo(galileo) => ("fluid.galileo", buoyancy.sqrt() / galileo),
        ViscosityBy::Archimedes(archimedes) => ("fluid.archimedes", (buoyancy / archimedes).sqrt()),
    };
    if buoyancy <= 0.0 {
        return Err(document.error(
            name,
            &format!("`{name}` cannot give the viscosity of this case"),
            "it is zero for any viscosity: gravity is zero or the densities are equal",
            "give `viscosity` (m^2/s) instead",
        ));
    }
    Ok(viscosity)
}

/// The collision operator of the fluid, and the coupling to particles.
fn collision(document: &Document, lattice: &LatticeSection) -> Result<(Collision, Method)> {
    let refused = |key: &str, of: &str, wanted: &str, has: &str| {
        let title = format!("`lattice.{key}` belongs to the {of} \"{wanted}\", but this case has \"{has}\"");
        let remedy = format!("add `{of} = \"{wanted}\"`, or remove it");
        Err(document.error(&format!("lattice.{key}"), &title, "has no effect here", &remedy))
    };
    let coupling = match lattice.coupling {
        Coupling::Homogenised => {
            if lattice.solid_operator.is_some() {
                return refused("solid_operator", "coupling", "saturated", "homogenised");
            }
            let ramp = lattice.solid_ramp_width.unwrap_or(0.5);
            Method::Homogenised(Homogenised { ramp })
        }
        Coupling::Saturated => {
            if lattice.solid_ramp_width.is_some() {
                return refused("solid_ramp_width", "coupling", "homogenised", "saturated");
            }
            Method::Saturated(Saturated::new(lattice.solid_operator.unwrap_or_default()))
        }
    };
    let usual = coupling.usual_collision();
    // Half-way walls exactly half-way, where bodies have no magic parameter of their own.
    let usual_magic = if let Collision::Trt { magic } = usual { magic } else { 0.1875 };
    let magic = lattice.magic_parameter.unwrap_or(usual_magic);
    let collision = match lattice.collision {
        None if matches!(usual, Collision::Trt { .. }) => Collision::Trt { magic },
        None => usual,
        Some(CollisionKind::Bgk) => Collision::Bgk,
        Some(CollisionKind::Trt) => Collision::Trt { magic },
        Some(CollisionKind::RecursiveRegularised) => {
            Collision::RecursiveRegularised { magic, smagorinsky: lattice.smagorinsky.unwrap_or(0.0) }
        }
    };
    if lattice.magic_parameter.is_some() && !matches!(collision, Collision::Trt { .. }) {
        return refused("magic_parameter", "collision", "trt", collision.name());
    }
    let regularised = matches!(collision, Collision::RecursiveRegularised { .. });
    if lattice.smagorinsky.is_some() && !regularised {
        return refused("smagorinsky", "collision", "recursive_regularised", collision.name());
    }
    if regularised && matches!(coupling, Method::Homogenised(_)) {
        let title = "`lattice.collision` \"recursive_regularised\" has cells with solids only with the coupling \"saturated\"";
        let remedy = "remove `lattice.coupling`, or take \"trt\" or \"bgk\"";
        return Err(document.error("lattice.collision", title, "not with \"homogenised\"", remedy));
    }
    Ok((collision, coupling))
}
