//! Positions files of a case: the particles of a section, and the sizes that they have.

use super::checks::Document;
use super::file::ParticleSection;
use super::files::Files;
use crate::error::{Error, Result};
use crate::input;
use crate::packing::positions::{self, Columns, Placement};

/// Relative difference up to which diameters are the same: a text may have few digits.
pub(super) const SAME_DIAMETER: f64 = 1e-6;

/// Largest factor between a diameter and that of the shape: more is a mistaken unit.
const FURTHEST: f64 = 100.0;

/// The particles of a section that reads a file.
#[derive(Debug)]
pub(super) struct Listed {
    /// The file as messages call it.
    pub(super) name: String,
    /// All of the file, or those of the kind of the section.
    pub(super) placements: Vec<Placement>,
}

impl Listed {
    /// Reads the file of a section; adds to notes that are ready to print.
    pub(super) fn read(
        document: &Document,
        files: &Files,
        index: usize,
        file: &str,
        notes: &mut Vec<String>,
    ) -> Result<Self> {
        let sections = &document.case.particles;
        let columns = Columns::new(&sections[index].columns).map_err(|(column, what)| {
            let key = format!("particles.{index}.columns.{column}");
            let title = format!("`{key}` {what}");
            document.error(&key, &title, "no column", "e.g. \"2*radius\" or \"Points:0 [mm]\"")
        })?;
        let name = files.path(file).display().to_string();
        let key = format!("particles.{index}.file");
        let bytes = files.contents(file, input::POSITIONS).map_err(|what| {
            let title = format!("cannot read the positions file {name}: {what}");
            document.error(&key, &title, "this file", "the path is relative to the case file")
        })?;
        let several = sections.iter().filter(|section| reads(section, file)).count() > 1;
        let found = positions::parse(&bytes, &name, &columns, several).map_err(|text| Error::Parse {
            path: name.clone().into(),
            line: (text.strip_prefix(&format!("{name}:")))
                .and_then(|rest| rest.split(':').next()?.parse().ok())
                .unwrap_or(0),
            text,
        })?;
        notes.extend(
            found
                .notes
                .iter()
                .map(|note| document.warning(&key, &format!("{name}: {note}"), "this file", "")),
        );
        let mut placements = Vec::new();
        for placement in found.placements {
            let is_of_another = is_of_another(sections, index, (file, &name), &placement);
            let refused = |(title, remedy): (String, &str)| document.error(&key, &title, "this file", remedy);
            if !is_of_another.map_err(refused)? {
                placements.push(placement);
            }
        }
        if placements.is_empty() {
            let title = format!("{name} holds no particles of kind {index}, those of `particles.{index}`");
            let remedy = "kinds are the [[particles]] sections, counted from 0; a section without particles has `count = 0`";
            return Err(document.error(&key, &title, "this file", remedy));
        }
        Ok(Self { name, placements })
    }

    /// Factors on a shape of this diameter (m) that give all diameters of the file, ascending; 1 without a column of them. The error
    /// says which diameter is too far from that of the shape.
    pub(super) fn scales(&self, own: f64) -> std::result::Result<Vec<f64>, String> {
        let mut scales = Vec::new();
        for placement in &self.placements {
            let Some((diameter, column)) = placement.diameter else {
                continue;
            };
            let scale = diameter / own;
            if !(1.0 / FURTHEST..=FURTHEST).contains(&scale) {
                let place = positions::place(&self.name, placement, column);
                return Err(format!(
                    "{place}: `diameter` is {diameter} m, more than a factor of {FURTHEST} from the {own} m of the shape"
                ));
            }
            scales.push(if (scale - 1.0).abs() <= SAME_DIAMETER { 1.0 } else { scale });
        }
        scales.sort_unstable_by(f64::total_cmp);
        scales.dedup_by(|next, kept| *next - *kept <= SAME_DIAMETER * *kept);
        if scales.is_empty() {
            scales.push(1.0);
        }
        Ok(scales)
    }
}

fn reads(section: &ParticleSection, file: &str) -> bool {
    section.file() == Some(file)
}

/// True if a particle belongs to another section, which must read the file, too; else an error and its remedy.
fn is_of_another(
    sections: &[ParticleSection],
    index: usize,
    (file, name): (&str, &str),
    placement: &Placement,
) -> std::result::Result<bool, (String, &'static str)> {
    let Some((kind, column)) = placement.kind else {
        return match sections.iter().filter(|section| reads(section, file)).count() {
            1 => Ok(false),
            count => Err((
                format!("{name} has no column `kind`, but {count} [[particles]] sections read it"),
                "a column `kind` says which section, counted from 0, a line belongs to",
            )),
        };
    };
    let section = usize::try_from(kind).ok().and_then(|i| sections.get(i));
    if section.is_some_and(|section| reads(section, file)) {
        return Ok(kind != index as u64);
    }
    let why = match section {
        Some(_) => format!("`particles.{kind}` does not read this file"),
        None => format!("the case has {} [[particles]] sections", sections.len()),
    };
    let remedy = "a line of kind n belongs to the n-th [[particles]] section, counted from 0: give each the same `file`";
    Err((format!("{}: `kind` is {kind}, but {why}", positions::place(name, placement, column)), remedy))
}
