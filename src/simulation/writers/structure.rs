//! Structure of the particles: pair distribution, neighbours, contact network, [clusters](mod@clusters) and orientations, as sums over all ranks.
//!
//! ```text
//! g(r) = n(r) V / (N (N - 1) 4 pi / 3 (r2^3 - r1^3) w(r))       n(r) ordered pairs in the bin from r1 to r2
//! w(r) = < prod (1 - r |e_a| / L_a) >                           closed axes a, mean over directions e; 1 in a periodic box
//! g(r, theta)  the same of pairs within 30 degrees of a plane, in sectors of 10 degrees, w of the middle of the sector
//! g_ab(r)      the same of pairs of a particle of section a and one of section b, with N_a (N_a - 1) or 2 N_a N_b
//! ```
//!
//! `w` is the part of the shell about a point of the box that lies in it (the set covariance of the box). Centres reach over the blocks of
//! ranks by messages ([`centres_near`]), so that `r` may be longer than ghosts reach. Every pair is counted once by the owner of each of its
//! particles; counts are whole numbers, and so have the same bits on any ranks. The structure factor is a sum of [waves].
//!
//! # Reference
//! Hansen and `McDonald` (2013), Theory of Simple Liquids, section 2.5, for `g`; Stoyan et al. (1995), Stochastic Geometry, section 4.5, for `w`.

mod clusters;
mod pairs;
mod waves;

use super::table::Table;
use super::vtk::parsed;
use super::{FileEstimate, NUMBER, Need, RankState, RootOutput, Writer, WriterState, files_of};
use crate::case::{Setup, Structure};
use crate::comm::Comm;
use crate::dem::ContactState;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::output::structure::{
    COLUMNS, FACTOR_BINS, FACTOR_COLUMNS, FORCE_BINS, FORCE_COLUMNS, PAIR_BINS, SECTORS, kinds, pair_head,
};
use crate::output::{OutputFiles, RowsMark, SeriesTable, Summary, averages, directory};
use crate::particle::{Particle, Template};
use crate::simulation::observe::{Centre, PAIRS, Sums, Totals, at_owners, centres_near};
use clusters::{Cluster, clusters, clusters_of_all};
use pairs::each_pair;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use waves::Waves;

const NAME: &str = "structure";
/// Fewest contacts of a particle that holds itself.
const HOLDS: u64 = 4;
/// Bins of the contact forces, and the width of each over the mean.
const FORCES: usize = 60;
const FORCE_WIDTH: f64 = 0.1;
/// Least relative difference of a moment of inertia from both others by which a body has an axis.
const DISTINCT: f64 = 1e-3;

// Sums: whole numbers of particles, of those that move, of those with a neighbour, of contacts, then forces, bodies with an axis, velocities.
const ALL: usize = 0;
const MOVING: usize = 1;
const TOUCHES: usize = 2;
const LOOSE: usize = 3;
const HOLDING: usize = 4;
const NEAR: usize = 5;
const CONTACTS: usize = 6;
const FORCE: usize = 7;
const WITH_AXIS: usize = 8;
const VELOCITY: usize = 9;
const PRODUCTS: usize = 12;
const CLUSTERS: usize = 18;
const SQUARES: usize = 19;
const COUNTS: usize = 20;
// Fixed-point sums: distance over the reach, fabric, orientation.
const DISTANCE: usize = 0;
const FABRIC: usize = 1;
const AXES: usize = 7;
const FIXED: usize = 13;
// Maxima: the largest cluster, and for each axis one if a cluster reaches through the box.
const LARGEST: usize = 0;
const THROUGH: usize = 1;
const MAXIMA: usize = 4;

/// Writes `structure.csv`, `pair_distribution.csv`, `contact_forces.csv` and, where a case asks for it, `structure_factor.csv`, and at the end the
/// means over time.
pub(in crate::simulation) struct StructureWriter<'a> {
    setup: &'a Setup,
    plan: Structure,
    files: OutputFiles,
    /// Axis of the bodies of each template, if they have one.
    axes: Vec<Option<Vec3>>,
    waves: Option<Waves>,
    /// Number of sections of particles.
    sections: usize,
    /// In the order of the rows that [`StructureWriter::complete`] writes.
    tables: Vec<Table>,
    /// Step of the last rows.
    last: u64,
}

