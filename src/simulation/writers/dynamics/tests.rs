use super::*;
use crate::domain::Domain;

fn particles(at: &[([f64; 3], [f64; 3])]) -> Vec<Particle> {
    let particle = |(id, (position, velocity)): (usize, &([f64; 3], [f64; 3]))| Particle {
        velocity: *velocity,
        ..Particle::at(id as u64, 0, Vec3::from(*position))
    };
    at.iter().enumerate().map(particle).collect()
}

#[test]
fn displacements_go_on_across_periodic_faces_and_count_from_their_mean() {
    let domain = Domain { cells: [10, 10, 10], dx: 1.0, faces: Domain::faces([true, true, false]) };
    // Along x by 3 and 5 per sample, that is by more than the box in all; along z one particle stays below.
    let at = |n: f64| {
        let wrapped = |x: f64| x.rem_euclid(10.0);
        particles(&[
            ([wrapped(9.0 + 3.0 * n), 1.0, 2.0], [3.0, 0.0, 0.0]),
            ([wrapped(9.5 + 5.0 * n), wrapped(1.0 - 4.0 * n), 2.0 + 1.5 * n], [5.0, -4.0, 1.5]),
        ])
    };
    let mut block = Block::new(0, 0, &at(0.0));
    for n in 1..=5 {
        block.follow(&domain, &at(f64::from(n)), 1.0);
    }
    let ways: Vec<[f64; 3]> = block.tracers.iter().map(|tracer| tracer.way).collect();
    for (way, expected) in ways.iter().zip([[15.0, 0.0, 0.0], [25.0, -20.0, 7.5]]) {
        assert!(way.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{ways:?}");
    }
    // Of two values the variance is half the square of their difference.
    let [squares, memory] = block.moments();
    assert!((squares[0] - 50.0).abs() < 1e-9 && (squares[2] - 0.5 * 7.5 * 7.5).abs() < 1e-9);
    assert!((memory[0] - 2.0).abs() < 1e-12 && (memory[1] - 8.0).abs() < 1e-12);
    // One that is gone is followed no more.
    block.follow(&domain, &at(6.0)[1..], 1.0);
    assert_eq!(block.tracers.iter().map(|tracer| tracer.id).collect::<Vec<_>>(), [1]);
    assert!(block.moments()[0][0].is_nan());
}
