//! Partial slip: a disc of contact that slips at its edge and sticks inside, by [`FrictionLaw::MindlinDeresiewicz`](super::FrictionLaw).
//!
//! The contact of Hertz, Cattaneo and Mindlin is that of a row of independent springs, of which spring `z` comes into contact at the depth `z^2`. With the
//! depth `d` and the stiffness `k = 8 G* a` of the whole contact, the deflections `u(z)` and the normal force `N`,
//!
//! ```text
//! u' = turned(u) + v dt,   |u'| <= g (d - z^2),   g = 3 mu N / (2 k d);   f = k / sqrt(d) int u' dz  (0 <= z <= sqrt(d)),   |f| <= mu N
//! ```
//!
//! where springs that come into contact have `u = 0`. The row is kept as three points between which `u` is linear in `z^2`, which is exact where it slips; a fourth one, where
//! slip begins or the contact has grown, replaces the one that matters least, so that `f` stays the same and
//! the energy `k / (2 sqrt(d)) int u^2 dz` never grows; where both cannot be, `f` changes a little.
//!
//! References: Mindlin and Deresiewicz (1953), J. Appl. Mech. 20, 327; Jäger (1993), Arch. Appl. Mech. 63, 402 (any history of oblique forces); Popov and
//! Hess (2015), Method of Dimensionality Reduction, doi:10.1007/978-3-642-53876-6 (the row of springs). Three points are ours.

#[cfg(test)]
mod tests;

use super::friction::capped;
use crate::math::Vec3;
use bytemuck::{Pod, Zeroable};

/// Memory of the law: 88 B.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SpringRow {
    /// Deflections (m) of the spring in the middle and of two others.
    deflections: [[f64; 3]; 3],
    /// `sqrt(d)` (m^(1/2)) of the sub-step before.
    edge: f64,
    /// `z` of these two (m^(1/2)).
    places: [f32; 2],
}

/// A spring of the row.
#[derive(Clone, Copy, Debug)]
struct Knot {
    /// `z` (m^(1/2)).
    place: f64,
    /// Deflection (m).
    deflection: Vec3,
}

impl SpringRow {
    /// Turns all deflections.
    pub(super) fn turn(&mut self, turned: impl Fn(Vec3) -> Vec3) {
        self.deflections = self.deflections.map(|deflection| turned(deflection.into()).into());
    }

    /// Moves the surfaces by a way (m) along each other, at a depth (m) and with the slope `g` (-) up to which the springs stick; returns their mean
    /// deflection (m).
    pub(super) fn slide(&mut self, depth: f64, slope: f64, way: Vec3) -> Vec3 {
        let end = Knot { place: depth.sqrt(), deflection: Vec3::zeros() };
        let most = |knot: &Knot| slope * (depth - knot.place * knot.place).max(0.0);
        let slips = |knot: &Knot| knot.place > end.place || knot.deflection.norm() > most(knot);
        let mut row = [end; 6];
        let places = [0.0, self.places[0].into(), self.places[1].into(), rounded_down(self.edge)];
        for (n, place) in places.into_iter().enumerate() {
            let before = self.deflections.get(n).map_or(Vec3::zeros(), |of| Vec3::from(*of));
            row[n] = Knot { place, deflection: before + way };
        }
        let mut count = 4;
        if let Some(sticks) = (0..3).rev().find(|&n| !slips(&row[n]) && slips(&row[n + 1])) {
            row.copy_within(sticks + 1..4, sticks + 2);
            row[sticks + 1] = onset([&row[sticks], &row[sticks + 2]], depth, slope);
            count = 5;
        }
        count = row[..count].iter().filter(|knot| knot.place <= end.place).count();
        for knot in &mut row[..count] {
            knot.deflection = capped(knot.deflection, most(knot));
        }
        row[count] = end;
        while count > 3 {
            thin(&mut row[..=count]);
            count -= 1;
        }
        let outermost = row[count - 1];
        row[count..].fill(outermost);
        row[3] = end;
        self.deflections = [0, 1, 2].map(|n| row[n].deflection.into());
        self.places = [1, 2].map(|n| row[n].place as f32);
        self.edge = end.place;
        sum(&row[..4]) / end.place
    }
}