#[derive(Serialize, Deserialize)]
struct State {
    /// Reach and number of bins.
    bins: (f64, usize),
    plane: Option<[usize; 2]>,
    shortest_wave: Option<f64>,
    rows: Vec<Option<RowsMark>>,
    last: u64,
}

impl<'a> StructureWriter<'a> {
    /// That of a case, if it asks for one.
    pub(in crate::simulation) fn of(setup: &'a Setup) -> Option<Self> {
        let plan = setup.plan.output.structure?;
        let files = files_of(setup);
        let waves = plan.shortest_wave.map(|shortest| Waves::new(setup.domain, shortest));
        let sections = setup.section_count();
        let heads = [
            (directory::STRUCTURE, COLUMNS.clone()),
            (directory::PAIR_DISTRIBUTION, pair_head(plan.plane.is_some(), sections)),
            (directory::CONTACT_FORCES, FORCE_COLUMNS.clone()),
            (directory::STRUCTURE_FACTOR, FACTOR_COLUMNS.clone()),
        ];
        let heads = heads.into_iter().take(if waves.is_some() { 4 } else { 3 });
        Some(Self {
            tables: heads.map(|(name, head)| Table::new(files.table(name), head)).collect(),
            waves,
            sections,
            axes: setup.templates.iter().map(axis_of).collect(),
            setup,
            plan,
            files,
            last: 0,
        })
    }

    /// Writes the rows of a moment of which all particles are known, ascending by id, and perhaps all contacts, between these and with walls.
    pub(in crate::simulation) fn add(
        &mut self,
        step: u64,
        time: f64,
        particles: &[Particle],
        contacts: Option<&[ContactState]>,
    ) -> Result<()> {
        let mut sums = self.of_particles(particles, &[]);
        if let Some(contacts) = contacts {
            let touching = self.add_contacts(contacts, &Comm::Solo, &mut sums);
            let touches = |particle: &Particle| touching.get(&particle.id).copied().unwrap_or(0);
            self.add_touching(particles, particles.iter().map(touches), &mut sums);
            let template = |particle: &Particle| &self.setup.templates[particle.template as usize];
            self.add_clusters(&clusters_of_all(&self.setup.domain, particles, template, contacts), &mut sums);
        } else {
            untold(&mut sums);
        }
        let totals = Totals::of(sums, &Comm::Solo);
        self.complete(&RootOutput::of(step, time, &totals))
    }

    fn sectors(&self) -> usize {
        self.plan.plane.map_or(0, |_| SECTORS)
    }

    /// Index of the first sum of the pairs of sections.
    fn on_kinds(&self) -> usize {
        COUNTS + self.plan.bins * (1 + self.sectors())
    }

    /// Index of the first sum of the forces of contacts.
    fn on_forces(&self) -> usize {
        self.on_kinds() + self.plan.bins * kinds(self.sections).count()
    }

    /// Index of the first of the numbers of particles in each section.
    fn on_sections(&self) -> usize {
        self.on_forces() + FORCES
    }

    fn moves(&self, particle: &Particle) -> bool {
        !self.setup.motions[particle.template as usize].holds_centre()
    }

    /// Sums over these particles, `others` being the centres near them.
    fn of_particles(&self, own: &[Particle], others: &[Centre]) -> Sums {
        let of_waves = self.waves.as_ref().map_or(0, Waves::sums);
        let mut sums = Sums::new(self.on_sections() + self.sections, FIXED + of_waves, MAXIMA);
        let moving = own.iter().filter(|particle| self.moves(particle)).count();
        sums.add(ALL, &[own.len() as f64, moving as f64]);
        for particle in own {
            sums.add(self.on_sections() + self.setup.sections[particle.template as usize], &[1.0]);
            if self.moves(particle) {
                let v = particle.velocity;
                sums.add(VELOCITY, &v);
                sums.add(PRODUCTS, &PAIRS.map(|(i, j)| v[i] * v[j]));
            }
            if let Some(axis) = self.axes[particle.template as usize] {
                let axis = particle.orientation() * axis;
                sums.add(WITH_AXIS, &[1.0]);
                for (k, (i, j)) in PAIRS.into_iter().enumerate() {
                    sums.add_fixed(AXES + k, axis[i] * axis[j]);
                }
            }
        }
        let centres: Vec<Vec3> = own.iter().map(Particle::position).collect();
        if let Some(waves) = &self.waves {
            waves.add(&centres, &mut sums, FIXED);
        }
        let templates = own.iter().map(|particle| particle.template);
        let templates = templates.chain(others.iter().map(|(_, template)| *template));
        let sections = templates.map(|template| self.setup.sections[template as usize]).collect::<Vec<_>>();
        self.add_pairs(centres, others, &sections, &mut sums);
        sums
    }

