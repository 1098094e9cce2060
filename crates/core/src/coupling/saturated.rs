//! Partially saturated cells: a solid operator replaces part of the collision, by the exact volume fraction of each cell,
//! and a body receives the momentum that the operator gives to its part of the cells.
//!
//! ```text
//! f' = f + W,   b = B / (1 + B),   B = e (1/4 + 3/4 e) t / (0.6 (1 - e) + l),   t = tau - 1/2,   e = volume fraction
//! sc3: even and odd part of f - feq relax with tau + B / 2 and 1/2 + s / (1 + 2 s B),   s = tau_odd - 1/2
//! sum c W = (1 - e) rho a - G,   G = 2 b rho (u - u_s) + b (1 - e) rho a,   F = G + S(t) - S(t - dt),   S = rho V U + sum e rho (u - u_s)
//! ```
//!
//! Steady Stokes flow past sc3 depends on `t s` only. `S` is the momentum inside the body, `l` a leak. Volume fractions of several bodies
//! add up to at most one. The fluid feels the surface of a body moved in by
//!
//! ```text
//! 0.04 - 0.3 <H> - 0.12 E cells,   <H> = (int H dA + 1/2 sum L t) / A,   E = V^(1/3) sum L w / (2 A)
//! w = (1 - cos t + min(4, tan^2(t/2))) / 2
//! ```
//!
//! with the mean curvature `H` (1 / cells) and edges of length `L` at which the normals turn by `t`: the no-slip plane of the
//! operator lies outside of the surface, and a lattice does not resolve the singular stress at an edge. Derivation:
//! `docs/theory/coupling.md`; the operators and the leak: `docs/theory/fluid.md`.
//!
//! References: Noble and Torczynski (1998), doi:10.1142/S0129183198001084; Rettinger and Ruede (2017),
//! doi:10.1016/j.compfluid.2017.05.033.

mod collision;
mod flat;
mod polyhedra;
mod round;

use super::cover::Cover;
use super::mapper::{Geometry, HALF_DIAGONAL, Image, Mapper};
use super::method::CouplingMethod;
use crate::fluid::{ExchangeSum, RigidMotion, Simd};
use crate::math::{Vec3, to_fixed_wide};
use crate::particle::Particle;
use crate::shape::{Curvature, Ellipsoid, Shape};
pub use collision::SolidOperator;
use flat::FlatSurface;
pub(super) use flat::LEAST_SKIN;
pub(super) use polyhedra::KeptPolyhedra;
use round::{CylinderSurface, EllipsoidSurface, SmoothSurface, SphereSurface};
use std::sync::Arc;

/// Partially saturated cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturated {
    /// Collision of the solid part.
    pub operator: SolidOperator,
    /// Shift of the surfaces.
    pub shift: SurfaceShift,
}

/// Distance by which surfaces are moved inwards for the drag to be right: `plane - curvature <H> - edges E` cells (head of this module).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceShift {
    /// Of any surface (cells).
    pub plane: f64,
    /// Times the mean curvature in 1 / cells.
    pub curvature: f64,
    /// Times the sharpness of the edges (cells).
    pub edges: f64,
}

/// Largest mean curvature (1 / cells) for which a surface is moved, that of a sphere 8 cells across: on coarser lattices the
/// fit does not hold, and bodies moved out so far are unstable.
const MOST_CURVED: f64 = 0.25;
/// Factor of the difference of the curvature at an end of an ellipsoid and the mean one, fitted to the drag of spheroids, and most that
/// counts of the sum of both (1 / cells).
const END: f64 = 1.75;
const MOST_CURVED_END: f64 = 0.8;

impl SurfaceShift {
    /// Surfaces stay where they are.
    pub const NONE: Self = Self { plane: 0.0, curvature: 0.0, edges: 0.0 };
    /// Fitted to the drag of spheres and cubes, see `validation/drag`.
    pub const FITTED: Self = Self { plane: 0.04, curvature: 0.3, edges: 0.12 };
}

impl Saturated {
    /// With surfaces moved so that the drag is right.
    pub const fn new(operator: SolidOperator) -> Self {
        Self { operator, shift: SurfaceShift::FITTED }
    }
}

impl CouplingMethod for Saturated {
    fn half_layer(self) -> f64 {
        HALF_DIAGONAL
    }

    /// Moved by the distance of the drag, and by the part that makes volumes of smooth bodies right where they count as a plane in
    /// each cell, `(k_1 + k_2) / 24`: that of the whole surface everywhere, along a semi-axis of an ellipsoid by the curvature of its end.
    fn felt(self, shape: &Arc<dyn Shape>, dx: f64) -> (Arc<dyn Shape>, f64) {
        let SurfaceShift { plane, curvature, edges } = self.shift;
        let Curvature { mean, smooth, sharpness } = shape.curvature();
        let shift = |mean: f64, smooth: f64, most: f64| {
            plane + smooth * dx / 12.0 - curvature * (mean * dx).min(most) - edges * sharpness
        };
        let moved = shape.as_ellipsoid().and_then(|semi_axes| {
            let squares = semi_axes.component_mul(&semi_axes);
            let end = |i: usize| {
                let curved = 0.5 * semi_axes[i] * (1.0 / squares[(i + 1) % 3] + 1.0 / squares[(i + 2) % 3]);
                semi_axes[i] - shift(mean + END * (curved - mean), curved, MOST_CURVED_END) * dx
            };
            Ellipsoid::new(Vec3::from_fn(|i, _| end(i))).ok()
        });
        match moved {
            Some(ellipsoid) => (Arc::new(ellipsoid), 0.0),
            None => (shape.clone(), shift(mean, smooth, MOST_CURVED)),
        }
    }

    fn may_keep(self, part: &Mapper) -> bool {
        polyhedra::planes(part).is_some()
    }

    fn cover(self, mapper: &Mapper, image: &Image, cover: &mut Cover, simd: Simd) {
        match &mapper.geometry {
            Geometry::Sphere(radius) => cover.add(SphereSurface::new(mapper, *radius), mapper, image, simd),
            Geometry::Flat(planes) => {
                cover.add(FlatSurface::new(mapper, planes, LEAST_SKIN), mapper, image, simd);
            }
            Geometry::Ellipsoid(semi_axes) => {
                cover.add(EllipsoidSurface::new(mapper, *semi_axes), mapper, image, simd);
            }
            Geometry::Cylinder(radius, half) => {
                cover.add(CylinderSurface::new(mapper, *radius, *half), mapper, image, simd);
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
