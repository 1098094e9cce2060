//! Contacts at one time: overlapping pairs and their relative velocities.

use super::NativeParams;
use super::failures::{is_too_deep, too_deep};
use super::films::{Acting, Films};
use super::forces::{ContactForces, ContactInput, PairEntry};
use super::order::{IdOrder, PartIndex};
use super::velocities::KnownVelocities;
use crate::contact::law::Action;
use crate::contact::{
    Body, CohesionLaw, ContactModel, GrownShape, Overlap, PairLaw, PairProperties, RelativeMotion,
    overlap_again,
};
use crate::dem::assign::GhostLayer;
use crate::dem::exchange::LocalParticles;
use crate::dem::integrator::Inertia;
use crate::dem::{ContactKey, Load};
use crate::error::Result;
use crate::math::{Mat3, Vec3};
use crate::particle::{Particle, PrescribedMotion, Template};
use crate::shape::{Part, Shape};
use std::sync::Arc;

/// Bounding spheres that miss each other by less than this part of their distance are left to the exact test.
const SLACK: f64 = 1e-9;

/// Properties of a template that contacts need.
#[derive(Clone, Debug)]
pub(super) struct TemplateConstants {
    /// Its convex parts.
    pub(super) parts: Vec<PartConstants>,
    /// [`ContactModel::reach`] of the shape (m).
    pub(super) bound: f64,
    /// [`ContactModel::reach_along`] of the shape (m).
    pub(super) reach: Vec3,
    pub(super) inertia: Inertia,
    /// Its weight (N).
    pub(super) weight: Vec3,
    /// The axis of the box along which it goes through it, the only one that it turns about.
    pub(super) turns_about: Option<usize>,
    /// True if nothing of its motion is prescribed.
    pub(super) is_free: bool,
    /// Prescribed part of its motion.
    pub(super) motion: PrescribedMotion,
}

/// Properties of a convex part of a template that contacts need.
#[derive(Clone, Debug)]
pub(super) struct PartConstants {
    pub(super) shape: GrownShape,
    /// Its pose in the body, if it is not the only part.
    pose: Option<Part>,
    /// The parts of the body that it shares space with.
    shared: Vec<u32>,
    /// [`ContactModel::reach`] of the shape (m).
    pub(super) bound: f64,
    /// Radius of the sphere of equal volume, or across a body that goes through the box, plus enlargement (m).
    pub(super) radius: f64,
    /// Distance (m) to a wall below which the part may touch it, hold on to it, or have a film there.
    pub(super) near_wall: f64,
    /// Circumradius of the shape (m).
    pub(super) circumradius: f64,
    /// [`Shape::thickness_of`] the part (m).
    pub(super) thickness: f64,
    /// Mean curvature of the shape (1/m), if there are films.
    pub(super) mean_curvature: f64,
}

impl PartConstants {
    /// The parts of a template.
    pub(super) fn all(template: &Template, model: &ContactModel) -> Vec<Self> {
        let (shape, parts) = (&template.shape, template.parts().enumerate());
        let part = |(n, part)| Self {
            shared: shape.shared_with(n).to_vec(),
            thickness: shape.thickness_of(n),
            ..Self::new(part, model)
        };
        parts.map(part).collect()
    }

    fn new((shape, pose): (&Arc<dyn Shape>, Option<&Part>), model: &ContactModel) -> Self {
        let (bound, circumradius) = (model.reach(shape), shape.circumradius());
        let range = model.lubrication.map_or(0.0, |lubrication| lubrication.range());
        let grown = circumradius + model.enlargement;
        Self {
            shape: GrownShape::new(shape.clone(), model.enlargement),
            pose: pose.cloned(),
            shared: Vec::new(),
            bound,
            near_wall: bound.max(circumradius + range).max(grown + model.stretch(grown)),
            circumradius,
            radius: shape.passage().map_or(0.5 * shape.equivalent_diameter(), |passage| passage.radius)
                + model.enlargement,
            thickness: shape.thickness(),
            mean_curvature: model.lubrication.map_or(0.0, |_| shape.curvature().mean),
        }
    }

    /// True if the body has no other part.
    #[inline]
    pub(super) fn is_whole(&self) -> bool {
        self.pose.is_none()
    }