    /// Adds the pairs of the centres of this rank, `others` being those of other ranks near them, all of these sections.
    fn add_pairs(&self, mut centres: Vec<Vec3>, others: &[Centre], sections: &[usize], sums: &mut Sums) {
        let Structure { reach, bins, plane, .. } = self.plan;
        let (domain, width) = (self.setup.domain, reach / bins as f64);
        let (own, first_kind) = (centres.len(), self.on_kinds() - COUNTS);
        centres.extend(others.iter().map(|(centre, _)| centre));
        let mut kind_of = vec![None; self.sections * self.sections];
        for (kind, [a, b]) in kinds(self.sections).enumerate() {
            (kind_of[a * self.sections + b], kind_of[b * self.sections + a]) = (Some(kind), Some(kind));
        }
        let mut counts = vec![0.0; self.on_forces() - COUNTS];
        let mut nearest = vec![f64::INFINITY; own];
        each_pair(&domain, &centres, own, reach, |[i, j], way, distance| {
            let mut mine = 0.0;
            for least in [i, j].into_iter().filter(|k| *k < own) {
                nearest[least] = nearest[least].min(distance);
                mine += 1.0;
            }
            let bin = (distance / width) as usize;
            if bin >= bins {
                return;
            }
            counts[bin] += mine;
            if let Some(sector) = plane.and_then(|plane| sector(way, plane)) {
                counts[bins + bin * SECTORS + sector] += mine;
            }
            if let Some(kind) = kind_of[sections[i] * self.sections + sections[j]] {
                counts[first_kind + kind * bins + bin] += mine;
            }
        });
        for (index, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
            sums.add(COUNTS + index, &[*count]);
        }
        for distance in nearest.iter().filter(|distance| distance.is_finite()) {
            sums.add(NEAR, &[1.0]);
            sums.add_fixed(DISTANCE, distance / reach);
        }
    }

    /// Adds the contacts of a rank; with how many bodies particles have some there, by id. Collective.
    fn add_contacts(&self, contacts: &[ContactState], comm: &Comm, sums: &mut Sums) -> BTreeMap<u64, u64> {
        let (mut partners, mut touching) = (BTreeSet::new(), BTreeMap::new());
        let mut forces = Vec::new();
        for contact in contacts.iter().filter(|contact| contact.touches()) {
            // Parts of two bodies may touch several times.
            if partners.insert((contact.first, contact.second, contact.key().shift())) {
                *touching.entry(contact.first).or_insert(0) += 1;
                if contact.wall().is_none() {
                    *touching.entry(contact.second).or_insert(0) += 1;
                }
            }
            if contact.wall().is_none() {
                let normal = Vec3::from(contact.normal);
                sums.add(CONTACTS, &[1.0]);
                for (k, (i, j)) in PAIRS.into_iter().enumerate() {
                    sums.add_fixed(FABRIC + k, normal[i] * normal[j]);
                }
                forces.push(-Vec3::from(contact.force).dot(&normal));
            }
        }
        // The bins are in units of the mean, which all ranks must know first.
        let mut total = Sums::new(2, 0, 0);
        for force in &forces {
            total.add(0, &[*force, 1.0]);
        }
        let total = Totals::of(total, comm);
        let mean = total.sums[0] / total.sums[1];
        for force in forces {
            sums.add(FORCE, &[force]);
            let bin = force / (mean * FORCE_WIDTH);
            if bin >= 0.0 && bin < FORCES as f64 {
                sums.add(self.on_forces() + bin as usize, &[1.0]);
            }
        }
        touching
    }

