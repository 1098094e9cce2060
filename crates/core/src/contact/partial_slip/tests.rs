//! Claims about a disc that slips at its edge: Cattaneo, Mindlin and Deresiewicz, energy, and a contact that is shaken.

use super::*;
use crate::contact::tests::random;
use rand::Rng;

/// Mean deflection (m) at which a contact of this depth (m) slides, with a slope of 1.
fn sliding(depth: f64) -> f64 {
    2.0 / 3.0 * depth
}

fn new() -> SpringRow {
    SpringRow::zeroed()
}

/// A row of a thousand springs, of depths up to 1 m.
struct Fine(Vec<Vec3>);

impl Fine {
    const SPRINGS: usize = 1000;

    fn slide(&mut self, depth: f64, way: Vec3) -> Vec3 {
        let mut sum = Vec3::zeros();
        for (n, deflection) in self.0.iter_mut().enumerate() {
            let place = (n as f64 + 0.5) / Self::SPRINGS as f64;
            let most = (depth - place * place).max(0.0);
            *deflection = capped(*deflection + way, most);
            sum += *deflection;
        }
        sum / (Self::SPRINGS as f64 * depth.sqrt())
    }
}

/// Mean deflection, a part of that at which the contact slides, of one that has been moved by a part of the way to there, by Cattaneo and Mindlin.
fn virgin(part: f64) -> f64 {
    1.0 - (1.0 - part) * (1.0 - part).sqrt()
}

#[test]
fn under_a_constant_normal_force_the_disc_slips_as_cattaneo_and_mindlin_and_turns_round_as_mindlin_and_deresiewicz_have_it()
 {
    let (depth, mut row) = (1.0, new());
    row.slide(depth, 1.0, Vec3::zeros());
    let mut at = 0.0;
    let mut moved = |way: f64, steps: u32| {
        let mut mean = 0.0;
        for _ in 0..steps {
            mean = row.slide(depth, 1.0, Vec3::y() * (way / f64::from(steps))).y;
        }
        at += way;
        (at, mean / sliding(depth))
    };
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 2e-3, "{found} {expected}");
    for steps in [1, 10, 100] {
        let (at, there) = moved(0.1, steps);
        near(there, virgin(at));
    }
    // Back along a curve of twice the size, up again, for which three points are one too few, and past the first turn, which is then forgotten.
    let (turn, top) = (0.3, virgin(0.3));
    let (at, down) = moved(-0.2, 50);
    near(down, top - 2.0 * virgin(0.5 * (turn - at)));
    let (at, up) = moved(0.1, 50);
    near(up, down + 2.0 * virgin(0.5 * (at - 0.1)));
    let (at, mean) = moved(0.4, 50);
    near(mean, virgin(at));
    near(moved(0.5, 10).1, 1.0);
}

#[test]
fn a_contact_that_sticks_while_it_grows_has_the_stiffness_of_its_whole_disc() {
    let steady = |_: u32| 0.002;
    let slower = |n: u32| 2e-5 * f64::from(200 - n);
    for way in [&steady as &dyn Fn(u32) -> f64, &slower] {
        let (mut row, mut expected) = (new(), 0.0);
        for n in 1..=200 {
            let mean = row.slide(f64::from(n) * 0.005, 1.0, Vec3::z() * way(n)).z;
            // What was in contact before is moved, and what comes into contact meanwhile by the rest of the way.
            let [x, y] = [n - 1, n].map(|n| (f64::from(n) * 0.005).sqrt());
            expected += way(n) * (x + (y - x) * (2.0 * y + x) / (3.0 * (x + y)));
            assert!((mean * y / expected - 1.0).abs() < 1e-4, "{n}: {mean}");
        }
    }
}

#[test]
fn three_points_follow_a_thousand_springs_along_random_ways() {
    let mut random = random(3);
    let (mut sum, mut most) = (0.0, 0.0_f64);
    for path in 0..60 {
        let (mut row, mut fine) = (new(), Fine(vec![Vec3::zeros(); Fine::SPRINGS]));
        let (mut depth, mut worst) = (0.3_f64, 0.0_f64);
        let (mut speed, mut growth) = (Vec3::zeros(), 0.0);
        for step in 0..400 {
            if step % 40 == 0 {
                let mut part = || random.random_range(-1.0..1.0);
                speed = Vec3::new(0.0, part(), if path % 2 == 0 { 0.0 } else { part() }) * 0.01;
                growth = 0.01 * part();
            }
            depth = (depth + growth).clamp(0.05, 0.99);
            let off = row.slide(depth, 1.0, speed) - fine.slide(depth, speed);
            worst = worst.max(off.norm() / sliding(depth));
        }
        sum += worst / 60.0;
        most = most.max(worst);
    }
    println!("worst of a path, of the sliding force: {sum:.3} in the mean, {most:.3} at most");
    assert!(sum < 0.05 && most < 0.2);
}

#[test]
fn no_cycle_of_loads_and_small_slips_gains_energy() {
    let mut random = random(5);
    let mut least = f64::INFINITY;
    for cycle in 0..2000 {
        let (mut row, mut depth, mut work, mut most) = (new(), 0.5_f64, 0.0, 0.0_f64);
        let (mut at, size) = (Vec3::zeros(), [1e-4, 1e-3, 1e-2, 0.1][cycle % 4]);
        row.slide(depth, 1.0, at);
        for step in 0..200 {
            depth = (depth + 0.05 * random.random_range(-1.0..1.0)).clamp(0.05, 1.0);
            let way = Vec3::from_fn(|n, _| if n == 0 { 0.0 } else { size * random.random_range(-1.0..1.0) });
            let way = if step == 199 { -at } else { way };
            let before = row.slide(depth, 1.0, Vec3::zeros());
            let mean = (before + row.slide(depth, 1.0, way)) * 0.5;
            at += way;
            work += mean.dot(&way) * depth.sqrt();
            most = most.max(work);
        }
        least = least.min(work / most);
    }
    println!("least work of a cycle, of the largest on the way: {least:.2e}");
    assert!(least > 0.0);
}

#[test]
fn a_loaded_contact_that_is_shaken_along_its_normal_moves_a_little_and_then_no_more() {
    let mut row = new();
    let (load, dt) = (0.5 * sliding(1.0), 0.02);
    let (mut at, mut speed, mut after) = (0.0, 0.0, [0.0; 2]);
    for step in 0..200_000 {
        let grown = (f64::from(step + 1) / 2000.0).min(1.0);
        let depth = grown - 0.05 * (1.0 - libm::cos(1e-3 * f64::from(step.max(2000) - 2000)));
        let pull = load * (f64::from(step) / 2000.0 - 1.0).clamp(0.0, 1.0);
        let mean = row.slide(depth, 1.0, Vec3::y() * (speed * dt)).y;
        speed += dt * (pull - mean * depth.sqrt() - speed);
        at += dt * speed;
        if step % 100_000 == 99_999 {
            after[step as usize / 100_000] = at;
        }
    }
    println!("at {after:?}");
    assert!((after[1] / after[0] - 1.0).abs() < 1e-6);
}
