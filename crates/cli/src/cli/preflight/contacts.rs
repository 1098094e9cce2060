//! Contacts: how long they last, how deep they are, and which Young's modulus and sub-steps resolve them.

use crate::cli::terminal::{Row, row};
use std::ops::RangeInclusive;
use turbid::case::{Impact, Setup};
use turbid::contact::{ContactModel, RollingLaw, SpherePair};
use turbid::output::numbers::small;

/// Most sub-steps that are suggested to anybody.
const MOST_SUBSTEPS: f64 = 1000.0;
/// Young's moduli that are suggested to anybody (Pa).
const USUAL_MODULI: RangeInclusive<f64> = 1.0..=1e13;
/// Steps that a swing of the spring of friction needs at least: the integration is unstable below pi.
const LEAST_SWING: f64 = 10.0;
/// Largest usual depth of a contact in diameters.
const USUAL_DEPTH: f64 = 0.1;

/// The template whose contacts at rest are deepest for its size, with their depth (m) and that over its diameter (-).
fn deepest(setup: &Setup) -> Option<(usize, f64, f64)> {
    let over_diameter = |(template, depth): (usize, f64)| {
        (template, depth, depth / setup.templates[template].shape.equivalent_diameter())
    };
    setup.resting_depths().into_iter().map(over_diameter).max_by(|a, b| a.2.total_cmp(&b.2))
}

/// Names the particles of a template where forces move those of several sections.
fn kind(setup: &Setup, template: usize) -> String {
    let mut sections: Vec<usize> =
        setup.movable().into_iter().map(|template| setup.sections[template]).collect();
    sections.dedup();
    if sections.len() > 1 { format!(" of `particles.{}`", setup.sections[template]) } else { String::new() }
}

/// Duration and depth of contacts.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let Some(contact) = &setup.contact else {
        return vec![row("contacts", "off", "")];
    };
    if setup.movable().is_empty() {
        return vec![row("contacts", "none", "forces move no particle")];
    }
    let percent = |d: f64| format!("{:.3} % D", 100.0 * d);
    let (weight, dx) = match setup.fluid {
        Some(_) => ("submerged weight", Some(setup.domain.dx)),
        None => ("weight", None),
    };
    let cells = |d: f64| match dx {
        Some(dx) => format!("{:.3} cells", d / dx),
        None => format!("{d:.3e} m"),
    };
    let mut rows = Vec::new();
    let impact = setup.impact();
    if let Some((Impact { template, speed, cause, .. }, spheres)) =
        impact.and_then(|impact| Some((impact, setup.spheres(impact.template)?)))
    {
        let kind = kind(setup, template);
        for (speed, part) in [(speed, ""), (0.1 * speed, " / 10")] {
            let steps = spheres.duration(speed) / setup.time_step;
            let substeps = match setup.substeps {
                1 => String::new(),
                n => format!(", {n} sub-steps each"),
            };
            let remark = format!("steps, impact{kind} at {cause}{part}, {speed:.3e} m/s{substeps}");
            rows.push(row("contact lasts", format!("{steps:.0}"), remark));
        }
        let depth = spheres.impact_depth(speed);
        let part = depth / setup.templates[template].shape.equivalent_diameter();
        rows.push(row("overlap, impact", percent(part), format!("{}{kind}, at {cause}, dry", cells(depth))));
    }
    if let Some((template, depth, part)) = deepest(setup) {
        let cohesion = if contact.is_cohesive() { " and cohesion" } else { "" };
        let remark = format!("{}{}, one {weight}{cohesion}", cells(depth), kind(setup, template));
        rows.push(row("overlap, at rest", percent(part), remark));
    }
    rows.extend(pull_off_row(setup, weight));
    rows.extend(step_rows(setup, contact));
    rows.extend(restitution_rows(contact));
    rows.extend(creep_row(setup, contact));
    rows.extend(rolling_row(contact));
    rows
}

/// The force that pulls two particles off each other, of those for which it is largest beside their weight.
fn pull_off_row(setup: &Setup, weight: &str) -> Option<Row> {
    let of = |template: usize| Some((template, setup.spheres(template)?.pull_off(), setup.weight(template)));
    let forces = setup.movable().into_iter().filter_map(of).filter(|(_, force, _)| *force > 0.0);
    let (template, force, own) = forces.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))?;
    let kind = kind(setup, template);
    let times =
        if own > 0.0 { format!(", {} times the {weight} of one", small(force / own)) } else { String::new() };
    Some(row(
        "pull-off force",
        format!("{force:.2e} N"),
        format!("of two equal particles{kind}, as spheres{times}"),
    ))
}

