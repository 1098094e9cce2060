//! Gravity, viscosity, time step and contacts of a case.

use super::checks::at;
use super::file::{Case, GeometryKind};
use super::forms::Gravity;
use super::scales::Reference;
use super::source::Source;
use crate::contact::{ContactModel, ContactParams, ElasticLaw, Geometry, Material, PairParams};
use crate::error::Result;
use crate::math::Vec3;
use crate::units::Units;

/// Gravity as a vector (m/s^2).
pub(super) fn gravity(source: &Source, case: &Case) -> Result<Vec3> {
    let gravity = &case.driving.gravity;
    let vector = match gravity.value {
        Gravity::Downwards(g) => {
            let remedy = "a number is the magnitude and points along -z; give [x, y, z] for other directions";
            source.non_negative("driving.gravity", &at(&gravity.span, g), remedy)?;
            [0.0, 0.0, -g]
        }
        Gravity::Vector(vector) => source.finite("driving.gravity", &gravity.span, vector)?,
    };
    Ok(vector.into())
}

/// Kinematic viscosity (m^2/s), from whichever number the case gives.
pub(super) fn viscosity(source: &Source, case: &Case, reference: &Reference) -> Result<f64> {
    let fluid = &case.fluid.value;
    let choices = [
        ("viscosity", &fluid.viscosity),
        ("archimedes", &fluid.archimedes),
        ("galileo", &fluid.galileo),
    ];
    let spans = choices.map(|(name, value)| (name, value.as_ref().map(|v| v.span.clone())));
    let (name, value) = choices[source.exactly_one("fluid", &case.fluid.span, &spans)?];
    let value = value.as_ref().expect("checked by exactly_one");
    let remedy = match name {
        "viscosity" => "kinematic, in m^2/s; water has 1e-6",
        _ => "e.g. archimedes = 1000",
    };
    let number = source.positive(&format!("fluid.{name}"), value, remedy)?;
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
pub(super) fn time_step(
    source: &Source,
    case: &Case,
    dx: f64,
    viscosity: f64,
    density: f64,
) -> Result<(Units, f64)> {
    let lattice = &case.lattice.value;
    let choices = [
        (
            "relaxation_time",
            lattice.relaxation_time.as_ref().map(|v| v.span.clone()),
        ),
        ("time_step", lattice.time_step.as_ref().map(|v| v.span.clone())),
    ];
    source.exactly_one("lattice", &case.lattice.span, &choices)?;
    if let Some(tau) = &lattice.relaxation_time {
        let remedy = "0.5 stands for no viscosity at all; 0.51 to 1 is usual, 0.55 a good start";
        let wanted = "a finite number above 0.5";
        let tau = source.satisfies("lattice.relaxation_time", tau, |x| x > 0.5, wanted, remedy)?;
        return Ok((Units::from_relaxation_time(dx, tau, viscosity, density), tau));
    }
    let dt = lattice.time_step.as_ref().expect("checked by exactly_one");
    let usual = Units::from_relaxation_time(dx, 0.55, viscosity, density).dt;
    let remedy = format!("in seconds; {usual:.3e} s would be a relaxation time of 0.55");
    let dt = source.positive("lattice.time_step", dt, &remedy)?;
    let units = Units { dx, dt, density };
    Ok((units, units.relaxation_time(viscosity)))
}

/// The contact model in SI units, if contacts are on.
pub(super) fn contact(source: &Source, case: &Case, dx: f64) -> Result<Option<ContactModel>> {
    let contact = &case.contact;
    let range = "above 0 and at most 1";
    let within = |x: f64| x > 0.0 && x <= 1.0;
    let poisson = "above -1 and at most 0.5";
    let samples = &contact.samples;
    if !(2..=1000).contains(&samples.value) {
        let value = samples.value.to_string();
        return Err(source.out_of_range(
            "contact.samples",
            &samples.span,
            &value,
            "from 2 to 1000",
            "8 is usual",
        ));
    }
    // Checked even where contacts are off: a wrong number is wrong.
    let material = Material {
        youngs_modulus: source.positive("contact.youngs_modulus", &contact.youngs_modulus, "in Pa")?,
        poisson_ratio: source.satisfies(
            "contact.poisson_ratio",
            &contact.poisson_ratio,
            |x| x > -1.0 && x <= 0.5,
            poisson,
            "0.2 to 0.3 is usual",
        )?,
    };
    let pair = PairParams {
        restitution: source.satisfies(
            "contact.restitution",
            &contact.restitution,
            within,
            range,
            "1 is elastic; 0.926 is usual for glass",
        )?,
        friction_static: source.non_negative(
            "contact.friction_static",
            &contact.friction_static,
            "0 is smooth",
        )?,
        friction_kinetic: source.non_negative(
            "contact.friction_kinetic",
            &contact.friction_kinetic,
            "0 is smooth",
        )?,
        transition_velocity: source.positive(
            "contact.transition_velocity",
            &contact.transition_velocity,
            "in m/s",
        )?,
    };
    let params = ContactParams {
        material,
        pair,
        law: ElasticLaw::Paper,
        enlargement: dx * source.non_negative("contact.enlargement", &contact.enlargement, "in cells")?,
        geometry: match contact.geometry {
            GeometryKind::Exact => Geometry::Exact,
            GeometryKind::Sampled => Geometry::Sampled {
                samples: samples.value,
            },
        },
    };
    Ok(contact.enabled.then(|| params.into()))
}
