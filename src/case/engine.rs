//! Which engine moves the particles, and whether it can: LIGGGHTS knows spheres, one law of contact and few walls.
//!
//! The limits are those of LIGGGHTS 3.8.0: it ends with an error where a material or a restitution lies outside of them, and
//! takes other walls for what they are not.

use super::file::{Case, EngineKind, GeometryKind, ShapeSection};
use super::located::Located;
use super::source::Source;
use super::walls::PlacedWall;
use crate::contact::ElasticLaw;
use crate::engine::{EngineChoice, LiggghtsOptions, commands};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::wall::Surface;

/// LIGGGHTS takes coefficients of restitution above this one.
const LEAST_RESTITUTION: f64 = 0.05;

/// Most that the components of a direction across an axis may be, over its length.
const ALIGNED: f64 = 1e-9;

/// The engine that the case asks for, if its sections ask for nothing that the engine lacks.
pub(super) fn engine(source: &Source, case: &Case) -> Result<EngineChoice> {
    let (asked, section) = (&case.dem.engine, &case.dem.liggghts);
    if asked.value == EngineKind::Native {
        let Some(section) = section else {
            return Ok(EngineChoice::Native);
        };
        let title = "[dem.liggghts] is given, but `dem.engine` is \"native\"";
        let places = [(&section.span, "has no effect here"), (&asked.span, "the engine")];
        let remedy = "set engine = \"liggghts\" in [dem], or remove the section";
        return Err(source.error_at(&places, title, remedy));
    }
    let check = Check { source, case };
    check.shapes()?;
    if case.contact.enabled {
        check.law()?;
        check.materials()?;
        check.restitution()?;
    }
    let mut options = LiggghtsOptions::default();
    if let Some(Located { value: section, .. }) = section {
        options.process = section.process;
        for (index, Located { span, value }) in section.commands.iter().enumerate() {
            options.commands.push(commands::accept(value).map_err(|refusal| {
                let title = format!("`dem.liggghts.commands.{index}` {}", refusal.title);
                source.error(span, &title, &refusal.label, &refusal.remedy)
            })?);
        }
        options.timeout = section.timeout.as_ref().map(|timeout| timeout.value);
    }
    Ok(EngineChoice::Liggghts(options))
}

/// Refuses walls that the engine does not have; without contacts there are none for it.
pub(super) fn refuse_walls(
    source: &Source,
    case: &Case,
    engine: &EngineChoice,
    walls: &[PlacedWall],
) -> Result<()> {
    if *engine == EngineChoice::Native || !case.contact.enabled {
        return Ok(());
    }
    for PlacedWall { wall, span, .. } in walls {
        let velocity = wall.motion.velocity;
        let still = velocity == Vec3::zeros();
        let moves_along = |normal: &Vec3| velocity.dot(normal).abs() > ALIGNED * velocity.norm();
        let what = match &wall.surface {
            _ if wall.motion.angular_velocity != Vec3::zeros() => "turns",
            Surface::Plane { normal, .. } if lies_askew(normal) => "is a plane across none of x, y, z",
            Surface::Plane { normal, .. } if moves_along(normal) => "moves along its normal",
            Surface::Plane { .. } if lies_askew(&velocity) => "slides along none of x, y, z",
            Surface::Cylinder { axis, .. } if lies_askew(axis) => {
                "is a cylinder with its axis along none of x, y, z"
            }
            Surface::Cylinder { .. } if !still => "is a cylinder that moves",
            _ => continue,
        };
        let title = format!("the wall \"{}\" {what}, which no wall of LIGGGHTS can", wall.name);
        let remedy = "LIGGGHTS has planes across x, y or z, at rest or sliding along one axis, and circular cylinders \
                      along x, y or z at rest; with other walls take dem.engine = \"native\"";
        return Err(source.error(span, &title, "this wall", remedy));
    }
    Ok(())
}

/// Whether a vector lies along none of the axes.
fn lies_askew(vector: &Vec3) -> bool {
    vector.iter().filter(|x| x.abs() > ALIGNED * vector.norm()).count() > 1
}

/// What LIGGGHTS has no place for, section by section.
struct Check<'a> {
    source: &'a Source,
    case: &'a Case,
}

impl Check<'_> {
    fn shapes(&self) -> Result<()> {
        for (index, section) in self.case.particles.iter().enumerate() {
            let shape = &section.value.shape;
            if matches!(shape.value, ShapeSection::Sphere(_)) {
                continue;
            }
            let name = shape.value.name();
            let title = format!(
                "`particles.{index}.shape` is \"{name}\", but LIGGGHTS, `dem.engine`, knows spheres only"
            );
            let places = [(&shape.span, "not a sphere"), (&self.case.dem.engine.span, "the engine")];
            let remedy =
                "take dem.engine = \"native\" for other shapes; Debian's LIGGGHTS is built without them";
            return Err(self.source.error_at(&places, &title, remedy));
        }
        Ok(())
    }

    fn law(&self) -> Result<()> {
        let contact = &self.case.contact;
        let (key, value, given) = if contact.law.value == ElasticLaw::OverlapEnergy {
            ("law", "overlap_energy", &contact.law.span)
        } else if contact.geometry.value == GeometryKind::Sampled {
            ("geometry", "sampled", &contact.geometry.span)
        } else {
            return Ok(());
        };
        let title = format!("`contact.{key}` is \"{value}\", which LIGGGHTS, `dem.engine`, does not have");
        let remedy = "LIGGGHTS has a law of its own, Hertz's with a dashpot; remove the key: \"exact\" with \"hertz\" is the same \
                      elastic force, \"paper\" differs by the lens ratio, 1 - d/(12 R) for equal spheres";
        let places = [(given, "not in LIGGGHTS"), (&self.case.dem.engine.span, "the engine")];
        Err(self.source.error_at(&places, &title, remedy))
    }

    fn materials(&self) -> Result<()> {
        let contact = [("contact".to_string(), Some(&self.case.contact.poisson_ratio))];
        let listed = self.case.materials.iter().enumerate();
        let listed = listed
            .map(|(index, section)| (format!("materials.{index}"), section.value.poisson_ratio.as_ref()));
        for (section, ratio) in contact.into_iter().chain(listed) {
            if let Some(ratio) = ratio.filter(|ratio| ratio.value < 0.0) {
                let key = format!("{section}.poisson_ratio");
                return Err(self.beyond(&key, ratio, "from 0 to 0.5 for LIGGGHTS"));
            }
        }
        Ok(())
    }

    fn restitution(&self) -> Result<()> {
        let contact = &self.case.contact;
        let usual = [("contact".to_string(), Some(&contact.restitution))];
        let pairs = contact.pairs.iter().enumerate();
        let pairs =
            pairs.map(|(index, pair)| (format!("contact.pairs.{index}"), pair.value.restitution.as_ref()));
        for (section, restitution) in usual.into_iter().chain(pairs) {
            if let Some(number) = restitution.filter(|number| number.value <= LEAST_RESTITUTION) {
                let wanted = format!("above {LEAST_RESTITUTION} and at most 1 for LIGGGHTS");
                return Err(self.beyond(&format!("{section}.restitution"), number, &wanted));
            }
        }
        Ok(())
    }

    fn beyond(&self, key: &str, number: &Located<f64>, wanted: &str) -> Error {
        let remedy = "LIGGGHTS is told all materials and pairs, also those that touch nothing; dem.engine = \"native\" takes \
                      this value";
        self.source.out_of_range(key, &number.span, &number.value.to_string(), wanted, remedy)
    }
}
