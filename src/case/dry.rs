//! Particles without a fluid: their time step, and the cells that only the decomposition of the box needs.

use super::checks::Alternative;
use super::file::{Case, DrySection, LatticeSection};
use super::hertz::Hertz;
use super::located::Located;
use super::materials::Materials;
use super::source::Source;
use crate::error::Result;
use crate::particle::Template;

/// Steps of the shortest contact in a derived time step.
const STEPS_PER_CONTACT: f64 = 50.0;
/// Widest cell in diameters of the smallest particle.
const WIDEST_CELL: f64 = 0.25;
/// Times that cells may be smaller, so that the box is a whole number of them.
const FINER: usize = 4;

/// Whether a case has a fluid or is dry, and that it is not both.
pub(super) enum Medium<'a> {
    /// Fluid and lattice.
    Wet(&'a Located<super::file::FluidSection>, &'a Located<LatticeSection>),
    /// Particles alone.
    Dry(&'a Located<DrySection>),
}

impl<'a> Medium<'a> {
    /// Finds out; what belongs to the fluid has no place in a dry run.
    pub(super) fn of(source: &Source, case: &'a Case) -> Result<Self> {
        let Some(dry) = &case.dry else {
            let missing = |name: &str| {
                let title = format!("the section [{name}] is missing");
                let remedy = "a case has [fluid] and [lattice], or [dry] for particles without a fluid";
                Err(source.error(&(0..0), &title, "", remedy))
            };
            return match (&case.fluid, &case.lattice) {
                (Some(fluid), Some(lattice)) => Ok(Self::Wet(fluid, lattice)),
                (None, _) => missing("fluid"),
                (_, None) => missing("lattice"),
            };
        };
        let driving = &case.driving;
        let acceleration = &driving.body_acceleration.span;
        for (name, span) in [
            ("[fluid]", case.fluid.as_ref().map(|s| &s.span)),
            ("[lattice]", case.lattice.as_ref().map(|s| &s.span)),
            ("`driving.force_balance`", driving.force_balance.as_ref().map(|s| &s.span)),
            ("`driving.zero_net_flux`", driving.zero_net_flux.as_ref().map(|s| &s.span)),
            ("`driving.body_acceleration`", Some(acceleration).filter(|s| !s.is_empty())),
        ] {
            if let Some(span) = span {
                let places = [(span, "belongs to a fluid"), (&dry.span, "no fluid here")];
                let title = format!("{name} has no meaning in a dry run");
                return Err(source.error_at(&places, &title, "remove one of them"));
            }
        }
        let grown = &case.contact.enlargement.span;
        if !grown.is_empty() {
            let title = "`contact.enlargement` is in cells of the fluid, of which a dry run has none";
            let remedy = "give `dry.enlargement` in metres";
            return Err(source.error(grown, title, "in cells", remedy));
        }
        Ok(Self::Dry(dry))
    }
}

/// The time step (s).
pub(super) fn time_step(
    source: &Source,
    section: &Located<DrySection>,
    substeps: u32,
    templates: &[Template],
    materials: &Materials,
) -> Result<f64> {
    let dry = &section.value;
    let choices: [(_, &dyn Alternative); 2] =
        [("time_step", &dry.time_step), ("impact_speed", &dry.impact_speed)];
    source.exactly_one("dry", &section.span, &choices)?;
    if let Some(step) = &dry.time_step {
        return Ok(step.value);
    }
    let speed = dry.impact_speed.as_ref().expect("checked by exactly_one");
    let shortest = templates
        .iter()
        .map(|template| Hertz::new(template, materials.stiffest()).duration(speed.value))
        .fold(f64::INFINITY, f64::min);
    Ok(f64::from(substeps) * shortest / STEPS_PER_CONTACT)
}

/// Edge of the cells (m): at most a quarter of the smallest particle, and a whole part of every edge of the box if one
/// is found.
pub(super) fn cell(edges: [f64; 3], templates: &[Template]) -> f64 {
    let smallest =
        templates.iter().map(|template| template.shape.equivalent_diameter()).fold(f64::INFINITY, f64::min);
    let widest = WIDEST_CELL * smallest;
    let shortest = edges.iter().copied().fold(f64::INFINITY, f64::min);
    let least = (shortest / widest).ceil().clamp(1.0, 1e9) as usize;
    let fits = |count: &usize| {
        let dx = shortest / *count as f64;
        edges.iter().all(|edge| {
            let cells = edge / dx;
            (cells - cells.round()).abs() <= 1e-9 * cells
        })
    };
    // A search that takes no time even for a huge box.
    let count = (least..=(FINER * least).min(least + 100_000)).find(fits).unwrap_or(least);
    shortest / count as f64
}
