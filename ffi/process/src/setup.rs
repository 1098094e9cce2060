//! The JSON of the messages `hello` and `set-up`: what an engine can do, and the case that it gets.

use serde::{Deserialize, Serialize};
use turbid_core::contact::{
    CohesionLaw, ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Geometry, Material, PairParams,
    RollingLaw, TwistingLaw,
};
use turbid_core::math::Vec3;
use turbid_core::particle::Template;
use turbid_core::shape::Shape;
use turbid_core::wall::{Surface, Wall};

/// Name and abilities of an engine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools, reason = "keys of the protocol")]
pub struct Hello {
    /// Its name, and its version if it has one, for messages; a saved state goes only to an engine of the same name.
    pub name: String,
    /// Kinds of [`ShapeSection`] that it moves.
    pub shapes: Vec<String>,
    /// Kinds of [`SurfaceSection`] that it has walls of.
    #[serde(default)]
    pub walls: Vec<String>,
    /// True if its states have orientations. If not, Turbid integrates them from the angular velocities: for spheres only.
    #[serde(default)]
    pub orientations: bool,
    /// True if it lists contacts.
    #[serde(default)]
    pub contacts: bool,
    /// True if the contacts that it lists have the overlaps that it has measured.
    #[serde(default)]
    pub overlaps: bool,
    /// True if it saves its state.
    #[serde(default)]
    pub saves: bool,
}

/// The case, SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetUp {
    /// The box, from the origin.
    #[serde(rename = "box")]
    pub domain: BoxSection,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: [f64; 3],
    /// Bodies; particles name theirs by its index.
    pub templates: Vec<TemplateSection>,
    /// Contacts; without, particles pass through each other and through walls, and there are no walls here.
    pub contact: Option<ContactSection>,
    /// Walls.
    pub walls: Vec<WallSection>,
    /// Further settings for the engine.
    #[serde(default)]
    pub options: serde_json::Value,
}

/// The box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxSection {
    /// Edges (m).
    pub size: [f64; 3],
    /// Periodic directions.
    pub periodic: [bool; 3],
}

/// Geometry, mass and material of particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemplateSection {
    /// Geometry in the body frame.
    pub shape: ShapeSection,
    /// Mass (kg).
    pub mass: f64,
    /// Principal moments of inertia (kg m^2).
    pub inertia: [f64; 3],
    /// Index of the material.
    pub material: usize,
}

/// A convex body about its centre of mass, along its principal axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[allow(missing_docs, reason = "lengths (m)")]
pub enum ShapeSection {
    Sphere {
        radius: f64,
    },
    Ellipsoid {
        semi_axes: [f64; 3],
    },
    /// Along z.
    Cylinder {
        radius: f64,
        half_length: f64,
    },
    /// Indices of vertices by face, counter-clockwise seen from outside; cuboids are some of these.
    Polyhedron {
        vertices: Vec<[f64; 3]>,
        faces: Vec<Vec<u32>>,
    },
}

impl ShapeSection {
    /// The shape, if the protocol has its kind.
    pub(crate) fn of(shape: &dyn Shape) -> Option<Self> {
        if let Some(radius) = shape.as_sphere() {
            return Some(Self::Sphere { radius });
        }
        if let Some(semi_axes) = shape.as_ellipsoid() {
            return Some(Self::Ellipsoid { semi_axes: semi_axes.into() });
        }
        if let Some((radius, half_length)) = shape.as_cylinder() {
            return Some(Self::Cylinder { radius, half_length });
        }
        shape.as_polyhedron().map(|body| Self::Polyhedron {
            vertices: body.vertices.iter().map(|&vertex| vertex.into()).collect(),
            faces: body.faces.iter().map(|face| face.corners.clone()).collect(),
        })
    }

    /// Its kind, as the engine says it.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Sphere { .. } => "sphere",
            Self::Ellipsoid { .. } => "ellipsoid",
            Self::Cylinder { .. } => "cylinder",
            Self::Polyhedron { .. } => "polyhedron",
        }
    }
}

impl TemplateSection {
    pub(crate) fn of(template: &Template) -> Option<Self> {
        Some(Self {
            shape: ShapeSection::of(&*template.shape)?,
            mass: template.mass(),
            inertia: template.inertia().into(),
            material: template.material,
        })
    }
}

/// Parameters of contacts; an engine uses those that its law has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactSection {
    /// Distance by which the surface of every particle is grown for contacts (m).
    pub enlargement: f64,
    /// The elastic law of the case: its name, or a table of its parameters under its name.
    pub law: ElasticLaw,
    /// The damping of the case, in the same form.
    pub damping: DampingLaw,
    /// The friction of the case, in the same form.
    #[serde(default)]
    pub friction: FrictionLaw,
    /// The resistance to rolling of the case, in the same form.
    #[serde(default)]
    pub rolling: RollingLaw,
    /// The cohesion of the case, in the same form.
    #[serde(default)]
    pub cohesion: CohesionLaw,
    /// Materials.
    pub materials: Vec<Material>,
    /// Pairs of materials: entry `a * materials.len() + b`, symmetric.
    pub pairs: Vec<PairParams>,
}

