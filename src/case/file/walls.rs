//! Faces of the box and other walls as the user writes them.

use crate::case::forms::{Triple, zero};
use crate::case::located::Located;
use crate::case::schema::positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The closed faces of the box; a face that is not listed is at rest.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FacesSection {
    /// The face x = 0.
    #[serde(rename = "x-")]
    pub x_low: Option<Located<FaceSection>>,
    /// The face at the upper end of x.
    #[serde(rename = "x+")]
    pub x_high: Option<Located<FaceSection>>,
    /// The face y = 0.
    #[serde(rename = "y-")]
    pub y_low: Option<Located<FaceSection>>,
    /// The face at the upper end of y.
    #[serde(rename = "y+")]
    pub y_high: Option<Located<FaceSection>>,
    /// The face z = 0.
    #[serde(rename = "z-")]
    pub z_low: Option<Located<FaceSection>>,
    /// The face at the upper end of z.
    #[serde(rename = "z+")]
    pub z_high: Option<Located<FaceSection>>,
}

impl FacesSection {
    /// The faces by name, the lower one of each direction first.
    pub fn named(&self) -> [(&'static str, Option<&Located<FaceSection>>); 6] {
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
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceSection {
    /// Velocity (m/s), along the face. Default `[0, 0, 0]`.
    #[serde(default = "zero")]
    pub velocity: Triple,
    /// Angular velocity (1/s) about the axis of its direction (x, y or z, for both faces) through the middle of the
    /// face. Default 0.
    #[serde(default = "still")]
    pub rotation: Located<f64>,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<Located<String>>,
}

fn still() -> Located<f64> {
    0.0.into()
}

/// A wall in the box: exactly one of `plane`, `pipe`, `rod`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["plane"] }, { "required": ["pipe"] }, { "required": ["rod"] }]))]
pub struct WallSection {
    /// Name for messages and output.
    pub name: Located<String>,
    /// Everything behind a plane is wall.
    pub plane: Option<Located<PlaneSection>>,
    /// Everything outside of an endless circular cylinder is wall.
    pub pipe: Option<Located<RoundSection>>,
    /// Everything inside of an endless circular cylinder is wall.
    pub rod: Option<Located<RoundSection>>,
    /// Velocity of the pivot (m/s). Default `[0, 0, 0]`.
    #[serde(default = "zero")]
    pub velocity: Triple,
    /// Angular velocity about the pivot (1/s). Default `[0, 0, 0]`.
    #[serde(default = "zero")]
    pub angular_velocity: Triple,
    /// A point that the wall turns about (m). Default: the point of the plane or of the axis.
    pub pivot: Option<Triple>,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<Located<String>>,
}

/// A plane.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSection {
    /// A point of the plane (m).
    pub point: Triple,
    /// Normal from the wall into the free space, of any length.
    pub normal: Triple,
}

/// An endless circular cylinder.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoundSection {
    /// A point of the axis (m).
    pub point: Triple,
    /// Direction of the axis, of any length.
    pub axis: Triple,
    /// Diameter (m).
    #[schemars(transform = positive)]
    pub diameter: Located<f64>,
}
