//! The engine that moves the particles, and whether it can: LIGGGHTS and LAMMPS have spheres, one contact law each and few walls; a program
//! says itself what it can when it is started.
//!
//! The limits are those of LIGGGHTS 3.8.0 and of LAMMPS of 29 September 2021: LIGGGHTS stops with an error where a material or a restitution lies outside of them, and
//! misinterprets other walls.

use super::checks::Document;
use super::file::{EngineKind, EngineSection, MotionSection, NamedMotion, ProcessSection, ShapeSection};
use super::walls::PlacedWall;
use crate::engine::process::wall_flaw;
use crate::engine::{EngineChoice, LammpsOptions, LiggghtsOptions, ProcessOptions, commands};
use crate::error::Result;
use crate::math::Vec3;
use crate::wall::Surface;
use std::path::Path;

/// LIGGGHTS takes coefficients of restitution above this one.
const LEAST_RESTITUTION: f64 = 0.05;

/// Largest components of an aligned direction across its axis, over its length.
const ALIGNED: f64 = 1e-9;

/// LAMMPS takes coefficients of restitution from this one on.
const LEAST_OF_LAMMPS: f64 = 0.12;

/// The engine that the case in this folder asks for, if its sections ask for nothing that the engine lacks.
pub(super) fn engine(document: &Document, folder: &Path) -> Result<EngineChoice> {
    let dem = &document.case.dem;
    refuse_section(document, "liggghts", dem.liggghts.is_some() && !dem.engine.is(EngineKind::Liggghts))?;
    refuse_section(document, "lammps", dem.lammps.is_some() && !dem.engine.is(EngineKind::Lammps))?;
    let kind = match &dem.engine {
        EngineSection::Named(kind) => *kind,
        EngineSection::Process(section) => return process(document, section, folder),
    };
    if kind == EngineKind::Native {
        return Ok(EngineChoice::Native);
    }
    let label = label(&dem.engine);
    refuse_shapes(document, label)?;
    refuse_motion(document, label)?;
    if document.case.contact.enabled {
        refuse_law(document)?;
        refuse_lubrication(document, label)?;
        refuse_numbers(document, kind)?;
    }
    if kind == EngineKind::Lammps {
        let section = dem.lammps.clone().unwrap_or_default();
        let (process, timeout) = (section.process, section.timeout);
        return Ok(EngineChoice::Lammps(LammpsOptions { process, timeout }));
    }
    let mut options = LiggghtsOptions::default();
    if let Some(section) = &dem.liggghts {
        options.process = section.process;
        for (index, command) in section.commands.iter().enumerate() {
            options.commands.push(commands::accept(command).map_err(|refusal| {
                let key = format!("dem.liggghts.commands.{index}");
                let title = format!("`{key}` {}", refusal.title);
                document.error(&key, &title, &refusal.label, &refusal.remedy)
            })?);
        }
        options.timeout = section.timeout;
    }
    Ok(EngineChoice::Liggghts(options))
}

/// Refuses the settings of an engine, `[dem.NAME]`, if they have `no_effect`.
fn refuse_section(document: &Document, name: &str, no_effect: bool) -> Result<()> {
    if !no_effect {
        return Ok(());
    }
    let is = match document.case.dem.engine {
        EngineSection::Named(EngineKind::Native) => "\"native\"",
        EngineSection::Named(EngineKind::Liggghts) => "\"liggghts\"",
        EngineSection::Named(EngineKind::Lammps) => "\"lammps\"",
        EngineSection::Process(_) => "a program",
    };
    let key = format!("dem.{name}");
    let mut marks = vec![(&*key, "has no effect here")];
    if document.has("dem.engine") {
        marks.push(("dem.engine", "the engine"));
    }
    let title = format!("[{key}] is given, but `dem.engine` is {is}");
    let remedy = format!("set engine = \"{name}\" in [dem], or remove the section");
    Err(document.error_at(&marks, &title, &remedy))
}

/// An engine other than the native one in messages.
fn label(engine: &EngineSection) -> &'static str {
    match engine {
        EngineSection::Named(EngineKind::Lammps) => "LAMMPS",
        EngineSection::Named(_) => "LIGGGHTS",
        EngineSection::Process(_) => "a program",
    }
}

/// A program of the user, which will not run unless it is allowed.
fn process(document: &Document, section: &ProcessSection, folder: &Path) -> Result<EngineChoice> {
    refuse_motion(document, "a program")?;
    refuse_law(document)?;
    refuse_lubrication(document, "a program")?;
    let command = section.command.join(" ");
    if section.command.is_empty() {
        let title = "`dem.engine.command` is empty";
        return Err(document.error(
            "dem.engine.command",
            title,
            "no program",
            "name one, e.g. [\"python3\", \"my_dem.py\"]",
        ));
    }
    let title = format!("`dem.engine` starts the program `{command}`, which has not been allowed");
    let remedy = "a case may come from anybody, and a program can do whatever you can: look at it, then give --allow-engine";
    let folder = folder.join(&section.folder);
    Ok(EngineChoice::Process(ProcessOptions {
        command: section.command.clone(),
        folder: std::path::absolute(if folder.as_os_str().is_empty() { Path::new(".") } else { &folder })
            .unwrap_or(folder),
        timeout: section.timeout,
        processes: section.processes as usize,
        refusal: document.error("dem.engine", &title, "a program", remedy).to_string(),
    }))
}