impl ContactSection {
    /// The model with all its parameters, or the part of it that the protocol does not have.
    pub(crate) fn of(model: &ContactModel) -> Result<Self, &'static str> {
        let ContactModel {
            materials,
            pairs,
            enlargement,
            geometry,
            law,
            damping,
            friction,
            rolling,
            twisting,
            cohesion,
            lubrication,
            van_der_waals,
        } = model.clone();
        if lubrication.is_some() {
            return Err("lubrication");
        }
        if van_der_waals.is_some() {
            return Err("van der Waals forces");
        }
        if geometry != Geometry::Exact {
            return Err("overlaps measured by samples");
        }
        if twisting != TwistingLaw::None {
            return Err("resistance to twisting");
        }
        if friction == FrictionLaw::MindlinDeresiewicz {
            return Err("friction with partial slip");
        }
        Ok(Self { enlargement, law, damping, friction, rolling, cohesion, materials, pairs })
    }

    /// A pair of materials, given by their indices.
    pub fn pair(&self, a: usize, b: usize) -> &PairParams {
        &self.pairs[a * self.materials.len() + b]
    }
}

/// A wall, whose surface stays where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallSection {
    /// Name for messages.
    pub name: String,
    /// Index of the material.
    pub material: usize,
    /// Velocity along the surface (m/s).
    pub velocity: [f64; 3],
    /// The surface.
    pub surface: SurfaceSection,
}

/// The surface of a wall; lengths in m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[allow(missing_docs, reason = "as in turbid_core::wall::Surface")]
pub enum SurfaceSection {
    /// `normal` is a unit vector into the free space.
    Plane { point: [f64; 3], normal: [f64; 3] },
    /// The free space is inside; `axis` is a unit vector.
    Pipe { point: [f64; 3], axis: [f64; 3], radius: f64 },
    /// The free space is outside.
    Rod { point: [f64; 3], axis: [f64; 3], radius: f64 },
}

impl WallSection {
    pub(crate) fn of(wall: &Wall) -> Self {
        let surface = match &wall.surface {
            &Surface::Plane { point, normal } => {
                SurfaceSection::Plane { point: point.into(), normal: normal.into() }
            }
            &Surface::Cylinder { point, axis, radius, pipe } => {
                let (point, axis) = (point.into(), axis.into());
                if pipe {
                    SurfaceSection::Pipe { point, axis, radius }
                } else {
                    SurfaceSection::Rod { point, axis, radius }
                }
            }
            Surface::Mesh(_) => panic!("wall {} {}", wall.name, MESH),
        };
        let (name, velocity) = (wall.name.clone(), wall.motion.velocity.at(0.0).into());
        Self { name, material: wall.material, velocity, surface }
    }
}

/// The flaw of a mesh.
const MESH: &str = "is a mesh, which the protocol does not have";

/// The reason why no engine of the protocol has this wall: its surface would not stay where it is, or its velocity not the same.
pub fn wall_flaw(wall: &Wall) -> Option<&'static str> {
    let velocity = wall.motion.velocity.at(0.0);
    match &wall.surface {
        Surface::Mesh(_) => Some(MESH),
        _ if !wall.motion.is_steady() => Some("varies its velocity"),
        _ if !wall.motion.angular_velocity.is_zero() => Some("turns"),
        Surface::Plane { normal, .. } if velocity.dot(normal).abs() > 1e-9 * velocity.norm() => {
            Some("moves along its normal")
        }
        Surface::Cylinder { .. } if velocity != Vec3::zeros() => Some("is a cylinder that moves"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid_core::contact::VanDerWaals;
    use turbid_core::contact::lubrication::{Lubrication, Unresolved};

    #[test]
    fn a_contact_model_is_sent_whole_or_refused() {
        for (law, damping, friction, cohesion) in [
            (
                ElasticLaw::OverlapVolume,
                DampingLaw::HuntCrossley,
                FrictionLaw::NassauerKuna,
                CohesionLaw::None,
            ),
            (ElasticLaw::OverlapEnergy, DampingLaw::Tsuji, FrictionLaw::Mindlin, CohesionLaw::Dmt),
            (ElasticLaw::Hertz, DampingLaw::Tsuji, FrictionLaw::MindlinDisplacement, CohesionLaw::Sjkr),
        ] {
            let enlargement = 1e-5;
            let model =
                ContactModel { law, damping, friction, cohesion, enlargement, ..ContactModel::default() };
            let sent = ContactSection::of(&model).unwrap();
            let received: ContactSection = serde_json::from_value(serde_json::json!(sent)).unwrap();
            assert_eq!(received, sent);
            let of = ContactModel {
                law: received.law,
                damping: received.damping,
                friction: received.friction,
                rolling: received.rolling,
                cohesion: received.cohesion,
                enlargement: received.enlargement,
                ..model.clone()
            };
            assert_eq!(of, model);
        }
        let geometry = Geometry::Sampled { samples: 4 };
        let sampled = ContactModel { geometry, ..ContactModel::default() };
        assert!(ContactSection::of(&sampled).unwrap_err().contains("samples"));
        let lubrication =
            Lubrication { viscosity: 1e-3, roughness: 1e-6, cell: 1e-4, unresolved: Unresolved::saturated() };
        let lubricated = ContactModel { lubrication: Some(lubrication), ..ContactModel::default() };
        assert!(ContactSection::of(&lubricated).unwrap_err().contains("lubrication"));
        let van_der_waals = VanDerWaals { hamaker_constant: 1e-19, smallest_gap: 1e-9, cut_off: 1e-7 };
        let drawn = ContactModel { van_der_waals: Some(van_der_waals), ..ContactModel::default() };
        assert!(ContactSection::of(&drawn).unwrap_err().contains("van der Waals"));
    }
}
