//! Polyhedra that are kept, and found anew.

use super::*;
use crate::coupling::cover::Cover;
use crate::coupling::tests::coupled;
use crate::coupling::{CouplingParams, Method, Saturated, SolidOperator};
use crate::fluid::ExchangeSum;
use crate::shape::{Cuboid, Polyhedron, Sphere, Through};
use std::collections::BTreeMap;

const CELLS: [usize; 3] = [30, 26, 22];
const BLOCK: Block = Block { lo: [0, 6, 0], hi: [30, 20, 22] };

/// Offset and bits of the fraction, by row, cell and id, of all cells that are covered.
type Covered = BTreeMap<(usize, u32, u64), ([i32; 3], u32)>;

fn covered(rows: &mut RowSegments, bodies: &[Body]) -> Covered {
    let ([_, ny, nz], fractions) = (BLOCK.size(), rows.fractions().to_vec());
    let in_row = |row: usize| {
        let cells = |segment: &Segment| {
            let (segment, cut) = (*segment, fractions[segment.cut as usize..].to_vec());
            let cell = move |k: usize| {
                let [n, ny, nz] = segment.offset;
                (segment.x + k as u32, [n + k as i32, ny, nz], segment.fraction(&cut, k))
            };
            (0..usize::from(segment.count)).map(cell).map(move |of| (segment.body, of))
        };
        rows.row(row).iter().flat_map(cells).collect::<Vec<_>>().into_iter().map(move |of| (row, of))
    };
    let all = (0..ny * nz).flat_map(in_row).filter(|(_, (_, (.., fraction)))| *fraction > 0.0);
    all.map(|(row, (body, (x, n, fraction)))| ((row, x, bodies[body as usize].id), (n, fraction.to_bits())))
        .collect()
}

/// A body after `step` steps, and its surface.
fn moved(id: u64, step: u32, shape: &Arc<dyn Shape>, params: &CouplingParams) -> (Body, Mapper) {
    let (k, t) = (id as f64, f64::from(step));
    let (start, speed) = ([4.0 * k, 5.1 * k, 7.0 + 0.3 * k], [0.03, 0.02 * (k - 2.0), 0.004 * (2.0 - k)]);
    let at: [f64; 3] = std::array::from_fn(|a| (start[a] + speed[a] * t).rem_euclid(CELLS[a] as f64));
    let reference = at.map(f64::round_ties_even);
    let centre = std::array::from_fn(|a| at[a] - reference[a]);
    let motion = RigidMotion { centre, ..RigidMotion::default() };
    let turn = match shape.passage() {
        Some(_) => Quat::identity(),
        None => Quat::from_euler_angles(0.3 * k + 0.003 * t, 0.001 * t, 0.2 * k - 0.002 * t),
    };
    let (reference, exchange) = (reference.map(|n| n as i64), ExchangeSum::default());
    let body = Body { id, reference, motion, exchange, departed: exchange };
    (body, Mapper::new(shape, turn, motion, params, 0.02))
}

#[test]
fn polyhedra_kept_while_they_move_come_and_go_have_the_cells_of_those_found_anew() {
    let domain = Domain { faces: Domain::faces([true, true, false]), cells: CELLS, dx: 1.0 };
    let method = Method::Saturated(Saturated::new(SolidOperator::Sc3));
    let params = coupled(method);
    let dx = params.units.dx;
    let hull = |radius: f64, refinement| -> Arc<dyn Shape> {
        let round = Sphere { radius: radius * dx }.surface_mesh(refinement);
        Arc::new(Polyhedron::hull(&round.points, 1e-9 * dx).unwrap().0)
    };
    // In cells of the last more faces meet than are evaluated together.
    let cuboid: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::new(4.3, 5.1, 6.2) * dx).unwrap());
    let prism = Arc::new(Cuboid::new(Vec3::new(30.0, 3.2, 2.7) * dx).unwrap());
    let through: Arc<dyn Shape> = Arc::new(Through::new(prism, 0, Vec3::x()).unwrap());
    let shapes = [cuboid, hull(3.0, 0), hull(1.6, 1), through];
    for simd in [Simd::Scalar, Simd::best()] {
        let (mut kept, mut unchanged, mut before) = (KeptPolyhedra::default(), 0, Vec::new());
        for step in 0..300 {
            // Through the periodic faces; one leaves and comes back, one is there for some time.
            let present = |id: &u64| match id {
                3 => step % 90 < 65,
                4 => (100..170).contains(&step),
                _ => true,
            };
            let all = (0..6).filter(present).map(|id| moved(id, step, &shapes[id as usize % 4], &params));
            let (bodies, mappers): (Vec<Body>, Vec<Mapper>) = all.unzip();
            let polyhedra: Vec<_> = (0..).zip(&mappers).collect();
            kept.update(&polyhedra, &bodies, &domain, BLOCK, simd);
            let (mut cover, mut rows) = (Cover::default(), RowSegments::default());
            for ((index, mapper), body) in polyhedra.iter().zip(&bodies) {
                mapper.each_image(&domain, BLOCK, body.reference, *index, 0.0, |image| {
                    let surface = FlatSurface::new(mapper, planes(mapper).unwrap(), LEAST_SKIN);
                    cover.add(surface, mapper, image, simd);
                });
            }
            let [_, ny, nz] = BLOCK.size();
            rows.sort(ny * nz, &cover.added, std::mem::take(&mut cover.cut));
            assert_eq!(covered(&mut kept.rows, &bodies), covered(&mut rows, &bodies), "step {step}");
            let now: Vec<_> = kept.listed.iter().map(|listed| (listed.id, listed.centre)).collect();
            unchanged += u32::from(now == before);
            before = now;
        }
        assert!(unchanged > 150, "{unchanged} steps of 300 with the same lists");
    }
}

#[test]
fn cells_of_fast_bodies_are_not_kept() {
    let params = coupled(Method::Saturated(Saturated::new(SolidOperator::Sc3)));
    let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::repeat(8.0 * params.units.dx)).unwrap());
    let pays = |velocity: [f64; 3], angular: [f64; 3]| {
        let motion = RigidMotion { velocity, angular, centre: [0.0; 3] };
        let mapper = Mapper::new(&shape, Quat::identity(), motion, &params, 0.0);
        KeptPolyhedra::pays([&mapper].into_iter())
    };
    assert!(pays([0.02, 0.0, 0.0], [0.0; 3]) && pays([0.0; 3], [0.0, 0.002, 0.0]));
    assert!(!pays([0.0, 0.1, 0.0], [0.0; 3]) && !pays([0.0; 3], [0.0, 0.0, 0.01]));
}
