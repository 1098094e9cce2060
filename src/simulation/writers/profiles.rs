//! Profiles of particles and fluid along axes of the box, or over rings about one: sums over bins, for which nothing is gathered.
//!
//! Bodies are cut exactly at the ends of bins along an axis. Over rings each body counts by 512 points in it, of equal
//! volume, and a cell by its middle. The stress by the fluid is the sum of the stresslets of the bodies whose centres are in a bin, over its volume: the part of each body
//! in a block is a whole number, added up by its owner.

use super::table::Table;
use super::vtk::parsed;
use super::{FileEstimate, NUMBER, Need, RankState, RootOutput, Writer, WriterState, files_of};
use crate::case::{Profile, Rings, Setup};
use crate::contact::CutPart;
use crate::domain::Block;
use crate::error::Result;
use crate::math::{Mat3, Quat, Vec3};
use crate::output::fronts::Column;
use crate::output::{OutputFiles, RowsMark, Summary, directory, profiles};
use crate::particle::Particle;
use crate::shape::Shape;
use crate::simulation::observe::{PAIRS, Sums, branch_moment, partners, settling_direction};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

const NAME: &str = "profiles";
/// Cosine of the angle to an axis up to which particles settle along it.
const ALONG: f64 = 0.999;
/// Points in a body, and in its bounds at most.
const POINTS: usize = 512;
const TRIES: u32 = 1 << 17;
// Sums of a bin: volume of the bodies, velocity, its products, angular velocity, stress by contacts and by the fluid, then the number in each section.
const VELOCITY: usize = 1;
const PRODUCTS: usize = 4;
const SPIN: usize = 10;
const STRESS: usize = 13;
const BY_FLUID: usize = 19;
const NUMBERS: usize = 25;
// Of the sums of the flow.
const FLOW: usize = 1;
const SQUARES: usize = 4;
const PRESSURE: usize = 10;

/// Writes `profiles.csv`, and at the end the means over time.
pub(super) struct Profiles<'a> {
    setup: &'a Setup,
    files: OutputFiles,
    /// Parts of the bodies by template, as they are cut.
    parts: Vec<Vec<CutPart>>,
    /// Points in the bodies by template, where there are rings.
    points: Vec<Vec<Vec3>>,
    sections: usize,
    table: Table,
    /// Step of the last rows.
    last: u64,
}

/// Form of a profile: axis, number of bins, rings, and true with the stress by the fluid.
type Form = (usize, usize, Option<Rings>, bool);

#[derive(Serialize, Deserialize)]
struct State {
    profiles: Vec<Form>,
    rows: Option<RowsMark>,
    last: u64,
}

impl<'a> Profiles<'a> {
    /// Those of a case, if it has some.
    pub(super) fn of(setup: &'a Setup) -> Option<Self> {
        if setup.plan.output.profiles.is_empty() {
            return None;
        }
        let parts =
            setup.templates.iter().map(|template| template.parts().map(CutPart::new).collect()).collect();
        let sections = setup.section_count();
        let files = files_of(setup);
        let table = Table::new(files.table(directory::PROFILES), profiles::head(sections));
        let rings = setup.plan.output.profiles.iter().any(|profile| profile.rings.is_some());
        let templates = setup.templates.iter().filter(|_| rings);
        let points = templates.map(|template| {
            let piece = template.shape.piece();
            points_in(piece.as_deref().unwrap_or(&*template.shape))
        });
        let points = points.collect();
        Some(Self { setup, files, parts, points, sections, table, last: 0 })
    }

    fn per_bin(&self) -> usize {
        NUMBERS + self.sections
    }

    /// Each profile, with the number of its first bin among all.
    fn all(&self) -> impl Iterator<Item = (usize, &Profile)> {
        let profiles = &self.setup.plan.output.profiles;
        profiles.iter().scan(0, |bins, profile| {
            *bins += profile.bins;
            Some((*bins - profile.bins, profile))
        })
    }

    fn forms(&self) -> Vec<Form> {
        let profiles = self.setup.plan.output.profiles.iter();
        let form = |of: &Profile| (of.axis, of.bins, of.rings, of.hydrodynamic_stress);
        profiles.map(form).collect()
    }

    fn bins(&self) -> usize {
        self.setup.plan.output.profiles.iter().map(|profile| profile.bins).sum()
    }

