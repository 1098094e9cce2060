//! Claims about the integrator.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOP: Inertia = Inertia { mass: 2.0, moments: Vec3::new(1.0, 2.0, 2.5) };

const NOTHING: Load = Load { force: Vec3::new(0.0, 0.0, 0.0), torque: Vec3::new(0.0, 0.0, 0.0) };

fn forced(force: Vec3) -> Load {
    Load { force, ..NOTHING }
}

fn twisted(torque: Vec3) -> Load {
    Load { torque, ..NOTHING }
}

fn spinning() -> Particle {
    let mut particle = Particle::at(1, 0, Vec3::zeros());
    particle.set_orientation(&turned(&Quat::identity(), Vec3::new(0.3, -0.2, 0.9), 1.0));
    particle.angular_momentum = [0.2, 2.0, 0.1];
    particle
}

fn spin_energy(particle: &Particle) -> f64 {
    let momentum = Vec3::from(particle.angular_momentum);
    0.5 * momentum.dot(&TOP.angular_velocity(&particle.orientation(), momentum))
}

/// Largest deviation of the energy of a free top over a time of 20, and the final orientation.
fn free_top(dt: f64) -> (f64, Quat) {
    let mut particle = spinning();
    let energy = spin_energy(&particle);
    let mut worst = 0.0_f64;
    for _ in 0..(20.0 / dt).round() as usize {
        step(&mut particle, &TOP, &NOTHING, &NOTHING, dt);
        worst = worst.max((spin_energy(&particle) / energy - 1.0).abs());
    }
    (worst, particle.orientation())
}

#[test]
fn a_free_asymmetric_top_keeps_its_angular_momentum() {
    let mut particle = spinning();
    let momentum = particle.angular_momentum;
    for _ in 0..1000 {
        step(&mut particle, &TOP, &NOTHING, &NOTHING, 0.01);
    }
    assert_eq!(particle.angular_momentum.map(f64::to_bits), momentum.map(f64::to_bits));
    let turned = Vec3::from(particle.angular_velocity) - spinning().angular_velocity();
    assert!(turned.norm() > 0.1, "it does tumble");
}

#[test]
fn a_free_asymmetric_top_keeps_its_energy_and_course_to_second_order() {
    let (_, exact) = free_top(0.000_625);
    let [(coarse, at_coarse), (fine, at_fine)] = [0.02, 0.01].map(free_top);
    assert!(coarse < 1e-3);
    assert!(coarse / fine > 3.8, "energy {coarse} {fine}");
    let ratio = at_coarse.angle_to(&exact) / at_fine.angle_to(&exact);
    assert!((3.7..4.5).contains(&ratio), "course {ratio}");
}

/// Time in which the angular velocity of a free top runs once through its course in the body frame, by Euler's solution
/// (Landau and Lifshitz, Mechanics, section 37), for moments `i[0] < i[1] < i[2]`.
fn period_of_a_free_top(moments: Vec3, angular_velocity: Vec3) -> f64 {
    let momentum = moments.component_mul(&angular_velocity);
    let (l2, e2) = (momentum.norm_squared(), momentum.dot(&angular_velocity));
    let [mut i1, i2, mut i3] = moments.into();
    if l2 < e2 * i2 {
        std::mem::swap(&mut i1, &mut i3);
    }
    let speed = ((i3 - i2) * (l2 - e2 * i1) / (i1 * i2 * i3)).sqrt();
    let modulus = (i2 - i1) * (e2 * i3 - l2) / ((i3 - i2) * (l2 - e2 * i1));
    // Complete elliptic integral by the arithmetic-geometric mean.
    let (mut a, mut g) = (1.0, (1.0 - modulus).sqrt());
    for _ in 0..30 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    4.0 * std::f64::consts::PI / (2.0 * a) / speed
}

/// A free body with these moments that spins with this angular velocity, seen in its own frame.
fn thrown(moments: Vec3, angular_velocity: Vec3) -> (Inertia, Particle) {
    let inertia = Inertia { mass: 1.0, moments };
    let mut particle = Particle::at(1, 0, Vec3::zeros());
    particle.set_orientation(&turned(&Quat::identity(), Vec3::new(0.3, -0.2, 0.9), 1.0));
    let spin = particle.orientation().transform_vector(&angular_velocity);
    particle.angular_velocity = spin.into();
    particle.angular_momentum = inertia.angular_momentum(&particle.orientation(), spin).into();
    (inertia, particle)
}

