//! Random velocities at the start: a granular temperature.
//!
//! ```text
//! v_i = w_i - sum m w / sum m,   components of w_i normal;   then scaled to sum v^2 = 3 N T
//! ```
//!
//! So the particles of a section have the Maxwell distribution of temperature `T` (m^2/s^2), up to the removal of the mean, no momentum
//! together, and that temperature exactly. The numbers depend on the seed and the ids alone, so that they are the same on any ranks.
//! Reference: Box and Muller (1958), doi:10.1214/aoms/1177706645.

use super::checks::Document;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, PrescribedMotion, Template};
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Stream of the random numbers, apart from those of positions.
const STREAM: u64 = 0x7665_6c6f_6369_7479;

/// Adds random velocities to the particles of the sections that have a temperature; where particles are only counted there is nothing to do.
pub(super) fn agitate(
    document: &Document,
    sections: &[usize],
    (templates, motions): (&[Template], &[PrescribedMotion]),
    particles: &mut [Particle],
) -> Result<()> {
    for (index, section) in document.case.particles.iter().enumerate() {
        let Some(temperature) = section.granular_temperature else { continue };
        let key = format!("particles.{index}.granular_temperature");
        if !motions[index].is_free() {
            let motion = format!("particles.{index}.motion");
            let marks = [(&*key, "random velocities"), (&*motion, "prescribes them")];
            let title = format!("`{key}` gives velocities to bodies whose motion is prescribed");
            return Err(document.error_at(&marks, &title, "remove one of them"));
        }
        let mut own: Vec<&mut Particle> =
            particles.iter_mut().filter(|p| sections[p.template as usize] == index).collect();
        if own.len() == 1 {
            let title = format!("`{key}` needs two particles or more: one alone has no momentum");
            let remedy = "give it a `velocity` in `list`, or take more particles";
            return Err(document.error(&key, &title, "of one particle", remedy));
        }
        let mut random = ChaCha8Rng::seed_from_u64(section.seed.unwrap_or(1));
        random.set_stream(STREAM);
        let mut velocities: Vec<Vec3> = own.iter().map(|_| normal(&mut random)).collect();
        let masses = || own.iter().map(|p| templates[p.template as usize].mass());
        let momentum: Vec3 = masses().zip(&velocities).map(|(mass, velocity)| velocity * mass).sum();
        let mean = momentum / masses().sum::<f64>();
        let squares: f64 = velocities
            .iter_mut()
            .map(|velocity| {
                *velocity -= mean;
                velocity.norm_squared()
            })
            .sum();
        let scale = (3.0 * velocities.len() as f64 * temperature / squares).sqrt();
        for (particle, velocity) in own.iter_mut().zip(&velocities) {
            particle.velocity = (particle.velocity() + velocity * scale).into();
        }
    }
    Ok(())
}

/// Three normal numbers.
fn normal(random: &mut ChaCha8Rng) -> Vec3 {
    let mut pair = || {
        // In the middle of 2^53 intervals, so that neither is 0.
        let [a, b] = [(); 2].map(|()| ((random.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64);
        let (sine, cosine) = libm::sincos(TAU * b);
        let length = (-2.0 * libm::log(a)).sqrt();
        [length * cosine, length * sine]
    };
    let ([x, y], [z, _]) = (pair(), pair());
    Vec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};
    use crate::math::Vec3;
    use crate::particle::Particle;

    fn setup(options: &[&str]) -> crate::error::Result<Setup> {
        let text = "domain.size = [1e-2, 1e-2, 1e-2]\n\
                    dry.time_step = 1e-6\n\
                    driving.gravity = 0\n\
                    run.end.steps = 1\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 4e-4\n\
                    density = 2500.0\n\
                    count = 2000\n\
                    sizes = [{ scale = 1, share = 1 }, { scale = 0.5, share = 1 }]\n\
                    granular_temperature = 4e-4\n";
        from_text(text, "hot", &options.iter().map(ToString::to_string).collect::<Vec<_>>())
    }

    #[test]
    fn particles_have_the_temperature_exactly_no_momentum_and_normal_velocities() {
        let setup = setup(&[]).unwrap();
        let velocities: Vec<Vec3> = setup.particles.iter().map(Particle::velocity).collect();
        let count = velocities.len() as f64;
        let squares: f64 = velocities.iter().map(Vec3::norm_squared).sum();
        assert!((squares / (3.0 * count) / 4e-4 - 1.0).abs() < 1e-12);
        let mass = |n: usize| setup.templates[setup.particles[n].template as usize].mass();
        let momentum: Vec3 = velocities.iter().enumerate().map(|(n, v)| v * mass(n)).sum();
        assert!(momentum.norm() < 1e-12 * count * mass(0) * 0.02, "{momentum}");
        // The fourth moment of a normal distribution is 3, and the axes are alike.
        for axis in 0..3 {
            let moment =
                |power: i32| velocities.iter().map(|v| (v[axis] / 0.02).powi(power)).sum::<f64>() / count;
            assert!((moment(2) - 1.0).abs() < 0.1 && (moment(4) - 3.0).abs() < 0.6, "{axis}");
        }
    }

    #[test]
    fn the_velocities_follow_the_seed_and_add_to_those_of_the_list() {
        let velocities = |options: &[&str]| -> Vec<Vec3> {
            setup(options).unwrap().particles.iter().map(Particle::velocity).collect()
        };
        assert_eq!(velocities(&[]), velocities(&["particles.0.seed=1"]));
        assert_ne!(velocities(&[]), velocities(&["particles.0.seed=2"]));
        let list = "particles.0.list=[{ position = [1e-3, 1e-3, 1e-3], velocity = [1, 0, 0] }, { position = [5e-3, 1e-3, 1e-3], velocity = [1, 0, 0] }]";
        let plain = "particles.0={ shape.sphere.diameter = 4e-4, density = 2500, granular_temperature = 4e-4, list = [] }";
        let two = velocities(&[plain, list]);
        assert!((two[0] + two[1] - 2.0 * Vec3::x()).norm() < 1e-15 && (two[0] - two[1]).norm() > 1e-2);
        let one = "particles.0.list=[[1e-3, 1e-3, 1e-3]]";
        let error = setup(&[plain, one]).unwrap_err().to_string();
        assert!(error.contains("two particles or more"), "{error}");
        let error = setup(&["particles.0.motion=fixed"]).unwrap_err().to_string();
        assert!(error.contains("whose motion is prescribed"), "{error}");
    }
}