    /// The bin of a profile at a number of bins from the origin.
    fn bin(&self, profile: &Profile, at: f64) -> usize {
        let (bins, at) = (profile.bins as i64, at.floor() as i64);
        let periodic = self.setup.domain.is_periodic(profile.axis);
        (if periodic { at.rem_euclid(bins) } else { at.clamp(0, bins - 1) }) as usize
    }

    /// The bin of a profile that a point (m) lies in, and the axes in which it has the components of vectors there, if they are not those of the box.
    /// Nothing beyond the rings.
    fn place(&self, profile: &Profile, point: Vec3) -> Option<(usize, Option<Mat3>)> {
        let Some(Rings { centre, radius }) = profile.rings else {
            let scale = profile.bins as f64 / self.setup.domain.size()[profile.axis];
            return Some((self.bin(profile, point[profile.axis] * scale), None));
        };
        let domain = &self.setup.domain;
        let mut way = domain.nearest_image(domain.wrap(point - Vec3::from(centre)));
        way[profile.axis] = 0.0;
        let (bin, along) =
            ((way.norm() * profile.bins as f64 / radius) as usize, Vec3::ith(profile.axis, 1.0));
        let out = way.try_normalize(0.0).unwrap_or_else(|| Vec3::ith((profile.axis + 1) % 3, 1.0));
        let axes = Mat3::from_rows(&[out, along.cross(&out), along].map(|axis| axis.transpose()));
        (bin < profile.bins).then_some((bin, Some(axes)))
    }

    /// Volume of a bin of a profile (m^3), and where it is (m).
    fn extent(&self, profile: &Profile, bin: usize) -> [f64; 2] {
        let (size, bins) = (self.setup.domain.size(), profile.bins as f64);
        let middle = (bin as f64 + 0.5) / bins;
        match profile.rings {
            None => [size.product() / bins, middle * size[profile.axis]],
            Some(Rings { radius, .. }) => {
                let at = middle * radius;
                [2.0 * PI * at * radius / bins * size[profile.axis], at]
            }
        }
    }

    /// Calls `add(bin, volume)` with the parts of a body (m^3) in the bins of a profile.
    fn divide(&self, particle: &Particle, profile: &Profile, mut add: impl FnMut(usize, f64)) {
        if profile.rings.is_none() {
            return self.cut(particle, profile, add);
        }
        let template = particle.template as usize;
        let points = &self.points[template];
        let each = self.setup.templates[template].shape.volume() / points.len() as f64;
        let mut counts = vec![0_u32; profile.bins];
        for point in points {
            let point = particle.position() + particle.orientation() * point;
            if let Some((bin, _)) = self.place(profile, point) {
                counts[bin] += 1;
            }
        }
        let filled = counts.iter().enumerate().filter(|(_, count)| **count > 0);
        filled.for_each(|(bin, count)| add(bin, f64::from(*count) * each));
    }

    /// Calls `add(bin, volume)` with the parts of a body (m^3) in the bins of a profile.
    fn cut(&self, particle: &Particle, profile: &Profile, mut add: impl FnMut(usize, f64)) {
        let (axis, turn) = (Vec3::ith(profile.axis, 1.0), particle.orientation());
        let width = self.setup.domain.size()[profile.axis] / profile.bins as f64;
        let parts = &self.parts[particle.template as usize];
        let sum: f64 = parts.iter().map(|part| part.shape.volume()).sum();
        // Parts may share a region, which counts once.
        let counts = self.setup.templates[particle.template as usize].shape.volume() / sum;
        for part in parts {
            let orientation = turn * part.orientation;
            let centre = (particle.position() + turn * part.position)[profile.axis];
            let in_body = orientation.inverse_transform_vector(&axis);
            let [low, high] = [-1.0, 1.0].map(|way| part.shape.support(in_body * way).dot(&in_body));
            let [first, last] = [low, high].map(|end| ((centre + end) / width).floor());
            let below = part.below(orientation, profile.axis, first < last);
            let (mut bin, mut so_far) = (first, 0.0);
            while bin < last {
                let volume = below((bin + 1.0) * width - centre).clamp(so_far, part.shape.volume());
                add(self.bin(profile, bin), (volume - so_far) * counts);
                (bin, so_far) = (bin + 1.0, volume);
            }
            add(self.bin(profile, last), (part.shape.volume() - so_far) * counts);
        }
    }

