//! Laws of contacts that the bodies of a case cannot have: those of round bodies for bodies with edges, the van der Waals force of others than spheres, and cohesion without its
//! parameter or so strong that bodies in contact sink too deep into each other.

use super::checks::Document;
use super::kinds::Kinds;
use super::walls::PlacedWall;
use crate::contact::{CohesionLaw, ContactModel, DEEPEST, ElasticLaw, FrictionLaw, PairParams, VanDerWaals};
use crate::error::Result;
use crate::output::numbers::small;
use crate::particle::Template;

/// A law of round bodies.
struct Round {
    key: &'static str,
    does: &'static str,
    /// Reason, of a template that cannot have it.
    lacks: fn(&Template) -> Option<&'static str>,
    /// Its parameter; a pair with 0 is left alone.
    parameter: (&'static str, fn(&PairParams) -> f64),
    instead: &'static str,
}

const ROLLING: Round = Round {
    key: "contact.rolling",
    does: "resists the rolling of round bodies",
    lacks: |template| has_no_round_side(template).then_some("has edges, and no radius to roll on"),
    parameter: ("rolling_friction", |pair| pair.rolling_friction),
    instead: "faces and edges resist by themselves",
};
const DMT: Round = Round {
    key: "contact.cohesion",
    does: "\"dmt\" is the cohesion of round bodies",
    lacks: |template| has_edges(template).then_some("has edges, and no radius of curvature"),
    parameter: ("work_of_adhesion", |pair| pair.work_of_adhesion),
    instead: "or take \"sjkr\", which is proportional to the area of the overlap",
};

const JKR: Round = Round {
    key: "contact.cohesion",
    does: "\"jkr\" is the cohesion of spheres",
    lacks: |template| is_no_sphere(template).then_some("no sphere"),
    parameter: ("work_of_adhesion", |pair| pair.work_of_adhesion),
    instead: "or take \"dmt\" for round bodies, or \"sjkr\", which is proportional to the area of the overlap",
};

const PARTIAL_SLIP: Round = Round {
    key: "contact.friction",
    does: "\"mindlin_deresiewicz\" is the friction of round bodies",
    lacks: |template| {
        has_edges(template).then_some("has edges, and no disc that slips from its edge inwards")
    },
    parameter: ("friction_kinetic", |pair| pair.friction_kinetic),
    instead: "or take \"mindlin\", the friction of bodies of any shape",
};

fn has_edges(template: &Template) -> bool {
    template.parts().any(|(shape, _)| shape.curvature().sharpness > 0.0)
}

/// True of one with edges but a cylinder, which rolls on its side.
fn has_no_round_side(template: &Template) -> bool {
    has_edges(template) && template.shape.as_cylinder().is_none()
}

fn is_no_sphere(template: &Template) -> bool {
    template.parts().any(|(shape, _)| shape.as_sphere().is_none())
}

/// Refuses the van der Waals force of bodies that are no spheres, beside a law of cohesion, and with a cut-off within its smallest gap.
pub(super) fn refuse_van_der_waals(document: &Document, kinds: &Kinds, model: &ContactModel) -> Result<()> {
    let Some(VanDerWaals { smallest_gap, cut_off, .. }) = model.van_der_waals else { return Ok(()) };
    let key = "contact.van_der_waals";
    if !document.case.contact.enabled {
        let title = format!("`{key}` needs contacts, which are off");
        let marks = [(key, "given"), ("contact.enabled", "no contacts")];
        return Err(document.error_at(&marks, &title, "remove one of them"));
    }
    if cut_off <= smallest_gap {
        let within = format!("{key}.cut_off");
        let title =
            format!("`{within}` is {cut_off:e} m, not above `{key}.smallest_gap`, {smallest_gap:e} m");
        let remedy = format!(
            "take a larger cut-off, for instance {} m, where a hundredth of the force is left",
            small(10.0 * smallest_gap)
        );
        return Err(document.error(&within, &title, "no force over any gap", &remedy));
    }
    if model.cohesion != CohesionLaw::None {
        let title =
            format!("`contact.cohesion` is {}, but `{key}` is given", serde_json::json!(model.cohesion));
        let marks = [("contact.cohesion", "adhesion in contact"), (key, "acts in contact, too")];
        let remedy =
            "remove one of them: both are the adhesion of surfaces that touch, which would count twice";
        return Err(document.error_at(&marks, &title, remedy));
    }
    let found = kinds.templates.iter().position(is_no_sphere);
    let Some(index) = found else { return Ok(()) };
    let shape = format!("particles.{}.shape", kinds.of_each(|section, _| section)[index]);
    let title =
        format!("`{key}` is a force of spheres, but `{shape}` is a {}", kinds.templates[index].shape.kind());
    let remedy = "remove it, or take contact.cohesion = \"dmt\" for round bodies, or \"sjkr\" for any, which act in contact alone";
    Err(document.error_at(&[(&*shape, "no sphere"), (key, "the force")], &title, remedy))
}

/// Refuses laws of round bodies for those with edges, which have no radius, and the law of spheres for others.
pub(super) fn refuse_edges(document: &Document, kinds: &Kinds, model: &ContactModel) -> Result<()> {
    let laws = [
        (ROLLING, model.rolling.is_given()),
        (PARTIAL_SLIP, model.friction == FrictionLaw::MindlinDeresiewicz),
        (DMT, model.cohesion == CohesionLaw::Dmt),
        (JKR, model.cohesion == CohesionLaw::Jkr),
    ];
    for (law, _) in laws.into_iter().filter(|(_, given)| *given) {
        let Round { key, does, lacks, parameter: (name, value), instead } = law;
        let acts = |material: usize| {
            (0..model.materials.len()).any(|other| value(model.pair(material, other)) > 0.0)
        };
        let unfit = |template: &Template| lacks(template).filter(|_| acts(template.material));
        let found = kinds.templates.iter().enumerate().find_map(|(index, of)| Some((index, unfit(of)?)));
        if let Some((index, has)) = found {
            let shape = format!("particles.{}.shape", kinds.of_each(|section, _| section)[index]);
            let kind = kinds.templates[index].shape.kind();
            let title = format!("`{key}` {does}, but `{shape}` is a {kind}");
            let marks = [(&*shape, has), (key, "the law")];
            let remedy =
                format!("give it a material of its own whose [[contact.pairs]] have {name} = 0: {instead}");
            return Err(document.error_at(&marks, &title, &remedy));
        }
    }
    Ok(())
}

/// A law of cohesion.
struct Cohesive {
    law: &'static str,
    /// Its parameter.
    name: &'static str,
    value: fn(&ContactModel, [usize; 2]) -> f64,
    unit: &'static str,
    usual: &'static str,
    /// The power of the depth at rest with which the parameter grows.
    power: f64,
}

impl Cohesive {
    fn of(model: &ContactModel) -> Option<Self> {
        Self::of_law(model.cohesion).or(model.van_der_waals.map(|_| Self {
            law: "van der Waals",
            name: "van_der_waals.hamaker_constant",
            value: |model, _| model.van_der_waals.map_or(0.0, |law| law.hamaker_constant),
            unit: "J",
            usual: "1e-20",
            power: 1.5,
        }))
    }

