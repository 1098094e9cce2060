//! Shapes as the user writes them.

use super::particles::OrientationSection;
use crate::document::positive;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use std::str::FromStr;

/// Geometry of a particle. With `equivalent_diameter` the lengths of a shape are proportions only: the shape is scaled
/// to the volume of a sphere of that diameter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeSection {
    /// A sphere.
    Sphere {
        /// Diameter (m); lengths are in metres.
        #[schemars(transform = positive)]
        diameter: f64,
    },
    /// A box.
    Cuboid {
        /// Edges along x, y and z, in metres.
        #[schemars(transform = positive)]
        edges: [f64; 3],
        /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
        #[schemars(transform = positive)]
        equivalent_diameter: Option<f64>,
    },
    /// A cube.
    Cube(CubeSection),
    /// An ellipsoid.
    Ellipsoid {
        /// Lengths of the axes along x, y and z, from end to end (m).
        #[schemars(transform = positive)]
        axes: [f64; 3],
        /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
        #[schemars(transform = positive)]
        equivalent_diameter: Option<f64>,
    },
    /// A circular cylinder along z.
    Cylinder(CylinderSection),
    /// A cylinder along z with half spheres as ends.
    Capsule(CylinderSection),
    /// A superellipsoid, `(|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) <= 1` with half axes `a`, `b`, `c`.
    Superellipsoid {
        /// Lengths of the axes along x, y and z, from end to end (m).
        #[schemars(transform = positive)]
        axes: [f64; 3],
        /// Exponents `[e1, e2]` (-): `[1, 1]` is an ellipsoid, small ones are a box.
        #[schemars(transform = positive)]
        exponents: [f64; 2],
        /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
        #[schemars(transform = positive)]
        equivalent_diameter: Option<f64>,
    },
    /// A convex polyhedron by its vertices.
    Polyhedron {
        /// Vertices (m), in any order and about any point: the body is centred at its centre of mass.
        #[schemars(extend("minItems" = 4))]
        vertices: Vec<[f64; 3]>,
        /// Drops vertices that are no corners of the convex hull, instead of refusing them. Default false.
        #[serde(default)]
        hull: bool,
        /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
        #[schemars(transform = positive)]
        equivalent_diameter: Option<f64>,
    },
    /// A body from an STL or OBJ file: convex, or of several convex parts.
    Mesh(MeshSection),
    /// The union of several shapes, a rigid body.
    Composite(CompositeSection),
}

impl ShapeSection {
    /// A question about the unit of a mesh file whose lengths are taken as metres only because the case gives no unit.
    pub(in crate::case) fn doubtful_unit(&self) -> Option<&'static str> {
        if let Self::Composite(CompositeSection { parts, equivalent_diameter: None }) = self {
            return parts.iter().find_map(|part| part.shape.doubtful_unit());
        }
        let Self::Mesh(MeshSection { unit: None, equivalent_diameter: None, .. }) = self else {
            return None;
        };
        Some(
            "lengths in the file are taken as metres: are they millimetres? Then add unit = \"mm\" to `mesh`",
        )
    }
}

/// A cube: exactly one of `edge`, `equivalent_diameter`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["edge"] }, { "required": ["equivalent_diameter"] }]))]
pub struct CubeSection {
    /// Edge (m).
    #[schemars(transform = positive)]
    pub edge: Option<f64>,
    /// Diameter of the sphere of equal volume (m).
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<f64>,
}

/// A cylinder or a capsule along z.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderSection {
    /// Diameter (m).
    #[schemars(transform = positive)]
    pub diameter: f64,
    /// Length from end to end (m); that of a capsule includes its round ends and exceeds its diameter.
    #[schemars(transform = positive)]
    pub length: f64,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<f64>,
}

/// A body from a file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshSection {
    /// STL (binary or text) or OBJ file, relative to the case file: a closed surface, outward facets.
    pub file: String,
    /// Unit of the lengths in the file: "m", "cm", "mm", "um", "in", or a number of metres. Default "m".
    pub unit: Option<LengthUnit>,
    /// Factor on all lengths (-). Default 1.
    #[serde(default = "one")]
    #[schemars(transform = positive)]
    pub scale: f64,
    /// Takes the convex hull of a body that is not convex, instead of refusing it. Default false.
    #[serde(default)]
    pub hull: bool,
    /// Takes each solid, group or object of the file, and each surface apart from the others, as a convex part of one body. Default false.
    #[serde(default)]
    pub parts: bool,
    /// Way to take a closed surface that is not convex: cut into convex parts. Default: it is refused.
    pub concave: Option<Concave>,
    /// Part of the volume of the body by which that of its parts may exceed it (-), with `concave`. Default 0.01.
    #[schemars(transform = positive)]
    pub excess: Option<f64>,
    /// Diameter of the sphere of equal volume (m); makes the lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<f64>,
}

/// Ways to take a concave body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Concave {
    /// Cut into convex parts along planes.
    Decompose,
}

/// The union of several shapes. Its centre of mass is where the particle is; its axes are those of the parts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompositeSection {
    /// Its parts, at most 256. They may touch and overlap: what they share counts once.
    #[schemars(extend("minItems" = 1))]
    pub parts: Vec<PartSection>,
    /// Diameter of the sphere of equal volume (m); makes all lengths proportions.
    #[schemars(transform = positive)]
    pub equivalent_diameter: Option<f64>,
}

/// A part of a body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartSection {
    /// Geometry.
    pub shape: ShapeSection,
    /// Place of the origin of the shape in the body (m): its centre, or the origin of its vertices or file. Default `[0, 0, 0]`.
    #[serde(default)]
    pub position: [f64; 3],
    /// Orientation of the shape in the body. Default: its axes are those of the body.
    pub orientation: Option<OrientationSection>,
}

fn one() -> f64 {
    1.0
}

/// Unit of the lengths in a mesh file.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LengthUnit {
    /// By name.
    Named(NamedUnit),
    /// In metres.
    Metres(#[schemars(transform = positive)] f64),
}

impl LengthUnit {
    /// In metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Named(NamedUnit::M) => 1.0,
            Self::Named(NamedUnit::Cm) => 1e-2,
            Self::Named(NamedUnit::Mm) => 1e-3,
            Self::Named(NamedUnit::Um) => 1e-6,
            Self::Named(NamedUnit::In) => 0.0254,
            Self::Metres(metres) => metres,
        }
    }
}

/// As on the command line: a name, or a number of metres.
impl FromStr for LengthUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let name =
            NamedUnit::deserialize(IntoDeserializer::<serde::de::value::Error>::into_deserializer(text));
        let number = || text.parse().ok().filter(|metres: &f64| metres.is_finite() && *metres > 0.0);
        name.ok().map(Self::Named).or_else(|| number().map(Self::Metres)).ok_or_else(|| {
            "must be \"m\", \"cm\", \"mm\", \"um\", \"in\", or a number of metres above 0".to_owned()
        })
    }
}

/// Unit of length.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedUnit {
    /// Metre.
    M,
    /// Centimetre.
    Cm,
    /// Millimetre.
    Mm,
    /// Micrometre.
    Um,
    /// Inch.
    In,
}