    /// Rows of the bins of profile number `number`, of which the first is `first` among all.
    fn rows(
        &self,
        (number, first, profile): (usize, usize, &Profile),
        output: &RootOutput,
    ) -> Vec<Vec<Option<f64>>> {
        let units = self.setup.fluid.as_ref().map(|_| self.setup.units());
        let flow = self.flow_in_bins(number, &output.totals.fixed);
        (0..profile.bins)
            .map(|bin| {
                let sums = &output.totals.sums[(first + bin) * self.per_bin()..][..self.per_bin()];
                let fluid = &flow[bin];
                let counts = &sums[NUMBERS..];
                let count: f64 = counts.iter().sum();
                let [volume, position] = self.extent(profile, bin);
                let mut row: Vec<Option<f64>> = [number as f64, output.step as f64, output.time, position]
                    .into_iter()
                    .chain([sums[0] / volume, count / volume])
                    .map(Some)
                    .collect();
                row.extend(means(count, &sums[VELOCITY..PRODUCTS], &sums[PRODUCTS..SPIN], 1.0));
                row.extend(sums[SPIN..STRESS].iter().map(|sum| (count > 0.0).then(|| sum / count)));
                let tells = sums[STRESS..BY_FLUID].iter().map(|sum| (!sum.is_nan()).then(|| sum / volume));
                row.extend(tells);
                let by_fluid = sums[BY_FLUID..NUMBERS].iter();
                row.extend(by_fluid.map(|sum| profile.hydrodynamic_stress.then(|| sum / volume)));
                let open = if units.is_some() { fluid[0] } else { 0.0 };
                let (speed, pressure) =
                    units.map_or((0.0, 0.0), |units| (units.velocity(), units.pressure()));
                row.extend(means(open, &fluid[FLOW..SQUARES], &fluid[SQUARES..PRESSURE], speed));
                row.push((open > 0.0).then(|| fluid[PRESSURE] / open * pressure));
                row.extend(counts.iter().map(|count| Some(count / volume)));
                row
            })
            .collect()
    }
}

/// A vector in these axes, if they are not its own.
fn turned(axes: Option<&Mat3>, vector: Vec3) -> Vec3 {
    axes.map_or(vector, |axes| axes * vector)
}

/// A symmetric tensor in these axes.
fn turned_tensor(axes: &Mat3, of: &[f64; 6]) -> [f64; 6] {
    let [xx, yy, zz, xy, xz, yz] = *of;
    let tensor = axes * Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * axes.transpose();
    PAIRS.map(|(i, j)| tensor[(i, j)])
}

/// Points that fill a body evenly, in its frame: of the sequence with the powers of `1 / p`, `p^4 = p + 1`, in its bounds, those inside. Unlike a
/// lattice it lies along no axis.
///
/// # Reference
/// Roberts (2018), The unreasonable effectiveness of quasirandom sequences.
fn points_in(shape: &dyn Shape) -> Vec<Vec3> {
    const RATIO: f64 = 1.220_744_084_605_759_5;
    let (low, high) = shape.bounds(&Quat::identity());
    let steps = Vec3::new(1.0, 1.0 / RATIO, 1.0 / (RATIO * RATIO)) / RATIO;
    let point = |n: u32| {
        let part = (steps * f64::from(n)).map(|x| (0.5 + x).fract());
        low + part.component_mul(&(high - low))
    };
    let inside = (0..TRIES).map(point).filter(|point| shape.signed_distance(*point) <= 0.0);
    inside.take(POINTS).collect()
}

/// Means of the profiles of a run from a time (s) on, and the heights of fronts, in tables that `to` gets; nothing where there are no profiles.
pub(in crate::simulation) fn average(
    setup: &Setup,
    [of, to]: [&OutputFiles; 2],
    from: f64,
    summary: &mut Summary,
) -> Result<()> {
    let rows = of.table(directory::PROFILES);
    if !rows.is_file() {
        return Ok(());
    }
    if let Some(column) = settling_column(setup) {
        summary.averages.extend(column.write(&rows, &to.table(directory::FRONTS))?);
    }
    profiles::BINS.write_means(&rows, &to.table(directory::PROFILE_MEANS), from)
}

/// The first profile along the direction in which the particles settle, if the box is closed in it.
fn settling_column(setup: &Setup) -> Option<Column> {
    let down = settling_direction(setup)?;
    let profiles = setup.plan.output.profiles.iter().enumerate();
    let along = |axis: usize| down[axis].abs() > ALONG && !setup.domain.is_periodic(axis);
    let (profile, of) = profiles.into_iter().find(|(_, of)| of.rings.is_none() && along(of.axis))?;
    let (length, downwards) = (setup.domain.size()[of.axis], down[of.axis] < 0.0);
    Some(Column { profile, length, downwards, diameter: setup.diameter })
}