/// The text of the case, as it is saved: the folder of a program is where it was.
pub(super) fn saved_text(document: &Document, engine: &EngineChoice) -> String {
    let EngineChoice::Process(options) = engine else {
        return document.text.clone();
    };
    let mut table: toml::Table = document.text.parse().expect("a case that has been read");
    let folder = options.folder.to_string_lossy().into_owned();
    let engine =
        table.get_mut("dem").and_then(|dem| dem.get_mut("engine")).and_then(toml::Value::as_table_mut);
    engine.expect("the section was read").insert("folder".to_owned(), folder.into());
    toml::to_string(&table).expect("a parsed document can be written")
}

/// Refuses walls that the engine does not have; without contacts there are none for it.
pub(super) fn refuse_walls(document: &Document, engine: &EngineChoice, walls: &[PlacedWall]) -> Result<()> {
    if *engine == EngineChoice::Native || !document.case.contact.enabled {
        return Ok(());
    }
    if let EngineChoice::Process(_) = engine {
        let flaw = |placed: &PlacedWall| Some((placed.key.clone(), wall_flaw(&placed.wall)?));
        let Some((key, flaw)) = walls.iter().find_map(flaw) else {
            return Ok(());
        };
        let title = format!("`{key}` {flaw}, but the walls of a program, `dem.engine`, stay where they are");
        let remedy = "take dem.engine = \"native\"; planes may slide along themselves";
        return Err(document.error(&key, &title, "this wall", remedy));
    }
    let is_lammps = matches!(engine, EngineChoice::Lammps(_));
    for PlacedWall { wall, key, .. } in walls {
        let velocity = wall.motion.velocity.at(0.0);
        let still = velocity == Vec3::zeros();
        let moves_along = |normal: &Vec3| velocity.dot(normal).abs() > ALIGNED * velocity.norm();
        let what = match &wall.surface {
            _ if !wall.motion.is_steady() => "varies its velocity",
            _ if !wall.motion.angular_velocity.is_zero() => "turns",
            Surface::Mesh(_) => "is a mesh",
            Surface::Plane { normal, .. } if lies_askew(normal) => "is a plane across none of x, y, z",
            Surface::Plane { normal, .. } if moves_along(normal) => "moves along its normal",
            Surface::Plane { .. } if lies_askew(&velocity) => "slides along none of x, y, z",
            Surface::Cylinder { .. } if is_lammps => "is a cylinder",
            Surface::Cylinder { axis, .. } if lies_askew(axis) => {
                "is a cylinder with its axis along none of x, y, z"
            }
            Surface::Cylinder { .. } if !still => "is a cylinder that moves",
            _ => continue,
        };
        let name = if is_lammps { "LAMMPS" } else { "LIGGGHTS" };
        let title = format!("the wall \"{}\" {what}, which no wall of {name} can", wall.name);
        let cylinders = if is_lammps { "" } else { ", and circular cylinders along x, y or z at rest" };
        let remedy = format!(
            "{name} has planes across x, y or z, at rest or sliding along one axis{cylinders}; with other walls take \
             dem.engine = \"native\""
        );
        return Err(document.error(key, &title, "this wall", &remedy));
    }
    Ok(())
}

/// True for a vector along none of the axes.
fn lies_askew(vector: &Vec3) -> bool {
    vector.iter().filter(|x| x.abs() > ALIGNED * vector.norm()).count() > 1
}

fn refuse_shapes(document: &Document, engine: &str) -> Result<()> {
    let is_sphere = |shape: &ShapeSection| matches!(shape, ShapeSection::Sphere { .. });
    let Some(index) = document.case.particles.iter().position(|section| !is_sphere(&section.shape)) else {
        return Ok(());
    };
    let key = format!("particles.{index}.shape");
    let name = document.choice(&key);
    let title = format!("`{key}` is \"{name}\", but {engine}, `dem.engine`, has spheres only");
    let marks = [(&*key, "not a sphere"), ("dem.engine", "the engine")];
    let remedy =
        format!("take dem.engine = \"native\" for other shapes; Debian's {engine} is built without them");
    Err(document.error_at(&marks, &title, &remedy))
}