    /// Distance of its centre from that of the body (m).
    pub(super) fn length(&self) -> f64 {
        self.pose.as_ref().map_or(0.0, |pose| pose.position.norm())
    }

    /// Its centre relative to that of a particle (m), unless it is the only part.
    pub(super) fn arm(&self, particle: &Particle) -> Option<Vec3> {
        self.pose.as_ref().map(|pose| particle.orientation() * pose.position)
    }

    /// The part of a particle.
    pub(super) fn body(&self, particle: &Particle) -> Body<'_> {
        let turn = particle.orientation();
        let orientation = self.pose.as_ref().map_or(turn, |pose| turn * pose.orientation);
        Body { grown: &self.shape, orientation }
    }
}

/// The neck by which two spheres that do not overlap, `offset` (m) apart, hold on to each other if they have touched.
#[inline]
fn neck(parts: [&PartConstants; 2], offset: Vec3, law: &PairLaw) -> Option<Overlap> {
    if !law.cohesion.has_neck() {
        return None;
    }
    let [Some(a), Some(b)] = parts.map(|part| part.shape.sphere()) else { return None };
    let distance = offset.norm();
    let (normal, depth) = (offset / distance, a + b - distance);
    // In the plane in which overlaps of spheres have their disc.
    let plane = 0.5 * (distance + (a - b) * (a + b) / distance);
    let holds = depth >= -law.cohesion.stretch(a / (1.0 + a / b));
    holds.then(|| Overlap::neck(normal * plane, normal, depth))
}

/// The van der Waals pull of two spheres with these radii (m), that of a wall infinite, whose surfaces are a gap (m) apart along a normal, beside the film
/// there; `arms` (m) lead from the centres of the bodies to those of the spheres.
pub(super) fn with_pull(
    film: Option<Acting>,
    model: &ContactModel,
    radii: [Option<f64>; 2],
    arms: [Option<Vec3>; 2],
    gap: impl FnOnce(f64) -> (Vec3, f64),
) -> Option<Acting> {
    let (Some(law), [Some(a), Some(b)]) = (&model.van_der_waals, radii) else { return film };
    let (normal, width) = gap(a + b);
    let pull = law.pull(width, a / (1.0 + a / b));
    if pull <= 0.0 {
        return film;
    }
    // Through both centres, so that it turns spheres about nothing but the centre of a body of several.
    let ([arm, its], force) = (arms.map(Option::unwrap_or_default), normal * pull);
    let action = Action { force, torques: [arm.cross(&force), its.cross(&-force)] };
    Some(match film {
        Some(film) => Acting { action: film.action.plus(&action), ..film },
        None => Acting { action, normal, lever: arm + normal * (a + 0.5 * width) },
    })
}

/// Masses (kg) of the two bodies of a contact: infinite, and second, where forces do not move the centre of one of them.
fn masses(bodies: [&TemplateConstants; 2]) -> [f64; 2] {
    let [a, b] = bodies.map(|body| body.inertia.mass);
    match bodies.map(|body| body.motion.holds_centre()) {
        [true, false] => [b, f64::INFINITY],
        [false, true] => [a, f64::INFINITY],
        // Between two of them only a rotation can be free.
        _ => [a, b],
    }
}

/// Everything that contacts depend on.
#[derive(Clone, Debug)]
pub(super) struct ContactContext {
    pub(super) params: NativeParams,
    /// As those of the store.
    pub(super) templates: Vec<TemplateConstants>,
    /// By the materials of the pair, as [`ContactModel::pairs`].
    pub(super) laws: Vec<PairLaw>,
    pub(super) near: GhostLayer,
    pub(super) local: LocalParticles,
    /// Sub-steps since the start.
    pub(super) substep: u64,
    /// Loads of the previous sub-step by particle, if a law needs them.
    pub(super) past: Vec<Load>,
    /// True if the box is so narrow that a body may meet several images of another, or its own.
    pub(super) is_narrow: bool,
}

impl ContactContext {
    /// Constants of the template of a particle.
    pub(super) fn constants(&self, particle: &Particle) -> &TemplateConstants {
        &self.templates[particle.template as usize]
    }

    /// Particle and constants of a part.
    pub(super) fn part(&self, index: PartIndex) -> (&Particle, &PartConstants) {
        let particle = &self.local.store.particles[index.particle as usize];
        (particle, &self.constants(particle).parts[index.part as usize])
    }