/// Mean vector and variances of what is added up with a weight, times a unit; nothing without weight.
fn means(weight: f64, vector: &[f64], products: &[f64], unit: f64) -> impl Iterator<Item = Option<f64>> {
    let mean: [f64; 3] = std::array::from_fn(|axis| vector[axis] / weight);
    let variances: [f64; 6] = std::array::from_fn(|k| {
        let (i, j) = PAIRS[k];
        (products[k] / weight - mean[i] * mean[j]) * unit * unit
    });
    let known = weight > 0.0;
    mean.into_iter().map(move |mean| mean * unit).chain(variances).map(move |value| known.then_some(value))
}

impl Writer for Profiles<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn every(&self) -> u64 {
        self.setup.plan.output.profiles_every
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn sums(&self, rank: &mut RankState) -> Sums {
        let per_bin = self.per_bin();
        let mut sums = Sums::new(self.bins() * per_bin, flow::sums(self.setup), 0);
        let stresslets =
            self.all().any(|(_, profile)| profile.hydrodynamic_stress).then(|| rank.stresslets());
        let simulation = rank.simulation();
        for (first, profile) in self.all() {
            let of_fluid = stresslets.as_ref().filter(|_| profile.hydrodynamic_stress);
            for (n, particle) in simulation.particles().iter().enumerate() {
                self.divide(particle, profile, |bin, volume| sums.add((first + bin) * per_bin, &[volume]));
                let Some((bin, axes)) = self.place(profile, particle.position()) else { continue };
                let at = (first + bin) * per_bin;
                let [v, spin] =
                    [particle.velocity(), particle.angular_velocity()].map(|of| turned(axes.as_ref(), of));
                sums.add(at + VELOCITY, v.as_slice());
                sums.add(at + PRODUCTS, &PAIRS.map(|(i, j)| v[i] * v[j]));
                sums.add(at + SPIN, spin.as_slice());
                if let Some(stresslet) = of_fluid.map(|all| &all[n]) {
                    let stresslet = axes.map_or(*stresslet, |axes| turned_tensor(&axes, stresslet));
                    sums.add(at + BY_FLUID, &stresslet);
                }
                sums.add(at + NUMBERS + self.setup.sections[particle.template as usize], &[1.0]);
            }
            if !simulation.dem().tells_contacts() {
                (0..profile.bins).for_each(|bin| sums.add((first + bin) * per_bin + STRESS, &[f64::NAN; 6]));
            }
        }
        let known = partners(rank.simulation(), rank.contacts());
        for contact in rank.contacts() {
            let moment = branch_moment(self.setup, &known, contact);
            for (first, profile) in self.all() {
                if let Some((bin, axes)) = self.place(profile, contact.point.into()) {
                    let moment = axes.map_or(moment, |axes| turned_tensor(&axes, &moment));
                    sums.add((first + bin) * per_bin + STRESS, &moment);
                }
            }
        }
        sums
    }

    fn of_rows(&self, block: Block) -> Option<FlowOfRows> {
        self.setup.fluid.is_some().then(|| self.flow_of_rows(block))
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let rows: Vec<_> = self
            .all()
            .enumerate()
            .flat_map(|(number, (first, profile))| self.rows((number, first, profile), output))
            .collect();
        self.last = output.step;
        self.table.write(&rows)
    }

    fn intact(&self) -> Result<()> {
        self.table.intact()
    }

    fn state(&mut self) -> Result<WriterState> {
        let rows = self.table.mark()?;
        Ok(serde_json::json!(State { profiles: self.forms(), rows, last: self.last }))
    }

    fn fits(&self, state: &WriterState) -> Result<()> {
        let State { profiles, rows, .. } = parsed(NAME, state)?;
        self.table.fits(NAME, profiles == self.forms(), rows.as_ref())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let State { rows, last, .. } = parsed(NAME, state)?;
        self.last = last;
        self.table.resume(rows.as_ref())
    }

    fn finish(&mut self, summary: &mut Summary) -> Result<()> {
        let from = self.setup.averages_from(self.last);
        average(self.setup, [&self.files; 2], from, summary)
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let numbers = self.bins() * (profiles::COLUMNS.len() + self.sections);
        let rows = FileEstimate::of(self, end_step, "profiles", NUMBER * numbers as f64, "");
        Some(rows.in_one_file())
    }
}

mod flow;
pub use flow::FlowOfRows;
#[cfg(test)]
mod tests;
