//! `open.py`, the script of a run for `ParaView`: where `pvbatch` is, and `xvfb-run` if there is no display. With
//! `TURBID_NEEDS_PARAVIEW` set it must be (Debian: paraview python3-paraview xvfb xauth).

use crate::common::Place;
use crate::common::case::SPHERES;
use std::collections::HashSet;
use std::env;
use std::fs::File;
use std::io::BufReader;
use std::process::{Command, Stdio};

/// The picture that the script saves of the results in `out`, as pixels of three bytes; nothing without `ParaView`.
fn picture(place: &Place) -> Option<HashSet<[u8; 3]>> {
    let mut words = vec!["pvbatch", "out/open.py", "--save", "picture.png", "--size", "400x300"];
    if env::var_os("DISPLAY").is_none() {
        // A server that resets itself after the first of two connections may refuse the second.
        words.splice(..0, ["xvfb-run", "-a", "-s", "-noreset -screen 0 1280x1024x24"]);
    }
    let has = |program: &str| {
        Command::new(program).arg("--help").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
    };
    if !has("pvbatch") || !has(words[0]) {
        assert!(env::var_os("TURBID_NEEDS_PARAVIEW").is_none(), "no {} and pvbatch here", words[0]);
        return None;
    }
    let output = Command::new(words[0]).args(&words[1..]).current_dir(place.folder()).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let decoder = png::Decoder::new(BufReader::new(File::open(place.path("picture.png")).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (400, 300));
    let bytes = info.color_type.samples();
    Some(pixels.chunks_exact(bytes).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect())
}

#[test]
fn the_script_for_paraview_draws_particles_and_fluid_also_without_surfaces() {
    let place = Place::new(SPHERES);
    place.well(&["run", "case.toml", "--out", "out", "--quiet"]);
    let Some(with_surfaces) = picture(&place) else {
        return;
    };
    // Shaded bodies and a field have many colours; the box, the axes and the text alone few.
    assert!(with_surfaces.len() > 1000, "{} colours with surfaces", with_surfaces.len());
    std::fs::remove_file(place.path("out/surfaces.pvd")).unwrap();
    let with_glyphs = picture(&place).unwrap();
    assert!(with_glyphs.len() > 1000, "{} colours with glyphs", with_glyphs.len());
}
