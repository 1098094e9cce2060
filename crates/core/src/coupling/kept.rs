//! Spheres whose cells the sweep finds: their periodic images and the rows that these may reach, kept while spheres move little.

use super::mapper::images_within;
use super::shift_of_reference;
use crate::domain::{Block, Domain};
use crate::fluid::{Body, HALF_DIAGONAL, LatticeSphere, SphereImage, SphereRows};
use crate::math::{ceil, floor};

/// Distance (cells) that a sphere may move before its rows are listed anew. What is listed changes no bit: rows that a sphere does not
/// reach are passed over.
const SKIN: f64 = 0.25;

/// Spheres of a block.
#[derive(Default)]
pub(super) struct KeptSpheres {
    pub(super) rows: SphereRows,
    /// The spheres when their rows were listed, in ascending order of ids.
    listed: Vec<Listed>,
    /// Cells of the block at offset 0 of their images then.
    bases: Vec<[i32; 3]>,
}

/// A sphere when its rows were listed.
struct Listed {
    id: u64,
    reference: [i64; 3],
    centre: [f64; 3],
    sphere: LatticeSphere,
    /// One past its last image.
    end: usize,
}

impl KeptSpheres {
    /// Moves to the present `spheres`, with the indices of their bodies, in ascending order of ids.
    pub(super) fn update(
        &mut self,
        spheres: &[(u32, LatticeSphere)],
        bodies: &[Body],
        domain: &Domain,
        block: Block,
    ) {
        if !self.moved_little(spheres, bodies, domain, block) {
            self.list(spheres, bodies, domain, block);
        }
    }

    /// Moves the images; returns false if the rows have to be listed anew.
    fn moved_little(
        &mut self,
        spheres: &[(u32, LatticeSphere)],
        bodies: &[Body],
        domain: &Domain,
        block: Block,
    ) -> bool {
        let (mut first, mut before) = (0, self.listed.iter().peekable());
        for &(index, sphere) in spheres {
            let body = &bodies[index as usize];
            while let Some(gone) = before.next_if(|listed| listed.id < body.id) {
                if gone.end > first {
                    return false;
                }
            }
            let Some(listed) = before.next_if(|listed| listed.id == body.id) else {
                // Its images are looked for in every step as long as there are none.
                if !images_of(body, index, sphere, domain, block).is_empty() {
                    return false;
                }
                continue;
            };
            let shift = shift_of_reference(listed.reference, body.reference, domain);
            let moved: [f64; 3] =
                std::array::from_fn(|a| (body.motion.centre[a] - listed.centre[a]) - shift[a] as f64);
            let square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2];
            // Not a number is far, too.
            let is_near = square < SKIN * SKIN;
            if !is_near || sphere != listed.sphere {
                return false;
            }
            for (image, base) in self.rows.images[first..listed.end].iter_mut().zip(&self.bases[first..]) {
                image.body = index;
                image.base = std::array::from_fn(|a| base[a] - shift[a] as i32);
            }
            first = listed.end;
        }
        before.all(|gone| gone.end <= first)
    }

    fn list(&mut self, spheres: &[(u32, LatticeSphere)], bodies: &[Body], domain: &Domain, block: Block) {
        self.listed.clear();
        self.rows.images.clear();
        for &(index, sphere) in spheres {
            let body = &bodies[index as usize];
            self.rows.images.extend(images_of(body, index, sphere, domain, block));
            let (reference, centre) = (body.reference, body.motion.centre);
            self.listed.push(Listed { id: body.id, reference, centre, sphere, end: self.rows.images.len() });
        }
        self.bases = self.rows.images.iter().map(|image| image.base).collect();
        let [_, ny, nz] = block.size();
        self.rows.list([ny, nz], SKIN, |image| bodies[image.body as usize].motion.centre);
    }
}

