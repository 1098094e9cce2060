//! Flow through and past walls made of facets: `validation/mesh_walls`.

use super::prelude::*;
use super::round_walls::flow;
use super::vessels::{add_mesh, turned};
use std::f64::consts::PI;
use turbid::shape::{Shape, Sphere};
use turbid::wall::{FreeSide, Motion, WallMesh};

const TEXT: &str = include_str!("../../../../validation/mesh_walls/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/sphere_array/reference.csv");

pub(super) const CASE: Case = Case {
    name: "mesh_walls",
    question: "flow through a pipe, past spheres and between plates whose walls are made of facets",
    source: "Hagen and Poiseuille, exact",
    parts: &[
        Part::quick(2.0, pipe),
        Part::quick(2.0, plates),
        Part::quick(3.0, |context, found| array(context, found, "0.064", 25)),
        Part::quick(2.0, |context, found| array(context, found, "0.25", 16)),
        Part::full(60.0, bed),
    ],
};

/// Edge of a cell (m), and viscosity (m^2/s), as in the case file.
const CELL: f64 = 1e-4;
const VISCOSITY: f64 = 1e-6;
/// Of the flow through a pipe of 20 cells.
const FLOW: f64 = 5e-3;
/// Of the drag factor of spheres of 12 cells.
const DRAG: f64 = 0.02;
/// Of the flow through a bed of spheres of facets over that through one of bodies.
const BED: f64 = 0.01;

/// The case with a wall of facets in a cube or a box, and other changes.
fn with_mesh(context: &SuiteContext, mesh: WallMesh, own: &[String]) -> Result<Setup> {
    let mut setup = context.setup(TEXT, CASE.name, own)?;
    add_mesh(&mut setup, "mesh", mesh, Motion::default());
    Ok(setup)
}

/// A container: a round tube along x of `sides` strips, beyond the box at both ends, and closed there.
fn tube(length: f64, [y, z]: [f64; 2], radius: f64, sides: u32) -> WallMesh {
    let [low, high] = [-4.0 * CELL, length + 4.0 * CELL];
    let profile = [[0.0, low], [radius, low], [radius, high], [0.0, high]];
    turned(&profile, sides, Some(FreeSide::Inside), |a, b, x| Vec3::new(x, y + a, z + b))
}

fn pipe(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let diameter = 20.0 * CELL;
    for (off, relaxation_time) in [([0.0, 0.0], 0.8), ([0.3, 0.15], 1.0)] {
        let (width, acceleration) = (24.0 * CELL, 3e-3);
        let axis = off.map(|off| 0.5 * width + off * CELL);
        // 12 times the decay to 1/e of the slowest mode.
        let end = 12.0 * diameter * diameter / (4.0 * 5.78 * VISCOSITY);
        let own = [format!("lattice.relaxation_time={relaxation_time}"), format!("run.end.time={end}")];
        let setup = with_mesh(context, tube(4.0 * CELL, axis, 0.5 * diameter, 128), &own)?;
        // A polygon of 128 sides is 0.04 % narrower than its circle.
        let exact = PI * diameter.powi(4) * acceleration / (128.0 * VISCOSITY);
        let quantity = format!(
            "pipe of 128 sides, 20 cells: flow over the exact one, axis off by {off:?} cells, tau {relaxation_time} (-)"
        );
        found.relative(quantity, flow(&setup)? / exact, 1.0, FLOW);
    }
    Ok(())
}

