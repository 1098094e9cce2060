//! Files of a cross-check.
//!
//! ```text
//! DIRECTORY/
//!   crosscheck.csv  crosscheck.json
//!   CASE_NAME.png  CASE_NAME.svg        overlays
//!   CASE_series.csv                     of a user's case: differences and statistics over time
//!   CASE_native.pvd    CASE_native/0000.vtp ...
//!   CASE_liggghts.pvd  CASE_liggghts/0000.vtp ...
//!   logs/                                what LIGGGHTS said
//! ```

use super::{Outcome, Row};
use crate::crosscheck::{Findings, Moment, Overlay};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::output::{Collection, surfaces, write_bytes};
use crate::particle::{Particle, Template};
use crate::shape::Sphere;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use turbid_plot::Style;

/// Endings of the files of a case.
const OWN: [&str; 6] = ["png", "svg", "pvd", "vtp", "log", "csv"];
/// Names of the engines in files.
const ENGINES: [&str; 2] = ["native", "liggghts"];

/// Creates the directory, removes what earlier runs of these cases left there, and returns the directory for logs.
pub fn prepare(directory: &Path, cases: &[&str]) -> Result<PathBuf> {
    let logs = directory.join("logs");
    let attempt = || -> io::Result<()> {
        fs::create_dir_all(&logs)?;
        let mut folders = vec![directory.to_path_buf(), logs.clone()];
        for case in cases {
            folders.extend(ENGINES.map(|engine| directory.join(format!("{case}_{engine}"))));
        }
        for folder in folders.iter().filter(|folder| folder.is_dir()) {
            for entry in fs::read_dir(folder)? {
                let path = entry?.path();
                let text = |part: Option<&std::ffi::OsStr>| {
                    part.map_or_else(String::new, |part| part.to_string_lossy().into_owned())
                };
                let (stem, ending) = (text(path.file_stem()), text(path.extension()));
                let of_case = |case: &&str| {
                    let rest = stem.strip_prefix(*case);
                    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['_', '-', '.']))
                };
                let frame = ending == "vtp" && stem.bytes().all(|b| b.is_ascii_digit());
                if OWN.contains(&ending.as_str()) && (frame || cases.iter().any(of_case)) {
                    fs::remove_file(&path)?;
                }
            }
        }
        Ok(())
    };
    attempt().map_err(|source| {
        Error::Input(format!(
            "cannot write to the output directory {}: {source}\n  choose another one with --out DIR",
            directory.display()
        ))
    })?;
    Ok(logs)
}

/// Writes the plots and trajectories of a case.
pub fn write_case(directory: &Path, outcome: &Outcome) -> Result<()> {
    let Ok(Findings {
        overlays, moments, ..
    }) = &outcome.result
    else {
        return Ok(());
    };
    for overlay in overlays {
        overlay.write(directory, outcome.case, looks(overlay))?;
    }
    for (engine, name) in ENGINES.iter().enumerate() {
        let stem = format!("{}_{name}", outcome.case);
        let mut collection = Collection::new(directory.join(format!("{stem}.pvd")));
        for (number, moment) in moments.iter().enumerate() {
            let file = directory.join(&stem).join(format!("{number:04}.vtp"));
            write_moment(&file, moment, engine)?;
            collection.add(moment.time, &file)?;
        }
    }
    Ok(())
}

/// Writes `crosscheck.csv` and `crosscheck.json`.
pub fn write_tables(directory: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_bytes(&directory.join("crosscheck.csv"), &csv(outcomes))?;
    write_json(&directory.join("crosscheck.json"), outcomes)
}

/// Writes rows, the header first, as `CASE_series.csv`.
pub fn write_series(directory: &Path, case: &str, rows: &[Vec<String>]) -> Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table
            .write_record(row)
            .expect("memory takes any row, and all are of one length");
    }
    let bytes = table.into_inner().expect("memory takes any row");
    write_bytes(&directory.join(format!("{case}_series.csv")), &bytes)
}

/// Writes a list with one object for each check.
pub fn write_json(path: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_bytes(path, json(outcomes).as_bytes())
}

pub(super) fn json(outcomes: &[Outcome]) -> String {
    let rows: Vec<Row> = outcomes.iter().flat_map(Outcome::rows).collect();
    let mut text = serde_json::to_string_pretty(&rows).expect("rows are plain JSON");
    text.push('\n');
    text
}

pub(super) fn csv(outcomes: &[Outcome]) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in outcomes.iter().flat_map(Outcome::rows) {
        table.serialize(row).expect("memory takes any row");
    }
    table.into_inner().expect("memory takes any row")
}

/// Legend and style of every curve: by the engine whose name it begins with; the only other beside both is the reference.
///
/// Where both engines have several curves, those of LIGGGHTS are told apart, and those of the native engine lie on them.
pub(super) fn looks(overlay: &Overlay) -> Vec<(String, Style)> {
    const ROLES: [(&str, Style); 3] = [
        ("native", Style::Overlaid),
        ("LIGGGHTS", Style::Measured),
        ("analytic", Style::Reference),
    ];
    let role = |name: &str| {
        let begins = ROLES.iter().position(|role| name.starts_with(role.0))?;
        // A name with both engines is that of a difference.
        let others = ROLES.iter().filter(|role| name.contains(role.0)).count();
        (others == 1).then_some(begins)
    };
    let roles: Vec<Option<usize>> = overlay.curves.iter().map(|(name, _)| role(name)).collect();
    let count = |role: Option<usize>| roles.iter().filter(|other| **other == role).count();
    let both = count(Some(0)) > 0 && count(Some(1)) > 0;
    let look = |(name, role): (&String, &Option<usize>)| match *role {
        Some(role) if both && count(Some(role)) > 1 && role != 1 => (ROLES[role].0.into(), ROLES[role].1),
        Some(role) if both || count(Some(role)) == 1 => (name.clone(), ROLES[role].1),
        None if both && count(None) == 1 => (name.clone(), Style::Reference),
        _ => (name.clone(), Style::Measured),
    };
    overlay
        .curves
        .iter()
        .map(|(name, _)| name)
        .zip(&roles)
        .map(look)
        .collect()
}

/// The spheres of one engine at a moment.
fn write_moment(path: &Path, moment: &Moment, engine: usize) -> Result<()> {
    let mut radii: Vec<f64> = moment.spheres[engine].iter().map(|sphere| sphere.3).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    let templates: Vec<Template> = (radii.iter())
        .map(|&radius| Template {
            shape: Arc::new(Sphere { radius }),
            density: 1.0,
            material: 0,
        })
        .collect();
    let particles: Vec<Particle> = (0..)
        .zip(&moment.spheres[engine])
        .map(|(id, &(position, velocity, spin, radius))| {
            let template = radii.partition_point(|&known| known < radius);
            let mut particle = Particle::at(id, template, position);
            (particle.velocity, particle.angular_velocity) = (velocity.into(), spin.into());
            particle
        })
        .collect();
    // Positions stay as they are.
    let open = Domain {
        cells: [1; 3],
        dx: 1.0,
        periodic: [false; 3],
    };
    surfaces::write_motion(path, &open, &templates, &particles)
}

/// Position, velocity, angular velocity and radius of a sphere as a [`Moment`] has them.
pub(in crate::crosscheck) fn sphere(particle: &Particle, template: &Template) -> (Vec3, Vec3, Vec3, f64) {
    let radius = 0.5 * template.shape.equivalent_diameter();
    (
        particle.position(),
        particle.velocity(),
        particle.angular_velocity(),
        radius,
    )
}