#[test]
fn over_100_tumbles_a_free_top_keeps_its_angular_momentum_to_1e10_and_its_energy_to_1e6() {
    // The worst of many orders of the moments, which decide on the order of the turns, at 1000 steps per turn.
    for (moments, spin) in [
        (Vec3::new(1.0, 2.0, 2.5), Vec3::new(0.3, 1.0, 0.2)),
        (Vec3::new(2.5, 1.0, 2.0), Vec3::new(0.2, 0.3, 1.0)),
        (Vec3::new(2.0, 2.5, 1.0), Vec3::new(1.0, 0.2, 0.3)),
        (Vec3::new(1.0, 2.0, 2.9), Vec3::new(0.7, 0.5, 0.9)),
        (Vec3::new(1.0, 10.0, 10.5), Vec3::new(3.0, 1.0, -0.8)),
    ] {
        let (inertia, mut particle) = thrown(moments, spin);
        let before = Vec3::from(particle.angular_momentum);
        let energy = before.dot(&particle.angular_velocity());
        let dt = 2.0 * std::f64::consts::PI / spin.norm() / 1000.0;
        let (mut off_energy, mut off_momentum) = (0.0_f64, 0.0_f64);
        for _ in 0..100 * 1000 {
            step(&mut particle, &inertia, &NOTHING, &NOTHING, dt);
            let velocity = particle.angular_velocity();
            let momentum = inertia.angular_momentum(&particle.orientation(), velocity);
            off_momentum = off_momentum.max((momentum - before).norm() / before.norm());
            off_energy = off_energy.max((momentum.dot(&velocity) / energy - 1.0).abs());
        }
        println!("{moments:?}: momentum off by {off_momentum:.1e}, energy by {off_energy:.1e}");
        assert!(off_momentum < 1e-10, "momentum {off_momentum:e}");
        assert!(off_energy < 1e-6, "energy {off_energy:e}");
    }
}

#[test]
fn a_spin_about_the_middle_axis_tips_over_in_the_time_of_eulers_solution_and_back_again() {
    let (moments, spin) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1e-4, 1.0, 1e-4));
    let (inertia, mut particle) = thrown(moments, spin);
    let period = period_of_a_free_top(moments, spin);
    let steps = 4000;
    let dt = period / f64::from(steps);
    let mut flips = Vec::new();
    let mut last = 1.0;
    for n in 1..=20 * steps {
        step(&mut particle, &inertia, &NOTHING, &NOTHING, dt);
        let along = particle.orientation().inverse_transform_vector(&particle.angular_velocity()).y;
        if along * last < 0.0 {
            flips.push(f64::from(n) - along / (along - last));
        }
        last = along;
    }
    println!("period {period}, {} flips", flips.len());
    assert!((39..=40).contains(&flips.len()), "two in each period: {}", flips.len());
    for pair in flips.windows(2) {
        assert!(((pair[1] - pair[0]) * 2.0 / f64::from(steps) - 1.0).abs() < 1e-3, "{pair:?}");
    }
}

#[test]
fn a_spin_about_the_largest_or_smallest_axis_stays() {
    for spin in [Vec3::new(1.0, 1e-3, 1e-3), Vec3::new(1e-3, 1e-3, 1.0)] {
        let (inertia, mut particle) = thrown(Vec3::new(1.0, 2.0, 3.0), spin);
        for _ in 0..40_000 {
            step(&mut particle, &inertia, &NOTHING, &NOTHING, 0.02);
            let now = particle.orientation().inverse_transform_vector(&particle.angular_velocity());
            assert!((now - spin).norm() < 5e-3, "{now:?}");
        }
    }
}