/// Two sheets, without thickness, half-way between cells: the flow between them and that through the rest of the box.
fn plates(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let (mut vertices, mut facets) = (Vec::new(), Vec::new());
    // Ten cells apart of the 24.
    for z in [7.0 * CELL, 17.0 * CELL] {
        let first = vertices.len() as u32;
        let [low, high] = [-4.0 * CELL, 28.0 * CELL];
        vertices
            .extend([(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| Vec3::new(x, y, z)));
        facets.extend([[0, 1, 2], [0, 2, 3]].map(|facet: [u32; 3]| facet.map(|k| first + k)));
    }
    let mesh = WallMesh::new(vertices, facets, None).expect("sheets");
    let own = ["lattice.magic_parameter=0.1875".to_string(), "run.end.time=4".to_string()];
    let setup = with_mesh(context, mesh, &own)?;
    let exact = |gap: f64| 3e-3 * (gap * CELL).powi(3) * 24.0 * CELL / (12.0 * VISCOSITY);
    let quantity = "sheets 10 cells apart in 24: flow on both sides over the exact one (-)";
    found.relative(quantity, flow(&setup)? / (exact(10.0) + exact(14.0)), 1.0, FLOW);
    Ok(())
}

/// Spheres of facets, of the volume of the spheres that they stand for.
pub(super) fn spheres(centres: &[Vec3], radius: f64, refinement: u32) -> WallMesh {
    let sphere = Sphere { radius }.surface_mesh(refinement);
    let volume: f64 = sphere
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| sphere.points[i as usize]);
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum();
    let scale = (4.0 / 3.0 * PI * radius.powi(3) / volume).cbrt();
    let vertices = centres.iter().flat_map(|centre| sphere.points.iter().map(move |at| centre + at * scale));
    let facets = (0..centres.len()).flat_map(|n| {
        let first = (n * sphere.points.len()) as u32;
        sphere.triangles.iter().map(move |t| t.map(|i| first + i))
    });
    WallMesh::new(vertices.collect(), facets.collect(), Some(FreeSide::Outside)).expect("closed meshes")
}

/// Simple-cubic array of spheres of about 12 cells.
fn array(context: &SuiteContext, found: &mut Findings, phi: &str, cells: usize) -> Result<()> {
    let (side, expected) = (cells as f64 * CELL, Table::new(REFERENCE).of("phi", phi, "K"));
    let radius = side * (3.0 * phi.parse::<f64>().expect("a number") / (4.0 * PI)).cbrt();
    let centre = Vec3::new(0.5 * side + 0.3 * CELL, 0.5 * side - 0.2 * CELL, 0.5 * side + 0.45 * CELL);
    let (acceleration, steps) = (1e-3, 8 * cells * cells);
    let own = [
        format!("domain.size={:?}", [side; 3]),
        format!("driving.body_acceleration={:?}", [acceleration, 0.0, 0.0]),
        "lattice.relaxation_time=1".to_string(),
        format!("run.end={{steps={steps}}}"),
    ];
    let setup = with_mesh(context, spheres(&[centre], radius, 3), &own)?;
    let velocity = flow(&setup)? / (side * side);
    let drag = acceleration * side.powi(3) / (6.0 * PI * VISCOSITY * radius * velocity);
    let quantity = format!("sphere of facets, {:.1} cells: K, phi {phi} (-)", 2.0 * radius / CELL);
    found
        .relative(quantity, drag, expected, DRAG)
        .source("Zick and Homsy (1982), doi:10.1017/S0022112082000627");
    Ok(())
}

/// A random bed of spheres of 16 cells, of bodies and of facets, whose images reach through the periodic faces.
fn bed(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let (cells, diameter) = (48, 16.0 * CELL);
    let side = f64::from(cells) * CELL;
    let own = [
        format!("domain.size={:?}", [side; 3]),
        "driving.body_acceleration=[1e-3, 0.0, 0.0]".to_string(),
        "lattice.relaxation_time=0.8".to_string(),
        "run.end={steps=3000}".to_string(),
    ];
    let kind = format!(
        "particles=[{{ shape.sphere.diameter = {diameter:e}, density = 1000, motion = \"fixed\", volume_fraction = 0.3, seed = 1 }}]"
    );
    let cells_per_diameter = "lattice.cells_per_diameter=16".to_string();
    let bodies = context.setup(TEXT, CASE.name, &[&own[..], &[kind, cells_per_diameter]].concat())?;
    let near = |x: f64| {
        [-side, 0.0, side]
            .map(|shift| x + shift)
            .into_iter()
            .filter(|x| (x - 0.5 * side).abs() < 0.5 * side + diameter)
    };
    let images = |at: Vec3| {
        near(at.x)
            .flat_map(move |x| near(at.y).flat_map(move |y| near(at.z).map(move |z| Vec3::new(x, y, z))))
    };
    let centres: Vec<Vec3> = bodies.particles.iter().flat_map(|p| images(p.position())).collect();
    let meshes = with_mesh(context, spheres(&centres, 0.5 * diameter, 3), &own)?;
    let quantity = "random bed of spheres of 16 cells, phi 0.3: flow past facets over that past bodies (-)";
    found
        .relative(quantity, flow(&meshes)? / flow(&bodies)?, 1.0, BED)
        .source("the same bed of fixed bodies");
    Ok(())
}
