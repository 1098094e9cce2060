//! Contacts: how long they last, how deep they are, and which Young's modulus and sub-steps resolve them.

use crate::cli::terminal::{Row, row};
use turbid::case::{Hertz, Impact, Setup};
use turbid::contact::{ContactModel, DampingLaw, law};

/// Most sub-steps that are suggested to anybody.
const MOST_SUBSTEPS: f64 = 1000.0;
/// Largest usual depth of a contact in diameters.
const USUAL_DEPTH: f64 = 0.1;

/// Two particles of the first kind in contact, as spheres of their volume.
pub(super) fn hertz(setup: &Setup, contact: &ContactModel) -> Hertz {
    let template = &setup.templates[0];
    Hertz::new(template, &contact.materials[template.material])
}

/// Weight of one particle of the first kind minus its buoyancy (N).
fn submerged_weight(setup: &Setup) -> f64 {
    let template = &setup.templates[0];
    (template.density - setup.fluid_density()).abs() * template.shape.volume() * setup.gravity.norm()
}

/// Duration and depth of contacts.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let Some(contact) = &setup.contact else {
        return vec![row("contacts", "off", "")];
    };
    let hertz = hertz(setup, contact);
    let depth = |d: f64| format!("{:.3} % D", 100.0 * d / setup.diameter);
    let (weight, dx) = match setup.fluid {
        Some(_) => ("submerged weight", Some(setup.domain.dx)),
        None => ("weight", None),
    };
    let cells = |d: f64| match dx {
        Some(dx) => format!("{:.3} cells", d / dx),
        None => format!("{d:.3e} m"),
    };
    let mut rows = Vec::new();
    if let Some(Impact { speed, cause, .. }) = setup.impact() {
        for (speed, part) in [(speed, ""), (0.1 * speed, " / 10")] {
            let steps = hertz.duration(speed) / setup.time_step;
            let substeps = match setup.substeps {
                1 => String::new(),
                n => format!(", {n} sub-steps each"),
            };
            let remark = format!("steps, Hertz impact at {cause}{part}{substeps}");
            rows.push(row("contact lasts", format!("{steps:.0}"), remark));
        }
        let impact = hertz.impact_depth(speed);
        rows.push(row("overlap, impact", depth(impact), format!("{}, at {cause}, dry", cells(impact))));
    }
    let resting = hertz.static_depth(submerged_weight(setup));
    let remark = format!("{}, one {weight}", cells(resting));
    rows.push(row("overlap, at rest", depth(resting), remark));
    rows.extend(restitution_rows(contact));
    rows
}

/// The restitution that comes out of each one that is set, where the damping only comes near it.
fn restitution_rows(contact: &ContactModel) -> Vec<Row> {
    if contact.damping != DampingLaw::HuntCrossley {
        return Vec::new();
    }
    let mut set: Vec<f64> = contact.pairs.iter().map(|pair| pair.restitution).collect();
    set.sort_by(f64::total_cmp);
    set.dedup();
    let rows = set.into_iter().map(|e| {
        let comes_out = law::resulting_restitution(law::damping_number(e));
        row("restitution", format!("{comes_out:.3}"), format!("{e} is set; of a dry head-on impact"))
    });
    rows.collect()
}

/// Contacts that are too short or too deep, with a Young's modulus and sub-steps that mend both.
pub(super) fn advice(setup: &Setup) -> Option<String> {
    let contact = setup.contact.as_ref()?;
    let hertz = hertz(setup, contact);
    let given = contact.materials[setup.templates[0].material].youngs_modulus;
    let impact = setup.impact();
    let resolved = impact.map_or(f64::INFINITY, |impact| impact.steps / impact.needed);
    let depth = hertz.static_depth(submerged_weight(setup)) / setup.diameter;
    let (short, deep) = (resolved < 1.0, depth > USUAL_DEPTH);
    if !short && !deep {
        return None;
    }
    let mut faults = Vec::new();
    if let Some(Impact { cause, steps, needed, .. }) = impact.filter(|_| short) {
        faults.push(format!("an impact at {cause} lasts {steps:.1} steps of the particles, below {needed}"));
    }
    if deep {
        faults.push(format!(
            "a resting particle sinks {:.1} % of a diameter into its neighbour, above {:.0} %",
            100.0 * depth,
            100.0 * USUAL_DEPTH
        ));
    }
    // Rounded to the safe side when it is printed.
    let stiffest = 0.999 * given * libm::pow(resolved, 2.5);
    let softest = 1.001 * given * libm::pow(depth / USUAL_DEPTH, 1.5);
    // Sub-steps for the modulus that is left or taken.
    let modulus = if deep { softest } else { given };
    let substeps = (f64::from(setup.substeps) / resolved * libm::pow(modulus / given, 0.4)).ceil();
    let enough = substeps <= f64::from(setup.substeps);
    let remedy = match (short, deep) {
        _ if substeps > MOST_SUBSTEPS => {
            "no usual Young's modulus and number of sub-steps mends that: check the units of the case"
                .to_string()
        }
        (_, true) if enough => format!("take contact.youngs_modulus = {softest:.3e} or more"),
        (_, true) => {
            format!("take contact.youngs_modulus = {softest:.3e} with contact.substeps = {substeps:.0}")
        }
        (_, false) if softest < stiffest => {
            format!("take contact.substeps = {substeps:.0} or contact.youngs_modulus = {stiffest:.3e}")
        }
        (_, false) => format!("take contact.substeps = {substeps:.0}"),
    };
    Some(format!("{}; {remedy}", faults.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::advice;
    use turbid::case::from_text;

    /// The number behind a key in an advice.
    fn value(text: &str, key: &str) -> Option<String> {
        let (_, rest) = text.split_once(&format!("contact.{key} = "))?;
        Some(format!("contact.{key}={}", rest.split(' ').next()?))
    }

    #[test]
    fn a_contact_that_follows_the_advice_is_given_none() {
        let text = "domain.size.diameters = [4, 4, 4]\n\
                    fluid = { density = 1000, archimedes = 1000 }\n\
                    lattice = { cells_per_diameter = 8, relaxation_time = 0.65 }\n\
                    run.end.steps = 1000\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1.5e-3\n\
                    density = 3300.0\n\
                    count = 1\n";
        let of =
            |options: &[String]| advice(&from_text(text, "case", options).unwrap_or_else(|e| panic!("{e}")));
        let mut seen = [0; 3];
        for step in 0..20 {
            let given = format!("contact.youngs_modulus={:e}", 10.0 * 3.0_f64.powi(step));
            let Some(said) = of(std::slice::from_ref(&given)) else {
                continue;
            };
            if said.contains("check the units") {
                continue;
            }
            let (modulus, substeps) = (value(&said, "youngs_modulus"), value(&said, "substeps"));
            let deep = said.contains("sinks");
            seen[usize::from(deep) + usize::from(deep && said.contains("lasts"))] += 1;
            match (modulus, substeps) {
                (Some(modulus), Some(substeps)) if said.contains(" or ") && !deep => {
                    assert_eq!(of(&[modulus]), None, "{said}");
                    assert_eq!(of(&[given, substeps]), None, "{said}");
                }
                (modulus, substeps) => {
                    let changed = [given].into_iter().filter(|_| modulus.is_none());
                    let options: Vec<String> = changed.chain(modulus.clone()).chain(substeps).collect();
                    assert_eq!(of(&options), None, "{said}");
                }
            }
        }
        assert!(seen[0] > 0 && seen[1] + seen[2] > 0, "{seen:?}");
    }
}
