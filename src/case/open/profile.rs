//! Profiles of the velocity over inlets.

use crate::case::checks::Document;
use crate::case::file::FACES;
use crate::case::walls::{PlacedWall, bounds_of_mesh};
use crate::domain::{Domain, Face};
use crate::error::{Error, Result};
use crate::math::{Grid, Profile, Vec3};
use crate::wall::Surface;
use std::sync::Arc;

/// A profile by rows `[a, b, factor]`, whose points must form a grid over the face.
pub(super) fn table(
    document: &Document,
    domain: &Domain,
    key: &str,
    face: usize,
    rows: &[[f64; 3]],
) -> Result<Profile> {
    let normal = face / 2;
    let axes = [usize::from(normal == 0), 2 - usize::from(normal == 2)];
    let [first, second] = axes.map(|a| ["x", "y", "z"][a]);
    if rows.is_empty() {
        let remedy = "rows are [a, b, factor]; one is the same factor everywhere";
        return Err(document.error(key, &format!("`{key}` has no rows"), "empty", remedy));
    }
    if rows.iter().all(|row| row[2] <= 0.0) {
        let title = format!("`{key}` has no factor above 0, so that no fluid comes in");
        return Err(document.error(
            key,
            &title,
            "nothing comes in",
            "give factors above 0, or remove the inlet",
        ));
    }
    let points = [0, 1].map(|a| {
        let mut points: Vec<f64> = rows.iter().map(|row| row[a]).collect();
        points.sort_by(f64::total_cmp);
        points.dedup();
        points
    });
    for (points, axis) in points.iter().zip(axes) {
        let (from, to, length) = (points[0], points[points.len() - 1], domain.size()[axis]);
        if points.len() > 1 && (to <= 0.0 || from >= length) {
            let name = ["x", "y", "z"][axis];
            let title = format!(
                "the points of `{key}` reach from {name} = {from:.4e} m to {to:.4e} m, but the face \"{}\" from 0 to {length:.4e} m",
                FACES[face]
            );
            return Err(document.error(
                key,
                &title,
                "beside the face",
                "give the coordinates in m, in the frame of the box",
            ));
        }
    }
    let index = |points: &[f64], x: f64| points.partition_point(|point| *point < x);
    let mut values: Vec<([usize; 2], f64)> =
        rows.iter().map(|row| ([index(&points[1], row[1]), index(&points[0], row[0])], row[2])).collect();
    values.sort_by_key(|(at, _)| *at);
    let refused = |what: &str, [j, i]: [usize; 2]| {
        let at = format!("({first}, {second}) = ({}, {}) m", points[0][i], points[1][j]);
        let title = format!("the points of `{key}` form no grid: {at} {what}");
        let remedy = format!("one row for each pair of a value of {first} and one of {second}, in any order");
        document.error(key, &title, "no grid", &remedy)
    };
    if let Some(twice) = values.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(refused("is there twice", twice[0].0));
    }
    let (width, height) = (points[0].len(), points[1].len());
    let all = (0..height).flat_map(|j| (0..width).map(move |i| [j, i]));
    let found = values.iter().map(|(at, _)| Some(*at)).chain(std::iter::repeat(None));
    if let Some((missing, _)) = all.zip(found).find(|(at, found)| Some(*at) != *found) {
        return Err(refused(&format!("of {width} x {height} points is missing"), missing));
    }
    let values = values.into_iter().map(|(_, factor)| factor).collect();
    Ok(Profile::Table { grid: Arc::new(Grid { axes, values, points }), unit: 1.0 })
}

/// The profile of a flow between the walls round a face.
pub(super) fn parabola(
    document: &Document,
    domain: &Domain,
    walls: &[PlacedWall],
    face: usize,
) -> Result<Profile> {
    let (normal, size) = (face / 2, domain.size());
    // A rod across the flow, or a mesh, that does not reach the face has no part in the profile there.
    let end = if face.is_multiple_of(2) { 0.0 } else { size[normal] };
    let is_behind = |surface: &Surface| match surface {
        Surface::Cylinder { point, axis, radius, pipe: false } => {
            axis[normal].abs() < 1e-9 && (point[normal] - end).abs() >= *radius
        }
        Surface::Mesh(placed) => {
            let [low, high] = bounds_of_mesh(placed).map(|corner| corner[normal]);
            if face.is_multiple_of(2) { low > end } else { high < end }
        }
        _ => false,
    };
    let listed = walls.iter().filter(|placed| !placed.is_face).map(|placed| &placed.wall.surface);
    let listed: Vec<&Surface> = listed.filter(|surface| !is_behind(surface)).collect();
    match listed[..] {
        [] => {}
        [&Surface::Cylinder { point, axis, radius, pipe: true }]
            if axis.cross(&Vec3::ith(normal, 1.0)).norm() < 1e-9 =>
        {
            let least = 1e-9 * radius;
            let fits = |a: usize| {
                let half =
                    |end: usize, to: f64| to.abs() < least && domain.faces[2 * a + end] == Face::FreeSlip;
                let [below, above] = [point[a], size[a] - point[a]];
                (below >= radius - least || half(0, below)) && (above >= radius - least || half(1, above))
            };
            if !(0..3).filter(|&a| a != normal).all(fits) {
                let what = "the pipe is not whole in the box, nor halved by a plane of symmetry";
                return Err(no_parabola(document, face, what));
            }
            return Ok(Profile::Round { centre: point.into(), axis: normal, radius });
        }
        _ => {
            return Err(no_parabola(
                document,
                face,
                "the walls in the box are not one pipe along its normal",
            ));
        }
    }
    let beside = (0..6).filter(|n| n / 2 != normal && !domain.is_periodic(n / 2));
    for n in beside {
        let of_face = |placed: &&PlacedWall| placed.is_face && placed.wall.name == FACES[n];
        let rests = walls.iter().find(of_face).is_some_and(|placed| placed.wall.motion.rests());
        if domain.faces[n].is_open() || !rests {
            let what = format!("the face \"{}\" beside it is no wall at rest", FACES[n]);
            return Err(no_parabola(document, face, &what));
        }
    }
    let between: [Option<[f64; 2]>; 3] = std::array::from_fn(|a| {
        let slips = [0, 1].map(|side| domain.faces[2 * a + side] == Face::FreeSlip);
        let length = size[a];
        match slips {
            _ if a == normal || domain.is_periodic(a) => None,
            [true, true] => None,
            [false, false] => Some([0.0, length]),
            [false, true] => Some([0.0, 2.0 * length]),
            [true, false] => Some([-length, 2.0 * length]),
        }
    });
    if between == [None; 3] {
        return Err(no_parabola(document, face, "no direction along it has walls"));
    }
    Ok(Profile::Parabolic(between))
}

fn no_parabola(document: &Document, face: usize, what: &str) -> Error {
    let key = format!("domain.faces.{}.inlet.profile", FACES[face]);
    let title = format!("`{key}` is \"parabolic\", the flow between walls or in a pipe, but {what}");
    document.error(&key, &title, "no such profile", "take \"uniform\"")
}
