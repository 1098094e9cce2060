//! `turbid mesh`: findings on a file, as text, JSON and picture, and lines that cases take.

use crate::common::{Place, has};
use std::fmt::Write;

/// A prism of height 1 over the polygon (0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3), at (13, 13, 13), as OBJ.
const L: &str = "v 13 13 13\nv 16 13 13\nv 16 14 13\nv 14 14 13\nv 14 16 13\nv 13 16 13\n\
    v 13 13 14\nv 16 13 14\nv 16 14 14\nv 14 14 14\nv 14 16 14\nv 13 16 14\n\
    f 4 6 5\nf 4 1 6\nf 4 2 1\nf 4 3 2\nf 10 11 12\nf 10 12 7\nf 10 7 8\nf 10 8 9\n\
    f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";

/// Cubes with an edge of 1 from these corners, as OBJ, each an object of its own.
fn cubes(corners: &[[f64; 3]]) -> String {
    let mut text = String::new();
    for (n, [x, y, z]) in corners.iter().enumerate() {
        writeln!(text, "o cube{n}").unwrap();
        for k in 0..8 {
            let [i, j, k] = [k & 1, k >> 1 & 1, k >> 2].map(f64::from);
            writeln!(text, "v {} {} {}", x + i, y + j, z + k).unwrap();
        }
        for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
            let [a, b, c, d] = face.map(|corner| corner + 8 * n);
            writeln!(text, "f {a} {b} {c} {d}").unwrap();
        }
    }
    text
}

/// A dry case with a kind of particle of this shape, or with this wall.
fn case(shape: &str, wall: &str) -> String {
    format!(
        "[domain]\nsize = [0.03, 0.03, 0.03]\nperiodic = [false, false, false]\n[dry]\ntime_step = 1e-5\n{wall}\n\
         [[particles]]\n{shape}\ndensity = 2500\nlist = [[0.005, 0.005, 0.02]]\n\
         [contact]\nyoungs_modulus = 5e5\npoisson_ratio = 0.25\nrestitution = 0.8\n\
         [driving]\ngravity = 9.81\n[run]\nend = {{ steps = 1 }}\n"
    )
}

#[test]
fn a_mesh_is_shown_as_text_as_json_and_as_a_picture_in_si_units() {
    let place = Place::empty();
    place.write("l.obj", L);
    let said = place.well(&["mesh", "l.obj", "--unit", "mm", "--picture", "l.png"]);
    has(&said, &["OBJ", "5.00000e-9 m^3", "0.003000 x 0.003000 x 1.000e-3 m", "adds 40.0 %", "l.obj"]);
    let pixels = image(&place);
    assert!(pixels.iter().filter(|rgb| **rgb != [255; 3]).count() > 50_000, "a body fills much of the page");
    let found: serde_json::Value =
        serde_json::from_str(&place.well(&["mesh", "l.obj", "--unit", "mm", "--json"])).unwrap();
    assert_eq!(
        (&found["format"], &found["facets"], &found["vertices"]),
        (&"OBJ".into(), &20.into(), &12.into())
    );
    assert_eq!((&found["body"]["convex"], &found["open"]), (&false.into(), &serde_json::Value::Null));
    let centre = found["body"]["centre"][0].as_f64().unwrap();
    assert!((centre - 14.1e-3).abs() < 1e-15, "{centre}");
    let said = place.well(&["mesh", "l.obj"]);
    has(&said, &["--unit mm", "unit = \"mm\""]);
}

