//! Faces of the box and other walls as the user writes them.

use super::motion::{ScalarSection, VectorSection};
use super::particles::OrientationSection;
use super::shapes::LengthUnit;
use crate::document::{one_of, positive};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde_json::{Map, Value as Json};

/// Names of the faces of the box, the lower one of each direction first.
pub const FACES: [&str; 6] = ["x-", "x+", "y-", "y+", "z-", "z+"];

/// The schema of the faces by name.
pub(super) fn faces(generator: &mut SchemaGenerator) -> Schema {
    let face = generator.subschema_for::<FaceSection>().to_value();
    let named = |name: &str| {
        let mut face = face.clone();
        face["description"] = format!("The face {name} of the box.").into();
        (name.to_owned(), face)
    };
    let faces: Map<String, Json> = FACES.into_iter().map(named).collect();
    json_schema!({ "type": "object", "properties": faces, "additionalProperties": false })
}

/// A closed face of the box: a no-slip wall, unless it has one of `inlet`, `outlet` and `free_slip`. Bodies meet a solid surface at each.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceSection {
    /// Velocity (m/s), along the face: `[x, y, z]`, `{ oscillation = { amplitude = [...], frequency = ... } }` or
    /// `{ table = [[t, x, y, z], ...] }`. Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: VectorSection,
    /// Angular velocity (1/s) about the axis of its direction (x, y or z, for both faces) through the middle of the
    /// face. Default 0.
    #[serde(default)]
    pub rotation: f64,
    /// Fluid comes in with a given velocity: `{ velocity = [1e-3, 0, 0] }`. Needs an outlet.
    pub inlet: Option<InletSection>,
    /// Fluid leaves, or comes in, at a given pressure: `{ pressure = 0 }`.
    pub outlet: Option<OutletSection>,
    /// A plane of symmetry of the fluid, which slips along it without shear stress. Default false.
    #[serde(default)]
    pub free_slip: bool,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<String>,
}

/// A face through which fluid comes in.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InletSection {
    /// Mean velocity over the face or its patch (m/s), or with a table as `profile` what its factors multiply, along its normal: `[x, y, z]`, `{ oscillation = { amplitude = [...], frequency = ... } }` or
    /// `{ table = [[t, x, y, z], ...] }`.
    pub velocity: VectorSection,
    /// Profile of the velocity over the face: "uniform", "parabolic" or `{ table = [[a, b, factor], ...] }`. Default "uniform".
    #[serde(default)]
    pub profile: InletProfileSection,
    /// Part of the face that it has, or a list of parts; the rest is a no-slip wall at rest. Default: the whole face.
    pub patch: Option<PatchesSection>,
}

/// Parts of a face.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum PatchesSection {
    /// One.
    One(PatchSection),
    /// Several, which have no cell in common.
    Several(Vec<PatchSection>),
}

/// Part of a face, which has the cells whose centres it has. Coordinates along the normal have no effect.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PatchSection {
    /// A disc.
    Disc(DiscSection),
    /// A rectangle.
    Rectangle(RectangleSection),
}

/// A disc on a face.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscSection {
    /// Its middle (m).
    pub centre: [f64; 3],
    /// Diameter (m).
    #[schemars(transform = positive)]
    pub diameter: f64,
}

/// A rectangle on a face.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleSection {
    /// Lower corner (m).
    pub lower: [f64; 3],
    /// Upper corner (m).
    pub upper: [f64; 3],
}

/// Profile of the velocity over an inlet.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum InletProfileSection {
    /// By its name.
    Named(ProfileKind),
    /// By its values.
    Given(GivenProfile),
}

impl Default for InletProfileSection {
    fn default() -> Self {
        Self::Named(ProfileKind::Uniform)
    }
}

/// Values of a profile.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GivenProfile {
    /// Rows `[a, b, factor]`: both coordinates along the face (m; x before y before z), and the factor by which the velocity is multiplied there.
    /// The points form a rectangular grid, in any order; linear between them, constant beyond.
    Table(Vec<[f64; 3]>),
}

