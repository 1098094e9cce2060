//! Discrete contacts of convex bodies and walls: overlap geometry, force law, material.
//!
//! A contact is measured by the volume, depth, centre, normal, area and moment of the overlap of the two (enlarged)
//! bodies ([`overlap()`], which chooses by pair):
//!
//! | with | sphere | polyhedron | any other | plane | pipe, rod | mesh |
//! |---|---|---|---|---|---|---|
//! | sphere | [`sphere_sphere`] | [`sphere_polyhedron`] | [`sampled`] | [`sphere_plane`] | [`sampled`] | [`mesh`] |
//! | polyhedron | | [`polyhedra`] | [`sampled`] | [`polyhedra`] | [`sampled`] | [`mesh`] |
//! | cylinder | | | [`sampled`] | [`cylinder_plane`] | [`sampled`] | [`mesh`] |
//! | any other | | | [`sampled`] | [`sampled`] | [`sampled`] | [`mesh`] |
//!
//! Everything but [`sampled`] is exact. The force follows from these numbers and from the relative velocity at the
//! centre ([`law`], [`friction`], [`rolling`], [`cohesion`]). [`lubrication`] and [`van_der_waals`] act between bodies that do not touch. [`pairs`] finds the pairs near enough to be
//! measured, and [`neighbours`] keeps them while bodies move little. The engine keeps what a
//! law remembers of each contact; no other result depends on earlier ones.

mod clip;
pub mod cohesion;
mod cut;
mod cylinder_plane;
pub mod friction;
mod impact;
pub mod law;
pub mod lubrication;
pub mod mesh;
pub mod nearest;
pub mod neighbours;
pub mod overlap;
pub mod pairs;
mod parallel;
mod partial_slip;
mod polyhedra;
pub mod rolling;
pub mod sampled;
mod solid;
mod sphere_plane;
mod sphere_polyhedron;
pub mod sphere_sphere;
#[cfg(test)]
mod tests;
pub mod van_der_waals;

use crate::math::Vec3;
use crate::shape::{Passage, Shape};
pub use cohesion::Cohesion;
pub use cut::CutPart;
pub use friction::{Friction, RelativeMotion};
pub use impact::SpherePair;
pub use law::{PairLaw, PairProperties};
pub use lubrication::Lubrication;
pub use neighbours::{Neighbour, NeighbourList};
pub use overlap::{
    Body, GrownShape, Overlap, intersects, intersects_wall, overlap, overlap_again, overlap_wall,
};
pub use pairs::PairFinder;
pub use polyhedra::Hint;
pub use rolling::Turning;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
#[cfg(test)]
pub(crate) use tests::ContactParams;
pub use van_der_waals::VanDerWaals;

/// Overlaps deeper than this part of the thickness of the (thinner) body are beyond the contact model, and end a run; for spheres half of
/// the radius.
pub const DEEPEST: f64 = 0.25;

/// Materials and model of all contacts, SI units. Without materials it is that of bodies which nothing touches.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactModel {
    /// Materials; templates and walls name theirs by its index.
    pub materials: Vec<Material>,
    /// Properties of pairs of materials: entry `a * materials.len() + b`, symmetric.
    pub pairs: Vec<PairParams>,
    /// Distance by which the surface of every particle is grown for contacts (m).
    pub enlargement: f64,
    /// Method of measuring overlaps.
    pub geometry: Geometry,
    /// Law of the elastic force.
    pub law: ElasticLaw,
    /// Law of the normal damping.
    pub damping: DampingLaw,
    /// Law of friction.
    pub friction: FrictionLaw,
    /// Law of the resistance to rolling.
    pub rolling: RollingLaw,
    /// Law of the resistance to twisting.
    pub twisting: TwistingLaw,
    /// Law of cohesion.
    pub cohesion: CohesionLaw,
    /// Forces of the fluid in narrow gaps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lubrication: Option<Lubrication>,
    /// Van der Waals force over gaps of spheres, in place of a law of cohesion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub van_der_waals: Option<VanDerWaals>,
}

impl ContactModel {
    /// Properties of a pair of materials, given by their indices.
    pub fn pair(&self, a: usize, b: usize) -> &PairParams {
        &self.pairs[a * self.materials.len() + b]
    }

    /// Distance from the centre of a body within which it may act on another one, or a wall on it (m). Ghosts, the search of pairs
    /// and the smallest box follow from it.
    pub fn reach(&self, shape: &Arc<dyn Shape>) -> f64 {
        if let Some(Passage { radius, length, .. }) = shape.passage() {
            return Vec3::new(self.across(radius), 0.5 * length, 0.0).norm();
        }
        let film = shape.circumradius() + self.half_film();
        let neck = shape.circumradius() + self.enlargement;
        let neck = neck + 0.5 * self.stretch(neck);
        let pull =
            shape.circumradius() + self.enlargement + self.van_der_waals.map_or(0.0, |law| law.cut_off);
        let grown = |shape: &Arc<dyn Shape>| GrownShape::new(shape.clone(), self.enlargement).reach();
        let parts = shape.parts().iter().map(|part| part.position.norm() + grown(&part.shape));
        parts.fold(grown(shape).max(film).max(neck).max(pull), f64::max)
    }

    /// The same from the axis of a body that goes through the box, all of whose points lie within a radius (m).
    fn across(&self, radius: f64) -> f64 {
        // Edges of a prism grow by more than its faces.
        radius + (2.0 * self.enlargement).max(self.half_film())
    }

