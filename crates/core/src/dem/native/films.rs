//! Films of fluid in narrow gaps, between particles and at walls.

use super::context::{ContactContext, PartConstants, TemplateConstants};
use super::order::{IdOrder, PartIndex};
use crate::comm::Comm;
use crate::contact::law::Action;
use crate::contact::lubrication::{Film, Lubrication, Mobility, Partner, Rates, Side};
use crate::contact::nearest::{Ellipsoidal, Gap};
use crate::contact::{Body, ContactModel};
use crate::math::{Mat3, Vec3};
use crate::particle::Particle;
use crate::wall::{Surface, Wall};
use bytemuck::{Pod, Zeroable};

/// Rates of a particle (1/s), on their way to a rank that has it as a ghost.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct RatesRecord {
    id: u64,
    rates: Rates,
}

/// The films of a sub-step. Those of pairs are found once, which takes far more time than to use them. Keeps its buffers from sub-step to sub-step.
#[derive(Clone, Debug, Default)]
pub(super) struct Films {
    mobilities: Vec<Mobility>,
    /// Sums of the rates of each particle, ghosts included.
    sums: Vec<Rates>,
    /// The particles as films meet them, ghosts included.
    sides: Vec<Side>,
    /// Films of pairs with an owned particle, by their index in the list of neighbours, ascending.
    found: Vec<(u32, Placed)>,
    /// Those of them that lie behind.
    passed: usize,
    /// Length of the sub-step (s).
    dt: f64,
}

impl Films {
    /// The place of the film that was found for a pair of the list. Pairs come in ascending order.
    fn place(&mut self, neighbour: u32) -> Option<usize> {
        let before = |(at, _): &&(u32, Placed)| *at < neighbour;
        self.passed += self.found[self.passed..].iter().take_while(before).count();
        self.found.get(self.passed).is_some_and(|(at, _)| *at == neighbour).then_some(self.passed)
    }

    /// Action of a film between a particle and another, or a wall.
    fn act(&self, context: &ContactContext, placed: &Placed, sides: [&Side; 2]) -> Acting {
        let Placed { film, normal, lever, .. } = *placed;
        Acting { action: film.act(sides, context.span(self.dt)), normal, lever }
    }
}

/// A film that acts on the first of its bodies, with its place.
pub(super) struct Acting {
    /// Force and torques.
    pub(super) action: Action,
    /// Unit normal, from the first body to the second.
    pub(super) normal: Vec3,
    /// From the centre of the first body to the middle of the gap (m).
    pub(super) lever: Vec3,
}

/// A film in its place.
#[derive(Clone, Copy, Debug)]
struct Placed {
    film: Film,
    /// Unit normal, from the first body to the second.
    normal: Vec3,
    /// From the centre of the first body to the middle of the gap (m).
    lever: Vec3,
    /// From that centre to the surface of the second body (m).
    foot: Vec3,
}

impl Placed {
    fn new(lubrication: &Lubrication, gap: &Gap, mean: f64, partner: Partner) -> Option<Self> {
        let film = lubrication.film(gap, mean, partner)?;
        let Gap { normal, width, points: [point, _], .. } = *gap;
        Some(Self { film, normal, lever: point + normal * (0.5 * width), foot: point + normal * width })
    }
}

impl PartConstants {
    /// The radius (m) of a sphere that is a body of its own.
    fn film_radius(&self) -> Option<f64> {
        self.shape.shape.as_sphere().filter(|_| self.is_whole())
    }

    /// The part of a particle if it is a sphere or an ellipsoid.
    fn ellipsoidal(&self, particle: &Particle) -> Option<Ellipsoidal> {
        let Body { grown, orientation } = self.body(particle);
        let semi_axes = grown.shape.as_ellipsoid().or(grown.shape.as_sphere().map(Vec3::repeat))?;
        Some(Ellipsoidal::new(semi_axes, &orientation))
    }
}

impl ContactContext {
    fn mobility(&self, particle: &Particle) -> Mobility {
        let TemplateConstants { inertia, motion, .. } = self.constants(particle);
        let turn = particle.orientation().to_rotation_matrix().into_inner();
        let moments = inertia.moments.map(|moment| 1.0 / moment);
        Mobility {
            mass: if motion.holds_centre() { 0.0 } else { 1.0 / inertia.mass },
            inertia: if motion.free_rotation {
                turn * Mat3::from_diagonal(&moments) * turn.transpose()
            } else {
                Mat3::zeros()
            },
        }
    }