    /// Shift (boxes) of the second body from its nearest image, of two parts `offset` (m) apart, that image `own` boxes from the nearest
    /// one; none if they are parts of one body, or if a nearer image continues them.
    pub(super) fn shift(&self, parts: [PartIndex; 2], own: [i8; 3], offset: Vec3) -> Option<[i8; 3]> {
        let is_one = parts[0].particle == parts[1].particle;
        if !self.is_narrow {
            return (!is_one).then_some([0; 3]);
        }
        let [(a, one), (b, other)] = parts.map(|index| self.part(index));
        let passages = [one, other].map(|part| part.shape.shape.passage());
        if passages.into_iter().flatten().any(|passage| own[passage.axis] != 0) {
            return None;
        }
        let [arm, its] = [one.arm(a), other.arm(b)].map(Option::unwrap_or_default);
        let domain = self.near.decomposition().domain;
        let shift = domain.boxes(offset + arm - its - domain.nearest_image(b.position() - a.position()));
        (!is_one || shift != [0; 3]).then_some(shift)
    }

    /// Part of a contact that counts, where parts of a body share space: one over the number of parts that have it,
    ///
    /// ```text
    /// 1 / (1 + sum_j f_j),   f_j = (1 - s_j / e_j) / 2 within 0 and 1,   e_j = a sin + d/2 cos
    /// ```
    ///
    /// `s_j` is the distance of the point of contact from the surface of another part, and `e_j` how far the contact reaches across that surface: a disc with its area,
    /// of the radius `a` and as thick as the depth `d`, with the angle of both normals. `overlap` is seen from the centre of the body.
    pub(super) fn share(&self, index: PartIndex, point: Vec3, overlap: &Overlap) -> f64 {
        let (particle, part) = self.part(index);
        let Overlap { normal, depth, area, .. } = *overlap;
        if part.shared.is_empty() || depth <= 0.0 {
            return 1.0;
        }
        let radius = (area * std::f64::consts::FRAC_1_PI).sqrt();
        let parts = &self.constants(particle).parts;
        let within = part.shared.iter().map(|&other| {
            let other = &parts[other as usize];
            let Body { grown, orientation } = other.body(particle);
            let seen = point - other.arm(particle).unwrap_or_default();
            let own = orientation.inverse_transform_vector(&seen);
            let (distance, gradient) = grown.shape.distance_and_gradient(own);
            let cosine = (orientation * gradient).dot(&normal).abs().min(1.0);
            let reach = radius * (1.0 - cosine * cosine).sqrt() + 0.5 * depth * cosine;
            (0.5 * (1.0 - (distance - grown.enlargement) / reach)).clamp(0.0, 1.0)
        });
        1.0 / (1.0 + within.sum::<f64>())
    }

    /// The parts of the owned particles.
    pub(super) fn owned_parts(&self) -> impl Iterator<Item = PartIndex> {
        let owned = (0..).zip(self.local.store.owned());
        owned.flat_map(|(particle, of)| {
            (0..self.constants(of).parts.len() as u32).map(move |part| PartIndex { particle, part })
        })
    }

    /// Material of a particle.
    pub(super) fn material(&self, particle: &Particle) -> usize {
        self.local.store.template(particle).material
    }

    /// The motion of one body relative to another, by the [velocities](super::velocities::Velocities::at) of both.
    pub(super) fn relative(&self, [a, b]: [[Vec3; 3]; 2], dt: f64) -> RelativeMotion {
        RelativeMotion {
            velocity: a[0] - b[0],
            before: a[1] - b[1],
            spin: (a[2] + b[2]) * 0.5,
            turning: a[2] - b[2],
            elapsed: if self.substep > 0 { dt } else { 0.0 },
        }
    }