/// Profile of the velocity over an inlet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProfileKind {
    /// The same everywhere.
    #[default]
    Uniform,
    /// `6 s (1 - s)` from wall to wall, a product of two between four walls; `2 (1 - r^2 / R^2)` in a pipe along the normal. In a `patch`
    /// as if its edge were these walls.
    Parabolic,
}

/// A face with a given pressure.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutletSection {
    /// Pressure (Pa) over that of the fluid at rest, without the hydrostatic part: a number,
    /// `{ oscillation = { amplitude = ..., frequency = ... } }` or `{ table = [[t, p], ...] }`. Default 0.
    #[serde(default)]
    pub pressure: ScalarSection,
    /// Part of the face that it has, or a list of parts; the rest is a no-slip wall at rest. Default: the whole face.
    pub patch: Option<PatchesSection>,
    /// Lets sound leave instead of reflecting it; the pressure then differs from this where the velocity changes within the time that
    /// sound takes to cross the box a few times. Default false.
    #[serde(default)]
    pub absorbs_sound: bool,
}

/// A wall in the box: exactly one of `plane`, `pipe`, `rod`, `mesh`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of)]
pub struct WallSection {
    /// Name for messages and output.
    pub name: String,
    /// Its surface.
    #[serde(flatten)]
    pub shape: WallShape,
    /// Velocity of the pivot (m/s): `[x, y, z]`, `{ oscillation = { amplitude = [...], frequency = ... } }` or
    /// `{ table = [[t, x, y, z], ...] }`. Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: VectorSection,
    /// Angular velocity about the pivot (1/s), along one axis, with the forms of `velocity`. Default `[0, 0, 0]`.
    #[serde(default)]
    pub angular_velocity: VectorSection,
    /// A point that the wall turns about (m). Default: the point of the plane or of the axis, the position of the mesh.
    pub pivot: Option<[f64; 3]>,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<String>,
}

/// Surface of a wall.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WallShape {
    /// Everything behind a plane is wall.
    Plane(PlaneSection),
    /// Everything outside of an endless circular cylinder is wall.
    Pipe(RoundSection),
    /// Everything inside of an endless circular cylinder is wall.
    Rod(RoundSection),
    /// The surface in an STL or OBJ file is wall, with the free space on one side or on both.
    Mesh(WallMeshSection),
}

/// A plane.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSection {
    /// A point of the plane (m).
    pub point: [f64; 3],
    /// Normal into the free space, of any length.
    pub normal: [f64; 3],
}

/// The surface in a file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallMeshSection {
    /// STL (binary or text) or OBJ file, relative to the case file.
    pub file: String,
    /// Unit of the lengths in the file: "m", "cm", "mm", "um", "in", or a number of metres. Default "m".
    pub unit: Option<LengthUnit>,
    /// Position of the origin of the file in the box (m). Default `[0, 0, 0]`.
    #[serde(default)]
    pub position: [f64; 3],
    /// Orientation of the axes of the file. Default: along those of the box.
    pub orientation: Option<OrientationSection>,
    /// Side of the free space: "outside" of a closed surface (an obstacle, or a vessel with an inner and an outer surface), "inside" of
    /// one (a container), "both" of a sheet without thickness. Default: "outside" of a closed surface, "both" of an open one.
    pub side: Option<SideKind>,
}

/// Side of a mesh on which the free space is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SideKind {
    /// An obstacle.
    Outside,
    /// A container.
    Inside,
    /// A sheet.
    Both,
}

/// An endless circular cylinder.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoundSection {
    /// A point of the axis (m).
    pub point: [f64; 3],
    /// Direction of the axis, of any length.
    pub axis: [f64; 3],
    /// Diameter (m).
    #[schemars(transform = positive)]
    pub diameter: f64,
}
