//! Kinds of particles: their shapes, sizes and materials.

use super::checks::{Alternative, at};
use super::file::{Case, MeshSection, ParticleSection, ShapeSection};
use super::files::Files;
use super::forms::{LengthUnit, Sizes, Triple};
use super::located::Located;
use super::materials::Materials;
use super::source::Source;
use crate::error::{Error, Result};
use crate::input;
use crate::math::{Quat, Vec3};
use crate::mesh;
use crate::particle::Template;
use crate::shape::{
    Capsule, Cuboid, Cylinder, Ellipsoid, Polyhedron, Shape, ShapeError, Sphere, Superellipsoid, polyhedron,
};
use std::ops::Range;
use std::sync::Arc;

/// Units of length, and how many metres they are.
const UNITS: [(&str, f64); 5] = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("in", 0.0254)];

/// Most sizes of one kind.
const MAX_SIZES: u32 = 1000;

/// One `[[particles]]` section.
#[derive(Clone, Debug)]
pub(super) struct Kind {
    /// Its first template; the others follow.
    pub(super) first: usize,
    /// Share of the number of particles that each of its templates has (-); they add up to 1.
    pub(super) shares: Vec<f64>,
    /// From the body frame to the axes in which the case gives the shape.
    pub(super) rotation: Quat,
}

impl Kind {
    /// Its templates.
    pub(super) fn templates(&self) -> Range<usize> {
        self.first..self.first + self.shares.len()
    }

    /// Orientation of the body, from that of the shape as the case gives it.
    pub(super) fn turned(&self, given: &Quat) -> Quat {
        // Without the product a shape that is given along its own axes keeps every bit.
        if self.rotation == Quat::identity() { *given } else { given * self.rotation }
    }
}

/// All kinds and templates of a case.
#[derive(Debug)]
pub(super) struct Kinds {
    /// One for each section.
    pub(super) sections: Vec<Kind>,
    /// Those of the first section, then those of the second, ...
    pub(super) templates: Vec<Template>,
    /// Diameter of the sphere of the volume of the first shape as written (m).
    pub(super) diameter: f64,
}

impl Kinds {
    /// The section of each template.
    pub(super) fn section_of_each(&self) -> Vec<usize> {
        let of = |(section, kind): (usize, &Kind)| std::iter::repeat_n(section, kind.shares.len());
        self.sections.iter().enumerate().flat_map(of).collect()
    }

    /// [`Kind::rotation`] of each template.
    pub(super) fn frames(&self) -> Vec<Quat> {
        let of = |kind: &Kind| std::iter::repeat_n(kind.rotation, kind.shares.len());
        self.sections.iter().flat_map(of).collect()
    }
}

/// A shape as the case writes it.
struct Written {
    shape: Arc<dyn Shape>,
    rotation: Quat,
}

impl Written {
    fn upright(shape: impl Shape + 'static) -> Self {
        Self::shared(Arc::new(shape))
    }

    fn shared(shape: Arc<dyn Shape>) -> Self {
        Self { shape, rotation: Quat::identity() }
    }
}

/// Builds all kinds.
pub(super) fn kinds(source: &Source, case: &Case, materials: &Materials, files: &Files) -> Result<Kinds> {
    if case.particles.is_empty() {
        let what = "the case has no [[particles]]".to_string();
        let remedy =
            "the diameter of the first kind is the reference length, and `count = 0` runs the fluid alone";
        return Err(Error::Case {
            key: "particles".to_string(),
            text: format!("{}: {what}; {remedy}", source.path),
            what,
            remedy: remedy.to_string(),
        });
    }
    let mut all = Kinds { sections: Vec::new(), templates: Vec::new(), diameter: 0.0 };
    for (index, section) in case.particles.iter().enumerate() {
        let kind = &section.value;
        let key = format!("particles.{index}");
        let builder = Builder { source, key: &key, section: kind, files };
        let scale = builder.scale()?;
        let written = builder.build(scale)?;
        if index == 0 {
            all.diameter = written.shape.equivalent_diameter();
        }
        let material = materials.index(source, &format!("{key}.material"), kind.material.as_ref())?;
        let sizes = builder.sizes()?;
        let total: f64 = sizes.iter().map(|(_, share)| share).sum();
        if !total.is_finite() {
            return Err(source.error(
                &section.span,
                &format!("the shares of `{key}.sizes` are too large to be added up"),
                "of these",
                "shares need not add up to 1, but 1 is a good size",
            ));
        }
        all.sections.push(Kind {
            first: all.templates.len(),
            shares: sizes.iter().map(|(_, share)| share / total).collect(),
            rotation: written.rotation,
        });
        for (size, _) in sizes {
            all.templates.push(Template {
                shape: builder.build(scale * size)?.shape,
                density: kind.density.value,
                material,
            });
        }
    }
    Ok(all)
}