/// Nearest number in single precision that is not above it.
fn rounded_down(value: f64) -> f64 {
    let near = value as f32;
    f64::from(if f64::from(near) > value { near.next_down() } else { near })
}

/// The spring at which slip begins, between one that sticks and one that slips.
fn onset([inner, outer]: [&Knot; 2], depth: f64, slope: f64) -> Knot {
    let from = inner.place * inner.place;
    let (span, change) = (outer.place * outer.place - from, outer.deflection - inner.deflection);
    let (fall, most) = (slope * span, slope * (depth - from));
    // |u + t du| = most - t fall, without a difference of large numbers.
    let a = change.norm_squared() - fall * fall;
    let b = inner.deflection.dot(&change) + most * fall;
    let c = most * most - inner.deflection.norm_squared();
    let part = (c / (b + (b * b + a * c).max(0.0).sqrt())).min(1.0);
    let place = rounded_down((from + part * span).sqrt()).max(inner.place);
    let part = ((place * place - from) / span).min(1.0);
    Knot { place, deflection: inner.deflection + change * part }
}

/// Removes a knot but the first and the last, the one without which the sum changes least; the last place is left over.
fn thin(row: &mut [Knot]) {
    let last = row.len() - 2;
    let lost = |n: usize| sum(&row[n - 1..n + 2]) - sum(&[row[n - 1], row[n + 1]]);
    let sizes = [1, 2, 3, 4].map(|n| if n <= last { lost(n).norm_squared() } else { f64::INFINITY });
    let least = (1..=last).min_by(|a, b| sizes[a - 1].total_cmp(&sizes[b - 1])).expect("a knot between");
    let (lost, before) = (lost(least), energy(row));
    row.copy_within(least + 1.., least);
    let row = &mut row[..=last];
    if sizes[least - 1] <= 0.0 {
        return;
    }
    // A neighbour makes up for it where no energy is gained by that, and as little is lost as can be.
    let (mut best, mut is_made_up) = ((energy(row) - before, 0, row[0].deflection), false);
    for n in [least - 1, least] {
        if n == last {
            continue;
        }
        let alone = row[n].deflection;
        let weight =
            weights(&row[n], &row[n + 1])[0] + if n > 0 { weights(&row[n - 1], &row[n])[1] } else { 0.0 };
        row[n].deflection = alone + lost / weight;
        let gained = energy(row) - before;
        if gained <= 0.0 && (!is_made_up || gained > best.0) {
            (best, is_made_up) = ((gained, n, row[n].deflection), true);
        }
        row[n].deflection = alone;
    }
    let (gained, n, deflection) = best;
    row[n].deflection = deflection;
    if gained > 0.0 {
        let part = (before / (before + gained)).sqrt();
        for knot in row {
            knot.deflection *= part;
        }
    }
}

/// `int u dz` over a piece between two knots as a sum of their deflections.
fn weights(a: &Knot, b: &Knot) -> [f64; 2] {
    let (width, both) = (b.place - a.place, a.place + b.place);
    if width > 0.0 { [b.place, a.place].map(|far| width * (both + far) / (3.0 * both)) } else { [0.0; 2] }
}

/// `int u dz`.
fn sum(row: &[Knot]) -> Vec3 {
    let pieces = row.windows(2).map(|ends| {
        let [a, b] = weights(&ends[0], &ends[1]);
        ends[0].deflection * a + ends[1].deflection * b
    });
    pieces.fold(Vec3::zeros(), |sum, piece| sum + piece)
}

/// `int u^2 dz`.
fn energy(row: &[Knot]) -> f64 {
    let pieces = row.windows(2).map(|ends| {
        let (x, y) = (ends[0].place, ends[1].place);
        let (width, both) = (y - x, x + y);
        if width <= 0.0 {
            return 0.0;
        }
        // With u = p + t q: the moments of t, (z^2 - x^2) / (y^2 - x^2).
        let (p, q) = (ends[0].deflection, ends[1].deflection - ends[0].deflection);
        let first = (y + 2.0 * x) / (3.0 * both);
        let second = (3.0 * width * width + 15.0 * x * width + 20.0 * x * x) / (15.0 * both * both);
        width * (p.norm_squared() + 2.0 * first * p.dot(&q) + second * q.norm_squared())
    });
    pieces.sum()
}