/// Steps in a period of the spring of friction, in the time that cohesion takes to draw bodies together, in the approach by van der Waals forces, and in the wave of Rayleigh: of the particles for which
/// each is shortest.
fn step_rows(setup: &Setup, contact: &ContactModel) -> Vec<Row> {
    let step = setup.time_step / f64::from(setup.substeps);
    let all: Vec<(usize, SpherePair)> = setup
        .movable()
        .into_iter()
        .filter_map(|template| Some((template, setup.spheres(template)?)))
        .collect();
    let shortest = |of: &dyn Fn(usize, &SpherePair) -> Option<f64>| {
        let times = all.iter().filter_map(|(template, spheres)| Some((*template, of(*template, spheres)?)));
        times.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(template, time)| (kind(setup, template), time / step))
    };
    let (impacts, resting) = (setup.impacts(), setup.resting_depths());
    let depth = |template: usize, spheres: &SpherePair| {
        let impacts = impacts.iter().filter(|impact| impact.template == template);
        let depths = impacts.map(|impact| spheres.impact_depth(impact.speed));
        let rests = resting.iter().filter(|(of, _)| *of == template).map(|(_, depth)| *depth);
        depths.chain(rests).fold(0.0, f64::max)
    };
    let sliding = |template: usize, spheres: &SpherePair| {
        let depth = depth(template, spheres);
        (depth > 0.0).then(|| spheres.sliding_period(depth))
    };
    let mut rows = Vec::new();
    if let Some((kind, steps)) = shortest(&|_, spheres| spheres.bound_duration()) {
        let remark =
            format!("steps of the particles{kind}, half a swing of two that cohesion holds together");
        rows.push(row("cohesion holds", format!("{steps:.0}"), remark));
    }
    if let Some((kind, steps)) = shortest(&|_, spheres| spheres.approach_duration()) {
        let remark = format!(
            "steps of the particles{kind}, pi sqrt(m / k) with the steepest change of the force; {LEAST_SWING} at least"
        );
        rows.push(row("van der Waals", format!("{steps:.0}"), remark));
    }
    if contact.friction.has_spring()
        && let Some((kind, steps)) = shortest(&sliding)
    {
        let remark = format!(
            "steps of the particles{kind}, a swing of the spring of friction in the deepest contact; {LEAST_SWING} at least"
        );
        rows.push(row("friction swings", format!("{steps:.0}"), remark));
    }
    if let Some((kind, steps)) = shortest(&|_, spheres| Some(spheres.rayleigh_time())) {
        let part = format!("{:.1} %", 100.0 / steps);
        rows.push(row("Rayleigh time", part, format!("that a step of the particles{kind} takes of it")));
    }
    rows
}

/// The restitution that comes out of each one that is set, where the damping only comes near it.
fn restitution_rows(contact: &ContactModel) -> Vec<Row> {
    let mut set: Vec<f64> = contact.pairs.iter().map(|pair| pair.restitution).collect();
    set.sort_by(f64::total_cmp);
    set.dedup();
    let rows = set.into_iter().filter_map(|e| {
        let comes_out = contact.damping.resulting_restitution(e)?;
        Some(row("restitution", format!("{comes_out:.3}"), format!("{e} is set; of a dry head-on impact")))
    });
    rows.collect()
}

/// The speed of bodies at rest that friction without memory does not hold, where something pulls them along the surface. With `mu(x) = 2 mu_s x^2` near rest that is `u_k / 2`
/// under half of the largest force.
fn creep_row(setup: &Setup, contact: &ContactModel) -> Option<Row> {
    let rough = contact.pairs.iter().filter(|pair| pair.friction_static > 0.0);
    let speed = rough.map(|pair| 0.5 * pair.transition_velocity).fold(0.0, f64::max);
    let pulled = setup.movable().into_iter().any(|template| setup.weight(template) > 0.0);
    if contact.friction.has_spring() || speed <= 0.0 || !pulled {
        return None;
    }
    let remark = "friction without memory holds nothing: the creep of a body on a slope of half the coefficient; \"mindlin\" holds it";
    Some(row("friction creeps", format!("{speed:.1e} m/s"), remark))
}

/// The steepest slope on which the resistance to rolling holds a sphere, or by which it slows one down.
fn rolling_row(contact: &ContactModel) -> Option<Row> {
    let most = contact.pairs.iter().map(|pair| pair.rolling_friction).fold(0.0, f64::max);
    let remark = match contact.rolling {
        RollingLaw::ElasticPlastic => {
            "slope (tan) up to which a sphere does not roll, with the largest coefficient"
        }
        RollingLaw::ConstantTorque => {
            "slope (tan) on which a sphere rolls steadily, with the largest coefficient; it holds nothing at rest"
        }
        RollingLaw::None => return None,
    };
    (most > 0.0).then(|| row("rolling", format!("{most}"), remark))
}

