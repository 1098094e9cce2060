//! Particles without a fluid: their time step, and the cells that only the decomposition of the box needs.

use super::checks::Document;
use super::file::{DrySection, DryStep, FluidSection, LatticeSection};
use super::speeds::{STEPS_PER_CONTACT, spheres};
use crate::contact::ContactModel;
use crate::error::Result;
use crate::particle::Template;

/// Widest cell in diameters of the smallest particle.
const WIDEST_CELL: f64 = 0.25;
/// Factor by which cells may be smaller, so that the box is a whole number of them.
const FINER: usize = 4;

/// The sections that say what surrounds the particles.
pub(super) enum Medium<'a> {
    /// Fluid and lattice.
    Fluid(&'a FluidSection, &'a LatticeSection),
    /// Nothing.
    Dry(&'a DrySection),
}

impl<'a> Medium<'a> {
    /// Refuses a case that has both, or neither, and keys of the fluid in a dry run.
    pub(super) fn of(document: &'a Document) -> Result<Self> {
        let case = &document.case;
        let missing = |name: &str| {
            let remedy = "a case has [fluid] and [lattice], or [dry] for particles without a fluid";
            Err(document.error(name, &format!("the section [{name}] is missing"), "", remedy))
        };
        let dry = match (&case.dry, &case.fluid, &case.lattice) {
            (Some(dry), ..) => dry,
            (None, Some(fluid), Some(lattice)) => return Ok(Self::Fluid(fluid, lattice)),
            (None, None, _) => return missing("fluid"),
            (None, _, None) => return missing("lattice"),
        };
        for key in [
            "fluid",
            "lattice",
            "driving.force_balance",
            "driving.zero_net_flux",
            "driving.body_acceleration",
            "contact.lubrication",
        ] {
            if document.has(key) {
                let name = if key.contains('.') { format!("`{key}`") } else { format!("[{key}]") };
                let title = format!("{name} has no meaning in a dry run");
                let marks = [(key, "belongs to a fluid"), ("dry", "no fluid here")];
                return Err(document.error_at(&marks, &title, "remove one of them"));
            }
        }
        let grown = "contact.enlargement";
        if document.has(grown) {
            let title = "`contact.enlargement` is in cells of the fluid, of which a dry run has none";
            let remedy = "give `dry.enlargement` in metres";
            return Err(document.error(grown, title, "in cells", remedy));
        }
        Ok(Self::Dry(dry))
    }
}

/// The time step (s).
pub(super) fn time_step(
    dry: &DrySection,
    substeps: u32,
    templates: &[Template],
    model: &ContactModel,
) -> f64 {
    match dry.step {
        DryStep::Time(step) => step,
        DryStep::ImpactSpeed(speed) => {
            let durations = templates.iter().flat_map(|template| {
                (0..model.materials.len())
                    .map(move |material| spheres(model, material, template).duration(speed))
            });
            f64::from(substeps) * durations.fold(f64::INFINITY, f64::min) / STEPS_PER_CONTACT
        }
    }
}

/// Edge of the cells (m): at most a quarter of the smallest particle, and a whole part of every edge of the box if one
/// is found.
pub(super) fn cell(edges: [f64; 3], templates: &[Template]) -> f64 {
    let diameters = templates.iter().map(|template| template.shape.equivalent_diameter());
    let widest = WIDEST_CELL * diameters.fold(f64::INFINITY, f64::min);
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