#[test]
fn a_symmetric_top_precesses_by_the_exact_angle() {
    // About its momentum by L / I, and about its own axis by the rest.
    let (moments, spin) = (Vec3::new(2.0, 2.0, 3.0), Vec3::new(0.8, 0.0, 1.1));
    let (inertia, mut particle) = thrown(moments, spin);
    let start = particle.orientation();
    let momentum = Vec3::from(particle.angular_momentum);
    let (steps, time) = (200, 3.0);
    for _ in 0..steps {
        let dt = time / f64::from(steps);
        step(&mut particle, &inertia, &NOTHING, &NOTHING, dt);
    }
    let own = Vec3::z() * (spin.z * (1.0 - 3.0 / 2.0));
    let exact = Quat::new(momentum / 2.0 * time) * start * Quat::new(own * time);
    assert!(particle.orientation().angle_to(&exact) < 1e-7);
}

#[test]
fn a_torque_turns_a_body_at_rest_by_half_t_squared() {
    let mut particle = Particle::at(1, 0, Vec3::zeros());
    let torque = Vec3::new(0.0, 0.0, 0.5);
    for _ in 0..1000 {
        step(&mut particle, &TOP, &twisted(torque), &NOTHING, 1e-3);
    }
    assert!((particle.orientation().angle() - 0.5 * 0.5 / 2.5).abs() < 1e-10);
    assert!((particle.angular_velocity[2] - 0.2).abs() < 1e-12);
}

#[test]
fn a_constant_force_gives_a_parabola_be_it_a_load_or_a_contact() {
    let force = Vec3::new(0.3, 0.0, -2.0);
    for (load, contact) in [(forced(force), NOTHING), (NOTHING, forced(force))] {
        let mut particle = Particle::at(1, 0, Vec3::new(1.0, 2.0, 3.0));
        particle.velocity = [0.5, -1.0, 0.0];
        start(&mut particle, &contact);
        let dt = 0.125;
        for n in 1..=64 {
            step(&mut particle, &TOP, &load, &contact, dt);
            let t = f64::from(n) * dt;
            let exact =
                Vec3::new(1.0, 2.0, 3.0) + Vec3::new(0.5, -1.0, 0.0) * t + force / 2.0 * (0.5 * t * t);
            assert!((particle.position() - exact).norm() < 1e-12 * (1.0 + exact.norm()));
            assert!((particle.velocity() - (Vec3::new(0.5, -1.0, 0.0) + force / 2.0 * t)).norm() < 1e-12);
        }
    }
}

#[test]
fn loads_that_jump_from_step_to_step_give_a_chain_of_parabolas_and_their_sum_as_momentum() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut particle = Particle::at(1, 0, Vec3::new(1.0, 2.0, 3.0));
    let ball = Inertia { mass: 2.0, moments: Vec3::repeat(0.4) };
    let dt = 0.01;
    let (mut x, mut v, mut spin) = (particle.position(), Vec3::zeros(), Vec3::zeros());
    let (mut off, mut fastest, mut furthest) = ([0.0_f64; 3], 0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        let mut jump = || Vec3::from_fn(|_, _| random.random_range(-5.0..5.0));
        let load = Load { force: jump(), torque: jump() };
        step(&mut particle, &ball, &load, &NOTHING, dt);
        x += v * dt + load.force * (0.5 * dt * dt / ball.mass);
        v += load.force * (dt / ball.mass);
        spin += load.torque * (dt / 0.4);
        (fastest, furthest) = (fastest.max(v.norm()), furthest.max(x.norm()));
        off[0] = off[0].max((particle.position() - x).norm());
        off[1] = off[1].max((particle.velocity() - v).norm());
        off[2] = off[2].max((particle.angular_velocity() - spin).norm() / spin.norm());
    }
    println!(
        "position off by {:.1e}, velocity by {:.1e}, spin by {:.1e}",
        off[0] / furthest,
        off[1] / fastest,
        off[2]
    );
    assert!(off[0] < 1e-13 * furthest && off[1] < 1e-13 * fastest && off[2] < 1e-12);
}

#[test]
fn a_load_beside_a_contact_that_changes_adds_just_its_own_parabola() {
    // The same contact forces with and without jumping loads: the difference is exact free motion under the loads.
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut pair = [Particle::at(1, 0, Vec3::zeros()); 2];
    let (dt, mut x, mut v) = (0.01, Vec3::zeros(), Vec3::zeros());
    for _ in 0..1000 {
        let mut jump = || Vec3::from_fn(|_, _| random.random_range(-5.0..5.0));
        let (contact, load) = (forced(jump()), forced(jump()));
        step(&mut pair[0], &TOP, &NOTHING, &contact, dt);
        step(&mut pair[1], &TOP, &load, &contact, dt);
        x += v * dt + load.force * (0.5 * dt * dt / TOP.mass);
        v += load.force * (dt / TOP.mass);
        assert!((pair[1].velocity() - pair[0].velocity() - v).norm() < 1e-12);
        assert!((pair[1].position() - pair[0].position() - x).norm() < 1e-12);
    }
}