/// Contacts that are too short or too deep, with Young's moduli and sub-steps that mend both.
pub(super) fn advice(setup: &Setup) -> Option<String> {
    let contact = setup.contact.as_ref()?;
    let power = contact.law.exponent();
    let (impacts, material) = (setup.impacts(), |template: usize| setup.templates[template].material);
    let short = setup.impact().filter(|impact| impact.resolved() < 1.0);
    let deep = deepest(setup).filter(|(.., part)| *part > USUAL_DEPTH);
    let mut faults = Vec::new();
    if let Some(Impact { template, cause, steps, needed, .. }) = short {
        let kind = kind(setup, template);
        faults.push(format!(
            "an impact{kind} at {cause} lasts {steps:.1} steps of the particles, below {needed}"
        ));
    }
    if let Some((template, _, part)) = deep {
        let far =
            if part < 10.0 { format!("{:.1} %", 100.0 * part) } else { "more than ten times".to_string() };
        faults.push(format!(
            "a resting particle{} sinks {far} of a diameter into its neighbour, above {:.0} %",
            kind(setup, template),
            100.0 * USUAL_DEPTH
        ));
    }
    if faults.is_empty() {
        return None;
    }
    // Factors on the stiffness of each material: the least with which contacts at rest are shallow enough, and the largest with which
    // impacts last long enough. Rounded to the safe side when they are printed.
    let (mut least, mut most) =
        (vec![0.0_f64; contact.materials.len()], vec![1.0_f64; contact.materials.len()]);
    for (template, depth) in setup.resting_depths() {
        let part = depth / setup.templates[template].shape.equivalent_diameter();
        let least = &mut least[material(template)];
        *least = least.max(1.001 * libm::pow(part / USUAL_DEPTH, power));
    }
    for impact in impacts.iter().filter(|impact| impact.resolved() < 1.0) {
        let most = &mut most[material(impact.template)];
        *most = most.min(0.999 * libm::pow(impact.resolved(), power + 1.0));
    }
    let stiffer: Vec<f64> = least.iter().map(|least| least.max(1.0)).collect();
    // Sub-steps for the moduli that are left or taken.
    let needed = impacts.iter().map(|impact| {
        f64::from(setup.substeps) / impact.resolved()
            * libm::pow(stiffer[material(impact.template)], 1.0 / (power + 1.0))
    });
    let substeps = needed.fold(1.0, f64::max).ceil();
    let enough = substeps <= f64::from(setup.substeps);
    let softer = most.iter().zip(&least).all(|(most, least)| least < most);
    let remedy = match (deep.is_some(), moduli(contact, &stiffer), moduli(contact, &most)) {
        (true, None, _) => None,
        _ if substeps > MOST_SUBSTEPS => None,
        (true, Some(moduli), _) if enough => Some(format!("take {moduli} or more")),
        (true, Some(moduli), _) => Some(format!("take {moduli} with contact.substeps = {substeps:.0}")),
        (false, _, Some(moduli)) if softer => {
            Some(format!("take contact.substeps = {substeps:.0} or {moduli}"))
        }
        (false, ..) => Some(format!("take contact.substeps = {substeps:.0}")),
    };
    let remedy = remedy.unwrap_or_else(|| {
        "no usual Young's modulus and number of sub-steps mends that: check the units of the case".to_string()
    });
    Some(format!("{}; {remedy}", faults.join("; ")))
}

/// Young's moduli times these factors, as keys of the case with their values; none if one of them is unusual. Of a law that reads none,
/// the factor on its own stiffness.
fn moduli(contact: &ContactModel, factors: &[f64]) -> Option<String> {
    if !contact.parameters().contains(&"youngs_modulus") {
        let [least, most] = [f64::min, f64::max].map(|of| factors.iter().copied().fold(1.0, of));
        let factor = if least < 1.0 { least } else { most };
        return Some(format!("a stiffness of `contact.law` {factor:.3e} times as large"));
    }
    let changed = contact
        .materials
        .iter()
        .zip(factors)
        .enumerate()
        .filter(|(_, (_, factor))| (**factor - 1.0).abs() > 0.0);
    let words = changed.map(|(index, (material, factor))| {
        let modulus = material.youngs_modulus * factor;
        let key = match index {
            0 => "contact".to_string(),
            index => format!("materials.{}", index - 1),
        };
        USUAL_MODULI.contains(&modulus).then(|| format!("{key}.youngs_modulus = {modulus:.3e}"))
    });
    words.collect::<Option<Vec<_>>>().map(|words| words.join(" and "))
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
