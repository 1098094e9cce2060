//! A mesh, in perspective.

use super::view::{FROM, scale_bar, single, whole};
use super::{Format, KINDS, write_figure};
use crate::error::Result;
use crate::math::{Vec3, bounding_box};
use std::path::Path;
use turbid_plot::{Item, Mesh, Paint, Triangle, View};

/// Width and height of the page (pixels).
const SIZE: [u32; 2] = [1000, 750];
/// Length of the scale over the diagonal of the box.
const SCALE: f64 = 0.2;

/// Writes a picture of the facets (m) of bodies as PNG, each in a colour of its own; z is upwards.
pub fn write_facets(path: &Path, title: &str, caption: &str, bodies: &[Vec<[Vec3; 3]>]) -> Result<()> {
    let (low, high) = bounding_box(bodies.iter().flatten().flatten().copied());
    let [x, y, z] = FROM;
    let of = |facets: &Vec<[Vec3; 3]>| {
        let mut mesh = Mesh { points: Vec::new(), triangles: Vec::new(), open: true };
        for (face, corners) in facets.iter().enumerate() {
            let [a, b, c] = corners;
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            let first = mesh.points.len() as u32;
            mesh.points.extend(corners.map(single));
            let corners = [first, first + 1, first + 2];
            mesh.triangles.push(Triangle { corners, normals: [single(normal); 3], face: face as u32 });
        }
        mesh
    };
    let item = |n: usize| Item { shade: Some(n), mesh: n, ..whole(Paint::Solid(KINDS[n % KINDS.len()])) };
    let view = View {
        title: title.to_owned(),
        caption: caption.to_owned(),
        size: SIZE,
        from: [z, -x, y].map(|x| x as f32),
        up: [0.0, 0.0, 1.0],
        zoom: 1.0,
        edges: [single(low), single(high)],
        meshes: bodies.iter().map(of).collect(),
        items: (0..bodies.len()).map(item).collect(),
        seen_through: Vec::new(),
        bars: Vec::new(),
        scale: scale_bar(SCALE * (high - low).norm()),
        threads: 1,
    };
    write_figure(path, &view.figure(), Format::Png)
}