/// Periodic images of a sphere that reach the block, or would within the skin.
fn images_of(
    body: &Body,
    index: u32,
    sphere: LatticeSphere,
    domain: &Domain,
    block: Block,
) -> Vec<SphereImage> {
    let (reach, centre) = (sphere.radius + HALF_DIAGONAL + SKIN, body.motion.centre);
    let [first, last] = [centre.map(|x| ceil(x - reach)), centre.map(|x| floor(x + reach))];
    let (within, mut images) = ([first, last].map(|ends| ends.map(i64::from)), Vec::new());
    images_within(within, domain, block, body.reference, index, |image| {
        images.push(SphereImage { body: index, sphere, base: image.base.map(|n| n as i32) });
    });
    images
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluid::{ExchangeSum, RigidMotion};
    use std::collections::BTreeSet;

    const CELLS: [usize; 3] = [20, 16, 12];
    const BLOCK: Block = Block { lo: [0, 4, 0], hi: [20, 12, 12] };

    /// A body with its centre at these cells of the box.
    fn body(id: u64, at: [f64; 3]) -> Body {
        let at: [f64; 3] = std::array::from_fn(|a| at[a].rem_euclid(CELLS[a] as f64));
        let reference = at.map(f64::round_ties_even);
        let centre = std::array::from_fn(|a| at[a] - reference[a]);
        let motion = RigidMotion { centre, ..RigidMotion::default() };
        let (reference, exchange) = (reference.map(|n| n as i64), ExchangeSum::default());
        Body { id, reference, motion, exchange, departed: exchange }
    }

    /// Rows of the block, and which of the spheres that are listed cover cells there: id and cell of the block at offset 0.
    fn listed(kept: &KeptSpheres, bodies: &[Body], reach: f64) -> BTreeSet<(usize, u64, [i32; 3])> {
        let [_, ny, nz] = BLOCK.size();
        let in_row = |row: usize| {
            kept.rows.row(row).iter().filter_map(move |image| {
                let SphereImage { body, base, sphere } = kept.rows.images[*image as usize];
                let body = &bodies[body as usize];
                let [y, z] = [(1, row % ny), (2, row / ny)]
                    .map(|(a, n)| n as f64 - f64::from(base[a]) - body.motion.centre[a]);
                let most = sphere.radius + reach;
                let x = f64::from(base[0]) + body.motion.centre[0];
                let half = (most * most - y * y - z * z).sqrt();
                // Not a number is no reach.
                (x + half >= 0.0 && x - half <= CELLS[0] as f64 - 1.0).then_some((row, body.id, base))
            })
        };
        (0..ny * nz).flat_map(in_row).collect()
    }

    #[test]
    fn rows_kept_while_spheres_move_come_and_go_have_all_that_rows_listed_anew_have() {
        let domain = Domain { faces: Domain::faces([true, true, false]), cells: CELLS, dx: 1.0 };
        let (mut kept, mut unchanged, mut before) = (KeptSpheres::default(), 0, Vec::new());
        for step in 0..200_u32 {
            let t = f64::from(step);
            // Through the periodic faces; one leaves and comes back, one is there for some time.
            let present = |id: &u64| match id {
                3 => step % 60 < 45,
                4 => (70..120).contains(&step),
                _ => true,
            };
            let of = |id: u64| {
                let k = id as f64;
                let start = [3.0 * k, 5.1 * k, 5.0 + 0.3 * k];
                let speed = [0.05, 0.02 * (k - 2.0), 0.004 * (2.0 - k)];
                body(id, std::array::from_fn(|a| start[a] + speed[a] * t))
            };
            let bodies: Vec<Body> = (0..6).filter(present).map(of).collect();
            let surface = |body: &Body| LatticeSphere { radius: 2.0 + 0.2 * body.id as f64, shift: 0.0 };
            let spheres: Vec<_> = (0..).zip(&bodies).map(|(i, body)| (i, surface(body))).collect();
            kept.update(&spheres, &bodies, &domain, BLOCK);
            let mut anew = KeptSpheres::default();
            anew.update(&spheres, &bodies, &domain, BLOCK);
            assert_eq!(
                listed(&kept, &bodies, HALF_DIAGONAL),
                listed(&anew, &bodies, HALF_DIAGONAL),
                "step {step}"
            );
            let now: Vec<_> = kept.listed.iter().map(|listed| (listed.id, listed.centre)).collect();
            unchanged += u32::from(now == before);
            before = now;
        }
        assert!(unchanged > 140, "{unchanged}");
    }
}