#[test]
fn under_a_constant_load_a_step_is_to_the_bit_the_leapfrog_of_the_whole_force() {
    // A ball on a spring, which also twists it; without a load, and with a constant one.
    let load = Load { force: Vec3::new(0.3, 0.0, -2.0), torque: Vec3::new(0.01, -0.03, 0.02) };
    let (ball, dt) = (Inertia { mass: 2.0, moments: Vec3::repeat(0.4) }, 0.01);
    for load in [NOTHING, load] {
        let mut particle = Particle::at(1, 0, Vec3::new(1.0, 0.2, -0.5));
        let mut plain = particle;
        let mut last: Option<[Vec3; 2]> = None;
        for _ in 0..1000 {
            let spring = |at: Vec3| Load { force: at * -3.0, torque: at.cross(&Vec3::x()) * 0.1 };
            let contact = spring(particle.position());
            if last.is_none() {
                start(&mut particle, &contact);
            }
            step(&mut particle, &ball, &load, &contact, dt);

            let contact = spring(plain.position());
            let whole = [load.force + contact.force, load.torque + contact.torque];
            let [force, torque] = last.unwrap_or(whole);
            let between = plain.velocity() - force * (0.5 * dt / ball.mass) + whole[0] * (dt / ball.mass);
            plain.position = (plain.position() + between * dt).into();
            plain.velocity = (between + whole[0] * (0.5 * dt / ball.mass)).into();
            let between = Vec3::from(plain.angular_momentum) - torque * (0.5 * dt) + whole[1] * dt;
            plain.angular_momentum = (between + whole[1] * (0.5 * dt)).into();
            last = Some(whole);

            let bits =
                |p: &Particle| [p.position, p.velocity, p.angular_momentum].map(|v| v.map(f64::to_bits));
            assert_eq!(bits(&particle), bits(&plain));
        }
    }
}

#[test]
fn an_oscillator_is_followed_to_second_order_with_a_bounded_energy() {
    // x'' = -x from x = 1 at rest, up to t = 20.
    let run = |dt: f64| {
        let mut particle = Particle::at(1, 0, Vec3::x());
        let mut energy = 0.0_f64;
        for n in 0..(20.0 / dt).round() as usize {
            let spring = forced(-TOP.mass * particle.position());
            if n == 0 {
                start(&mut particle, &spring);
            }
            step(&mut particle, &TOP, &NOTHING, &spring, dt);
            energy = energy.max(particle.position().norm_squared() + particle.velocity().norm_squared());
        }
        ((particle.position[0] - 20.0_f64.cos()).abs(), energy)
    };
    let ((coarse, energy), (fine, _)) = (run(0.02), run(0.01));
    assert!((3.9..4.1).contains(&(coarse / fine)), "{}", coarse / fine);
    assert!(energy < 1.0 + 1e-3);
}

#[test]
fn the_quaternion_stays_unit() {
    let mut particle = spinning();
    for n in 0..100_000 {
        let torque = Vec3::new(f64::from(n % 7) - 3.0, f64::from(n % 5) - 2.0, 1.0);
        step(&mut particle, &TOP, &twisted(torque), &NOTHING, 1e-3);
    }
    assert!((particle.orientation().quaternion().norm() - 1.0).abs() < 1e-15);
}

#[test]
fn a_constant_spin_turns_by_the_right_angle_to_fourth_order() {
    let error = |n: u32| {
        let mut orientation = Quat::identity();
        for _ in 0..n {
            orientation = turned(&orientation, Vec3::new(0.0, 1.0, 0.0), 2.0 / f64::from(n));
        }
        (orientation.angle() - 2.0).abs()
    };
    assert!(error(20) / error(40) > 15.0 && error(40) < 1e-6);
}
