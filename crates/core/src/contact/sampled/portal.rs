//! The direction in which two convex bodies meet, from their furthest points along directions.
//!
//! The bodies overlap if the offset of the second from the first lies in the body of all differences of their points
//! (both taken from their centres). A triangle of points of its surface, the portal, through which the ray from its
//! centre to the offset leaves, is moved outwards until its normal is that of the surface there. A plane through
//! the furthest point along that normal which has the offset beyond it tells that the bodies are apart.
//!
//! # Reference
//! Snethen (2008), `XenoCollide`, Game Programming Gems 7, section 2.5.

use super::side::Side;
use crate::math::Vec3;

/// Triangles tried.
const STEPS: u32 = 60;
/// Limit on how far the surface may be beyond the portal, relative to the depth.
const PRECISION: f64 = 0.02;

/// Unit vector from the first body to the second, about normal to both where they meet; `None` if they are apart.
pub(super) fn normal(first: &Side, second: &Side, offset: Vec3) -> Option<Vec3> {
    // The second body stands at `offset`.
    meeting(offset, |along| {
        let (Some(a), Some(b)) = (first.support(along), second.support(-along)) else {
            return Vec3::zeros();
        };
        a - (b - offset)
    })
}

/// The same from the furthest difference of a point of the first body and one of the second, each from its centre,
/// along a unit vector. Bodies that are as good as in touch count as overlapping.
pub(in crate::contact) fn meeting(offset: Vec3, furthest: impl Fn(Vec3) -> Vec3) -> Option<Vec3> {
    let fallback = offset.try_normalize(0.0).unwrap_or_else(Vec3::x);
    let unit = |v: Vec3| v.try_normalize(0.0);
    let mut a = furthest(fallback);
    if a.dot(&fallback) <= offset.dot(&fallback) {
        return None;
    }
    let size = a.norm();
    // With the offset in the centre, or the point on the ray, every direction or this one is right.
    let sideways = a.cross(&offset);
    if offset.norm() <= 1e-12 * size || sideways.norm() <= 1e-12 * size * offset.norm() {
        return Some(fallback);
    }
    let mut b = furthest(unit(sideways)?);
    if b.dot(&sideways) <= 0.0 {
        return Some(fallback);
    }
    if a.cross(&b).dot(&offset) < 0.0 {
        std::mem::swap(&mut a, &mut b);
    }
    let mut c = Vec3::zeros();
    for _ in 0..STEPS {
        let Some(aside) = unit(a.cross(&b)) else {
            return Some(fallback);
        };
        c = furthest(aside);
        if c.cross(&a).dot(&offset) < 0.0 {
            b = c;
        } else if b.cross(&c).dot(&offset) < 0.0 {
            a = c;
        } else {
            break;
        }
    }
    let mut best = fallback;
    for _ in 0..STEPS {
        let Some(mut normal) = unit((b - a).cross(&(c - a))) else {
            return Some(best);
        };
        if normal.dot(&a) < 0.0 {
            normal = -normal;
        }
        best = normal;
        let p = furthest(normal);
        let depth = normal.dot(&(p - offset));
        if depth <= 0.0 {
            return None;
        }
        let beyond = normal.dot(&(p - a));
        if beyond <= PRECISION * depth || beyond <= 1e-12 * size {
            return Some(best);
        }
        let [by_a, by_b, by_c] = [a, b, c].map(|corner| p.cross(&corner).dot(&offset));
        if by_b <= 0.0 && by_a >= 0.0 {
            c = p;
        } else if by_c <= 0.0 && by_b >= 0.0 {
            a = p;
        } else {
            b = p;
        }
    }
    Some(best)
}
