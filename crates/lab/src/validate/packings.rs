//! Dense random packings: `validation/packings`.

use super::prelude::*;
use turbid::contact::{Body, GrownShape, intersects};

const TEXT: &str = include_str!("../../../../validation/packings/case.toml");

pub(super) const CASE: Case = Case {
    name: "packings",
    question: "volume fraction, overlaps and order of dense random packings of spheres of one and two sizes, cubes and ellipsoids",
    source: "a random packing has no order: with n bonds the parameter is n^-1/2, in a crystal of spheres 0.575 (Steinhardt, Nelson and Ronchetti 1983, doi:10.1103/PhysRevB.28.784)",
    parts: &[Part::full(30.0, |context, found| {
        PACKINGS.iter().try_for_each(|of| packing(context, found, of))
    })],
};

/// Name, volume fraction, and the section of particles if it is not that of the case.
type Packing = (&'static str, f64, &'static str);
const PACKINGS: [Packing; 4] = [
    ("spheres", 0.63, ""),
    (
        "spheres of two sizes, 1 to 0.4",
        0.68,
        "sphere={ diameter=1e-3 } }, sizes=[{ scale=1, share=0.15 }, { scale=0.4, share=0.85 }]",
    ),
    ("cubes", 0.6, "cuboid={ edges=[8e-4, 8e-4, 8e-4] } }"),
    ("ellipsoids of axes 1.25 to 1 to 0.8", 0.66, "ellipsoid={ axes=[1.25e-3, 1e-3, 8e-4] } }"),
];

/// Of the volume fraction, which is of whole particles.
const FRACTION: f64 = 1e-3;
/// Of the bond-orientational order.
const ORDER: f64 = 0.06;
/// Most bonds of which the order is.
const BONDS: usize = 5000;
/// Centres that are neighbours, in units of the mean distance at contact.
const NEAR: f64 = 1.2;

/// The sixth Legendre polynomial.
fn legendre(x: f64) -> f64 {
    let s = x * x;
    (((231.0 * s - 315.0) * s + 105.0) * s - 5.0) / 16.0
}

fn packing(context: &SuiteContext, found: &mut Findings, &(name, wanted, section): &Packing) -> Result<()> {
    let own = if section.is_empty() {
        Vec::new()
    } else {
        vec![format!("particles.0={{ shape={{ {section}, density=2500, volume_fraction={wanted}, seed=1 }}")]
    };
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let contours: Vec<GrownShape> =
        setup.templates.iter().map(|template| GrownShape::new(template.shape.clone(), 0.0)).collect();
    let body = |particle: &Particle| Body {
        grown: &contours[particle.template as usize],
        orientation: particle.orientation(),
    };
    let half =
        |particle: &Particle| 0.5 * setup.templates[particle.template as usize].shape.equivalent_diameter();
    let (mut overlaps, mut bonds) = (0, Vec::new());
    for (n, a) in setup.particles.iter().enumerate() {
        for b in &setup.particles[..n] {
            let offset = setup.domain.nearest_image(b.position() - a.position());
            let distance = offset.norm();
            if distance < NEAR * (half(a) + half(b)) {
                bonds.push(offset / distance);
            }
            let reach: f64 = [a, b].map(|of| contours[of.template as usize].reach()).iter().sum();
            overlaps += u32::from(distance < reach && intersects(&body(a), &body(b), offset));
        }
    }
    let phi = setup.volume_fraction;
    found
        .relative(format!("{name}: volume fraction (-)"), phi, wanted, FRACTION)
        .source("what was asked for");
    let quantity = format!("{name}: pairs that overlap");
    found.absolute(quantity, f64::from(overlaps), 0.0, 0.5).source("no two bodies overlap");
    let neighbours = 2.0 * bonds.len() as f64 / setup.particles.len() as f64;
    // By the theorem of addition no spherical harmonics are needed, but every pair of bonds: some suffice.
    let bonds: Vec<Vec3> = bonds.iter().copied().step_by(bonds.len() / BONDS + 1).collect();
    let sum: f64 = bonds.iter().map(|a| bonds.iter().map(|b| legendre(a.dot(b))).sum::<f64>()).sum();
    let order = sum.max(0.0).sqrt() / bonds.len() as f64;
    found.absolute(format!("{name}: bond-orientational order of degree 6 (-)"), order, 0.0, ORDER);
    found.note(format!("{name}: particles"), setup.particles.len() as f64);
    found.note(format!("{name}: neighbours of each (-)"), neighbours);
    Ok(())
}