fn image(place: &Place) -> Vec<[u8; 3]> {
    let file = std::io::BufReader::new(std::fs::File::open(place.path("l.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect()
}

#[test]
fn cases_take_the_lines_that_are_proposed_and_refuse_what_is_not() {
    let place = Place::empty();
    let two = cubes(&[[13.0, 13.0, 13.0], [15.0, 13.0, 13.0]]);
    let open = L.replace("f 4 3 2\n", "");
    for (text, unit, expected) in [
        (cubes(&[[13.0; 3]]), "1e-3", &["particle", "wall"][..]),
        (L.to_owned(), "mm", &["decompose", "hull", "wall"]),
        (two, "mm", &["parts", "decompose", "hull", "wall"]),
        (open, "mm", &["hull", "wall"]),
    ] {
        place.write("some.obj", &text);
        let said = place.well(&["mesh", "some.obj", "--unit", unit, "--json"]);
        let found: serde_json::Value = serde_json::from_str(&said).unwrap();
        let mut possible = Vec::new();
        for one in found["uses"].as_array().unwrap() {
            let kind = one["kind"].as_str().unwrap();
            let Some(line) = one["line"].as_str() else {
                assert!(one["problem"].as_str().unwrap().len() > 20, "{one}");
                continue;
            };
            possible.push(kind);
            let sphere = "shape = { sphere = { diameter = 1e-3 } }";
            let text = match kind {
                "wall" => case(sphere, &format!("[[walls]]\nname = \"some\"\n{line}")),
                _ => case(line, ""),
            };
            place.write("case.toml", text);
            place.well(&["check", "case.toml"]);
        }
        assert_eq!(possible, expected);
    }
    place.write("some.obj", L);
    place.write("case.toml", case("shape = { mesh = { file = \"some.obj\", unit = \"mm\" } }", ""));
    has(&place.ends(2, &["check", "case.toml"]), &["concave"]);
}

#[test]
fn files_and_options_that_cannot_be_used_are_refused_with_a_remedy() {
    let place = Place::empty();
    place.write("l.obj", L);
    place.write("l.ply", L);
    place.write("empty.obj", "");
    for (arguments, words) in [
        (&["absent.stl"][..], &["absent.stl"][..]),
        (&["l.ply"], &["`ply`", "`stl` or `obj`"]),
        (&["empty.obj"], &["no facets"]),
        (&["l.obj", "--unit", "ft"], &["\"mm\"", "number of metres"]),
        (&["l.obj", "--unit", "0"], &["number of metres"]),
        (&["l.obj", "--picture", "l.svg"], &["ends in .png"]),
    ] {
        place.refused(&[&["mesh"], arguments].concat(), words);
    }
}

#[test]
fn a_concave_body_is_cut_into_parts_in_a_case_and_shown_in_as_many_colours() {
    let place = Place::empty();
    place.write("l.obj", L);
    let said = place.well(&["mesh", "l.obj", "--unit", "mm", "--decompose", "--picture", "l.png"]);
    has(
        &said,
        &[
            "convex parts",
            "12 faces",
            "decompose: shape = { mesh = { file = \"l.obj\"",
            "concave = \"decompose\"",
        ],
    );
    let pixels = image(&place);
    // Of the two, one is bluer than red.
    let hues = [false, true].map(|is_blue| {
        let is = |[red, _, blue]: &&[u8; 3]| red.abs_diff(*blue) > 20 && (blue > red) == is_blue;
        pixels.iter().filter(is).count()
    });
    assert!(hues.iter().all(|count| *count > 5000), "two colours: {hues:?}");
    let shape = "shape = { mesh = { file = \"l.obj\", unit = \"mm\", concave = \"decompose\" } }";
    place.write("l.toml", case(shape, ""));
    let said = place.well(&["check", "l.toml"]);
    has(&said, &["cut into 2 convex parts of 12 faces: volume"]);
    place.well(&["run", "l.toml"]);
    for (wrong, words) in [
        (shape.replace("concave = \"decompose\"", "excess = 0.1"), "belongs to `concave`"),
        (shape.replace("unit = \"mm\"", "hull = true"), "has `concave` and `hull`"),
        (shape.replace("\"decompose\"", "\"decompose\", excess = 2"), "1e-5 to 1"),
        (shape.replace("\"decompose\"", "\"split\""), "decompose"),
    ] {
        place.write("l.toml", case(&wrong, ""));
        place.refused(&["check", "l.toml"], &[words, "l.toml"]);
    }
    place.refused(&["mesh", "l.obj", "--decompose=3"], &["1e-5 to 1"]);
}
