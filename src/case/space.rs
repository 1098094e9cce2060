//! The box: its cells, and whether the particles fit in.

use super::file::{Case, ShapeSection};
use super::forms::Size;
use super::source::Source;
use crate::domain::Domain;
use crate::error::Result;
use crate::particle::Template;

/// More cells than any machine of today holds.
const MAX_CELLS: f64 = 1e12;

/// The box in cells; what had to be rounded goes to `warnings`.
pub(super) fn domain(
    source: &Source,
    case: &Case,
    templates: &[Template],
    warnings: &mut Vec<String>,
) -> Result<Domain> {
    let periodic = &case.domain.periodic;
    if periodic.value != [true; 3] {
        return Err(source.error(
            &periodic.span,
            "walls are not part of this version: every direction is periodic",
            "must be [true, true, true]",
            "write periodic = [true, true, true], or leave the key out",
        ));
    }
    let diameter = templates[0].shape.equivalent_diameter();
    let per_diameter = source.satisfies(
        "lattice.cells_per_diameter",
        &case.lattice.value.cells_per_diameter,
        |n| n >= 2.0,
        "a finite number of at least 2",
        "9 to 27 cells are usual",
    )?;
    let dx = diameter / per_diameter;
    let size = &case.domain.size;
    let (edges, unit) = match &size.value {
        Size::Metres(edges) => (edges, diameter),
        Size::Relative(relative) => (&relative.diameters, 1.0),
    };
    let mut cells = [0; 3];
    let mut total = 1.0;
    let mut rounded = false;
    for i in 0..3 {
        let edge = source.positive(
            "domain.size",
            &edges[i],
            "three edges in metres, or { diameters = [6, 6, 6] }",
        )?;
        let exact = edge / unit * per_diameter;
        total *= exact.max(1.0);
        if total > MAX_CELLS {
            let title = format!("the box has more than {MAX_CELLS:e} cells");
            let remedy = "take a smaller `domain.size` or fewer `lattice.cells_per_diameter`";
            return Err(source.error(&edges[i].span, &title, "too large", remedy));
        }
        cells[i] = exact.round().max(1.0) as usize;
        rounded |= (exact - cells[i] as f64).abs() > 1e-9 * exact;
    }
    let domain = Domain {
        periodic: [true; 3],
        cells,
        dx,
    };
    let used = domain.size();
    if rounded {
        let (x, y, z) = (used.x, used.y, used.z);
        warnings.push(source.warning(
            &size.span,
            &format!("the box is not a whole number of cells; it is {x:.6e} x {y:.6e} x {z:.6e} m here"),
            &format!(
                "rounded to {} x {} x {} cells of {dx:.6e} m",
                cells[0], cells[1], cells[2]
            ),
            "",
        ));
    }
    for (template, section) in templates.iter().zip(&case.particles) {
        let ShapeSection::Sphere(sphere) = &section.value.shape;
        let width = 2.0 * template.shape.circumradius();
        let half = 0.5 * used.min();
        if width > half * (1.0 + 1e-9) {
            return Err(source.error_at(
                &[(&sphere.diameter.span, "too large for"), (&size.span, "this box")],
                &format!("a particle of {width} m is larger than half the box, {half:.6e} m"),
                &format!("the smallest edge must be at least {:.6e} m", 2.0 * width),
            ));
        }
    }
    Ok(domain)
}
