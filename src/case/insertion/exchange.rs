//! From the sections on particles that come and go to what a run needs, with all checks.
//!
//! Bodies are inserted one by one at random, and so fill at most a part `p = 0.4` of a region (spheres jam at 0.384). Those that move out of it
//! make room for others: with the volume `V` and the faces `A_i` of the region, grown by the reach of a body on each side, and a bound `u_i` of
//! the speed there, at most `p (V + sum u_i A_i t)` of solid volume can come in a time `t`.

use super::{Amount, Insertion, Removal, RemovedFrom, contours, largest_speed, volume_passed};
use crate::case::checks::{Clock, Document};
use crate::case::file::{AmountBy, Duration, FACES, InsertionSection, RegionSection, RemovalPlace};
use crate::case::placement::{Placer, pose};
use crate::case::walls::PlacedWall;
use crate::domain::{Domain, Face};
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::math::Vec3;
use crate::packing::insertion::{Bodies, Obstacles, Region};
use crate::packing::relax::Pose;
use crate::particle::{Particle, PrescribedMotion, Template};
use crate::wall::Surface;

/// Largest part of a region that bodies fill which are inserted one by one (-).
const JAMMED: f64 = 0.4;
/// Largest part of the box that a packing of any bodies fills (-).
const DENSEST: f64 = 0.8;
/// Least steps between two attempts by default.
const LEAST_INTERVAL: u64 = 20;
/// Attempts with which a region is known to have no room for a body beside walls.
const ATTEMPTS: u64 = 20;

/// A case, and all that its insertions and removals depend on.
pub(in crate::case) struct Exchange<'a> {
    pub(in crate::case) placer: &'a Placer<'a>,
    pub(in crate::case) clock: Clock,
    pub(in crate::case) end_step: u64,
    pub(in crate::case) motions: &'a [PrescribedMotion],
    /// Those of the start.
    pub(in crate::case) particles: &'a [Particle],
    pub(in crate::case) gravity: Vec3,
    /// Nothing but gravity and their own velocity moves the particles.
    pub(in crate::case) undriven: bool,
}

/// Refuses particles that come and go of an engine whose particles cannot.
pub(in crate::case) fn refuse_engine(document: &Document, engine: &EngineChoice) -> Result<()> {
    let key = ["insertion.0", "removal.0"].into_iter().find(|key| document.has(key));
    let (Some(key), false) = (key, *engine == EngineChoice::Native) else { return Ok(()) };
    let title =
        format!("`{key}` changes the number of particles, which an external engine, `dem.engine`, cannot");
    let marks = [(key, "particles come or go"), ("dem.engine", "the engine")];
    Err(document.error_at(&marks, &title, "take dem.engine = \"native\", or remove the section"))
}

