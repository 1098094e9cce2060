//! Plans of the statistics of particles and fluid.

use super::checks::Document;
use super::file::{PlaneName, ProfileSection};
use super::schedule::Known;
use crate::error::Result;
use crate::output::series::{COLUMNS, is_of_a_body};
use crate::particle::Particle;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A profile along an axis of the box, or away from one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// The axis.
    pub axis: usize,
    /// Number of bins of equal width.
    pub bins: usize,
    /// The bins are rings.
    pub rings: Option<Rings>,
    /// With the stress of the particles by the fluid.
    pub hydrodynamic_stress: bool,
}

/// Rings about a line along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rings {
    /// A point of the line (m).
    pub centre: [f64; 3],
    /// Radius of the outermost one (m).
    pub radius: f64,
}

/// Structure of the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Structure {
    /// Steps between rows; 0 is never.
    pub every: u64,
    /// Largest distance of two centres (m).
    pub reach: f64,
    /// Number of bins of equal width up to there.
    pub bins: usize,
    /// Axes of the plane in which pairs are told apart by their direction.
    pub plane: Option<[usize; 2]>,
    /// Wavelength (m) down to which there is a structure factor.
    pub shortest_wave: Option<f64>,
}

impl Structure {
    /// That of a box (periodic axes, edges in m) whose case says nothing, over a whole number of steps.
    pub fn usual(every: u64, edges: [Option<f64>; 3], diameter: f64) -> Self {
        let reach = (REACH * diameter).min(half_edge(edges));
        Self { every, reach, bins: BINS, plane: None, shortest_wave: None }
    }
}

/// Half of the shortest periodic edge (m), of those that there are.
fn half_edge(edges: [Option<f64>; 3]) -> f64 {
    edges.into_iter().flatten().map(|edge| 0.5 * edge).fold(f64::INFINITY, f64::min)
}

/// Motion of the particles over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dynamics {
    /// Steps between samples; 0 is never.
    pub every: u64,
    /// Number of samples of a block.
    pub lags: usize,
}

/// Diameters within which pairs are counted, and number of bins, if a case says nothing.
const REACH: f64 = 3.0;
const BINS: usize = 150;
/// Most wave vectors of the structure factor.
const WAVES: f64 = 1e5;
/// Samples of a block if a case says nothing.
pub(crate) const LAGS: usize = 100;

/// The profiles of a case.
pub(super) fn profiles(document: &Document, known: &Known) -> Result<Vec<Profile>> {
    let periodic = document.case.domain.periodic;
    let profile = |(n, of): (usize, &ProfileSection)| {
        let (axis, bins, hydrodynamic_stress) = (of.axis as usize, of.bins, of.hydrodynamic_stress);
        let key = |name: &str| format!("output.profiles.{n}.{name}");
        if hydrodynamic_stress && document.case.fluid.is_none() {
            let title = "`hydrodynamic_stress` is that of a fluid, and the case has none";
            return Err(document.error(&key("hydrodynamic_stress"), title, "no fluid", "remove it"));
        }
        let Some(centre) = of.about else {
            if of.radius.is_some() {
                let title = "`radius` is that of rings, of which `about` is missing";
                let remedy = "give about = [x, y, z], or remove it";
                return Err(document.error(&key("radius"), title, "of no ring", remedy));
            }
            return Ok(Profile { axis, bins, rings: None, hydrodynamic_stress });
        };
        let across = (0..3).filter(|other| *other != axis);
        let room = across.map(|other| {
            let (edge, x) = (known.size[other], centre[other]);
            if periodic[other] { 0.5 * edge } else { x.min(edge - x) }
        });
        let room = room.fold(f64::INFINITY, f64::min);
        if room.is_nan() || room <= 0.0 {
            let title = "`about` is not a point in the box";
            return Err(document.error(
                &key("about"),
                title,
                "no room for rings",
                "give a point in the box, in metres",
            ));
        }
        let radius = of.radius.unwrap_or(room);
        if radius > room * (1.0 + 1e-9) {
            let wanted =
                format!("at most {room:.6} m, where the rings reach a face or half of a periodic edge");
            return Err(document.out_of_range(&key("radius"), radius, &wanted, "leave the key out"));
        }
        Ok(Profile { axis, bins, rings: Some(Rings { centre, radius }), hydrodynamic_stress })
    };
    document.case.output.profiles.iter().enumerate().map(profile).collect()
}

