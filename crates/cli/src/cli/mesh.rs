//! `turbid mesh`.

use super::check_picture;
use super::terminal::{Row, remark, row, say, table, waiting};
use clap::Args;
use std::path::PathBuf;
use turbid::case::file::LengthUnit;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::mesh::decompose::{ALLOWED, Fit};
use turbid::mesh::{Survey, survey};
use turbid::output::directory::refuse_input;
use turbid::output::numbers::number;
use turbid::output::picture::write_facets;

/// Input and output of `turbid mesh`.
#[derive(Debug, Args)]
pub(super) struct MeshArguments {
    /// STL (text or binary) or OBJ file.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Unit of the lengths in the file: m, cm, mm, um, in, or a number of metres. Default m.
    #[arg(long, value_parser = unit)]
    unit: Option<Unit>,
    /// Also write a picture of it (.png).
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Cut the body into convex parts, as `concave = "decompose"` does, with at most this part more volume (0.01 without a value).
    #[arg(long, value_name = "EXCESS", num_args = 0..=1, require_equals = true, default_missing_value = "0.01", value_parser = excess)]
    decompose: Option<f64>,
    /// Print JSON with stable keys.
    #[arg(long)]
    json: bool,
}

/// A unit, and the same as a case has it.
#[derive(Clone, Debug)]
struct Unit(LengthUnit, String);

fn unit(text: &str) -> std::result::Result<Unit, String> {
    let unit: LengthUnit = text.parse()?;
    let given = match unit {
        LengthUnit::Named(_) => format!("\"{text}\""),
        LengthUnit::Metres(metres) => format!("{metres:?}"),
    };
    Ok(Unit(unit, given))
}

fn excess(text: &str) -> std::result::Result<f64, String> {
    let range = || format!("must be {:e} to {}", ALLOWED.start(), ALLOWED.end());
    text.parse().ok().filter(|excess| ALLOWED.contains(excess)).ok_or_else(range)
}

pub(super) fn mesh(arguments: &MeshArguments) -> Result<()> {
    let path = &arguments.file;
    if let Some(picture) = &arguments.picture {
        check_picture(picture)?;
        refuse_input(picture, std::slice::from_ref(path))?;
    }
    let bytes = input::read(path, input::MESH).map_err(|source| Error::io("read", path, source))?;
    let unit = arguments.unit.as_ref();
    let unit = (unit.map_or(1.0, |Unit(unit, _)| unit.metres()), unit.map(|Unit(_, given)| given.as_str()));
    let look = || survey(path, &bytes, unit, arguments.decompose);
    let (found, shown) =
        waiting("looking at the mesh", look).map_err(|error| Error::Input(error.to_string()))?;
    if let Some(picture) = &arguments.picture {
        let title = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let caption = match &found.decomposed {
            Some(fit) => format!("{} convex parts", fit.parts),
            None => format!("{} facets", found.facets),
        };
        write_facets(picture, &title, &caption, &shown)?;
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&found).expect("a survey is plain JSON"));
        return Ok(());
    }
    say(&format!("{}\n{}", path.display(), table(&rows(&found))));
    for one in &found.uses {
        match (&one.line, &one.problem) {
            (Some(line), _) => say(&format!("  {}: {line}", one.kind)),
            (_, Some(problem)) => say(&format!("  no {}: {problem}", one.kind)),
            _ => {}
        }
    }
    if found.is_large && arguments.unit.is_none() {
        remark(
            "note",
            "lengths are taken for metres; if the file is in millimetres, add `--unit mm`, and `unit = \"mm\"` in the case",
        );
    }
    Ok(())
}

fn point(at: [f64; 3]) -> String {
    format!("({})", at.map(|x| number(x, 4)).join(", "))
}

/// Lengths in m.
fn rows(found: &Survey) -> Vec<Row> {
    let dropped = found.dropped.as_ref().map_or_else(String::new, |dropped| format!("; {dropped}"));
    let [low, high] = found.bounds;
    let size = [0, 1, 2].map(|k| number(high[k] - low[k], 4)).join(" x ");
    let vertices = format!("{} vertices, area {} m^2{dropped}", found.vertices, number(found.area, 4));
    let mut rows = vec![
        row("file", found.format, ""),
        row("groups", found.groups.to_string(), "solids, groups or objects"),
        row("surfaces", found.surfaces.to_string(), "that have no vertex in common"),
        row("facets", found.facets.to_string(), vertices),
        row("extent", format!("{size} m"), format!("from {} to {}", point(low), point(high))),
    ];
    rows.push(match (&found.open, found.orientation) {
        (Some(open), _) => row("closed", "no", open.clone()),
        (None, way) => row("closed", "yes", format!("normals point {}", way.unwrap_or("outward"))),
    });
    let crossing = found.first_crossing.map_or_else(
        || "edges that run through a facet".to_owned(),
        |at| format!("edges that run through a facet, the first at {}", point(at)),
    );
    rows.push(row("self-intersections", found.self_crossings.to_string(), crossing));
    if let Some(body) = &found.body {
        let twice = if body.overlaps { "; overlaps count twice" } else { "" };
        let centre = format!("centre of mass {}{twice}", point(body.centre));
        rows.push(row("volume", format!("{} m^3", number(body.volume, 6)), centre));
        let moments = body.inertia_per_mass.map(|x| number(x, 4)).join(", ");
        rows.push(row("inertia per mass", moments, "principal moments, m^2"));
        let seen = "along normals, from the middles of at most 2000 facets";
        rows.push(row("thinnest", format!("{} m", number(body.thinnest, 4)), seen));
        let adds = body.hull_adds.filter(|_| !body.convex);
        let hull =
            adds.map(|part| format!("the convex hull adds {} % to the volume", number(100.0 * part, 3)));
        rows.push(row("convex", if body.convex { "yes" } else { "no" }, hull.unwrap_or_default()));
    }
    if let Some(Fit { parts, faces, volume, inertia, distance, .. }) = found.decomposed {
        let [volume, inertia, distance] =
            [volume, inertia, distance].map(|part| format!("{:.3} %", 100.0 * part));
        rows.push(row(
            "convex parts",
            parts.to_string(),
            format!("{faces} faces; volume {volume} more, inertia per mass within {inertia}, surface within {distance} of the diameter"),
        ));
    }
    rows
}