    /// Adds with how many bodies each particle has contacts.
    fn add_touching(&self, particles: &[Particle], touching: impl Iterator<Item = u64>, sums: &mut Sums) {
        for (particle, touches) in particles.iter().zip(touching) {
            if self.moves(particle) {
                sums.add(TOUCHES, &[touches as f64]);
                let holds = touches >= HOLDS;
                sums.add(if holds { HOLDING } else { LOOSE }, &[if holds { touches as f64 } else { 1.0 }]);
            }
        }
    }

    fn add_clusters(&self, clusters: &[Cluster], sums: &mut Sums) {
        for cluster in clusters {
            debug_assert!(cluster.size > 0, "each particle has an owner");
            let size = cluster.size as f64;
            sums.add(CLUSTERS, &[f64::from(u8::from(cluster.size > 1)), size * size]);
            sums.raise(LARGEST, size);
            for (axis, is) in cluster.percolates(&self.setup.domain).into_iter().enumerate() {
                sums.raise(THROUGH + axis, u8::from(is).into());
            }
        }
    }

    /// The row of `structure.csv`.
    fn numbers(&self, output: &RootOutput) -> Vec<Option<f64>> {
        let Totals { sums, fixed, maxima } = output.totals;
        let over = |sum: f64, count: f64| (count > 0.0 && !sum.is_nan()).then(|| sum / count);
        let holding = sums[MOVING] - sums[LOOSE];
        let tensor = |first: usize, count: f64| {
            fixed[first..first + 6].iter().map(move |sum| over(*sum, count)).collect::<Vec<_>>()
        };
        let mut row = vec![Some(output.step as f64), Some(output.time)];
        row.push(over(self.plan.reach * fixed[DISTANCE], sums[NEAR]));
        row.push(over(sums[TOUCHES], sums[MOVING]));
        row.push(over(sums[LOOSE], sums[MOVING]));
        row.push(over(sums[HOLDING], holding));
        row.extend(tensor(FABRIC, sums[CONTACTS]));
        row.push(over(sums[FORCE], sums[CONTACTS]));
        row.extend(tensor(AXES, sums[WITH_AXIS]));
        let mean = |index: usize| sums[index] / sums[MOVING];
        row.extend((0..6).map(|k| {
            let (i, j) = PAIRS[k];
            over(sums[PRODUCTS + k], sums[MOVING])
                .map(|product| product - mean(VELOCITY + i) * mean(VELOCITY + j))
        }));
        let told = |value: f64| (!sums[CLUSTERS].is_nan()).then_some(value);
        row.push(told(sums[CLUSTERS]));
        row.push(over(sums[SQUARES], sums[ALL]));
        row.push(told(maxima[LARGEST]).and_then(|largest| over(largest, sums[ALL])));
        row.extend(maxima[THROUGH..].iter().map(|through| told(*through)));
        row
    }

    /// Rows of `pair_distribution.csv`.
    fn pair_rows(&self, output: &RootOutput) -> Vec<Vec<Option<f64>>> {
        let Structure { reach, bins, plane, .. } = self.plan;
        let (domain, sums) = (&self.setup.domain, &output.totals.sums);
        let pairs = sums[ALL] * (sums[ALL] - 1.0) / domain.volume();
        let width = reach / bins as f64;
        let row = |bin: usize| {
            let [low, high] = [bin, bin + 1].map(|end| end as f64 * width);
            let (r, shell) = (0.5 * (low + high), 4.0 / 3.0 * PI * (high * high * high - low * low * low));
            let over = |count: f64, expected: f64| (expected > 0.0).then(|| count / expected);
            let mut row = vec![Some(output.step as f64), Some(output.time), Some(r)];
            row.push(over(sums[COUNTS + bin], pairs * shell * in_box(domain, r)));
            if let Some(plane) = plane {
                let first = COUNTS + bins + bin * SECTORS;
                row.extend((0..SECTORS).map(|sector| {
                    // Half of the directions are within 30 degrees of the plane.
                    let part = 0.5 / SECTORS as f64 * in_box_towards(domain, r, plane, sector);
                    over(sums[first + sector], pairs * shell * part)
                }));
            }
            let in_sections = &sums[self.on_sections()..];
            row.extend(kinds(self.sections).enumerate().map(|(kind, [a, b])| {
                let of_both = if a == b {
                    in_sections[a] * (in_sections[a] - 1.0)
                } else {
                    2.0 * in_sections[a] * in_sections[b]
                };
                let expected = of_both / domain.volume() * shell * in_box(domain, r);
                over(sums[self.on_kinds() + kind * bins + bin], expected)
            }));
            row
        };
        (0..bins).map(row).collect()
    }
}

