//! Pictures of a run as film strips: all of one name, in the order of their steps.

use super::html::escaped;
use base64::prelude::{BASE64_STANDARD, Engine};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::input;
use turbid::output::directory::PICTURES;

/// Largest picture that is shown (bytes).
pub(crate) const PICTURE: u64 = 32 << 20;
/// Pictures of a strip that are printed.
const PRINTED: usize = 6;

/// The pictures of a run that are named alike.
pub(crate) struct Film {
    /// What stands before the steps in their names.
    pub(crate) name: String,
    /// Step, file and its length in bytes, ascending by step.
    pub(crate) frames: Vec<(u64, PathBuf, u64)>,
}

/// The films in the output directory of a run, by name: files `pictures/NAME_STEP.png`.
pub(crate) fn films(directory: &Path) -> Vec<Film> {
    let mut films: BTreeMap<String, Vec<(u64, PathBuf, u64)>> = BTreeMap::new();
    for entry in fs::read_dir(directory.join(PICTURES.name())).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let parts = name.strip_suffix(".png").and_then(|stem| stem.rsplit_once('_'));
        let Some((name, step)) = parts.and_then(|(name, step)| Some((name, step.parse().ok()?))) else {
            continue;
        };
        if let Some(length) = entry.metadata().ok().filter(fs::Metadata::is_file).map(|data| data.len()) {
            films.entry(name.to_string()).or_default().push((step, entry.path(), length));
        }
    }
    let sorted = |(name, mut frames): (String, Vec<(u64, PathBuf, u64)>)| {
        frames.sort();
        Film { name, frames }
    };
    films.into_iter().map(sorted).collect()
}

/// Film strips in HTML with at most `budget` bytes of pictures, and where all of them are. Nothing without pictures.
pub(super) fn strips(directory: &Path, budget: u64, time_step: Option<f64>) -> String {
    let films = films(directory);
    let budget = budget / films.len().max(1) as u64;
    let strips: String = films.iter().map(|film| strip(film, budget, time_step)).collect();
    if strips.is_empty() { strips } else { format!("<div class=\"films\">\n{strips}</div>") }
}

fn strip(film: &Film, budget: u64, time_step: Option<f64>) -> String {
    let frames = chosen(&film.frames, budget);
    let of =
        |(step, path, _): &&(u64, PathBuf, u64)| Some((*step, input::read_unlinked(path, PICTURE).ok()?));
    let frames: Vec<(u64, Vec<u8>)> = frames.iter().filter_map(of).collect();
    let (name, all) = (escaped(&film.name.replace('_', " ")), film.frames.len());
    let Some(last) = frames.len().checked_sub(1) else {
        let folder = PICTURES.name();
        return format!(
            "<p class=\"note\">{all} pictures {name} are in <code>{folder}</code>, too large for this page.</p>\n"
        );
    };
    let mut html =
        format!("<section class=\"film\" aria-label=\"Pictures: {name}\">\n<div class=\"strip\">\n");
    for (at, (step, png)) in frames.iter().enumerate() {
        let time = time_step.map_or(String::new(), |dt| format!(", t = {:.4} s", *step as f64 * dt));
        // Evenly, the first and the last among them.
        let slot = |at: usize| at * (PRINTED - 1) / last.max(1);
        let class = if at == 0 || slot(at) > slot(at - 1) { " class=\"printed\"" } else { "" };
        let data = BASE64_STANDARD.encode(png);
        let _ = writeln!(
            html,
            "<img{class} alt=\"{name}, step {step}{time}\" src=\"data:image/png;base64,{data}\">"
        );
    }
    html += "</div>\n";
    if frames.len() < all {
        let shown = frames.len();
        let _ = writeln!(
            html,
            "<p class=\"note\">{shown} of {all} pictures, evenly chosen; all of them are in <code>{}</code>.</p>",
            PICTURES.name()
        );
    }
    html + "</section>\n"
}

/// As many frames as fit, at even distances, with the last one if there are any.
fn chosen(frames: &[(u64, PathBuf, u64)], budget: u64) -> Vec<&(u64, PathBuf, u64)> {
    let total: u64 = frames.iter().map(|frame| frame.2).sum();
    if total <= budget {
        return frames.iter().collect();
    }
    let count = (frames.len() as f64 * budget as f64 / total as f64) as usize;
    (1..=count).map(|i| &frames[i * frames.len() / count - 1]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_grouped_by_name_and_thinned_to_the_budget() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join(PICTURES.name());
        fs::create_dir(&folder).unwrap();
        for step in 1..=20 {
            fs::write(folder.join(format!("velocity_{step:010}.png")), [0; 100]).unwrap();
            fs::write(folder.join(format!("from_above_{step:010}.png")), [0; 100]).unwrap();
        }
        for other in ["velocity_last.png", "velocity_0000000001.svg", "1.png"] {
            fs::write(folder.join(other), "x").unwrap();
        }
        let films = films(place.path());
        let names: Vec<_> = films.iter().map(|film| (film.name.as_str(), film.frames.len())).collect();
        assert_eq!(names, [("from_above", 20), ("velocity", 20)]);
        let steps = |budget| chosen(&films[0].frames, budget).iter().map(|frame| frame.0).collect::<Vec<_>>();
        assert_eq!((steps(500), steps(10)), (vec![4, 8, 12, 16, 20], vec![20]));
        let html = strips(place.path(), 1000, Some(0.5));
        assert_eq!((html.matches("<img").count(), html.matches("5 of 20 pictures").count()), (10, 2));
        assert!(html.contains("alt=\"from above, step 20, t = 10.0000 s\""), "{html}");
        let long = strips(place.path(), 1 << 20, None);
        assert_eq!(long.matches("class=\"printed\"").count(), 2 * PRINTED);
    }
}
