//! The list of the files in the directory of a run or study.

use super::html::{escaped, table};
use super::{FIGURES, FILE, HTML, STUDY, Source};
use std::collections::BTreeMap;
use std::fs;
use turbid::output::numbers::significant;

/// Most files that are listed.
const LISTED: usize = 200;

/// Contents of files by their names, or the ends of their names.
const CONTENTS: [(&str, &str); 25] = [
    ("summary.json", "result in numbers"),
    ("particle_series.csv", "paths of some particles over time"),
    ("profiles.csv", "profiles along the axes of the box"),
    ("profile_means.csv", "means of the profiles over time"),
    ("fronts.csv", "heights of front and bed over time"),
    ("structure.csv", "neighbours, contact network and orientations over time"),
    ("pair_distribution.csv", "pair distributions over time"),
    ("pair_distribution_means.csv", "means of the pair distributions"),
    ("contact_forces.csv", "distributions of the contact forces over time"),
    ("contact_force_means.csv", "means of the distributions of the contact forces"),
    ("structure_factor.csv", "structure factors over time"),
    ("structure_factor_means.csv", "means of the structure factors"),
    ("dynamics.csv", "displacements and memory of velocities, block by block"),
    ("dynamics_means.csv", "means of these over the blocks"),
    ("series.csv", "time series of the whole system"),
    ("result.csv", "all runs with their results"),
    (STUDY, "figures, tables and checks as numbers"),
    ("settling_velocity.png", "settling velocity over time"),
    (".pvd", "for ParaView: all times of the files in the folder of this name"),
    ("walls.vtp", "for ParaView: walls"),
    (".log", "messages of the external engine"),
    ("pictures/", "pictures"),
    ("checkpoints/", "states to resume from"),
    (".toml", "case or study"),
    ("/", "folder"),
];

/// The files of a directory in HTML, with links where the page may lead to them; none if it cannot be read. Of a study without the
/// folders of its runs.
pub(super) fn list(source: &Source) -> Option<String> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(&source.directory).ok()?.flatten() {
        let Ok(data) = entry.metadata() else { continue };
        let name = entry.file_name().to_string_lossy().into_owned();
        let own = [FILE, HTML, FIGURES].contains(&name.as_str()) || name.starts_with('.');
        if own || (source.is_study && data.is_dir()) {
            continue;
        }
        let (name, size) = if data.is_dir() {
            let files = fs::read_dir(entry.path()).map_or(0, Iterator::count);
            (name + "/", format!("{files} entries"))
        } else {
            (name, in_kilobytes(data.len()))
        };
        found.insert(name, size);
    }
    let (mut rows, mut addresses) = (Vec::new(), Vec::new());
    let left_out = found.len().saturating_sub(LISTED);
    for (name, size) in found.into_iter().take(LISTED) {
        let contents =
            CONTENTS.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, contents)| contents);
        addresses.push(source.from_page.as_ref().map(|from| format!("{from}{name}")));
        rows.push(vec![name, size, contents.to_string()]);
    }
    let more = if left_out > 0 { format!("<p>{left_out} more files.</p>\n") } else { String::new() };
    let directory = escaped(&source.directory.display().to_string());
    let table = table(&["file", "size", "contents"], &rows, &addresses, false);
    Some(format!("<p>In <code>{directory}</code>:</p>\n{table}{more}"))
}

fn in_kilobytes(bytes: u64) -> String {
    format!("{} kB", significant(1e-3 * bytes as f64, 3))
}