/// Marks all that follows from contacts as unknown.
fn untold(sums: &mut Sums) {
    for of in [TOUCHES, LOOSE, HOLDING, CLUSTERS, SQUARES] {
        sums.add(of, &[f64::NAN]);
    }
}

/// The principal axis of the bodies of a template, in their frame, whose moment of inertia differs most from both others.
fn axis_of(template: &Template) -> Option<Vec3> {
    let moments = template.inertia();
    let least = |axis: usize| {
        let off = |other: usize| (moments[axis] - moments[(axis + other) % 3]).abs();
        off(1).min(off(2))
    };
    let best = (0..3).max_by(|&a, &b| least(a).total_cmp(&least(b)))?;
    (least(best) > DISTINCT * moments.max()).then(|| Vec3::ith(best, 1.0))
}

/// Sector of a pair that is within 30 degrees of a plane.
fn sector(way: Vec3, [a, b]: [usize; 2]) -> Option<usize> {
    let (mut x, mut y) = (way[a], way[b]);
    let across = way[3 - a - b];
    if 4.0 * across * across > way.norm_squared() {
        return None;
    }
    // Pairs have no direction: both ways to the bit.
    if y < 0.0 || (y == 0.0 && x < 0.0) {
        (x, y) = (-x, -y);
    }
    Some(((libm::atan2(y, x) / PI * SECTORS as f64) as usize).min(SECTORS - 1))
}

/// Part of a spherical shell about a point of the box that lies in it, in the mean over the point; with `m` closed axes
/// `1 - sum r / (2 L_a) + sum 2 r^2 / (3 pi L_a L_b) - r^3 / (4 pi L_x L_y L_z)`, as far as `r` is shorter than all of these.
fn in_box(domain: &Domain, r: f64) -> f64 {
    let size = domain.size();
    let s: Vec<f64> = (0..3).filter(|axis| !domain.is_periodic(*axis)).map(|axis| r / size[axis]).collect();
    let pairs: f64 = (0..s.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| s[i] * s[j]).sum();
    let triple = if s.len() == 3 { s[0] * s[1] * s[2] } else { 0.0 };
    1.0 - 0.5 * s.iter().sum::<f64>() + pairs * 2.0 / (3.0 * PI) - triple / (4.0 * PI)
}

/// The same of the directions in a sector of a plane, with their mean parts along and across it.
fn in_box_towards(domain: &Domain, r: f64, plane: [usize; 2], sector: usize) -> f64 {
    // Means of sqrt(1 - m^2) and of |m| over -1/2 < m < 1/2.
    const ALONG: f64 = 0.956_611_5;
    const ACROSS: f64 = 0.25;
    let (sin, cos) = libm::sincos((sector as f64 + 0.5) / SECTORS as f64 * PI);
    let closed = (0..3).filter(|axis| !domain.is_periodic(*axis));
    closed
        .map(|axis| {
            let part = match plane.iter().position(|of| *of == axis) {
                Some(0) => ALONG * cos.abs(),
                Some(_) => ALONG * sin,
                None => ACROSS,
            };
            (1.0 - r * part / domain.size()[axis]).max(0.0)
        })
        .product()
}

