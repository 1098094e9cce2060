//! Materials by name, and the contact model.

use super::file::{Case, GeometryKind};
use super::located::Located;
use super::source::{Source, nearest};
use crate::contact::{ContactModel, Geometry, Material, PairParams};
use crate::error::Result;
use std::ops::Range;

/// Name of the material of `[contact]`.
const DEFAULT: &str = "default";

/// Elasticity by name.
#[derive(Debug)]
pub(super) struct Materials {
    names: Vec<String>,
    elasticity: Vec<Material>,
}

/// The law has no place for a kinetic coefficient above the static one; a static one of 0 is smooth altogether.
fn friction_order(source: &Source, key: &str, span: &Range<usize>, pair: &PairParams) -> Result<()> {
    let (kinetic, most) = (pair.friction_kinetic, pair.friction_static);
    if most > 0.0 && kinetic > most {
        let key = format!("{key}.friction_kinetic");
        let wanted = format!("at most the static coefficient, {most}");
        let remedy = "sliding resists less than sticking; a pair takes what it does not give from [contact]";
        return Err(source.out_of_range(&key, span, &kinetic.to_string(), &wanted, remedy));
    }
    Ok(())
}

fn or(given: Option<&Located<f64>>, usual: f64) -> f64 {
    given.map_or(usual, |number| number.value)
}

impl Materials {
    /// That of `[contact]` first, then those listed.
    pub(super) fn new(source: &Source, case: &Case) -> Result<Self> {
        let usual = Material {
            youngs_modulus: case.contact.youngs_modulus.value,
            poisson_ratio: case.contact.poisson_ratio.value,
        };
        let mut all = Self { names: vec![DEFAULT.to_string()], elasticity: vec![usual] };
        for (index, section) in case.materials.iter().enumerate() {
            let (key, section) = (format!("materials.{index}"), &section.value);
            let name = section.name.value.trim();
            if name.is_empty() || all.names.iter().any(|known| known == name) {
                let why = if name == DEFAULT {
                    "the name of the material of [contact]"
                } else {
                    "empty or given twice"
                };
                let title = format!("`{key}.name` is \"{name}\", which is {why}");
                let remedy = "every material needs a name of its own";
                return Err(source.error(&section.name.span, &title, "not a new name", remedy));
            }
            all.elasticity.push(Material {
                youngs_modulus: or(section.youngs_modulus.as_ref(), usual.youngs_modulus),
                poisson_ratio: or(section.poisson_ratio.as_ref(), usual.poisson_ratio),
            });
            all.names.push(name.to_string());
        }
        Ok(all)
    }

    /// Index of a material by its name; without one that of `[contact]`.
    pub(super) fn index(&self, source: &Source, key: &str, name: Option<&Located<String>>) -> Result<usize> {
        let Some(name) = name else {
            return Ok(0);
        };
        if let Some(index) = self.names.iter().position(|known| *known == name.value) {
            return Ok(index);
        }
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let known = names.join(", ");
        let remedy = match nearest(&name.value, &names) {
            Some(near) => format!("did you mean \"{near}\"? materials here: {known}"),
            None => format!("materials here: {known}; add a section [[materials]]"),
        };
        let title = format!("`{key}` is \"{}\", but there is no such material", name.value);
        Err(source.error(&name.span, &title, "unknown material", &remedy))
    }

    /// The contact model in SI units, if contacts are on; surfaces are grown by `enlargement` (m).
    pub(super) fn contact(
        &self,
        source: &Source,
        case: &Case,
        enlargement: f64,
    ) -> Result<Option<ContactModel>> {
        let contact = &case.contact;
        let samples = &contact.samples;
        source.whole("contact.samples", samples, 2..=64, "from 2 to 64", "8 is usual")?;
        let usual = PairParams {
            restitution: contact.restitution.value,
            friction_static: contact.friction_static.value,
            friction_kinetic: contact.friction_kinetic.value,
            transition_velocity: contact.transition_velocity.value,
        };
        friction_order(source, "contact", &contact.friction_kinetic.span, &usual)?;
        let n = self.names.len();
        let mut pairs = vec![usual; n * n];
        let mut given: Vec<(usize, usize)> = Vec::new();
        for (index, section) in contact.pairs.iter().enumerate() {
            let key = format!("contact.pairs.{index}");
            let [first, second] = &section.value.materials;
            let name = format!("{key}.materials");
            let a = self.index(source, &name, Some(first))?;
            let b = self.index(source, &name, Some(second))?;
            let both = (a.min(b), a.max(b));
            if let Some(earlier) = given.iter().position(|pair| *pair == both) {
                let places = [(&contact.pairs[earlier].span, "given here"), (&section.span, "and here")];
                let title =
                    format!("the pair of \"{}\" and \"{}\" is given twice", first.value, second.value);
                return Err(source.error_at(&places, &title, "remove one of them"));
            }
            given.push(both);
            let pair = &section.value;
            let kinetic = pair.friction_kinetic.as_ref();
            let special = PairParams {
                restitution: or(pair.restitution.as_ref(), usual.restitution),
                friction_static: or(pair.friction_static.as_ref(), usual.friction_static),
                friction_kinetic: or(kinetic, usual.friction_kinetic),
                transition_velocity: or(pair.transition_velocity.as_ref(), usual.transition_velocity),
            };
            let span = kinetic.map_or(&section.span, |n| &n.span);
            friction_order(source, &key, span, &special)?;
            pairs[a * n + b] = special;
            pairs[b * n + a] = special;
        }
        Ok(contact.enabled.then(|| ContactModel {
            materials: self.elasticity.clone(),
            pairs,
            enlargement,
            geometry: match contact.geometry.value {
                GeometryKind::Exact => Geometry::Exact,
                GeometryKind::Sampled => Geometry::Sampled { samples: samples.value },
            },
            law: contact.law.value,
            damping: contact.damping,
        }))
    }

    /// The stiffest of all: its `E / (1 - nu^2)` is largest.
    pub(super) fn stiffest(&self) -> &Material {
        let stiffness = |m: &Material| m.youngs_modulus / (1.0 - m.poisson_ratio * m.poisson_ratio);
        self.elasticity
            .iter()
            .max_by(|a, b| stiffness(a).total_cmp(&stiffness(b)))
            .expect("there is always that of [contact]")
    }
}
