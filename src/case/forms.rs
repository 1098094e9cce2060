//! Values with a short and a long form, told apart by their TOML type so that errors keep their place.

use super::located::Located;
use super::schema::positive;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;

/// Three numbers.
pub type Triple = [Located<f64>; 3];

/// Edges of the box.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Size {
    /// In metres.
    Metres(Triple),
    /// In diameters of the first kind of particle.
    Relative(RelativeSize),
}

/// Edges of the box in diameters.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RelativeSize {
    /// Edges in diameters of the first kind of particle (of the sphere of equal volume).
    #[schemars(transform = positive)]
    pub diameters: Triple,
}

/// Gravity as a vector or as a magnitude that points along -z.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Gravity {
    /// Downwards, along -z (m/s^2).
    Downwards(f64),
    /// Any direction (m/s^2).
    Vector([f64; 3]),
}

/// One particle of a list.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Entry {
    /// Centre (m), at rest.
    Position(Triple),
    /// Centre and motion.
    Moving(Box<MovingEntry>),
}

/// How a particle of a list is turned: exactly one of `axis` with `angle`, and `quaternion`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["axis", "angle"] }, { "required": ["quaternion"], "not": { "required": ["angle"] } }]))]
pub struct OrientationSection {
    /// Axis it is turned about, of any length.
    pub axis: Option<Triple>,
    /// Angle (degrees), right-handed.
    pub angle: Option<Located<f64>>,
    /// Quaternion `[i, j, k, w]` of any length, from the axes of the shape to those of the box.
    pub quaternion: Option<[Located<f64>; 4]>,
}

/// Sizes of random particles.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Sizes {
    /// Factors and their shares.
    Shares(Vec<Located<SizeShare>>),
    /// Evenly spread factors.
    Spread(SizeSpread),
}

/// One size and how many particles have it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizeShare {
    /// Factor on all lengths of the shape (-).
    #[schemars(transform = positive)]
    pub scale: Located<f64>,
    /// Share of the number of particles (-); shares need not add up to 1.
    #[schemars(transform = positive)]
    pub share: Located<f64>,
}

/// Sizes evenly spread over a range, the same number of particles in each step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizeSpread {
    /// Smallest and largest factor on all lengths (-); each step has the factor in its middle.
    #[schemars(transform = positive)]
    pub uniform: [Located<f64>; 2],
    /// Number of sizes, from 1 to 1000. Default 5.
    #[schemars(extend("minimum" = 1, "maximum" = 1000))]
    pub steps: Option<Located<u32>>,
}

/// Unit of the lengths in a mesh file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LengthUnit {
    /// By name.
    Name(String),
    /// In metres.
    Metres(f64),
}

/// One particle of a list with its motion.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MovingEntry {
    /// Centre (m).
    pub position: Triple,
    /// Orientation. Default: the axes of the shape along those of the box.
    pub orientation: Option<Located<OrientationSection>>,
    /// Velocity (m/s). Default `[0, 0, 0]`.
    #[serde(default = "zero")]
    pub velocity: Triple,
    /// Angular velocity (1/s). Default `[0, 0, 0]`.
    #[serde(default = "zero")]
    pub angular_velocity: Triple,
}

/// Three zeros.
pub(super) fn zero() -> Triple {
    [0.0.into(), 0.0.into(), 0.0.into()]
}

/// Implements `Deserialize` from an array, a table, a number or a text, whichever the type has, and the schema of its two forms.
macro_rules! forms {
    ($type:ident: $first:ty | $second:ty, $expecting:literal $(, seq $seq:ident)? $(, map $map:ident)? $(, number $number:ident)? $(, text $text:ident)?) => {
        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Form;
                impl<'de> Visitor<'de> for Form {
                    type Value = $type;

                    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                        f.write_str($expecting)
                    }
                    $(fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<$type, A::Error> {
                        Deserialize::deserialize(SeqAccessDeserializer::new(seq)).map($type::$seq)
                    })?
                    $(fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<$type, A::Error> {
                        Deserialize::deserialize(MapAccessDeserializer::new(map)).map($type::$map)
                    })?
                    $(fn visit_f64<E>(self, number: f64) -> Result<$type, E> {
                        Ok($type::$number(number))
                    }

                    fn visit_i64<E>(self, number: i64) -> Result<$type, E> {
                        Ok($type::$number(number as f64))
                    })?
                    $(fn visit_str<E>(self, text: &str) -> Result<$type, E> {
                        Ok($type::$text(text.to_string()))
                    })?
                }
                deserializer.deserialize_any(Form)
            }
        }

        impl JsonSchema for $type {
            fn schema_name() -> Cow<'static, str> {
                stringify!($type).into()
            }

            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                let forms = [generator.subschema_for::<$first>(), generator.subschema_for::<$second>()];
                json_schema!({ "title": stringify!($type), "anyOf": forms })
            }
        }
    };
}

forms!(Size: Triple | RelativeSize, "[x, y, z] in metres or { diameters = [x, y, z] }", seq Metres, map Relative);
forms!(Gravity: f64 | [f64; 3], "a number (along -z) or [x, y, z] in m/s^2", seq Vector, number Downwards);
forms!(Entry: Triple | MovingEntry, "[x, y, z] or { position = [x, y, z], velocity = [x, y, z] }", seq Position, map Moving);
forms!(Sizes: Vec<SizeShare> | SizeSpread, "[{ scale = ..., share = ... }] or { uniform = [0.8, 1.2], steps = 5 }", seq Shares, map Spread);
forms!(LengthUnit: String | f64, "a unit such as \"mm\", or a number of metres", number Metres, text Name);