    /// The gap between two parts of particles, `offset` (m) from the centre of the first to that of the second, if it has a film.
    fn gap(pair: [(&Particle, &PartConstants); 2], offset: Vec3, range: f64) -> Option<Gap> {
        if let [Some(a), Some(b)] = pair.map(|(_, part)| part.film_radius()) {
            let distance = offset.norm();
            let width = distance - a - b;
            return (width < range).then(|| Gap::of_spheres([a, b], offset / distance, width));
        }
        let face = |k: usize, other: &Ellipsoidal, offset: Vec3| {
            let (particle, part) = pair[k];
            let Body { grown, orientation } = part.body(particle);
            other.gap_to_face((grown.shape.as_polyhedron()?, &orientation), offset, range)
        };
        let mut gap = match pair.map(|(particle, part)| part.ellipsoidal(particle)) {
            [Some(first), Some(second)] => first.gap(&second, offset, range),
            [Some(first), None] => face(1, &first, offset),
            [None, Some(second)] => face(0, &second, -offset).map(Gap::flipped),
            [None, None] => None,
        }?;
        for (point, (particle, part)) in gap.points.iter_mut().zip(pair) {
            *point = part.arm(particle).map_or(*point, |arm| *point + arm);
        }
        Some(gap)
    }

    /// The film between two parts of particles, `offset` (m) from the centre of the first to that of the second.
    fn film(
        lubrication: &Lubrication,
        pair: [(&Particle, &PartConstants); 2],
        offset: Vec3,
    ) -> Option<Placed> {
        let reach = pair.map(|(_, part)| part.shape.shape.circumradius());
        let reach = reach[0] + reach[1] + lubrication.range();
        if offset.norm_squared() >= reach * reach {
            return None;
        }
        let gap = Self::gap(pair, offset, lubrication.range())?;
        let mean = pair[0].1.mean_curvature + pair[1].1.mean_curvature;
        Placed::new(lubrication, &gap, mean, Partner::Body)
    }

    /// The film between a part of a particle and the surface of a wall; none at a mesh.
    fn wall_film(
        lubrication: &Lubrication,
        (particle, part): (&Particle, &PartConstants),
        surface: &Surface,
    ) -> Option<Placed> {
        if surface.mesh().is_some() {
            return None;
        }
        let (arm, range) = (part.arm(particle), lubrication.range());
        let centre = arm.map_or(particle.position(), |arm| particle.position() + arm);
        let distance = surface.distance(centre);
        if distance >= part.shape.shape.circumradius() + range {
            return None;
        }
        let gap = if let Some(radius) = part.film_radius() {
            Gap::of_spheres([radius, f64::INFINITY], -surface.normal(centre), distance - radius)
        } else {
            let mut gap = part.ellipsoidal(particle)?.gap_to_wall(&surface.seen_from(centre), range)?;
            gap.points[0] = arm.map_or(gap.points[0], |arm| gap.points[0] + arm);
            gap
        };
        Placed::new(lubrication, &gap, part.mean_curvature, Partner::Wall)
    }

    /// Finds the films of a sub-step of `dt` (s), and the sums of the rates of each particle, ghosts included; none without lubrication. An
    /// owner has all bodies near its particles, so it finds their sums alone, in ascending order of the partners, and tells
    /// them to the ranks that have ghosts of them. Collective.
    pub(super) fn find_films(
        &self,
        (model, films): (&ContactModel, &mut Films),
        order: &mut IdOrder,
        dt: f64,
        comm: &Comm,
    ) {
        let (Some(lubrication), store) = (&model.lubrication, &self.local.store) else { return };
        let Films { mobilities, sums, sides, found, .. } = films;
        mobilities.clear();
        mobilities.extend(store.particles.iter().map(|particle| self.mobility(particle)));
        sums.clear();
        sums.resize(store.particles.len(), [0.0; 2]);
        found.clear();
        let mut add = |index: usize, rates: Rates| {
            for (sum, rate) in sums[index].iter_mut().zip(rates) {
                *sum += rate;
            }
        };
        let domain = self.near.decomposition().domain;
        let nearest = domain.images_nearest();
        let (list, parts, positions) = order.pairs();
        for (neighbour, at) in list.iter().zip(0..) {
            let [p, q] = neighbour.pair.map(|k| k as usize);
            let [i, j] = [p, q].map(|k| parts[k].particle as usize);
            if i.min(j) >= store.owned {
                continue;
            }
            let (indices, offset) =
                ([p, q].map(|k| parts[k]), neighbour.offset((&domain, &nearest), positions));
            if self.shift(indices, neighbour.shift, offset).is_none() {
                continue;
            }
            if let Some(placed) = Self::film(lubrication, indices.map(|index| self.part(index)), offset) {
                let [first, second] = placed.film.rates([i, j].map(|k| &mobilities[k]));
                add(i, first);
                add(j, second);
                found.push((at, placed));
            }
        }
        let (time, still) = (self.substep as f64 * dt, Mobility::default());
        for wall in &self.params.walls {
            let surface = wall.surface_at(time);
            for index in self.owned_parts() {
                let particle = index.particle as usize;
                if let Some(Placed { film, .. }) = Self::wall_film(lubrication, self.part(index), &surface) {
                    add(particle, film.rates([&mobilities[particle], &still])[0]);
                }
            }
        }
        self.tell_rates(sums, comm);
        sides.clear();
        sides.extend(sums.iter().enumerate().map(|(index, rates)| self.side(index, *rates, dt)));
        (films.passed, films.dt) = (0, dt);
    }

