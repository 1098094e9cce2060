//! Pictures as the user asks for them.

use super::Axis;
use crate::document::positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A picture: exactly one of `slice`, `view`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["slice"] }, { "required": ["view"] }]))]
pub struct PictureSection {
    /// Beginning of the names of its files: letters, digits, `-` and `_`. Default: the quantity of a slice, or "view".
    pub name: Option<String>,
    /// The flow in a plane, with the outlines of the particles that it cuts.
    pub slice: Option<SliceSection>,
    /// The particles and walls in the box, in perspective.
    pub view: Option<ViewSection>,
}

/// A plane across an axis of the box, and what its colours mean.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SliceSection {
    /// Axis across which the plane lies: "x", "y" or "z". Default: the plane is parallel to gravity and if possible to x.
    pub normal: Option<Axis>,
    /// Coordinate along that axis (m). Default: the middle of the box.
    pub position: Option<f64>,
    /// Quantity in colour: the speed or a component of the velocity (m/s), the vorticity along the normal (1/s), or the pressure (Pa).
    /// Default "speed"; where a wall slides, the component along it.
    pub quantity: Option<Quantity>,
    /// Values at the lower and the upper end of the colours of all pictures, in the unit of the quantity. Default: what is expected of
    /// the run, or else of its first picture.
    pub range: Option<[f64; 2]>,
}

/// Quantity of a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Magnitude of the velocity (m/s).
    #[default]
    Speed,
    /// Velocity along x (m/s).
    VelocityX,
    /// Velocity along y (m/s).
    VelocityY,
    /// Velocity along z (m/s).
    VelocityZ,
    /// Component of the vorticity along the normal of the slice (1/s).
    Vorticity,
    /// Pressure (Pa).
    Pressure,
}

/// The box in perspective.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ViewSection {
    /// Direction from the middle of the box to the eye, of any length. Default: from the right and above, `[0.6, -1, 0.5]` for gravity
    /// along -z.
    pub from: Option<[f64; 3]>,
    /// Factor by which all is larger than with the whole box on the page (-).
    #[schemars(transform = positive)]
    pub zoom: f64,
    /// Width and height, from 300 to 4000 (pixels); labels shrink below 1000 x 750. Default `[1200, 900]`.
    #[schemars(transform = page)]
    pub size: [u32; 2],
    /// Colour of the particles: by their speed or a component of their velocity (m/s), angular speed (1/s), sum of contact forces
    /// (N) or kind, or "plain". Default "speed", or where a wall slides the component along it; with a slice or force chains "plain".
    pub colour: Option<BodyColour>,
    /// Values at the lower and the upper end of these colours in all pictures. Default: as for slices.
    pub range: Option<[f64; 2]>,
    /// A slice of the flow, before the part of the box behind it with the particles there, and those that it cuts. Default in a run
    /// with fluid: the one in the middle of the box; `false` leaves it out and shows the whole box.
    pub slice: Option<ViewSlice>,
    /// Draws every contact as a line from both centres to its point, seen through the particles; width and colour by the force.
    pub force_chains: bool,
    /// Force at the upper end of the colours of these (N). Default: the mean weight on the lowest particles, or else of the first
    /// picture with a contact.
    #[schemars(transform = positive)]
    pub force_range: Option<f64>,
}

impl Default for ViewSection {
    fn default() -> Self {
        Self {
            from: None,
            zoom: 1.0,
            size: [1200, 900],
            colour: None,
            range: None,
            slice: None,
            force_chains: false,
            force_range: None,
        }
    }
}

/// The slice in a view.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ViewSlice {
    /// True for one, false for none.
    Shown(bool),
    /// This one.
    Slice(SliceSection),
}

/// Meaning of the colours of particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyColour {
    /// One colour.
    Plain,
    /// By the section of the case.
    Kind,
    /// Magnitude of the velocity (m/s).
    Speed,
    /// Velocity along x (m/s).
    VelocityX,
    /// Velocity along y (m/s).
    VelocityY,
    /// Velocity along z (m/s).
    VelocityZ,
    /// Magnitude of the angular velocity (1/s).
    AngularSpeed,
    /// Magnitude of the sum of the forces of all contacts (N).
    ContactForce,
}

/// Sides of a page.
fn page(schema: &mut schemars::Schema) {
    if let Some(items) = schema.get_mut("items").and_then(serde_json::Value::as_object_mut) {
        items.insert("minimum".into(), 300.into());
        items.insert("maximum".into(), 4000.into());
    }
}