/// The structure that a case asks for.
pub(super) fn structure(document: &Document, known: &Known, end_step: u64) -> Result<Option<Structure>> {
    let Some(section) = document.case.output.structure else { return Ok(None) };
    let key = "output.structure.reach";
    let periodic = document.case.domain.periodic;
    let edges = [0, 1, 2].map(|axis| periodic[axis].then_some(known.size[axis]));
    let every = document.interval("output.structure.every", section.every, known.clock, end_step / 100)?;
    let (half, usual) = (half_edge(edges), Structure::usual(every, edges, known.diameter));
    let reach = section.reach.unwrap_or(usual.reach);
    // Half an edge of whole cells may round down.
    if reach > half * (1.0 + 1e-9) {
        let wanted = format!("at most {half:.6} m, half of the shortest periodic edge of the box");
        let remedy = "further away pairs of a particle and an image of another would count; take a larger box, or leave the key out";
        return Err(document.out_of_range(key, reach, &wanted, remedy));
    }
    if let Some(shortest) = section.shortest_wave {
        refuse_waves(document, edges, shortest)?;
    }
    Ok(Some(Structure {
        every,
        reach: reach.min(half),
        bins: section.bins.unwrap_or(usual.bins),
        plane: section.plane.map(|plane| match plane {
            PlaneName::Xy => [0, 1],
            PlaneName::Xz => [0, 2],
            PlaneName::Yz => [1, 2],
        }),
        shortest_wave: section.shortest_wave,
    }))
}

/// Refuses a box without waves as long as this one (m), and one with too many.
fn refuse_waves(document: &Document, edges: [Option<f64>; 3], shortest: f64) -> Result<()> {
    let key = "output.structure.shortest_wave";
    let waves: Vec<f64> = edges.into_iter().flatten().map(|edge| edge / shortest).collect();
    if waves.is_empty() {
        let title = format!("`{key}` is given, but no axis of the box is periodic");
        return Err(document.error(key, &title, "no wave fits", "leave it out"));
    }
    let longest = waves.iter().copied().fold(0.0, f64::max);
    if longest < 1.0 {
        let wanted = format!("at most {} m, the longest periodic edge", longest * shortest);
        return Err(document.out_of_range(key, shortest, &wanted, "longer waves do not fit into the box"));
    }
    // Half of an interval, a disc or a ball.
    let half = [1.0, 0.5 * PI, 2.0 / 3.0 * PI][waves.len() - 1];
    let ratio = half * waves.iter().product::<f64>() / WAVES;
    if ratio > 1.0 {
        let least = shortest * libm::pow(ratio, 1.0 / waves.len() as f64);
        let wanted = format!("at least {least:.3e} m");
        let remedy =
            format!("more than {WAVES} wave vectors are shorter; half a diameter is beyond all peaks");
        return Err(document.out_of_range(key, shortest, &wanted, &remedy));
    }
    Ok(())
}

/// The dynamics that a case asks for.
pub(super) fn dynamics(document: &Document, known: &Known, end_step: u64) -> Result<Option<Dynamics>> {
    let Some(section) = document.case.output.dynamics else { return Ok(None) };
    let every = document.interval("output.dynamics.every", section.every, known.clock, end_step / 1000)?;
    Ok(Some(Dynamics { every, lags: section.lags.unwrap_or(LAGS) }))
}

/// Refuses paths of particles that there are none of: neither listed, nor among as many random ones, which have the next ids, nor, where some are
/// `inserted`, later.
pub(super) fn refuse_paths(
    document: &Document,
    listed: &[Particle],
    random: usize,
    inserted: bool,
) -> Result<()> {
    let first = listed.last().map_or(0, |last| last.id + 1);
    let end = first + random as u64;
    let is_there = |id: u64| {
        listed.binary_search_by_key(&id, |particle| particle.id).is_ok()
            || (first..end).contains(&id)
            || (inserted && id >= end)
    };
    let mut asked = document.case.output.paths.iter().enumerate();
    let Some((n, id)) = asked.find(|(_, id)| !is_there(**id)) else { return Ok(()) };
    let largest = end.saturating_sub(1);
    let remedy = format!(
        "ids count from 0 in the order of the sections, unless a list gives its own; the largest is {largest}"
    );
    let title = format!("no particle has the id {id}");
    Err(document.error(&format!("output.paths.{n}"), &title, "not a particle", &remedy))
}

/// The columns of series.csv that a case averages.
pub(super) fn averaged(document: &Document) -> Result<Vec<String>> {
    let names = &document.case.output.average;
    let of_all = || COLUMNS.iter().filter_map(|head| head.split(" (").next());
    if let Some((n, name)) = names
        .iter()
        .enumerate()
        .find(|(_, name)| !is_of_a_body(name) && !of_all().any(|known| known == *name))
    {
        let key = format!("output.average.{n}");
        let title = format!("series.csv has no column `{name}`");
        let remedy = "docs/reference/tables.md lists the columns; those of structure.csv are averaged anyway";
        return Err(document.error(&key, &title, "not a column", remedy));
    }
    Ok(names.clone())
}