    /// Replaces the rates of ghosts by those of their owners.
    fn tell_rates(&self, sums: &mut [Rates], comm: &Comm) {
        let (near, store) = (&self.near, &self.local.store);
        if near.peers.is_empty() {
            return;
        }
        let mut messages = vec![Vec::new(); near.peers.len()];
        for (particle, &rates) in store.owned().iter().zip(&*sums) {
            for (link, message) in messages.iter_mut().enumerate() {
                if near.is_ghost_on_peer(link, particle.position(), particle.template) {
                    message.extend_from_slice(bytemuck::bytes_of(&RatesRecord { id: particle.id, rates }));
                }
            }
        }
        for message in comm.exchange(&near.peers, messages) {
            for RatesRecord { id, rates } in bytemuck::pod_collect_to_vec::<u8, RatesRecord>(&message) {
                if let Some(index) = self.local.index_of(id) {
                    sums[index] = rates;
                }
            }
        }
    }

    /// A particle as a film meets it: with the velocities that the loads of the sub-step before would bring about at the end of a
    /// sub-step of `dt` (s). The particle has those of a prediction with all forces, see [`integrator`](crate::dem::integrator).
    fn side(&self, index: usize, rates: Rates, dt: f64) -> Side {
        let particle = &self.local.store.particles[index];
        let TemplateConstants { inertia, motion, .. } = self.constants(particle);
        let past = self.past.get(index).filter(|_| self.substep > 0).copied().unwrap_or_default();
        let half = 0.5 * dt;
        let force = past.force + self.params.gravity * inertia.mass - Vec3::from(particle.contact_force);
        let force = Vec3::from_fn(|axis, _| if motion.free[axis] { force[axis] } else { 0.0 });
        let torque = past.torque - Vec3::from(particle.contact_torque);
        let torque = if motion.free_rotation { torque } else { Vec3::zeros() };
        let momentum = Vec3::from(particle.angular_momentum) + torque * half;
        Side {
            velocity: particle.velocity() + force * (half / inertia.mass),
            spin: inertia.angular_velocity(&particle.orientation(), momentum),
            rates,
        }
    }

    /// Time over which a film acts on the velocities of [`side`](Self::side): the first sub-step begins in its middle, see
    /// [`integrator::start`](crate::dem::integrator::start).
    fn span(&self, dt: f64) -> f64 {
        if self.substep == 0 { 0.5 * dt } else { dt }
    }

    /// Action of the film between two parts of particles, the pair `neighbour` of the list, `offset` (m) from the first to the second.
    pub(super) fn between(
        &self,
        model: &ContactModel,
        (neighbour, indices): (u32, [PartIndex; 2]),
        offset: Vec3,
        films: &mut Films,
    ) -> Option<Acting> {
        let lubrication = model.lubrication.as_ref()?;
        let [i, j] = indices.map(|index| index.particle as usize);
        let new;
        let placed = if i.min(j) < self.local.store.owned {
            let place = films.place(neighbour)?;
            &films.found[place].1
        } else {
            new = Self::film(lubrication, indices.map(|index| self.part(index)), offset)?;
            &new
        };
        Some(films.act(self, placed, [i, j].map(|k| &films.sides[k])))
    }

    /// Action of the film between a part of a particle and a wall whose surface is the one given at `time` (s).
    pub(super) fn at_wall(
        &self,
        model: &ContactModel,
        index: PartIndex,
        (wall, surface, time): (&Wall, &Surface, f64),
        films: &Films,
    ) -> Option<Acting> {
        let (particle, part) = self.part(index);
        let placed = Self::wall_film(model.lubrication.as_ref()?, (particle, part), surface)?;
        let velocity = wall.velocity(particle.position() + placed.foot, time);
        let still = Side { velocity, spin: Vec3::zeros(), rates: [0.0; 2] };
        Some(films.act(self, &placed, [&films.sides[index.particle as usize], &still]))
    }
}