    fn of_law(law: CohesionLaw) -> Option<Self> {
        match law {
            CohesionLaw::None => None,
            CohesionLaw::Dmt => Some(Self {
                law: "dmt",
                name: "work_of_adhesion",
                value: |model, [a, b]| model.pair(a, b).work_of_adhesion,
                unit: "J/m2",
                usual: "0.05",
                power: 1.5,
            }),
            CohesionLaw::Sjkr => Some(Self {
                law: "sjkr",
                name: "cohesion_density",
                value: |model, [a, b]| model.pair(a, b).cohesion_density,
                unit: "J/m3",
                usual: "100",
                power: 0.5,
            }),
            CohesionLaw::Jkr => Self::of_law(CohesionLaw::Dmt).map(|dmt| Self { law: "jkr", ..dmt }),
        }
    }

    /// Keys of the case that may give the parameter.
    fn keys(&self, document: &Document) -> Vec<String> {
        let pairs = (0..document.case.contact.pairs.len()).map(|pair| format!("contact.pairs.{pair}"));
        let sections = pairs.chain(["contact".to_owned()]);
        sections.map(|section| format!("{section}.{}", self.name)).filter(|key| document.has(key)).collect()
    }
}

/// Refuses cohesion without its parameter, and cohesion by which bodies that touch would sink into each other, or into a wall, deeper than a
/// run allows.
pub(super) fn refuse_cohesion(
    document: &Document,
    kinds: &Kinds,
    walls: &[PlacedWall],
    model: &ContactModel,
) -> Result<()> {
    let Some(cohesive) = Cohesive::of(model) else { return Ok(()) };
    let Cohesive { law, name, value, unit, usual, power } = cohesive;
    let keys = cohesive.keys(document);
    if keys.is_empty() {
        let title = format!("`contact.cohesion` is \"{law}\", but the case gives no `{name}`");
        let label = format!("needs `{name}`, which is 0 by default");
        let remedy =
            format!("give contact.{name} in {unit}, for instance {usual}, or {name} in [[contact.pairs]]");
        return Err(document.error("contact.cohesion", &title, &label, &remedy));
    }
    if model.cohesion == CohesionLaw::Jkr && model.law != ElasticLaw::Hertz {
        let has = serde_json::json!(model.law);
        let title = format!(
            "`contact.law` is {has}, but `contact.cohesion` is \"jkr\", whose elastic force is that of Hertz"
        );
        let key = if document.has("contact.law") { "contact.law" } else { "contact.cohesion" };
        return Err(document.error(key, &title, "another elastic force", "take contact.law = \"hertz\""));
    }
    if !document.case.contact.enabled {
        return Ok(());
    }
    let of_each = kinds.of_each(|section, _| section);
    let present = |section: usize| document.case.has_particles(section);
    let bodies = kinds.templates.iter().zip(of_each).filter(|(_, section)| present(*section));
    let bodies: Vec<(&Template, usize)> = bodies.collect();
    let radius = |template: &Template| 0.5 * template.shape.equivalent_diameter() + model.enlargement;
    // A body sinks deepest into the largest partner of each material.
    let mut largest = vec![None::<f64>; model.materials.len()];
    let of_walls = walls.iter().map(|placed| (placed.wall.material, f64::INFINITY));
    let sides = bodies.iter().map(|(template, _)| (template.material, radius(template))).chain(of_walls);
    for (material, radius) in sides {
        largest[material] = Some(largest[material].map_or(radius, |largest| largest.max(radius)));
    }
    for (template, section) in bodies {
        let partners = largest.iter().enumerate().filter_map(|(other, radius)| Some((other, (*radius)?)));
        for (other, partner) in partners {
            let materials = [template.material, other];
            let depth = model.cohesive_depth(materials, [radius(template), partner]);
            let allowed = DEEPEST * template.shape.thickness();
            if depth <= allowed {
                continue;
            }
            let given = value(model, materials);
            let gives = |key: &&String| document.number(key) == Some(given);
            let key = keys.iter().find(gives).or(keys.last()).map_or("contact.cohesion", String::as_str);
            let shown = if given < 1e-4 { format!("{given:e}") } else { given.to_string() };
            let into = if partner.is_finite() { "another body" } else { "a wall" };
            let title = format!(
                "`{key}` is {shown} {unit}, which alone presses `particles.{section}` {depth:.3e} m deep into {into}, more than \
                 the {allowed:.3e} m at which a run ends"
            );
            let factor = 0.99 * libm::pow(allowed / depth, power);
            // More than two digits round off.
            let stiffer = small(1.06 / factor);
            let remedy = format!(
                "take {name} = {:.2e} or less, or Young's moduli {stiffer} times as large",
                given * factor
            );
            return Err(document.error(key, &title, "too strong", &remedy));
        }
    }
    Ok(())
}
