//! Partially saturated cells: a solid operator replaces part of the collision, by the exact volume fraction of each cell,
//! and a body receives the momentum that the operator gives to its part of the cells.
//!
//! ```text
//! f' = f + (1 - b) W_fluid + b W_solid,   b = e t / ((1 - e) + t + l),   t = tau - 1/2,   e = volume fraction
//! F = G + S(t) - S(t - dt),   G = -b sum c W_solid,   S = rho V U + sum e rho (u - u_s)
//! ```
//!
//! `S` is the momentum inside the body, `l` a leak. Volume fractions of several bodies add up to at most one. Flat faces
//! are moved out by `0.1 E` cells, `E = V^(1/3) sum L (1 - cos t) / (2 A)` over the edges of length `L` at which the
//! normals turn by `t`, since a lattice does not resolve the singular stress at an edge. Derivation:
//! `docs/theory/coupling.md`; the operators and the leak: `docs/theory/fluid.md`.
//!
//! References: Noble and Torczynski (1998), doi:10.1142/S0129183198001084; Rettinger and Ruede (2017),
//! doi:10.1016/j.compfluid.2017.05.033.

mod collision;
mod flat;
mod round;
mod volume_fraction;

use super::cover::Cover;
use super::mapper::{Geometry, HALF_DIAGONAL, Image, Mapper};
use super::method::CouplingMethod;
use crate::fluid::{ExchangeSum, RigidMotion, Simd};
use crate::math::{Vec3, to_fixed_wide};
use crate::particle::Particle;
use crate::shape::Shape;
use flat::FlatSurface;
use round::{EllipsoidSurface, SmoothSurface, SphereSurface};
use serde::{Deserialize, Serialize};
use volume_fraction::curved;

/// Partially saturated cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturated {
    /// Collision of the solid part.
    pub operator: SolidOperator,
    /// Distance by which the flat faces of a cube are moved out (cells); those of other bodies as their edges require.
    pub face_shift: f64,
}

impl Saturated {
    /// With faces moved so that the drag is right.
    pub const fn new(operator: SolidOperator) -> Self {
        Self { operator, face_shift: 0.1 }
    }
}

/// What happens in solid cells of the coupling "saturated".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolidOperator {
    /// Bounce-back of the deviation from equilibrium.
    Sc1,
    /// Equilibrium of the solid, and what relaxation leaves.
    Sc2,
    /// Bounce-back off a moving wall.
    #[default]
    Sc3,
}

impl SolidOperator {
    /// Name in case files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sc1 => "sc1",
            Self::Sc2 => "sc2",
            Self::Sc3 => "sc3",
        }
    }

    /// Momentum that the operator gives to a wholly solid cell, over `rho (u_s - u)`.
    pub(crate) fn momentum(self) -> f64 {
        if self == Self::Sc3 { 2.0 } else { 1.0 }
    }
}

impl CouplingMethod for Saturated {
    fn half_layer(self) -> f64 {
        HALF_DIAGONAL
    }

    /// Smooth bodies count as a plane in each cell, moved in by their mean curvature, taken as the same everywhere; flat
    /// faces are moved out, for their edges (head of this module).
    ///
    /// `(k_1 + k_2) / 24` in the mean over the surface is `M / (12 A)` with the area `A` and, after Minkowski, the
    /// integral of the mean curvature `M = 2 pi b`, `b` the mean width.
    fn surface_shift(self, shape: &dyn Shape, dx: f64) -> f64 {
        if let Some(radius) = shape.as_sphere() {
            return curved(2.0 * dx / radius);
        }
        if let Some(polyhedron) = shape.as_polyhedron() {
            return -self.face_shift * polyhedron.sharpness();
        }
        // Lebedev's 26 points, exact for polynomials of degree 7: axes, diagonals of faces, diagonals of the cube.
        let mut width = 0.0;
        for n in 0..27 {
            let direction = Vec3::from([n % 3, n / 3 % 3, n / 9].map(|k| f64::from(k - 1)));
            let weight = match direction.norm_squared() as i32 {
                1 => 1.0 / 21.0,
                2 => 4.0 / 105.0,
                3 => 9.0 / 280.0,
                _ => continue,
            };
            let unit = direction.normalize();
            width += 2.0 * weight * shape.support(unit).dot(&unit);
        }
        let mesh = shape.surface_mesh(2);
        let triangle = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| mesh.points[i as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        let area: f64 = mesh.triangles.iter().map(triangle).sum();
        std::f64::consts::TAU * width / (12.0 * area) * dx
    }

    fn cover(self, mapper: &Mapper, image: &Image, cover: &mut Cover, simd: Simd) {
        match &mapper.geometry {
            Geometry::Sphere(radius) => cover.add(SphereSurface::new(mapper, *radius), mapper, image, simd),
            Geometry::Flat(planes) => cover.add(FlatSurface::new(mapper, planes), mapper, image, simd),
            Geometry::Ellipsoid(semi_axes) => {
                cover.add(EllipsoidSurface::new(mapper, *semi_axes), mapper, image, simd);
            }
            Geometry::Smooth => cover.add(SmoothSurface(mapper), mapper, image, simd),
        }
    }

    fn momentum_inside(
        self,
        particle: &Particle,
        shape: &dyn Shape,
        motion: &RigidMotion,
        dx: f64,
    ) -> ExchangeSum {
        let volume = shape.volume() / (dx * dx * dx);
        let momentum = Vec3::from(motion.velocity) * volume;
        let turn = particle.orientation();
        let inertia = shape.inertia_per_mass() / (dx * dx) * volume;
        let spin = turn.inverse_transform_vector(&Vec3::from(motion.angular));
        let angular = turn.transform_vector(&inertia.component_mul(&spin));
        let moment = angular + Vec3::from(motion.centre).cross(&momentum);
        ExchangeSum { force: momentum.map(to_fixed_wide).into(), moment: moment.map(to_fixed_wide).into() }
    }
}
