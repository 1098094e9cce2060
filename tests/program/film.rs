//! `turbid film`, end to end: the pictures of a run as an animated PNG.

use crate::common::{Place, case, words};
use std::path::Path;

/// A run of 20 steps with four pictures of each of two names.
fn run() -> Place {
    let pictures = "series_every = { steps = 5 }\npicture_every = { steps = 5 }\n\
        pictures = [{ slice = {} }, { name = \"a-b_c\", view = { size = [500, 300] } }]";
    let place = Place::new(&case::crowd(20, pictures));
    place.well(&["run", "case.toml", "--quiet"]);
    place
}

/// The pixels of all frames of a PNG.
fn frames(path: &Path) -> Vec<Vec<u8>> {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let count = reader.info().animation_control().map_or(1, |control| control.num_frames);
    let mut one = || {
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels
    };
    (0..count).map(|_| one()).collect()
}

/// Message of a film that is refused.
fn refused(place: &Place, more: &[&str]) -> String {
    place.ends(2, &[&["film", "out"], more].concat())
}

#[test]
fn a_film_has_the_pictures_of_a_name_in_order_as_its_frames() {
    let place = run();
    let said = place.well(&["film", "out", "--name", "a-b_c", "--fps", "4"]);
    assert!(said.contains("4 pictures") && said.contains("1.0 s"), "{said}");
    let film = frames(&place.path("out/a-b_c.png"));
    let pictures: Vec<Vec<u8>> = [5, 10, 15, 20]
        .iter()
        .flat_map(|step| frames(&place.path(format!("out/pictures/a-b_c_{step:010}.png"))))
        .collect();
    assert!(film == pictures && film[0] != film[3]);
}

#[test]
fn a_film_that_cannot_be_made_is_refused_with_a_way_out_and_leaves_no_file() {
    let place = run();
    let name = ["--name", "speed"];
    let said = refused(&place, &[]);
    assert!(said.contains("`a-b_c`, `speed`") && said.contains("--name"), "{said}");
    assert!(refused(&place, &["--name", "pressure"]).contains("no pictures of the name `pressure`"));
    assert!(refused(&place, &[&name[..], &["--out", "film.gif"]].concat()).contains(".png or .mp4"));
    for step in [10, 15, 20] {
        std::fs::remove_file(place.path(format!("out/pictures/speed_{step:010}.png"))).unwrap();
    }
    let said = refused(&place, &name);
    assert!(said.contains("only one picture") && said.contains("picture_every"), "{said}");
    assert!(!place.path("out/speed.png").exists() && !place.path("film.gif").exists());
}

#[test]
fn an_mp4_is_what_ffmpeg_makes_of_the_pixels_under_any_name_and_nothing_is_written_through_a_link() {
    let place = run();
    place.write("other", "mine");
    std::fs::create_dir(place.path("bin")).unwrap();
    let ffmpeg = |script: &str| {
        place.write("bin/ffmpeg", script);
        let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(place.path("bin/ffmpeg"), executable).unwrap();
    };
    let film = |out: &str| {
        let out = format!("--out={out}");
        let mut command = place.turbid(&["film", "out", "--name", "a-b_c", &out]);
        let path = format!("{}:/usr/bin:/bin", place.path("bin").display());
        command.env("PATH", path).output().unwrap().status.code()
    };
    // It writes its input to its last argument.
    ffmpeg("#!/bin/sh\nfor last; do :; done\ncat > \"${last#file:}\"\n");
    for out in ["film.mp4", "-x.mp4", "a:b.mp4"] {
        std::os::unix::fs::symlink(place.path("other"), place.path(format!("{out}.tmp"))).unwrap();
        assert_eq!(film(out), Some(0), "{out}");
        assert_eq!(std::fs::metadata(place.path(out)).unwrap().len(), 4 * 500 * 300 * 3, "{out}");
        assert!(!place.path(format!("{out}.tmp")).exists());
    }
    assert_eq!(std::fs::read_to_string(place.path("other")).unwrap(), "mine");
    ffmpeg("#!/bin/sh\ncat > /dev/null\necho half\nexit 1\n");
    assert_eq!(film("half.mp4"), Some(2));
    assert!(!place.path("half.mp4").exists() && !place.path("half.mp4.tmp").exists());
}

#[test]
fn a_picture_that_is_a_link_is_no_frame() {
    let place = run();
    let last = place.path(format!("out/pictures/speed_{:010}.png", 20));
    std::fs::rename(&last, place.path("elsewhere.png")).unwrap();
    std::os::unix::fs::symlink(place.path("elsewhere.png"), &last).unwrap();
    assert!(place.well(&["film", "out", "--name", "speed"]).contains("3 pictures"));
}

#[test]
fn an_mp4_without_ffmpeg_is_refused_and_names_the_other_format() {
    let place = run();
    let mut command = place.turbid(&["film", "out", "--name", "speed", "--out", "film.mp4"]);
    let output = command.env("PATH", place.path("nowhere")).output().unwrap();
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("ffmpeg") && said.contains(".png"), "{said}");
    assert!(!place.path("film.mp4").exists() && !place.path("film.mp4.tmp").exists());
}