impl Exchange<'_> {
    fn document(&self) -> &Document<'_> {
        self.placer.document
    }

    fn domain(&self) -> &Domain {
        &self.placer.domain
    }

    /// All insertions and removals of the case.
    pub(in crate::case) fn resolve(&self) -> Result<(Vec<Insertion>, Vec<Removal>)> {
        let case = &self.document().case;
        let insertions = case.insertion.iter().enumerate().map(|(n, section)| self.insertion(n, section));
        let insertions = insertions.collect::<Result<Vec<_>>>()?;
        let removals = case.removal.iter().enumerate().map(|(n, section)| {
            let key = format!("removal.{n}");
            if let Some(kind) = section.kind {
                self.kind(&key, kind)?;
                self.free(&key, "removes", kind)?;
            }
            let from = self.removed_from(&key, &section.place)?;
            Ok(Removal { section: section.kind, from })
        });
        let removals = removals.collect::<Result<Vec<_>>>()?;
        self.refuse_common_places(&insertions, &removals)?;
        for (n, insertion) in insertions.iter().enumerate() {
            self.refuse_where_no_room_is(n, insertion)?;
            self.refuse_what_is_too_fast(n, insertion)?;
        }
        self.refuse_overfull(&insertions, &removals)?;
        Ok((insertions, removals))
    }

    /// Refuses the number of a section that is not there.
    fn kind(&self, key: &str, kind: usize) -> Result<()> {
        let count = self.placer.kinds.sections.len();
        if kind < count {
            return Ok(());
        }
        let wanted = format!("the number of one of the {count} `[[particles]]` sections, counted from 0");
        let remedy = "a section with `count = 0` describes particles that are only inserted";
        Err(self.document().out_of_range(&format!("{key}.kind"), kind, &wanted, remedy))
    }

    /// Refuses a section of particles whose motion is prescribed; what the section `key` `does` with them.
    fn free(&self, key: &str, does: &str, kind: usize) -> Result<()> {
        if self.motions[kind].is_free() {
            return Ok(());
        }
        let (motion, does_so) = (format!("particles.{kind}.motion"), format!("{does} such particles"));
        let marks = [(key, &*does_so), (&*motion, "prescribes their motion")];
        let title = format!("`{key}` {does} particles whose motion is prescribed");
        Err(self.document().error_at(&marks, &title, "take a `[[particles]]` section of free particles"))
    }

    fn insertion(&self, n: usize, section: &InsertionSection) -> Result<Insertion> {
        let (document, key, index) = (self.document(), format!("insertion.{n}"), section.kind);
        self.kind(&key, index)?;
        if document.case.particles[index].through.is_some() {
            let through = format!("particles.{index}.through");
            let title = format!(
                "`{key}` inserts bodies that go through the box, which have places in `list` or `file` alone"
            );
            let marks = [(&*key, "inserts such bodies"), (&*through, "goes through the box")];
            return Err(document.error_at(&marks, &title, "take another `[[particles]]` section"));
        }
        self.free(&key, "inserts", index)?;
        let region = self.region(&key, &section.region)?;
        self.inside(&key, &region, [true; 3])?;
        let kind = &self.placer.kinds.sections[index];
        let templates = &self.placer.kinds.templates;
        let mean = |of: &dyn Fn(&Template) -> f64| -> f64 {
            kind.templates().zip(&kind.fractions).map(|(n, part)| part * of(&templates[n])).sum()
        };
        let amount = match section.amount {
            AmountBy::ParticleRate(rate) => Amount::Rate(rate),
            AmountBy::MassRate(rate) => Amount::Rate(rate / mean(&Template::mass)),
            AmountBy::VolumeFraction(fraction) => Amount::VolumeFraction(fraction),
        };
        let volume = mean(&|template| template.shape.volume());
        let room = region.edges().product();
        if let Amount::VolumeFraction(fraction) = amount
            && fraction * room < volume
        {
            let title = format!(
                "`{key}` fills a region of {room:.4e} m^3 to a volume fraction of {fraction}, less than one particle of {volume:.4e} m^3"
            );
            let remedy = "take a larger region, or give a rate, for which the region may be a plane";
            return Err(document.error(&format!("{key}.region"), &title, "too small", remedy));
        }
        let steps = |name: &str, given: Option<Duration>, default: u64| match given {
            None => Ok(default),
            Some(Duration::Steps(0)) if name == "start" => Ok(0),
            Some(given) => document.steps(&format!("{key}.{name}"), given, self.clock),
        };
        let (from, to) = (steps("start", section.start, 0)?, steps("end", section.end, u64::MAX)?);
        if to <= from {
            let marks = [(&*format!("{key}.start"), "begins here"), (&*format!("{key}.end"), "ends here")];
            let title = format!("`{key}` ends at step {to}, but begins at step {from}");
            return Err(document.error_at(&marks, &title, "give a later end, or leave it out"));
        }
        let velocity = [section.velocity, section.velocity_spread].map(Vec3::from);
        let (speed, cell) = (largest_speed(velocity) * self.clock.time_step, self.domain().dx);
        if speed > cell {
            let title = format!(
                "`{key}` inserts particles that would move by {:.3} cells in a step, more than 1",
                speed / cell
            );
            let remedy = "velocities are in m/s; take a smaller time step or a lower velocity";
            return Err(document.error(&format!("{key}.velocity"), &title, "too fast", remedy));
        }
        let usual = match amount {
            Amount::Rate(rate) => (1.0 / (rate * self.clock.time_step)) as u64,
            Amount::VolumeFraction(_) => 0,
        };
        let orientation = section.orientation.as_ref().map(|given| {
            Ok(kind.turned(&self.document().orientation(&format!("{key}.orientation"), given)?))
        });
        Ok(Insertion {
            section: index,
            bodies: Bodies {
                // Insertions with the same seed differ.
                seed: section.seed.unwrap_or(1).wrapping_add((n as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
                fractions: kind.templates().zip(kind.fractions.iter().copied()).collect(),
                orientation: orientation.transpose()?,
                velocity,
            },
            region,
            amount,
            steps: [from, to],
            every: steps("every", section.every, usual.max(LEAST_INTERVAL))?,
            most: section.count.unwrap_or(u64::MAX),
            volume,
        })
    }

    fn region(&self, key: &str, section: &RegionSection) -> Result<Region> {
        let region = Region { lower: section.lower.into(), upper: section.upper.into() };
        if let Some(i) = (0..3).find(|&i| region.lower[i] > region.upper[i]) {
            let (low, high, axis) = (region.lower[i], region.upper[i], ["x", "y", "z"][i]);
            let key = format!("{key}.region");
            let title = format!("`{key}` begins at {axis} = {low} m and ends at {high} m");
            return Err(self.document().error(&key, &title, "upside down", "the lower corner comes first"));
        }
        Ok(region)
    }

    /// Refuses a region that is not in the box along some `axes`; rounding may put it beside a face.
    fn inside(&self, key: &str, region: &Region, axes: [bool; 3]) -> Result<()> {
        let size = self.domain().size();
        let margin = 1e-9 * size;
        for (name, corner) in [("lower", region.lower), ("upper", region.upper)] {
            if let Some(i) =
                (0..3).find(|&i| axes[i] && !(-margin[i]..=size[i] + margin[i]).contains(&corner[i]))
            {
                let (x, edge, axis) = (corner[i], size[i], ["x", "y", "z"][i]);
                let key = format!("{key}.region.{name}");
                let title =
                    format!("`{key}` lies outside the box: {axis} is {x} m, but must be from 0 to {edge} m");
                let remedy = "positions are in metres, and the box starts at the origin";
                return Err(self.document().error(&key, &title, "outside the box", remedy));
            }
        }
        Ok(())
    }

    fn removed_from(&self, key: &str, place: &RemovalPlace) -> Result<RemovedFrom> {
        let (document, size) = (self.document(), self.domain().size());
        let whole = Region { lower: Vec3::zeros(), upper: size };
        let (from, is_there, name) = match place {
            RemovalPlace::Region(section) => {
                let region = self.region(key, section)?;
                self.inside(key, &region, [0, 1, 2].map(|axis| self.domain().is_periodic(axis)))?;
                (RemovedFrom::Region(region), region.meets(&whole), "region")
            }
            RemovalPlace::Plane(section) => {
                let normal = document.direction(&format!("{key}.plane.normal"), section.normal)?;
                let plane = Surface::Plane { point: section.point.into(), normal };
                let is_there = whole.corners().any(|corner| plane.distance(corner) < 0.0);
                (RemovedFrom::Plane(plane), is_there, "plane")
            }
            RemovalPlace::Outlet(name) => {
                let key = format!("{key}.outlet");
                let face = FACES.iter().position(|face| face == name);
                let is_open = |n: &usize| matches!(self.domain().faces[*n], Face::Outlet { .. });
                let Some(n) = face.filter(is_open) else {
                    let wanted = "the name of a face of `domain.faces` with an `outlet`";
                    let remedy = "a `region` or a `plane` removes particles anywhere in the box";
                    return Err(document.out_of_range(&key, format!("\"{name}\""), wanted, remedy));
                };
                let of_face = |placed: &&PlacedWall| placed.is_face && placed.wall.name == FACES[n];
                let wall = self.placer.walls.iter().find(of_face).expect("a closed face is a wall");
                return Ok(RemovedFrom::Outlet(wall.wall.surface.clone()));
            }
        };
        if is_there {
            return Ok(from);
        }
        let key = format!("{key}.{name}");
        let title =
            format!("`{key}` has nothing of the box, which ends at ({}, {}, {}) m", size.x, size.y, size.z);
        let remedy = "move it into the box; a plane removes what is behind it, on the side that its normal points away from";
        Err(document.error(&key, &title, "removes nothing", remedy))
    }

    /// Largest distance (m) of a point of an inserted particle from its centre.
    fn reach(&self, insertion: &Insertion) -> f64 {
        let of = |(template, _): &(usize, f64)| self.placer.kinds.templates[*template].shape.circumradius();
        insertion.bodies.fractions.iter().map(of).fold(0.0, f64::max)
    }

    /// Refuses two insertions into one place if one fills it to a volume fraction, and insertion where particles are removed.
    fn refuse_common_places(&self, insertions: &[Insertion], removals: &[Removal]) -> Result<()> {
        let key = |n: usize| format!("insertion.{n}.region");
        for (n, one) in insertions.iter().enumerate() {
            let fills = |of: &Insertion| matches!(of.amount, Amount::VolumeFraction(_));
            let mut others = insertions[..n].iter();
            if let Some(other) =
                others.position(|other| (fills(one) || fills(other)) && one.region.overlaps(&other.region))
            {
                let (first, second) = (key(other), key(n));
                let title = format!(
                    "`{first}` and `{second}` overlap, and one of them is filled to a volume fraction"
                );
                let marks = [(&*first, "here"), (&*second, "and here")];
                let remedy = "move them apart, or insert both by a rate: a volume fraction counts all particles of its region";
                return Err(self.document().error_at(&marks, &title, remedy));
            }
            let reach = self.reach(one) + self.placer.enlargement;
            let is_removed = |removal: &Removal| {
                let mut corners = one.region.corners();
                removal.section.is_none_or(|section| section == one.section)
                    && match &removal.from {
                        RemovedFrom::Region(region) => region.meets(&one.region),
                        RemovedFrom::Plane(plane) => corners.any(|corner| plane.distance(corner) < 0.0),
                        RemovedFrom::Outlet(face) => corners.any(|corner| face.distance(corner) <= reach),
                    }
            };
            if let Some(other) = removals.iter().position(is_removed) {
                let (inserted, removed) = (key(n), format!("removal.{other}"));
                let title = format!("`{removed}` removes particles where `insertion.{n}` inserts them");
                let marks = [(&*inserted, "inserted here"), (&*removed, "removed here")];
                return Err(self.document().error_at(&marks, &title, "move them apart"));
            }
        }
        Ok(())
    }

    /// Refuses a region in which the largest of the particles finds no room between walls and bodies whose motion is prescribed.
    fn refuse_where_no_room_is(&self, n: usize, insertion: &Insertion) -> Result<()> {
        let contours = contours(&self.placer.kinds.templates, self.placer.enlargement);
        let walls: Vec<Surface> =
            self.placer.walls.iter().map(|placed| placed.wall.surface.clone()).collect();
        let reach = |(template, _): &&(usize, f64)| contours[*template].reach();
        let largest = insertion.bodies.fractions.iter().max_by(|a, b| reach(a).total_cmp(&reach(b)));
        let Some(&(template, _)) = largest else { return Ok(()) };
        let bodies = Bodies { fractions: vec![(template, 1.0)], ..insertion.bodies.clone() };
        let solid = self.particles.iter().filter(|p| self.placer.prescribed[p.template as usize]);
        let poses: Vec<Pose> = solid.map(pose).collect();
        let mut obstacles = Obstacles::new(*self.domain(), &walls, &contours, poses);
        if (0..ATTEMPTS).any(|body| obstacles.insert(&bodies, body, 0, &insertion.region).is_some()) {
            return Ok(());
        }
        let key = format!("insertion.{n}.region");
        let title = format!(
            "`{key}` has no room for a particle of `particles.{}`, which reaches {:.4e} m from its centre: walls or fixed bodies are \
             everywhere",
            insertion.section,
            reach(&&(template, 1.0))
        );
        let remedy = "the region is that of the centres: keep it that far from walls, or make it larger";
        Err(self.document().error(&key, &title, "in a wall", remedy))
    }

    /// Refuses a rate that the region cannot take, by the estimate at the head of this file.
    fn refuse_what_is_too_fast(&self, n: usize, insertion: &Insertion) -> Result<()> {
        let Amount::Rate(rate) = insertion.amount else { return Ok(()) };
        let [from, to] = insertion.steps;
        let time = to.min(self.end_step).saturating_sub(from) as f64 * self.clock.time_step;
        let (reach, [mean, spread]) = (self.reach(insertion), insertion.bodies.velocity);
        let edges = insertion.region.edges().add_scalar(2.0 * reach);
        let speed = Vec3::from_fn(|i, _| {
            let own = mean[i].abs() + spread[i];
            (own * own + 2.0 * self.gravity[i].abs() * edges[i]).sqrt()
        });
        let room =
            |time: f64| JAMMED * volume_passed(&insertion.region, reach, speed, time) / insertion.volume;
        let due = insertion.expected(self.end_step, self.clock.time_step) as f64;
        if !self.undriven || due <= room(time) {
            return Ok(());
        }
        let most = room(time) / time.max(self.clock.time_step);
        let name = if self.document().has(&format!("insertion.{n}.mass_rate")) {
            "mass_rate"
        } else {
            "particle_rate"
        };
        let key = format!("insertion.{n}.{name}");
        let title = format!(
            "`{key}` requests {rate:.4e} particles per second, but at most {most:.4e} find room in the region as others leave it"
        );
        let remedy = "take a lower rate, a larger region or a larger `velocity`";
        Err(self.document().error(&key, &title, "faster than there is room", remedy))
    }

    /// Refuses more particles than the box holds.
    fn refuse_overfull(&self, insertions: &[Insertion], removals: &[Removal]) -> Result<()> {
        if insertions.is_empty() || !removals.is_empty() {
            return Ok(());
        }
        let volume = |p: &Particle| self.placer.kinds.templates[p.template as usize].shape.volume();
        let come = |of: &Insertion| of.expected(self.end_step, self.clock.time_step) as f64 * of.volume;
        let solid = self.particles.iter().map(volume).sum::<f64>() + insertions.iter().map(come).sum::<f64>();
        let fraction = solid / self.placer.free_volume;
        if fraction <= DENSEST {
            return Ok(());
        }
        let title = format!(
            "the insertions would fill the box to a volume fraction of {fraction:.3} by the end of the run, which no packing has"
        );
        let remedy = "insert fewer particles (`count`, `end`, a lower rate), take a larger box, or remove some (`[[removal]]`)";
        Err(self.document().error("insertion.0", &title, "too many", remedy))
    }
}
