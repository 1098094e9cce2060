//! Materials by name, and the contact model.

use super::checks::Document;
use super::file::GeometryKind;
use crate::contact::{ContactModel, Material, PairParams};
use crate::document::nearest;
use crate::error::Result;
use serde_json::{Map, Value as Json, json};
use std::fmt::Write;

/// Name of the material of `[contact]`.
const DEFAULT: &str = "default";

/// Parameters that only some laws read, with one that does.
const READERS: [(&str, &str); 4] = [
    ("transition_velocity", "contact.friction = \"nassauer_kuna\""),
    ("rolling_friction", "contact.rolling = \"elastic_plastic\""),
    ("work_of_adhesion", "contact.cohesion = \"dmt\" or \"jkr\""),
    ("cohesion_density", "contact.cohesion = \"sjkr\""),
];

/// Elasticity by name.
#[derive(Debug)]
pub(super) struct Materials {
    names: Vec<String>,
    elasticity: Vec<Material>,
}

/// The law cannot have a kinetic coefficient above the static one, unless that is 0 and the pair frictionless.
fn friction_order(document: &Document, section: &str, pair: &PairParams) -> Result<()> {
    let (kinetic, most) = (pair.friction_kinetic, pair.friction_static);
    if document.case.contact.friction.has_static() && most > 0.0 && kinetic > most {
        let wanted = format!("at most the static coefficient, {most}");
        let remedy = "sliding resists less than sticking; a pair takes from [contact] what it does not give";
        let key = format!("{section}.friction_kinetic");
        return Err(document.out_of_range(&key, kinetic, &wanted, remedy));
    }
    Ok(())
}

impl Materials {
    /// That of `[contact]` first, then those listed.
    pub(super) fn new(document: &Document) -> Result<Self> {
        let usual = Material {
            youngs_modulus: document.case.contact.youngs_modulus,
            poisson_ratio: document.case.contact.poisson_ratio,
        };
        let mut all = Self { names: vec![DEFAULT.to_string()], elasticity: vec![usual] };
        for (index, section) in document.case.materials.iter().enumerate() {
            let name = section.name.trim();
            if name.is_empty() || all.names.iter().any(|known| known == name) {
                let key = format!("materials.{index}.name");
                let why = match name {
                    DEFAULT => "the name of the material of [contact]",
                    _ => "empty or given twice",
                };
                let title = format!("`{key}` is \"{name}\", which is {why}");
                let remedy = "every material needs a name of its own";
                return Err(document.error(&key, &title, "not a new name", remedy));
            }
            all.elasticity.push(Material {
                youngs_modulus: section.youngs_modulus.unwrap_or(usual.youngs_modulus),
                poisson_ratio: section.poisson_ratio.unwrap_or(usual.poisson_ratio),
            });
            all.names.push(name.to_string());
        }
        Ok(all)
    }

    /// Index of the material that a key names; without a name that of `[contact]`.
    pub(super) fn index(&self, document: &Document, key: &str, name: Option<&String>) -> Result<usize> {
        let Some(name) = name else {
            return Ok(0);
        };
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        (names.iter().position(|known| known == name)).ok_or_else(|| {
            let known = names.join(", ");
            let remedy = match nearest(name, &names) {
                Some(near) => format!("did you mean \"{near}\"? materials here: {known}"),
                None => format!("materials here: {known}; add a section [[materials]]"),
            };
            let title = format!("`{key}` is \"{name}\", but there is no such material");
            document.error(key, &title, "unknown material", &remedy)
        })
    }

