//! Shapes as the user writes them.

use crate::case::forms::{LengthUnit, Triple};
use crate::case::located::Located;
use crate::case::schema::positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Geometry of a particle. With `equivalent_diameter` the lengths of a shape are proportions only: the shape is scaled
/// to the volume of a sphere of that diameter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeSection {
    /// A sphere.
    Sphere(SphereSection),
    /// A box.
    Cuboid(CuboidSection),
    /// A cube.
    Cube(CubeSection),
    /// An ellipsoid.
    Ellipsoid(EllipsoidSection),
    /// A circular cylinder along z.
    Cylinder(CylinderSection),
    /// A cylinder along z with half spheres as ends.
    Capsule(CylinderSection),
    /// A superellipsoid.
    Superellipsoid(SuperellipsoidSection),
    /// A convex polyhedron by its vertices.
    Polyhedron(PolyhedronSection),
    /// A convex body from an STL or OBJ file.
    Mesh(MeshSection),
}

/// A sphere.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereSection {
    /// Diameter (m); lengths are in metres.
    #[schemars(transform = positive)]
    pub diameter: Located<f64>,
}

/// A box.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CuboidSection {
    /// Edges along x, y and z, in metres.
    #[schemars(transform = positive)]
    pub edges: Triple,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// A cube: exactly one of `edge`, `equivalent_diameter`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["edge"] }, { "required": ["equivalent_diameter"] }]))]
pub struct CubeSection {
    /// Edge (m).
    #[schemars(transform = positive)]
    pub edge: Option<Located<f64>>,
    /// Diameter of the sphere of equal volume (m).
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// An ellipsoid.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidSection {
    /// Lengths of the axes along x, y and z, from end to end (m).
    #[schemars(transform = positive)]
    pub axes: Triple,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// A cylinder or a capsule along z.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderSection {
    /// Diameter (m).
    #[schemars(transform = positive)]
    pub diameter: Located<f64>,
    /// Length from end to end (m); that of a capsule includes its round ends and is at least its diameter.
    #[schemars(transform = positive)]
    pub length: Located<f64>,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// A superellipsoid, `(|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) <= 1` with half axes `a`, `b`, `c`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuperellipsoidSection {
    /// Lengths of the axes along x, y and z, from end to end (m).
    #[schemars(transform = positive)]
    pub axes: Triple,
    /// Exponents `[e1, e2]` (-): `[1, 1]` is an ellipsoid, small ones are a box.
    #[schemars(transform = positive)]
    pub exponents: [Located<f64>; 2],
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// A convex polyhedron by its vertices.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolyhedronSection {
    /// Vertices (m), in any order and about any point: the body is centred at its centre of mass.
    #[schemars(extend("minItems" = 4))]
    pub vertices: Located<Vec<[f64; 3]>>,
    /// Whether to drop vertices that are no corners of the convex hull, instead of refusing them. Default false.
    #[serde(default)]
    pub hull: bool,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

/// A convex body from a file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshSection {
    /// STL (binary or text) or OBJ file, relative to the case file: a closed surface, outward facets.
    pub file: Located<String>,
    /// Unit of the lengths in the file: "m", "cm", "mm", "um", "in", or a number of metres. Default "m".
    pub unit: Option<Located<LengthUnit>>,
    /// Factor on all lengths (-). Default 1.
    #[serde(default = "one")]
    #[schemars(transform = positive)]
    pub scale: Located<f64>,
    /// Whether to take the convex hull of a body that is not convex, instead of refusing it. Default false.
    #[serde(default)]
    pub hull: bool,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<Located<f64>>,
}

fn one() -> Located<f64> {
    1.0.into()
}

impl ShapeSection {
    /// The key of this shape.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sphere(_) => "sphere",
            Self::Cuboid(_) => "cuboid",
            Self::Cube(_) => "cube",
            Self::Ellipsoid(_) => "ellipsoid",
            Self::Cylinder(_) => "cylinder",
            Self::Capsule(_) => "capsule",
            Self::Superellipsoid(_) => "superellipsoid",
            Self::Polyhedron(_) => "polyhedron",
            Self::Mesh(_) => "mesh",
        }
    }
}
