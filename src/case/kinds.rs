//! Kinds of particles: their shapes, sizes and materials.

use super::checks::Document;
use super::file::{Axis, CompositeSection, LengthUnit, MeshSection, PartSection, ShapeSection};
use super::files::Files;
use super::listed::Listed;
use super::materials::Materials;
use super::sizes::sizes;
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::mesh::{
    self,
    decompose::{ALLOWED, EXCESS},
};
use crate::particle::Template;
use crate::shape::{
    Capsule, Composite, Cuboid, Cylinder, Ellipsoid, Part, Placement, Polyhedron, Shape, ShapeError, Sphere,
    Superellipsoid, Through, polyhedron,
};
use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

/// Most sizes of all sections: each has its shape, its constants of contacts and its surface for pictures.
const MOST_SIZES: usize = 10_000;
/// Most faces of the polyhedra of all sizes together, some 400 bytes each.
const MOST_FACES: usize = 500_000;

/// One `[[particles]]` section.
#[derive(Clone, Debug)]
pub(super) struct Kind {
    /// Its first template; the others follow.
    pub(super) first: usize,
    /// Fraction of its particles that each of its templates has (-).
    pub(super) fractions: Vec<f64>,
    /// From the body frame to the axes in which the case gives the shape.
    pub(super) rotation: Quat,
    /// Diameters of the spheres of equal volume (m), ascending, and their templates.
    by_diameter: Vec<(f64, usize)>,
}

impl Kind {
    /// Its templates.
    pub(super) fn templates(&self) -> Range<usize> {
        self.first..self.first + self.fractions.len()
    }