impl Writer for StructureWriter<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn every(&self) -> u64 {
        self.plan.every
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn sums(&self, rank: &mut RankState) -> Sums {
        let simulation = rank.simulation();
        let others = centres_near(simulation, rank.decomposition(), self.plan.reach);
        let mut sums = self.of_particles(simulation.particles(), &others);
        if simulation.dem().tells_contacts() {
            let touching = self.add_contacts(rank.contacts(), simulation.comm(), &mut sums);
            let touching = at_owners(simulation, rank.decomposition(), &touching);
            self.add_touching(simulation.particles(), touching.into_iter(), &mut sums);
            self.add_clusters(&clusters(rank), &mut sums);
        } else {
            untold(&mut sums);
        }
        sums
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        self.last = output.step;
        let sums = &output.totals.sums;
        let row = |key: f64, value: Option<f64>| {
            vec![Some(output.step as f64), Some(output.time), Some(key), value]
        };
        let forces = (0..FORCES).map(|bin| {
            let force = (bin as f64 + 0.5) * FORCE_WIDTH;
            let count = sums[self.on_forces() + bin];
            row(force, (sums[CONTACTS] > 0.0).then(|| count / (sums[CONTACTS] * FORCE_WIDTH)))
        });
        let factors = self.waves.iter().flat_map(|waves| {
            let factors = waves.factors(&output.totals.fixed[FIXED..], sums[ALL]);
            factors.into_iter().map(|[k, factor]| row(k, (sums[ALL] > 0.0).then_some(factor)))
        });
        let rows = [vec![self.numbers(output)], self.pair_rows(output), forces.collect(), factors.collect()];
        self.tables.iter_mut().zip(rows).try_for_each(|(table, rows)| table.write(&rows))
    }

    fn intact(&self) -> Result<()> {
        self.tables.iter().try_for_each(Table::intact)
    }

    fn state(&mut self) -> Result<WriterState> {
        let rows = self.tables.iter().map(Table::mark).collect::<Result<_>>()?;
        let Structure { reach, bins, plane, shortest_wave, .. } = self.plan;
        Ok(serde_json::json!(State { bins: (reach, bins), plane, shortest_wave, rows, last: self.last }))
    }

    fn fits(&self, state: &WriterState) -> Result<()> {
        let State { bins, plane, shortest_wave, rows, .. } = parsed(NAME, state)?;
        let plan = &self.plan;
        let is_same =
            (bins, plane, shortest_wave) == ((plan.reach, plan.bins), plan.plane, plan.shortest_wave);
        self.tables.iter().zip(&rows).try_for_each(|(table, rows)| table.fits(NAME, is_same, rows.as_ref()))
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let State { rows, last, .. } = parsed(NAME, state)?;
        self.last = last;
        self.tables
            .iter_mut()
            .zip(rows.iter().chain(std::iter::repeat(&None)))
            .try_for_each(|(table, rows)| table.resume(rows.as_ref()))
    }

    fn finish(&mut self, summary: &mut Summary) -> Result<()> {
        let from = self.setup.averages_from(self.last);
        average([&self.files; 2], from, summary)
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let shells = self.waves.as_ref().map_or(0, Waves::shells);
        let of_pair = 4 + self.sectors() + kinds(self.sections).count();
        let numbers = COLUMNS.len() + self.plan.bins * of_pair + 4 * (FORCES + shells);
        let rows = FileEstimate::of(self, end_step, "structure", NUMBER * numbers as f64, "");
        Some(rows.in_one_file())
    }
}

/// Averages of the tables of a run from a time (s) on, and the tables of means, which `to` gets; nothing where there are no tables.
pub(in crate::simulation) fn average(
    [of, to]: [&OutputFiles; 2],
    from: f64,
    summary: &mut Summary,
) -> Result<()> {
    let numbers = of.table(directory::STRUCTURE);
    if !numbers.is_file() {
        return Ok(());
    }
    let distance = summary.averaged_over_distance.unwrap_or(f64::INFINITY);
    let is_number = |name: &str| !["step", "t"].contains(&name);
    summary.averages.extend(averages(&SeriesTable::read(&numbers)?, is_number, from, distance));
    let tables = [
        (PAIR_BINS, directory::PAIR_DISTRIBUTION, directory::PAIR_DISTRIBUTION_MEANS),
        (FORCE_BINS, directory::CONTACT_FORCES, directory::CONTACT_FORCE_MEANS),
        (FACTOR_BINS, directory::STRUCTURE_FACTOR, directory::STRUCTURE_FACTOR_MEANS),
    ];
    let mut written = tables.iter().filter(|(_, rows, _)| of.table(rows).is_file());
    written.try_for_each(|(bins, rows, means)| bins.write_means(&of.table(rows), &to.table(means), from))
}

#[cfg(test)]
mod tests;
