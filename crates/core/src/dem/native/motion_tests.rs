//! Claims about bodies whose motion is prescribed.

use super::tests::{RADIUS, dry, engine, restitution};
use super::*;
use crate::comm::on_threads;
use crate::contact::{DampingLaw, ElasticLaw};
use crate::math::{Quat, TimeFunction};

const DT: f64 = 1e-6;

/// The first template is prescribed, the second free.
fn params(motion: PrescribedMotion) -> NativeParams {
    NativeParams { motions: vec![motion], ..dry(restitution(0.5)) }
}

fn oscillation() -> PrescribedMotion {
    PrescribedMotion {
        velocity: TimeFunction::Oscillation {
            mean: Vec3::new(0.3, 0.0, 0.0),
            amplitude: Vec3::new(0.5, -0.8, 0.3),
            frequency: 900.0,
            phase: 0.4,
        },
        angular_velocity: TimeFunction::Constant(Vec3::new(20.0, 0.0, 90.0)),
        ..PrescribedMotion::fixed()
    }
}

fn moving(id: u64, template: usize, position: Vec3, velocity: Vec3) -> Particle {
    let mut particle = Particle::at(id, template, position);
    particle.velocity = velocity.into();
    particle
}

/// One particle of each id under a constant load.
fn pull(engine: &mut Native, comm: &Comm, steps: u64) {
    let load = Load { force: Vec3::new(1e-4, 2e-4, -1e-4), torque: Vec3::repeat(1e-7) };
    for _ in 0..steps {
        let loads = vec![load; engine.particles().owned];
        engine.advance(comm, &loads, DT).unwrap();
    }
}

fn force(engine: &Native, id: usize) -> Vec3 {
    engine.particles().particles[id].contact_force.into()
}

#[test]
fn a_body_bounces_off_a_fixed_one_as_off_an_infinite_mass_and_does_not_move_it_by_a_bit() {
    for damping in [DampingLaw::HuntCrossley, DampingLaw::Tsuji] {
        let mut params = params(PrescribedMotion::fixed());
        if let Some(contact) = &mut params.contact {
            (contact.damping, contact.law) = (damping, ElasticLaw::Hertz);
        }
        let at = Vec3::new(3e-3, 5e-3, 4e-3);
        let gap = Vec3::new(RADIUS + 0.7e-3 + 1e-8, 0.0, 0.0);
        // Ids in both orders.
        for fixed in [0, 1] {
            let mut all = [moving(0, 0, at, Vec3::zeros()), moving(1, 1, at + gap, -0.1 * Vec3::x())];
            all[0].orientation = [0.48, 0.6, 0.0, 0.64];
            if fixed == 1 {
                all.reverse();
                (all[0].id, all[1].id) = (0, 1);
            }
            let mut engine = engine(params.clone(), 1, 0, &all);
            let mut most = 0.0_f64;
            for _ in 0..400 {
                engine.advance(&Comm::Solo, &[Load::default(); 2], DT).unwrap();
                assert!(
                    (force(&engine, 0) + force(&engine, 1)).norm() < 1e-18,
                    "the load is that of the contact"
                );
                most = most.max(force(&engine, fixed).norm());
            }
            let after = engine.particles().particles[1 - fixed].velocity[0];
            assert!((after - 0.05).abs() < 2e-3, "{damping:?}: {after}");
            let body = engine.particles().particles[fixed];
            assert_eq!((body.position, body.orientation), (all[fixed].position, all[fixed].orientation));
            assert!(most > 0.0);
        }
    }
}

#[test]
fn two_fixed_bodies_that_overlap_exert_no_force_and_are_no_contact() {
    let at = Vec3::repeat(6e-3);
    let all = [Particle::at(0, 0, at), Particle::at(1, 0, at + Vec3::new(1.2e-3, 0.0, 0.0))];
    let mut engine = engine(params(PrescribedMotion::fixed()), 1, 0, &all);
    pull(&mut engine, &Comm::Solo, 5);
    assert_eq!((engine.contacts().begun, engine.contact_states(&Comm::Solo).len()), (0, 0));
    assert_eq!(force(&engine, 0), Vec3::zeros());
}

