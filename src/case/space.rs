//! The box: its cells, and whether the particles fit in.

use super::checks::Document;
use super::dry;
use super::file::{LatticeSection, Size};
use super::kinds::Kinds;
use crate::domain::Domain;
use crate::error::Result;
use crate::particle::Particle;

/// More cells than any machine of today holds.
const MAX_CELLS: f64 = 1e12;
/// Fewest cells across a body with which the fluid resolves it.
const THINNEST_CELLS: f64 = 4.0;

/// The box in cells; what had to be rounded goes to `warnings`. Without a lattice the cells are those of a dry run.
pub(super) fn domain(
    document: &Document,
    lattice: Option<&LatticeSection>,
    kinds: &Kinds,
    warnings: &mut Vec<String>,
) -> Result<Domain> {
    let (diameter, key) = (kinds.diameter, "domain.size");
    // The unit of the edges in metres and in diameters.
    let (edges, unit, relative) = match &document.case.domain.size {
        Size::Metres(edges) => (*edges, 1.0, diameter),
        Size::Relative(relative) => (relative.diameters, diameter, 1.0),
    };
    let per_diameter = match lattice {
        Some(lattice) => lattice.cells_per_diameter,
        None => diameter / dry::cell(edges.map(|edge| unit * edge), &kinds.templates),
    };
    let dx = diameter / per_diameter;
    // Without the detour by metres a box in diameters is free of rounding.
    let exact = edges.map(|edge| edge / relative * per_diameter);
    if exact.iter().map(|cells| cells.max(1.0)).product::<f64>() > MAX_CELLS {
        let title = format!("the box has more than {MAX_CELLS:e} cells");
        let remedy = match lattice {
            Some(_) => "take a smaller `domain.size` or fewer `lattice.cells_per_diameter`",
            None => "take a smaller `domain.size` or larger particles",
        };
        return Err(document.error(key, &title, "too large", remedy));
    }
    let cells = exact.map(|cells| cells.round().max(1.0) as usize);
    let domain = Domain { periodic: document.case.domain.periodic, cells, dx };
    if (0..3).any(|i| (exact[i] - cells[i] as f64).abs() > 1e-9 * exact[i]) {
        let used = domain.size();
        let (x, y, z) = (used.x, used.y, used.z);
        warnings.push(document.warning(
            key,
            &format!("the box is not a whole number of cells; it is {x:.6e} x {y:.6e} x {z:.6e} m here"),
            &format!("rounded to {} x {} x {} cells of {dx:.6e} m", cells[0], cells[1], cells[2]),
            "volume fractions are those of the rounded box; a `domain.size` in multiples of the cell is exact",
        ));
    }
    refuse_what_is_too_large(document, kinds, &domain)?;
    if lattice.is_some() {
        warn_of_what_is_too_thin(document, kinds, dx, warnings);
    }
    Ok(domain)
}

/// A body may meet no image of itself, and must fit between walls.
fn refuse_what_is_too_large(document: &Document, kinds: &Kinds, domain: &Domain) -> Result<()> {
    let used = domain.size();
    for (index, kind) in kinds.sections.iter().enumerate() {
        let shape = format!("particles.{index}.shape");
        let unit = document.case.particles[index]
            .shape
            .doubtful_unit()
            .map_or(String::new(), |doubt| format!("; {doubt}"));
        let places = [(&*shape, "too large for"), ("domain.size", "this box")];
        for template in &kinds.templates[kind.templates()] {
            let (width, thickness) = (2.0 * template.shape.circumradius(), template.shape.thickness());
            for i in 0..3 {
                let (edge, axis) = (used[i], ["x", "y", "z"][i]);
                if domain.periodic[i] && width > 0.5 * edge * (1.0 + 1e-9) {
                    let half = 0.5 * edge;
                    let title = format!(
                        "a particle of {width} m is larger than half the box, {half:.6e} m in {axis}"
                    );
                    let remedy = format!("the smallest edge must be at least {:.6e} m{unit}", 2.0 * width);
                    return Err(document.error_at(&places, &title, &remedy));
                }
                if !domain.periodic[i] && thickness > edge * (1.0 + 1e-9) {
                    let title = format!(
                        "a particle {thickness:.6e} m thick does not fit between walls {edge:.6e} m apart in {axis}"
                    );
                    let remedy = format!("take a larger box or a smaller particle{unit}");
                    return Err(document.error_at(&places, &title, &remedy));
                }
            }
        }
    }
    Ok(())
}

fn warn_of_what_is_too_thin(document: &Document, kinds: &Kinds, dx: f64, warnings: &mut Vec<String>) {
    for (index, kind) in kinds.sections.iter().enumerate() {
        let templates = kinds.templates[kind.templates()].iter();
        let thinnest =
            templates.map(|template| template.shape.thickness() / dx).fold(f64::INFINITY, f64::min);
        if thinnest < THINNEST_CELLS {
            let (key, cells) =
                (format!("particles.{index}.shape"), kinds.diameter / dx * THINNEST_CELLS / thinnest);
            let title = format!(
                "`{key}` is {thinnest:.2} cells thick, below {THINNEST_CELLS}: the fluid resolves it poorly"
            );
            // Rounded up, and so to more than there are.
            let remedy =
                format!("take lattice.cells_per_diameter = {:.1} or more", (10.0 * cells).ceil() / 10.0);
            warnings.push(document.warning(&key, &title, "thin", &remedy));
        }
    }
}

/// Refuses a box in which a pair could touch through two images: the engine sees only the nearest one.
///
/// `reaches` (m) are those of the templates, grown for contacts.
pub(super) fn refuse_double_contacts(
    document: &Document,
    domain: &Domain,
    reaches: &[f64],
    particles: &[Particle],
) -> Result<()> {
    let mut reaches: Vec<f64> = particles.iter().map(|p| reaches[p.template as usize]).collect();
    reaches.sort_unstable_by(f64::total_cmp);
    let [.., second, largest] = reaches[..] else {
        return Ok(());
    };
    let (size, needed) = (domain.size(), 2.0 * (largest + second));
    let Some(i) = (0..3).find(|&i| domain.periodic[i] && size[i] < needed) else {
        return Ok(());
    };
    let (edge, axis) = (size[i], ["x", "y", "z"][i]);
    let title = format!(
        "the box is {edge:.6e} m wide in {axis}, where two particles could touch through two periodic images at once"
    );
    let remedy = format!(
        "make it at least {needed:.6e} m wide: the largest reach {largest:.6e} m and {second:.6e} m from their centres, \
         contact enlargement included"
    );
    Err(document.error("domain.size", &title, "too narrow", &remedy))
}