    /// The diameter (m) that is nearest to one, and its template.
    pub(super) fn nearest(&self, diameter: f64) -> (f64, usize) {
        let above = self.by_diameter.partition_point(|(known, _)| *known < diameter);
        let near = &self.by_diameter[above.saturating_sub(1)..(above + 1).min(self.by_diameter.len())];
        let off = |known: &(f64, usize)| (known.0 - diameter).abs();
        *near.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("every kind has a size")
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
    /// The contents of the file of each section that names one.
    pub(super) listed: Vec<Option<Listed>>,
    /// Factors on the shape of each section that has the sizes of its file.
    pub(super) scales: Vec<Option<Vec<f64>>>,
    /// Notes on the meshes and positions files, ready to print.
    pub(super) notes: Vec<String>,
}

impl Kinds {
    /// Builds all kinds; positions files are not read if their `scales` are known from elsewhere.
    pub(super) fn new(
        document: &Document,
        materials: &Materials,
        (files, elsewhere): (&Files, Option<&[Option<Vec<f64>>]>),
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        if document.case.particles.is_empty() {
            let remedy = "the diameter of the first kind is the reference length, and `count = 0` runs the fluid alone";
            return Err(document.error("particles", "the case has no `particles`", "", remedy));
        }
        let mut all = Self {
            sections: Vec::new(),
            templates: Vec::new(),
            diameter: 0.0,
            listed: Vec::new(),
            scales: Vec::new(),
            notes: Vec::new(),
        };
        let mut faces = 0;
        for (index, section) in document.case.particles.iter().enumerate() {
            let key = format!("particles.{index}");
            let shape_key = format!("{key}.shape.{}", document.choice(&format!("{key}.shape")));
            let notes = RefCell::default();
            let shapes = Shapes { document, shape: &section.shape, key: shape_key, files, notes };
            let scale = shapes.scale()?;
            let (shape, mut rotation) = shapes.build(scale)?;
            if index == 0 {
                all.diameter = shape.equivalent_diameter();
            }
            let material =
                materials.index(document, &format!("{key}.material"), section.material.as_ref())?;
            if section.file().is_none() && !section.columns.is_empty() {
                let key = format!("{key}.columns");
                let title = format!("`{key}` belongs to a `file` of positions, but there is none");
                return Err(document.error(&key, &title, "has no effect here", "remove it"));
            }
            let file = section.file().filter(|_| elsewhere.is_none());
            let listed = file.map(|file| Listed::read(document, files, index, file, &mut all.notes));
            let listed = listed.transpose()?;
            let own = shape.equivalent_diameter();
            let free = listed.as_ref().filter(|_| section.sizes.is_none());
            let scales = free.map(|listed| {
                listed.scales(own).map_err(|title| {
                    let remedy = "lengths are in m; a unit may stand in the header, as in `diameter [mm]`, or in `columns`";
                    document.error(&format!("{key}.file"), &title, "this file", remedy)
                })
            });
            let scales = match elsewhere {
                Some(scales) => scales.get(index).cloned().flatten(),
                None => scales.transpose()?,
            };
            let sizes = match &scales {
                Some(scales) => scales.iter().map(|scale| (*scale, 1.0)).collect(),
                None => sizes(document, &format!("{key}.sizes"), section, own, warnings)?,
            };
            let total: f64 = sizes.iter().map(|(_, share)| share).sum();
            if !total.is_finite() {
                let title = format!("the shares of `{key}.sizes` are too large to be added up");
                let remedy = "shares need not add up to 1, but 1 is a good size";
                return Err(document.error(&key, &title, "of these", remedy));
            }
            faces += faces_of(&*shape).saturating_mul(sizes.len());
            if all.templates.len() + sizes.len() > MOST_SIZES || (sizes.len() > 1 && faces > MOST_FACES) {
                let count = all.templates.len() + sizes.len();
                let title = format!(
                    "there are {count} sizes with {faces} faces, at most {MOST_SIZES} with {MOST_FACES} faces are kept"
                );
                let remedy = "write diameters with fewer digits, so that more particles share one, or take a coarser mesh";
                let last = if scales.is_some() { "file" } else { "sizes" };
                return Err(document.error(&format!("{key}.{last}"), &title, "too many", remedy));
            }
            if let (Some(listed), [(first, _), .., (last, _)]) = (free, &sizes[..]) {
                let title = format!(
                    "{}: the shape is scaled to {} diameters from {:.4e} to {:.4e} m",
                    listed.name,
                    sizes.len(),
                    first * own,
                    last * own
                );
                all.notes.push(document.warning(&format!("{key}.file"), &title, "this file", ""));
            }
            let first = all.templates.len();
            let of_facets = matches!(section.shape, ShapeSection::Mesh(_) | ShapeSection::Polyhedron { .. });
            for &(size, _) in &sizes {
                let body = shape.as_polyhedron().filter(|_| scales.is_some() && of_facets);
                let shape = match body {
                    _ if size.to_bits() == 1.0_f64.to_bits() => shape.clone(),
                    Some(body) => Arc::new(body.scaled(size)),
                    None => shapes.build(scale * size)?.0,
                };
                let shape = match section.through {
                    None => shape,
                    Some(axis) => through(document, &key, shape, (axis, &rotation))?,
                };
                all.templates.push(Template { shape, density: section.density, material });
            }
            if let Some(axis) = section.through {
                rotation = laid_along(axis) * rotation;
            }
            let templates = all.templates[first..].iter().zip(first..);
            let mut by_diameter: Vec<(f64, usize)> =
                templates.map(|(template, n)| (template.shape.equivalent_diameter(), n)).collect();
            by_diameter.sort_by(|a, b| a.0.total_cmp(&b.0));
            let fractions = sizes.iter().map(|(_, share)| share / total).collect();
            all.sections.push(Kind { first, fractions, rotation, by_diameter });
            all.listed.push(listed);
            all.scales.push(scales);
            all.notes.append(&mut shapes.notes.into_inner());
        }
        Ok(all)
    }

    /// A property of the section of each template.
    pub(super) fn of_each<T: Clone>(&self, property: impl Fn(usize, &Kind) -> T) -> Vec<T> {
        let sections = self.sections.iter().enumerate();
        sections.flat_map(|(n, kind)| std::iter::repeat_n(property(n, kind), kind.fractions.len())).collect()
    }
}

/// Flat faces of a shape or its parts.
fn faces_of(shape: &dyn Shape) -> usize {
    let own = shape.as_polyhedron().map_or(0, |body| body.faces.len());
    own + shape.parts().iter().map(|part| faces_of(&*part.shape)).sum::<usize>()
}

/// The rotation that lays the z axis along an axis of the box.
fn laid_along(axis: Axis) -> Quat {
    let turn = |w: f64, s: f64| Quat::new_unchecked(Quaternion::new(w, s, s, s));
    match axis {
        Axis::X => turn(0.5, 0.5),
        Axis::Y => turn(0.5, -0.5),
        Axis::Z => Quat::identity(),
    }
}

/// A shape that goes through the box along an axis, on which its z axis is laid; `rotation` leads to the axes in which it is given.
fn through(
    document: &Document,
    key: &str,
    shape: Arc<dyn Shape>,
    (axis, rotation): (Axis, &Quat),
) -> Result<Arc<dyn Shape>> {
    let kind = shape.kind();
    let own = Through::new(shape, axis as usize, rotation.inverse_transform_vector(&Vec3::z()));
    own.map(|own| Arc::new(own) as _).ok_or_else(|| {
        let key = format!("{key}.through");
        let title = format!("`{key}` is given, but the {kind} is no cylinder or prism along its z axis");
        let remedy =
            "bodies that go through the box are cylinders, cuboids, and polyhedra with side faces along z";
        document.error(&key, &title, "not this shape", remedy)
    })
}

/// The pose of a shape that is given in its own frame.
fn as_given() -> Placement {
    Placement { centre: Vec3::zeros(), rotation: Quat::identity() }
}

/// Builds the shapes of one section.
struct Shapes<'a> {
    document: &'a Document<'a>,
    shape: &'a ShapeSection,
    /// `particles.0.shape.sphere`.
    key: String,
    files: &'a Files<'a>,
    /// Notes on its mesh.
    notes: RefCell<Vec<String>>,
}

