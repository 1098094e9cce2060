//! The box: its cells, and whether the particles fit in.

use super::dry;
use super::file::{Case, LatticeSection};
use super::forms::Size;
use super::kinds::Kinds;
use super::source::Source;
use crate::domain::Domain;
use crate::error::Result;
use crate::particle::Particle;

/// More cells than any machine of today holds.
const MAX_CELLS: f64 = 1e12;
/// Fewest cells across a body that the fluid sees it by.
const THINNEST_CELLS: f64 = 4.0;

/// The box in cells; what had to be rounded goes to `warnings`. Without a lattice the cells are those of a dry run.
pub(super) fn domain(
    source: &Source,
    case: &Case,
    lattice: Option<&LatticeSection>,
    kinds: &Kinds,
    warnings: &mut Vec<String>,
) -> Result<Domain> {
    let diameter = kinds.diameter;
    let size = &case.domain.size;
    // The unit of the edges in metres and in diameters.
    let (edges, unit, relative) = match &size.value {
        Size::Metres(edges) => (edges, 1.0, diameter),
        Size::Relative(relative) => (&relative.diameters, diameter, 1.0),
    };
    let mut lengths = [0.0; 3];
    for i in 0..3 {
        let remedy = "three edges in metres, or { diameters = [6, 6, 6] }";
        lengths[i] = unit * source.positive("domain.size", &edges[i], remedy)?;
    }
    let per_diameter = match lattice {
        Some(lattice) => lattice.cells_per_diameter.value,
        None => diameter / dry::cell(lengths, &kinds.templates),
    };
    let dx = diameter / per_diameter;
    let mut cells = [0; 3];
    let mut total = 1.0;
    let mut rounded = false;
    for i in 0..3 {
        // Without the detour by metres a box in diameters is free of rounding.
        let exact = edges[i].value / relative * per_diameter;
        total *= exact.max(1.0);
        if total > MAX_CELLS {
            let title = format!("the box has more than {MAX_CELLS:e} cells");
            let remedy = if lattice.is_some() {
                "take a smaller `domain.size` or fewer `lattice.cells_per_diameter`"
            } else {
                "take a smaller `domain.size` or larger particles"
            };
            return Err(source.error(&edges[i].span, &title, "too large", remedy));
        }
        cells[i] = exact.round().max(1.0) as usize;
        rounded |= (exact - cells[i] as f64).abs() > 1e-9 * exact;
    }
    let domain = Domain { periodic: case.domain.periodic.value, cells, dx };
    if rounded {
        let used = domain.size();
        let (x, y, z) = (used.x, used.y, used.z);
        warnings.push(source.warning(
            &size.span,
            &format!("the box is not a whole number of cells; it is {x:.6e} x {y:.6e} x {z:.6e} m here"),
            &format!("rounded to {} x {} x {} cells of {dx:.6e} m", cells[0], cells[1], cells[2]),
            "",
        ));
    }
    refuse_what_is_too_large(source, case, kinds, &domain)?;
    if lattice.is_some() {
        warn_of_what_is_too_thin(source, case, kinds, dx, warnings);
    }
    Ok(domain)
}

/// A body may meet no image of itself, and must fit between walls.
fn refuse_what_is_too_large(source: &Source, case: &Case, kinds: &Kinds, domain: &Domain) -> Result<()> {
    let size = &case.domain.size.span;
    let used = domain.size();
    for (kind, section) in kinds.sections.iter().zip(&case.particles) {
        let span = &section.value.shape.span;
        let places = [(span, "too large for"), (size, "this box")];
        for template in &kinds.templates[kind.templates()] {
            let (width, thickness) = (2.0 * template.shape.circumradius(), template.shape.thickness());
            for i in 0..3 {
                let axis = ["x", "y", "z"][i];
                if domain.periodic[i] && width > 0.5 * used[i] * (1.0 + 1e-9) {
                    let title = format!(
                        "a particle of {width} m is larger than half the box, {:.6e} m in {axis}",
                        0.5 * used[i]
                    );
                    let remedy = format!("the smallest edge must be at least {:.6e} m", 2.0 * width);
                    return Err(source.error_at(&places, &title, &remedy));
                }
                if !domain.periodic[i] && thickness > used[i] * (1.0 + 1e-9) {
                    let title = format!(
                        "a particle {thickness:.6e} m thick does not fit between walls {:.6e} m apart in {axis}",
                        used[i]
                    );
                    return Err(source.error_at(&places, &title, "take a larger box or a smaller particle"));
                }
            }
        }
    }
    Ok(())
}

fn warn_of_what_is_too_thin(
    source: &Source,
    case: &Case,
    kinds: &Kinds,
    dx: f64,
    warnings: &mut Vec<String>,
) {
    for (index, (kind, section)) in kinds.sections.iter().zip(&case.particles).enumerate() {
        let thinnest = kinds.templates[kind.templates()]
            .iter()
            .map(|template| template.shape.thickness() / dx)
            .fold(f64::INFINITY, f64::min);
        if thinnest < THINNEST_CELLS {
            let cells = kinds.diameter / dx * THINNEST_CELLS / thinnest;
            warnings.push(source.warning(
                &section.value.shape.span,
                &format!(
                    "`particles.{index}.shape` is {thinnest:.2} cells thick, below {THINNEST_CELLS}: the fluid resolves it \
                     poorly"
                ),
                "thin",
                &format!("take lattice.cells_per_diameter = {cells:.1} or more"),
            ));
        }
    }
}

/// Refuses a box in which a pair could touch through two images: the nearest one is all the engine looks at.
///
/// `reaches` (m) are those of the templates, grown for contacts.
pub(super) fn refuse_double_contacts(
    source: &Source,
    case: &Case,
    domain: &Domain,
    reaches: &[f64],
    particles: &[Particle],
) -> Result<()> {
    let mut reaches: Vec<f64> = particles.iter().map(|p| reaches[p.template as usize]).collect();
    reaches.sort_unstable_by(f64::total_cmp);
    let [.., second, largest] = reaches[..] else {
        return Ok(());
    };
    let needed = 2.0 * (largest + second);
    let size = domain.size();
    let Some(i) = (0..3).find(|&i| domain.periodic[i] && size[i] < needed) else {
        return Ok(());
    };
    let (edge, axis) = (size[i], ["x", "y", "z"][i]);
    Err(source.error(
        &case.domain.size.span,
        &format!(
            "the box is {edge:.6e} m wide in {axis}, where two particles could touch through two periodic images at once"
        ),
        "too narrow",
        &format!(
            "make it at least {needed:.6e} m wide: the largest reach {largest:.6e} m and {second:.6e} m from their centres, \
             contact enlargement included"
        ),
    ))
}