#[test]
fn a_path_is_the_integral_of_its_velocity_in_any_number_of_sub_steps_whatever_acts() {
    let start = Vec3::new(5e-3, 6e-3, 7e-3);
    for substeps in [1, 3] {
        let mut engine =
            engine(NativeParams { substeps, ..params(oscillation()) }, 1, 0, &[Particle::at(0, 0, start)]);
        assert_eq!(
            engine.particles().particles[0].velocity(),
            oscillation().velocity.at(0.0),
            "from the start on"
        );
        pull(&mut engine, &Comm::Solo, 2000);
        let (time, particle) = (2000.0 * DT, engine.particles().particles[0]);
        let expected = start + oscillation().velocity.integral(0.0, time);
        assert!((particle.position() - expected).norm() < 1e-16, "{substeps} sub-steps");
        assert!((particle.velocity() - oscillation().velocity.at(time)).norm() < 1e-12);
        let turned = Quat::from_scaled_axis(Vec3::new(20.0, 0.0, 90.0) * time);
        assert!(particle.orientation().angle_to(&turned) < 1e-9);
        let inertia = engine.particles().templates[0].inertia();
        let momentum = Vec3::from(particle.angular_momentum);
        assert!((momentum - inertia.component_mul(&particle.angular_velocity())).norm() < 1e-20);
    }
}

#[test]
fn forces_move_a_body_in_its_free_directions_alone() {
    let free_z = PrescribedMotion { free: [false, false, true], ..PrescribedMotion::fixed() };
    let turning = PrescribedMotion { free_rotation: true, ..PrescribedMotion::fixed() };
    let start = Particle::at(0, 0, Vec3::repeat(5e-3));
    let after = |motion: PrescribedMotion| {
        let mut engine = engine(params(motion), 1, 0, &[start]);
        pull(&mut engine, &Comm::Solo, 100);
        engine.particles().particles[0]
    };
    let (free, along, turned) = (after(PrescribedMotion::default()), after(free_z), after(turning));
    assert_eq!((along.velocity[2], along.position[2]), (free.velocity[2], free.position[2]));
    assert_eq!((along.velocity[0], along.position[0]), (0.0, start.position[0]));
    assert_eq!(along.orientation(), start.orientation());
    assert_eq!(turned.position(), start.position());
    assert_eq!((turned.orientation, turned.angular_velocity), (free.orientation, free.angular_velocity));
}

#[test]
fn prescribed_bodies_among_free_ones_have_the_same_bits_on_1_to_4_ranks_also_resumed_within_a_period() {
    let all: Vec<Particle> = (0..24_u64)
        .map(|id| {
            let cell = Vec3::new((id % 4) as f64, (id / 4 % 3) as f64, (id / 12) as f64);
            let jitter = Vec3::new((id * 7 % 5) as f64, (id * 3 % 7) as f64, (id * 5 % 4) as f64) * 1e-4;
            let velocity = Vec3::new(2.0 - 2.0 * (id % 3) as f64, (id % 2) as f64 - 0.5, 0.4);
            moving(id, (id % 2) as usize, cell.component_mul(&Vec3::new(3e-3, 3e-3, 4e-3)) + jitter, velocity)
        })
        .collect();
    let state = |engine: &Native, comm: &Comm| {
        let own = bytemuck::cast_slice(engine.particles().owned()).to_vec();
        let mut all: Vec<Particle> = bytemuck::pod_collect_to_vec(&comm.all_gather(own).concat());
        all.sort_unstable_by_key(|particle| particle.id);
        let mut begun = [engine.contacts().begun as i64];
        comm.sum(&mut begun);
        (all, begun[0])
    };
    let run = |ranks: usize, half: Option<&[Vec<u8>]>| {
        let mut ends = on_threads(ranks, |comm| {
            let mut engine = engine(params(oscillation()), ranks, comm.rank(), &all);
            match half {
                Some(parts) => engine.restore(&comm, &SavedParts::divided(&comm, parts)).unwrap(),
                None => pull(&mut engine, &comm, 1300),
            }
            let parts = comm.all_gather(engine.save(&comm).unwrap());
            pull(&mut engine, &comm, 1300);
            (parts, state(&engine, &comm))
        });
        ends.swap_remove(0)
    };
    let (parts, expected) = run(1, None);
    assert!(expected.1 > 5, "{} contacts", expected.1);
    for ranks in 2..=4 {
        let (parts, whole) = run(ranks, None);
        assert_eq!(whole, expected, "{ranks} ranks");
        assert_eq!(run(5 - ranks, Some(&parts)).1, expected, "resumed");
    }
    assert_eq!(run(3, Some(&parts)).1, expected);
}