impl Shapes<'_> {
    /// Factor by which proportions become lengths.
    fn scale(&self) -> Result<f64> {
        let wanted = self.document.number(&format!("{}.equivalent_diameter", self.key));
        wanted.map_or(Ok(1.0), |wanted| Ok(wanted / self.build(1.0)?.0.equivalent_diameter()))
    }

    /// The shape with all lengths multiplied by `scale`, and the rotation from the body frame to the axes of the case.
    fn build(&self, scale: f64) -> Result<(Arc<dyn Shape>, Quat)> {
        self.placed(scale).map(|(shape, placement)| (shape, placement.rotation))
    }

    /// The same, with its pose in the frame in which the case gives it.
    fn placed(&self, scale: f64) -> Result<(Arc<dyn Shape>, Placement)> {
        match self.shape {
            ShapeSection::Sphere { diameter } => self.upright(Ok(Sphere { radius: 0.5 * scale * diameter })),
            ShapeSection::Cuboid { edges, .. } => self.upright(Cuboid::new(scale * Vec3::from(*edges))),
            ShapeSection::Cube(cube) => {
                self.upright(Cuboid::new(Vec3::repeat(scale * cube.edge.unwrap_or(1.0))))
            }
            ShapeSection::Ellipsoid { axes, .. } => {
                self.upright(Ellipsoid::new(0.5 * scale * Vec3::from(*axes)))
            }
            ShapeSection::Cylinder(cylinder) => {
                self.upright(Cylinder::new(0.5 * scale * cylinder.diameter, scale * cylinder.length))
            }
            ShapeSection::Capsule(capsule) => {
                let (diameter, length) = (capsule.diameter, capsule.length);
                if length <= diameter {
                    let wanted = format!("more than its diameter, {diameter}");
                    let remedy = "`length` is that from tip to tip; for equal ones take a sphere";
                    let key = format!("{}.length", self.key);
                    return Err(self.document.out_of_range(&key, length, &wanted, remedy));
                }
                self.upright(Capsule::new(0.5 * scale * diameter, scale * (length - diameter)))
            }
            ShapeSection::Superellipsoid { axes, exponents, .. } => {
                self.upright(Superellipsoid::new(0.5 * scale * Vec3::from(*axes), *exponents))
            }
            ShapeSection::Polyhedron { vertices, hull, .. } => {
                let given: Vec<Vec3> = vertices.iter().map(|&vertex| Vec3::from(vertex)).collect();
                let tolerance = polyhedron::COMPUTED.max(mesh::decimal_precision(&given));
                let points: Vec<Vec3> = given.iter().map(|vertex| scale * vertex).collect();
                let build = if *hull { Polyhedron::hull } else { Polyhedron::from_corners };
                let built = build(&points, tolerance);
                let (shape, placement) = built.map_err(|e| self.bad(".vertices", &e))?;
                Ok((Arc::new(shape), placement))
            }
            ShapeSection::Mesh(mesh) => self.mesh(mesh, scale),
            ShapeSection::Composite(section) => self.composite(section, scale),
        }
    }

    fn composite(&self, section: &CompositeSection, scale: f64) -> Result<(Arc<dyn Shape>, Placement)> {
        let document = self.document;
        if section.parts.is_empty() {
            let key = format!("{}.parts", self.key);
            let title = format!("`{key}` is empty");
            return Err(document.error(&key, &title, "no part", "a body has one part or more"));
        }
        let part = |(n, part): (usize, &PartSection)| {
            let key = format!("{}.parts.{n}", self.key);
            let shape_key = format!("{key}.shape.{}", document.choice(&format!("{key}.shape")));
            let shapes = Shapes { shape: &part.shape, key: shape_key, notes: RefCell::default(), ..*self };
            let (shape, placement) = shapes.placed(scale * shapes.scale()?)?;
            let given = part.orientation.as_ref();
            let turn = given.map(|given| document.orientation(&format!("{key}.orientation"), given));
            let turn = turn.transpose()?.unwrap_or_default();
            let position = scale * Vec3::from(part.position) + turn * placement.centre;
            Ok((Part { shape, position, orientation: turn * placement.rotation }, shapes.notes.into_inner()))
        };
        let built = section.parts.iter().enumerate().map(part).collect::<Result<Vec<_>>>()?;
        let (parts, notes): (Vec<Part>, Vec<Vec<String>>) = built.into_iter().unzip();
        *self.notes.borrow_mut() = notes.concat();
        let (shape, placement) = Composite::new(parts).map_err(|e| self.bad(".parts", &e))?;
        Ok((Arc::new(shape), placement))
    }

    fn mesh(&self, section: &MeshSection, scale: f64) -> Result<(Arc<dyn Shape>, Placement)> {
        let unit = section.unit.map_or(1.0, LengthUnit::metres);
        let (factor, path) = (scale * unit * section.scale, self.files.path(&section.file));
        let bad = |e: ShapeError| self.bad(".file", &e);
        if let Some(shape) = self.files.shape(&section.file) {
            // A body of the caller's own has one size.
            let problem = format!("a shape of its own cannot be scaled, here by {factor}");
            let refused = || bad(ShapeError::Mesh { path, problem });
            return ((factor - 1.0).abs() < 1e-12).then(|| (shape, as_given())).ok_or_else(refused);
        }
        if section.concave.is_some() || section.excess.is_some() {
            return self.decomposed(section, factor);
        }
        let meshes = (self.files.mesh(&section.file))
            .and_then(|bytes| {
                if section.parts {
                    mesh::parts(&path, &bytes, factor, section.hull)
                } else {
                    mesh::parse(&path, &bytes, factor, section.hull).map(|mesh| vec![mesh])
                }
            })
            .map_err(bad)?;
        self.note(section, meshes.iter().flat_map(|mesh| &mesh.notes));
        mesh::united(meshes.into_iter().map(|mesh| (mesh.body, mesh.placement)).collect()).map_err(bad)
    }

    /// The body in a file, cut into convex parts.
    fn decomposed(&self, section: &MeshSection, factor: f64) -> Result<(Arc<dyn Shape>, Placement)> {
        let (document, key) = (self.document, format!("{}.excess", self.key));
        if section.concave.is_none() {
            return Err(document.error(
                &key,
                &format!("`{key}` belongs to `concave`, but there is none"),
                "has no effect here",
                "remove it, or set `concave = \"decompose\"`",
            ));
        }
        for (is_set, name) in [(section.hull, "hull"), (section.parts, "parts")] {
            if is_set {
                let (title, other) =
                    (format!("`{}` has `concave` and `{name}`", self.key), format!("{}.{name}", self.key));
                return Err(document.error(
                    &other,
                    &title,
                    "not both",
                    "a body is cut into parts, or is the union of solids that are, or its own hull",
                ));
            }
        }
        let excess = section.excess.unwrap_or(EXCESS);
        if !ALLOWED.contains(&excess) {
            let wanted = format!("{:e} to {}", ALLOWED.start(), ALLOWED.end());
            return Err(document.out_of_range(
                &key,
                excess,
                &wanted,
                "it is a part of the volume of the body: 0.01 is one percent",
            ));
        }
        let found = self.files.decomposed(&section.file, excess).map_err(|e| self.bad(".file", &e))?;
        self.note(section, &found.notes());
        found.body(factor).map_err(|e| self.bad(".file", &e))
    }

    /// Keeps notes on a mesh, of any size the same.
    fn note<'n>(&self, section: &MeshSection, notes: impl IntoIterator<Item = &'n String>) {
        let warning = |note: &String| {
            let title = format!("{}: {note}", self.files.path(&section.file).display());
            self.document.warning(&format!("{}.file", self.key), &title, "this mesh", "")
        };
        *self.notes.borrow_mut() = notes.into_iter().map(warning).collect();
    }

    fn upright<S: Shape + 'static>(
        &self,
        shape: std::result::Result<S, ShapeError>,
    ) -> Result<(Arc<dyn Shape>, Placement)> {
        shape.map(|shape| (Arc::new(shape) as _, as_given())).map_err(|e| self.bad("", &e))
    }

    /// The error of a shape, at one of its keys (`.file`) or all of it.
    fn bad(&self, key: &str, error: &ShapeError) -> Error {
        let title = format!("`{}`: {error}", self.key);
        self.document.error(&format!("{}{key}", self.key), &title, "no body can be made of this", "")
    }
}
