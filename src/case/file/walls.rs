//! Faces of the box and other walls as the user writes them.

use crate::case::schema::positive;
use schemars::JsonSchema;
use serde::Deserialize;

/// The closed faces of the box; a face that is not listed is at rest.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FacesSection {
    /// The face x = 0.
    #[serde(rename = "x-")]
    pub x_low: Option<FaceSection>,
    /// The face at the upper end of x.
    #[serde(rename = "x+")]
    pub x_high: Option<FaceSection>,
    /// The face y = 0.
    #[serde(rename = "y-")]
    pub y_low: Option<FaceSection>,
    /// The face at the upper end of y.
    #[serde(rename = "y+")]
    pub y_high: Option<FaceSection>,
    /// The face z = 0.
    #[serde(rename = "z-")]
    pub z_low: Option<FaceSection>,
    /// The face at the upper end of z.
    #[serde(rename = "z+")]
    pub z_high: Option<FaceSection>,
}

impl FacesSection {
    /// The faces by name, the lower one of each direction first.
    pub fn named(&self) -> [(&'static str, Option<&FaceSection>); 6] {
        [
            ("x-", self.x_low.as_ref()),
            ("x+", self.x_high.as_ref()),
            ("y-", self.y_low.as_ref()),
            ("y+", self.y_high.as_ref()),
            ("z-", self.z_low.as_ref()),
            ("z+", self.z_high.as_ref()),
        ]
    }
}

/// A closed face of the box: a no-slip wall.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceSection {
    /// Velocity (m/s), along the face. Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity (1/s) about the axis of its direction (x, y or z, for both faces) through the middle of the
    /// face. Default 0.
    #[serde(default)]
    pub rotation: f64,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<String>,
}

/// A wall in the box: exactly one of `plane`, `pipe`, `rod`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["plane"] }, { "required": ["pipe"] }, { "required": ["rod"] }]))]
pub struct WallSection {
    /// Name for messages and output.
    pub name: String,
    /// Everything behind a plane is wall.
    pub plane: Option<PlaneSection>,
    /// Everything outside of an endless circular cylinder is wall.
    pub pipe: Option<RoundSection>,
    /// Everything inside of an endless circular cylinder is wall.
    pub rod: Option<RoundSection>,
    /// Velocity of the pivot (m/s). Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity about the pivot (1/s). Default `[0, 0, 0]`.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// A point that the wall turns about (m). Default: the point of the plane or of the axis.
    pub pivot: Option<[f64; 3]>,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<String>,
}

/// A plane.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSection {
    /// A point of the plane (m).
    pub point: [f64; 3],
    /// Normal from the wall into the free space, of any length.
    pub normal: [f64; 3],
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