fn vector(numbers: &Triple) -> Vec3 {
    numbers.each_ref().map(|number| number.value).into()
}

/// Builds the shapes of one section.
struct Builder<'a> {
    source: &'a Source,
    key: &'a str,
    section: &'a ParticleSection,
    files: &'a Files<'a>,
}

impl Builder<'_> {
    fn equivalent_diameter(&self) -> Option<&Located<f64>> {
        match &self.section.shape.value {
            ShapeSection::Sphere(_) => None,
            ShapeSection::Cuboid(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Cube(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Ellipsoid(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Cylinder(s) | ShapeSection::Capsule(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Superellipsoid(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Polyhedron(s) => s.equivalent_diameter.as_ref(),
            ShapeSection::Mesh(s) => s.equivalent_diameter.as_ref(),
        }
    }

    /// Factor on all lengths that gives the shape the volume asked for (-).
    fn scale(&self) -> Result<f64> {
        if let ShapeSection::Cube(cube) = &self.section.shape.value {
            let choices: [(_, &dyn Alternative); 2] =
                [("edge", &cube.edge), ("equivalent_diameter", &cube.equivalent_diameter)];
            self.source.exactly_one(&self.shape_key(), &self.section.shape.span, &choices)?;
        }
        let Some(wanted) = self.equivalent_diameter() else {
            return Ok(1.0);
        };
        Ok(wanted.value / self.build(1.0)?.shape.equivalent_diameter())
    }

    /// The shape with all lengths multiplied by `scale`.
    fn build(&self, scale: f64) -> Result<Written> {
        match &self.section.shape.value {
            ShapeSection::Sphere(sphere) => {
                Ok(Written::upright(Sphere { radius: 0.5 * scale * sphere.diameter.value }))
            }
            ShapeSection::Cuboid(cuboid) => self.made(Cuboid::new(scale * vector(&cuboid.edges))),
            ShapeSection::Cube(cube) => {
                let edge = cube.edge.as_ref().map_or(1.0, |edge| edge.value);
                self.made(Cuboid::new(Vec3::repeat(scale * edge)))
            }
            ShapeSection::Ellipsoid(ellipsoid) => {
                self.made(Ellipsoid::new(0.5 * scale * vector(&ellipsoid.axes)))
            }
            ShapeSection::Cylinder(cylinder) => {
                let (diameter, length) = (cylinder.diameter.value, cylinder.length.value);
                self.made(Cylinder::new(0.5 * scale * diameter, scale * length))
            }
            ShapeSection::Capsule(capsule) => {
                let diameter = capsule.diameter.value;
                let remedy = "`length` is that from tip to tip; for equal ones take a sphere";
                let length = self.source.satisfies(
                    &format!("{}.length", self.shape_key()),
                    &capsule.length,
                    |length| length > diameter,
                    &format!("more than its diameter, {diameter}"),
                    remedy,
                )?;
                self.made(Capsule::new(0.5 * scale * diameter, scale * (length - diameter)))
            }
            ShapeSection::Superellipsoid(superellipsoid) => {
                let axes = vector(&superellipsoid.axes);
                let exponents = superellipsoid.exponents.each_ref().map(|e| e.value);
                self.made(Superellipsoid::new(0.5 * scale * axes, exponents))
            }
            ShapeSection::Polyhedron(given) => {
                let points: Vec<Vec3> =
                    (given.vertices.value.iter()).map(|&vertex| scale * Vec3::from(vertex)).collect();
                let built = if given.hull {
                    Polyhedron::hull(&points, polyhedron::COMPUTED)
                } else {
                    Polyhedron::from_corners(&points, polyhedron::COMPUTED)
                };
                let (shape, placement) = built.map_err(|e| self.bad(&given.vertices.span, &e))?;
                Ok(Written { shape: Arc::new(shape), rotation: placement.rotation })
            }
            ShapeSection::Mesh(mesh) => {
                let name = &mesh.file.value;
                let unit = self.unit(mesh)?;
                let path = self.files.path(name);
                if let Some(shape) = self.files.shape(name) {
                    // A body of the caller's own has one size.
                    let factor = scale * unit * mesh.scale.value;
                    let fixed = (factor - 1.0).abs() < 1e-12;
                    let problem = format!("a shape of its own cannot be scaled, here by {factor}");
                    let refused = || self.bad(&mesh.file.span, &ShapeError::Mesh { path, problem });
                    return fixed.then(|| Written::shared(shape)).ok_or_else(refused);
                }
                let (shape, placement) = (self.files.contents(name, input::MESH))
                    .map_err(|e| format!("cannot be read: {e}"))
                    .map_err(|problem| ShapeError::Mesh { path: path.clone(), problem })
                    .and_then(|bytes| mesh::parse(&path, &bytes, scale * unit * mesh.scale.value, mesh.hull))
                    .map_err(|e| self.bad(&mesh.file.span, &e))?;
                Ok(Written { shape: Arc::new(shape), rotation: placement.rotation })
            }
        }
    }

    /// Metres in the unit of a mesh file.
    fn unit(&self, section: &MeshSection) -> Result<f64> {
        let Some(unit) = &section.unit else {
            return Ok(1.0);
        };
        let key = format!("{}.unit", self.shape_key());
        let known: Vec<&str> = UNITS.iter().map(|(name, _)| *name).collect();
        let remedy = format!("known units: {}; or a number of metres", known.join(", "));
        match &unit.value {
            LengthUnit::Metres(metres) => self.source.positive(&key, &at(&unit.span, *metres), &remedy),
            LengthUnit::Name(name) => {
                let metres = UNITS.iter().find(|(known, _)| known == name);
                metres.map(|(_, metres)| *metres).ok_or_else(|| {
                    let value = format!("\"{name}\"");
                    self.source.out_of_range(&key, &unit.span, &value, "a unit of length", &remedy)
                })
            }
        }
    }

    fn made(&self, shape: std::result::Result<impl Shape + 'static, ShapeError>) -> Result<Written> {
        shape.map(Written::upright).map_err(|e| self.bad(&self.section.shape.span, &e))
    }

    /// What the shape says is wrong with it, at its place in the case.
    fn bad(&self, span: &Range<usize>, error: &ShapeError) -> Error {
        let title = format!("`{}`: {error}", self.shape_key());
        self.source.error(span, &title, "no body can be made of this", "")
    }

    fn shape_key(&self) -> String {
        format!("{}.shape.{}", self.key, self.section.shape.value.name())
    }

    /// Factors on all lengths, and their shares.
    fn sizes(&self) -> Result<Vec<(f64, f64)>> {
        let Some(sizes) = &self.section.sizes else {
            return Ok(vec![(1.0, 1.0)]);
        };
        let source = self.source;
        let key = format!("{}.sizes", self.key);
        let remedy = "scales are factors on the lengths of the shape, e.g. 0.8";
        match &sizes.value {
            Sizes::Shares(list) if list.is_empty() => {
                Err(source.error(&sizes.span, &format!("`{key}` is empty"), "no size", remedy))
            }
            Sizes::Shares(list) => list
                .iter()
                .map(|entry| {
                    let scale = source.positive(&format!("{key}.scale"), &entry.value.scale, remedy)?;
                    let share = source.positive(
                        &format!("{key}.share"),
                        &entry.value.share,
                        "e.g. 0.5 for a half",
                    )?;
                    Ok((scale, share))
                })
                .collect(),
            Sizes::Spread(spread) => {
                let [from, to] = &spread.uniform;
                let key = format!("{key}.uniform");
                let low = source.positive(&key, from, remedy)?;
                let high = source.satisfies(
                    &key,
                    to,
                    |x| x >= low,
                    &format!("a number of at least {low}"),
                    "the smallest factor comes first",
                )?;
                let steps = match &spread.steps {
                    Some(steps) => {
                        let key = format!("{}.sizes.steps", self.key);
                        let wanted = format!("from 1 to {MAX_SIZES}");
                        source.whole(&key, steps, 1..=MAX_SIZES, &wanted, "5 is usual")?
                    }
                    None => 5,
                };
                let middle = |step: u32| low + (high - low) * (f64::from(step) + 0.5) / f64::from(steps);
                Ok((0..steps).map(|step| (middle(step), 1.0)).collect())
            }
        }
    }
}