    /// Contacts of pairs of particles that this rank evaluates, in ascending order of their ids, with sub-steps of `dt`
    /// (s), and the films between them. A particle may meet images of itself.
    pub(super) fn pairs(
        &self,
        model: &ContactModel,
        dt: f64,
        (order, films): (&mut IdOrder, &mut Films),
        (forces, velocities): (&mut ContactForces, &mut KnownVelocities),
    ) -> Result<()> {
        let (store, near) = (&self.local.store, &self.near);
        let IdOrder { list, parts, positions, radii, rotations, .. } = order;
        let domain = near.decomposition().domain;
        let (nearest, alone, unturned) = (domain.images_nearest(), near.ranks() == 1, Mat3::identity());
        velocities.clear(store.particles.len());
        let has_necks = model.cohesion == CohesionLaw::Jkr;
        let mut outcome = Ok(());
        for (neighbour, place) in list.find(positions, radii).iter_mut().zip(0..) {
            let [p, q] = [neighbour.pair[0] as usize, neighbour.pair[1] as usize];
            let (offset, reach) = (neighbour.offset((&domain, &nearest), positions), radii[p] + radii[q]);
            if offset.norm_squared() > reach * reach * (1.0 + SLACK) {
                continue;
            }
            let indices = [p, q].map(|k| parts[k]);
            let [i, j] = indices.map(|index| index.particle as usize);
            let Some(shift) = self.shift(indices, neighbour.shift, offset) else { continue };
            if !alone && near.evaluating_rank_of([i, j], store) != Some(near.rank) {
                continue;
            }
            let [(a, one), (b, other)] = indices.map(|index| self.part(index));
            let bodies = [&one.body(a), &other.body(b)];
            let turns = [p, q].map(|k| rotations.get(k).unwrap_or(&unturned));
            let hint = &mut neighbour.hint;
            let film = self.between(model, (place, indices), offset, films);
            let parts = indices.map(|index| index.part);
            let key = ContactKey { first: a.id, second: b.id, parts }.with_shift(shift);
            let touched = [Some(i), Some(j)];
            let [first, second] = [a, b].map(|p| self.constants(p));
            let held = first.motion.is_complete() && second.motion.is_complete();
            let law = || &self.laws[self.material(a) * model.materials.len() + self.material(b)];
            let overlap = if held {
                None
            } else {
                overlap_again(model.geometry, bodies, turns, offset, hint).or_else(|| {
                    let neck = has_necks.then(|| neck([one, other], offset, law())).flatten();
                    neck.filter(|_| forces.history.knows(&key))
                })
            };
            let Some(overlap) = overlap else {
                let gap = |radii: f64| {
                    let distance = offset.norm();
                    (offset / distance, distance - radii)
                };
                let radii = [one, other].map(|part| part.shape.sphere().filter(|_| !held));
                let acting = with_pull(film, model, radii, [one.arm(a), other.arm(b)], gap);
                if let Some(Acting { action, normal, lever }) = acting {
                    let point = domain.wrap(a.position() + lever);
                    forces.add(&PairEntry::apart(key, touched, (point, normal), action), near, store);
                }
                continue;
            };
            let (overlap, offset, part) = match [one.arm(a), other.arm(b)] {
                [None, None] => (overlap, offset, 1.0),
                arms => {
                    let [arm, its] = arms.map(Option::unwrap_or_default);
                    let (overlap, offset) = (overlap.seen_from(arm), offset + arm - its);
                    let own = self.share(indices[0], overlap.point, &overlap);
                    (overlap, offset, own * self.share(indices[1], overlap.point - offset, &overlap))
                }
            };
            let (law, levers) = (law(), [overlap.point, overlap.point - offset]);
            let input = ContactInput {
                key,
                from: None,
                indices: touched,
                law,
                overlap: &overlap,
                offset,
                properties: PairProperties {
                    radii: [one.radius, other.radius],
                    masses: masses([first, second]),
                    dt,
                },
                motion: self.relative(
                    [(i, levers[0]), (j, levers[1])]
                        .map(|(k, lever)| velocities.of(k, || self.velocities(k, dt)).at(&lever, law)),
                    dt,
                ),
                point: domain.wrap(a.position() + overlap.point),
            };
            let entry = forces.evaluate(&input).part(part);
            let entry = film.map_or(entry, |film| entry.with(&film.action));
            forces.add(&entry, near, store);
            let thinner = one.thickness.min(other.thickness);
            if is_too_deep(overlap.depth, thinner) && outcome.is_ok() {
                let partner = format_args!("particle {}", b.id);
                outcome = Err(too_deep(self.substep, a, partner, overlap.depth, thinner));
            }
        }
        outcome
    }
}
