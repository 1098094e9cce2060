//! Pictures of a run as film strips: all of one name, in the order of their steps.

use super::html::escaped;
use base64::prelude::{BASE64_STANDARD, Engine};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use turbid::input;
use turbid::output::directory::{PICTURES, PicturesOfName, pictures};

/// Largest picture that is shown (bytes).
pub(crate) const PICTURE: u64 = 32 << 20;
/// Pictures of a strip that are printed.
const PRINTED: usize = 6;

/// Step, file and its length in bytes.
type Frame = (u64, PathBuf, u64);

/// The pictures of a run that are named alike.
pub(crate) struct Film {
    /// Beginning of their names, before the steps.
    pub(crate) name: String,
    /// Step, file and its length in bytes, ascending by step.
    pub(crate) frames: PicturesOfName,
}

/// The films in the output directory of a run, by name; none if they cannot be read.
pub(crate) fn films(directory: &Path) -> Vec<Film> {
    pictures(directory).unwrap_or_default().into_iter().map(|(name, frames)| Film { name, frames }).collect()
}

/// Film strips in HTML, and where all pictures are. Nothing without pictures. They take about `share` bytes of pictures, as at least one of
/// each film is shown, but never more than is `left` of the page, which becomes less by what they take.
pub(super) fn strips(directory: &Path, share: u64, left: &mut u64, time_step: Option<f64>) -> String {
    let films = films(directory);
    let share = share / films.len().max(1) as u64;
    let strips: String = films.iter().map(|film| strip(film, share, left, time_step)).collect();
    if strips.is_empty() { strips } else { format!("<div class=\"films\">\n{strips}</div>") }
}

fn strip(film: &Film, share: u64, left: &mut u64, time_step: Option<f64>) -> String {
    let mut frames = Vec::new();
    for (step, path, length) in chosen(&film.frames, share, *left) {
        if let Ok(png) = input::read_unlinked(path, *length) {
            *left -= png.len() as u64;
            frames.push((*step, png));
        }
    }
    let (name, all) = (escaped(&film.name.replace('_', " ")), film.frames.len());
    let folder = PICTURES.name();
    let Some(last) = frames.len().checked_sub(1) else {
        return format!(
            "<p class=\"note\">{name}: none of {all} pictures, for which the page has no room; all of them are in \
             <code>{folder}</code>.</p>\n"
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
            "<p class=\"note\">{shown} of {all} pictures, evenly chosen; all of them are in <code>{folder}</code>.</p>"
        );
    }
    html + "</section>\n"
}

/// Frames at even distances, always with the last one: as many as fit the share, but at least one; none if it is larger than what is left.
fn chosen(frames: &[Frame], share: u64, left: u64) -> Vec<&Frame> {
    let length = |frames: &[&Frame]| frames.iter().fold(0_u64, |sum, frame| sum.saturating_add(frame.2));
    let even = |count: usize| (1..=count).map(|i| &frames[i * frames.len() / count - 1]).collect::<Vec<_>>();
    let all = even(frames.len());
    // Lengths of a stranger's sparse files may be anything.
    let part = share.min(left) as f64 / length(&all).max(1) as f64;
    let most = ((frames.len() as f64 * part) as usize).clamp(1, frames.len());
    (1..=most).rev().map(even).find(|some| length(some) <= left).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

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
        let steps = |budget| {
            chosen(&films[0].frames, budget, 1 << 20).iter().map(|frame| frame.0).collect::<Vec<_>>()
        };
        assert_eq!((steps(500), steps(10)), (vec![4, 8, 12, 16, 20], vec![20]));
        let html = strips(place.path(), 1000, &mut { 1 << 20 }, Some(0.5));
        assert_eq!((html.matches("<img").count(), html.matches("5 of 20 pictures").count()), (10, 2));
        assert!(html.contains("alt=\"from above, step 20, t = 10.0000 s\""), "{html}");
        let long = strips(place.path(), 1 << 20, &mut { 1 << 20 }, None);
        assert_eq!(long.matches("class=\"printed\"").count(), 2 * PRINTED);
    }

    #[test]
    fn a_page_never_has_more_bytes_of_pictures_than_are_left_and_says_so() {
        let place = tempfile::tempdir().unwrap();
        fs::create_dir(place.path().join(PICTURES.name())).unwrap();
        for (name, length) in [("a", 300), ("b", 300), ("c", 50)] {
            fs::write(PICTURES.named_file(place.path(), name, 1), vec![0; length]).unwrap();
        }
        let mut left = 400;
        let html = strips(place.path(), 90, &mut left, None);
        assert_eq!((html.matches("<img").count(), left), (2, 50), "{html}");
        assert!(html.contains("b: none of 1 pictures"), "{html}");
    }
}