    /// Half the widest gap with a film (m).
    fn half_film(&self) -> f64 {
        0.5 * self.lubrication.map_or(0.0, |film| film.range())
    }

    /// The same along the axes of the box beyond its periodic images: none along that of a body that goes
    /// [through](Shape::passage) the box, and across it from its axis.
    pub fn reach_along(&self, shape: &Arc<dyn Shape>) -> Vec3 {
        let reach = self.reach(shape);
        let Some(Passage { axis, radius, .. }) = shape.passage() else { return Vec3::repeat(reach) };
        let across = self.across(radius);
        Vec3::from_fn(|i, _| if i == axis { 0.0 } else { across })
    }
}

/// Elasticity of a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio (-).
    pub poisson_ratio: f64,
}

/// Dissipation between two materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairParams {
    /// Coefficient of restitution (-), `0 < e <= 1`.
    pub restitution: f64,
    /// Static friction coefficient (-).
    pub friction_static: f64,
    /// Kinetic friction coefficient (-).
    pub friction_kinetic: f64,
    /// Speed of transition from static to kinetic friction (m/s) of [`FrictionLaw::NassauerKuna`].
    pub transition_velocity: f64,
    /// Coefficient of rolling friction (-), without a meaning for [`RollingLaw::None`].
    #[serde(default)]
    pub rolling_friction: f64,
    /// Work of adhesion (J/m^2) of [`CohesionLaw::Dmt`] and [`CohesionLaw::Jkr`].
    #[serde(default)]
    pub work_of_adhesion: f64,
    /// Density of the energy of cohesion (J/m^3) of [`CohesionLaw::Sjkr`].
    #[serde(default)]
    pub cohesion_density: f64,
}

/// Law of the elastic part of the normal force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ElasticLaw {
    /// From volume and depth, `k E* sqrt(V d)`, as in Marquardt et al. (2024).
    #[default]
    #[serde(alias = "paper")]
    OverlapVolume,
    /// Minus the gradient of an energy of the overlap volume: elastic impacts of edges and corners conserve energy.
    OverlapEnergy,
    /// From the depth alone, `4/3 E* sqrt(R*) d^(3/2)`, with the radii of spheres of equal volume: exactly the static force
    /// of LIGGGHTS.
    Hertz,
}

/// Damping of the normal force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DampingLaw {
    /// The elastic force times `1 + c v`, as in Marquardt et al. (2024): never pulls. With the damping of a contact that is
    /// loaded rather than hit from the depth that it has.
    #[default]
    HuntCrossley,
    /// A dashpot beside the elastic force `F`, `sqrt(5) beta sqrt(m* F / d) v`, as LIGGGHTS has it: restitution does not
    /// depend on the speed, and the bodies pull at each other at the end of an impact. Also as there, the velocity is that of
    /// half a step before.
    Tsuji,
}

/// Law of friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionLaw {
    /// A spring along the surface, with the stiffness of Mindlin and a dashpot, up to Coulomb's force: holds bodies at rest. Its force is
    /// rescaled where the contact is unloaded, so that it never gains energy (`mindlin_rescale/force` of LAMMPS).
    Mindlin,
    /// The same with the stiffness of the present overlap, as `tangential history` of LIGGGHTS and `mindlin` of LAMMPS: for comparisons with
    /// them. One coefficient, the kinetic one.
    MindlinDisplacement,
    /// The contact of Mindlin and Deresiewicz (1953), which slips from its edge inwards, of bodies without edges: rebounds from oblique impacts as in theory, and
    /// bodies at rest stay where they are while they are shaken. One coefficient, the kinetic one.
    MindlinDeresiewicz,
    /// A function of the sliding speed, as in Marquardt et al. (2024), without memory: bodies at rest creep.
    #[default]
    #[serde(alias = "paper")]
    NassauerKuna,
}

/// Law of the resistance to rolling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollingLaw {
    /// There is none.
    #[default]
    None,
    /// A torque of constant magnitude against the rolling (`rolling_friction cdt` of LIGGGHTS): holds nothing at rest.
    ConstantTorque,
    /// An elastic-plastic spring with a dashpot (`rolling_friction epsd` of LIGGGHTS): holds bodies at rest.
    ElasticPlastic,
}

/// Law of the resistance to twisting, the turning about the normal of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TwistingLaw {
    /// There is none.
    #[default]
    None,
    /// A spring with a dashpot that follow from those of friction over the area of contact, as Marshall (2009).
    Marshall,
}

/// Law of cohesion, a pull between bodies that touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CohesionLaw {
    /// There is none.
    #[default]
    None,
    /// The constant force `2 pi w R*` of Derjaguin, Muller and Toporov (1975), for small and stiff bodies without edges.
    Dmt,
    /// In proportion to the area of the overlap, `k A` (`cohesion sjkr` of LIGGGHTS), for bodies of any shape.
    Sjkr,
    /// That of Johnson, Kendall and Roberts (1971), for spheres with the elastic law `hertz`, for large and soft ones: spheres that have touched hold on to
    /// each other over a gap.
    Jkr,
}

/// Method of measuring overlaps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Closed forms where they exist.
    #[default]
    Exact,
    /// The sampled scheme of Marquardt et al. (2024), with this many samples per direction.
    Sampled {
        /// Samples per direction, `N_c`.
        samples: u32,
    },
}