fn refuse_motion(document: &Document, engine: &str) -> Result<()> {
    let is_free = |motion: &MotionSection| matches!(motion, MotionSection::Named(NamedMotion::Free));
    let mut sections = document.case.particles.iter();
    let Some(index) = sections.position(|section| section.motion.as_ref().is_some_and(|m| !is_free(m)))
    else {
        return Ok(());
    };
    let key = format!("particles.{index}.motion");
    let title =
        format!("`{key}` prescribes motion, but {engine}, `dem.engine`, is given free particles only");
    let marks = [(&*key, "not free"), ("dem.engine", "the engine")];
    Err(document.error_at(&marks, &title, "take dem.engine = \"native\", or remove `motion`"))
}

fn refuse_law(document: &Document) -> Result<()> {
    let chosen = &document.case.dem.engine;
    let Some((key, value)) = document.case.contact.native_only(chosen) else {
        return Ok(());
    };
    let engine = label(chosen);
    if let EngineSection::Process(_) = chosen {
        let title = format!("`{key}` is {value}, of which a program, `dem.engine`, is told nothing");
        let places = [(key, "of the native engine"), ("dem.engine", "the engine")];
        return Err(document.error_at(&places, &title, "remove it, or take dem.engine = \"native\""));
    }
    let title = format!("`{key}` is {value}, which {engine}, `dem.engine`, does not have");
    let is_lammps = chosen.is(EngineKind::Lammps);
    let remedy = match key {
        "contact.friction" if is_lammps => {
            "take \"mindlin\" or \"mindlin_displacement\", the frictions of LAMMPS, or dem.engine = \"native\""
        }
        "contact.friction" => {
            "take \"mindlin_displacement\", the friction of LIGGGHTS, or dem.engine = \"native\""
        }
        "contact.twisting" | "contact.van_der_waals" | "contact.rolling" => {
            "remove it, or take dem.engine = \"native\""
        }
        "contact.cohesion" if is_lammps => {
            "LAMMPS has \"dmt\" and \"jkr\"; take one of those, or dem.engine = \"native\""
        }
        "contact.cohesion" => "LIGGGHTS has \"sjkr\"; take that, or dem.engine = \"native\"",
        _ => &format!(
            "{engine} has a law of its own, Hertz's with a dashpot; remove the key: \"exact\" with \"hertz\" is the same \
                      elastic force, \"overlap_volume\" differs by the lens ratio, 1 - d/(12 R) for equal spheres"
        ),
    };
    let marks = [(key, &*format!("not in {engine}")), ("dem.engine", "the engine")];
    Err(document.error_at(&marks, &title, remedy))
}

fn refuse_lubrication(document: &Document, engine: &str) -> Result<()> {
    let key = "contact.lubrication";
    if !document.has(key) {
        return Ok(());
    }
    let title = format!("`{key}` is given, but {engine}, `dem.engine`, has no lubrication of ours");
    let remedy = "remove it, or take dem.engine = \"native\"";
    Err(document.error_at(&[(key, "of the native engine"), ("dem.engine", "the engine")], &title, remedy))
}

/// Refuses materials and pairs beyond the limits of LIGGGHTS or LAMMPS.
fn refuse_numbers(document: &Document, kind: EngineKind) -> Result<()> {
    let is_lammps = kind == EngineKind::Lammps;
    let contact = &document.case.contact;
    let of_contact = |value| [("contact".to_string(), Some(value))];
    let ratios = document
        .case
        .materials
        .iter()
        .enumerate()
        .map(|(n, one)| (format!("materials.{n}"), one.poisson_ratio));
    let ratios = of_contact(contact.poisson_ratio).into_iter().chain(ratios);
    let restitutions = contact.pairs.iter().enumerate();
    let restitutions = restitutions.map(|(n, pair)| (format!("contact.pairs.{n}"), pair.restitution));
    let restitutions = of_contact(contact.restitution).into_iter().chain(restitutions);
    let is_negative = |ratio: f64| !is_lammps && ratio < 0.0;
    let ratios = (ratios.filter(|(_, ratio)| ratio.is_some_and(is_negative))).map(|(section, ratio)| {
        (section + ".poisson_ratio", ratio, "from 0 to 0.5 for LIGGGHTS".to_string())
    });
    let wanted = if is_lammps {
        format!("from {LEAST_OF_LAMMPS} to 1 for LAMMPS")
    } else {
        format!("above {LEAST_RESTITUTION} and at most 1 for LIGGGHTS")
    };
    let is_small = |one: f64| if is_lammps { one < LEAST_OF_LAMMPS } else { one <= LEAST_RESTITUTION };
    let restitutions = (restitutions.filter(|(_, one)| one.is_some_and(is_small)))
        .map(|(section, one)| (section + ".restitution", one, wanted.clone()));
    let Some((key, value, wanted)) = ratios.chain(restitutions).next() else {
        return Ok(());
    };
    let engine = if is_lammps { "LAMMPS" } else { "LIGGGHTS" };
    let remedy = format!(
        "{engine} is given all materials and pairs, also those that touch nothing; dem.engine = \"native\" takes this value"
    );
    Err(document.out_of_range(&key, value.unwrap_or_default(), &wanted, &remedy))
}