    /// The contact model in SI units, whether contacts are on or not; surfaces are grown by `enlargement` (m).
    pub(super) fn contact(&self, document: &Document, enlargement: f64) -> Result<ContactModel> {
        let contact = &document.case.contact;
        let usual = PairParams {
            restitution: contact.restitution,
            friction_static: contact.friction_static,
            friction_kinetic: contact.friction_kinetic,
            transition_velocity: contact.transition_velocity,
            rolling_friction: contact.rolling_friction,
            work_of_adhesion: contact.work_of_adhesion,
            cohesion_density: contact.cohesion_density,
        };
        friction_order(document, "contact", &usual)?;
        let n = self.names.len();
        let mut pairs = vec![usual; n * n];
        let mut given: Vec<(usize, usize)> = Vec::new();
        for (index, pair) in contact.pairs.iter().enumerate() {
            let key = format!("contact.pairs.{index}");
            let material =
                |i: usize| self.index(document, &format!("{key}.materials.{i}"), Some(&pair.materials[i]));
            let (a, b) = (material(0)?, material(1)?);
            let both = (a.min(b), a.max(b));
            if let Some(earlier) = given.iter().position(|pair| *pair == both) {
                let [first, second] = &pair.materials;
                let earlier = format!("contact.pairs.{earlier}");
                let marks = [(&*earlier, "given here"), (&*key, "and here")];
                let title = format!("the pair of \"{first}\" and \"{second}\" is given twice");
                return Err(document.error_at(&marks, &title, "remove one of them"));
            }
            given.push(both);
            let special = PairParams {
                restitution: pair.restitution.unwrap_or(usual.restitution),
                friction_static: pair.friction_static.unwrap_or(usual.friction_static),
                friction_kinetic: pair.friction_kinetic.unwrap_or(usual.friction_kinetic),
                transition_velocity: pair.transition_velocity.unwrap_or(usual.transition_velocity),
                rolling_friction: pair.rolling_friction.unwrap_or(usual.rolling_friction),
                work_of_adhesion: pair.work_of_adhesion.unwrap_or(usual.work_of_adhesion),
                cohesion_density: pair.cohesion_density.unwrap_or(usual.cohesion_density),
            };
            friction_order(document, &key, &special)?;
            pairs[a * n + b] = special;
            pairs[b * n + a] = special;
        }
        let model =
            ContactModel { materials: self.elasticity.clone(), pairs, enlargement, ..contact.model() };
        refuse_unread(document, &model, &model.parameters())?;
        Ok(model)
    }
}

/// Refuses parameters that no law of the case reads.
fn refuse_unread(document: &Document, model: &ContactModel, read: &[&str]) -> Result<()> {
    let contact = &document.case.contact;
    let samples = "contact.samples";
    if document.has(samples) && contact.geometry != GeometryKind::Sampled {
        let title = "`contact.samples` is given, but `contact.geometry` is \"exact\", which takes no samples";
        let remedy = "remove it, or take contact.geometry = \"sampled\"";
        return Err(document.error(samples, title, "has no effect", remedy));
    }
    let fields = [json!(model.materials[0]), json!(model.pairs[0])];
    let names = || fields.iter().filter_map(Json::as_object).flat_map(Map::keys);
    let materials = (0..document.case.materials.len()).map(|n| format!("materials.{n}"));
    let pairs = (0..contact.pairs.len()).map(|n| format!("contact.pairs.{n}"));
    for section in std::iter::once("contact".to_string()).chain(materials).chain(pairs) {
        for name in names().filter(|name| !read.contains(&name.as_str())) {
            let key = format!("{section}.{name}");
            if document.has(&key) {
                let title = format!("`{key}` is given, but the contact law of the case reads no `{name}`");
                let mut remedy = format!("remove it; read are {}", read.join(", "));
                for (parameter, law) in READERS.into_iter().filter(|(parameter, _)| parameter == name) {
                    let _ = write!(remedy, ", and `{parameter}` with {law}");
                }
                return Err(document.error(&key, &title, "has no effect", &remedy));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Source;

    const TEXT: &str = "domain.size = [1, 1, 1]\ndry.time_step = 1e-6\nrun.end.steps = 1\n\
                        particles = [{ shape.sphere.diameter = 0.1, density = 1, count = 1 }]\n\
                        contact.youngs_modulus = 1e6\n\
                        [[materials]]\nname = \"cork\"\npoisson_ratio = 0.0\n\
                        [[contact.pairs]]\nmaterials = [\"cork\", \"cork\"]\nrestitution = 0.1\n";

    #[test]
    fn a_parameter_that_no_law_reads_is_refused_wherever_it_stands() {
        let source = Source::new("case.toml".to_string(), TEXT.to_string(), &[]);
        let document = Document::parse(&source).unwrap_or_else(|e| panic!("{e}"));
        let model = Materials::new(&document).unwrap().contact(&document, 0.0).unwrap();
        let all = model.parameters();
        assert!(refuse_unread(&document, &model, &all).is_ok());
        for (name, key, line) in [
            ("youngs_modulus", "`contact.youngs_modulus`", "case.toml:5:26"),
            ("poisson_ratio", "`materials.0.poisson_ratio`", "case.toml:8:17"),
            ("restitution", "`contact.pairs.0.restitution`", "case.toml:11:15"),
        ] {
            let read: Vec<&str> = all.iter().copied().filter(|read| *read != name).collect();
            let refused = refuse_unread(&document, &model, &read).unwrap_err().to_string();
            assert!(
                refused.contains(key) && refused.contains(line) && refused.contains("remove it"),
                "{refused}"
            );
        }
    }
}
