//! Cooling of a gas of inelastic spheres of several sizes that share one temperature.
//!
//! A collision of species `i` and `j` along whose line the relative speed is `g` loses `(1 - e^2) m*_ij g^2 / 2`. Pairs collide
//! at the rate per volume (half of it for `i = j`), and lose on average
//!
//! ```text
//! n_i n_j chi_ij s_ij^2 sqrt(8 pi T / m*_ij),     (1 - e^2) T,     s_ij = R_i + R_j
//! ```
//!
//! with the temperature `T = m <v^2> / 3` (J): the speeds `g` of those that collide are distributed as `g exp(-m* g^2 / 2T)`,
//! so that `<g^2> = 2 T / m*`. So `T' ~ -T^(3/2)` and `T = T_0 / (1 + t / tau)^2`.
//!
//! # Reference
//! Haff (1983), doi:10.1017/S0022112083003419; pair correlation at contact: Boublik (1970), doi:10.1063/1.1673824, and Mansoori
//! et al. (1971), doi:10.1063/1.1675048.

use std::f64::consts::PI;

/// A gas of spheres of several sizes: radius (m), mass of one (kg) and number per volume (1/m^3) of each.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Mixture(Vec<[f64; 3]>);

impl Mixture {
    /// Of radius (m), mass of one (kg) and number of every size in a volume (m^3).
    pub(in super::super) fn new(sizes: &[(f64, f64, usize)], volume: f64) -> Self {
        let species = sizes.iter().map(|&(radius, mass, count)| [radius, mass, count as f64 / volume]);
        Self(species.collect())
    }

    /// Sum of the densities times a power of the diameter.
    fn moment(&self, power: i32) -> f64 {
        self.0.iter().map(|[radius, _, density]| density * (2.0 * radius).powi(power)).sum()
    }

    /// Pair correlation at contact (-).
    fn correlation(&self, a: f64, b: f64) -> f64 {
        let filled = PI / 6.0 * self.moment(3);
        let part = 2.0 * a * b / (a + b) * PI / 6.0 * self.moment(2);
        let free = 1.0 - filled;
        1.0 / free + 3.0 * part / (free * free) + 2.0 * part * part / (free * free * free)
    }

    /// Collisions of one sphere per time (1/s), on average, at a temperature (J).
    fn frequency(&self, temperature: f64) -> f64 {
        let pairs = self.0.iter().flat_map(|a| self.0.iter().map(move |b| (a, b)));
        let rate = |([r_a, m_a, n_a], [r_b, m_b, n_b]): (&[f64; 3], &[f64; 3])| {
            let mass = m_a * m_b / (m_a + m_b);
            let reach = r_a + r_b;
            let speed = (8.0 * PI * temperature / mass).sqrt();
            // Every pair of unlike species comes twice, so each time half of it.
            0.5 * n_a * n_b * self.correlation(*r_a, *r_b) * reach * reach * speed
        };
        2.0 * pairs.map(rate).sum::<f64>() / self.moment(0)
    }

    /// Temperature over that at the start (-), `temperature` (J), after `time` (s).
    pub(in super::super) fn cooled(&self, restitution: f64, temperature: f64, time: f64) -> f64 {
        // Half the collisions of one sphere times (1 - e^2) T, out of its energy of 3/2 T; half of that for 1 / sqrt(T).
        let decay = (1.0 - restitution * restitution) * self.frequency(temperature) / 6.0;
        f64::powi(1.0 + decay * time, -2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_spheres_collide_as_often_as_enskog_says() {
        // chi = (1 - phi / 2) / (1 - phi)^3; frequency 4 n s^2 chi sqrt(pi T / m).
        let (radius, mass, count, volume) = (0.5, 3.0, 100, 500.0);
        let gas = Mixture::new(&[(radius, mass, count)], volume);
        let filled = 100.0 * PI / 6.0 / volume;
        let correlation = (1.0 - 0.5 * filled) / f64::powi(1.0 - filled, 3);
        let expected = 4.0 * 0.2 * correlation * (PI * 7.0 / mass).sqrt();
        assert!((gas.frequency(7.0) / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_gas_split_into_two_species_of_the_same_spheres_is_the_same_gas() {
        let one = Mixture::new(&[(0.5, 3.0, 100)], 500.0);
        let two = Mixture::new(&[(0.5, 3.0, 30), (0.5, 3.0, 70)], 500.0);
        assert!((one.frequency(2.0) / two.frequency(2.0) - 1.0).abs() < 1e-12);
        assert!((one.cooled(0.9, 2.0, 3.0) / two.cooled(0.9, 2.0, 3.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_first_collisions_take_the_energy_of_their_number() {
        let gas = Mixture::new(&[(0.5, 3.0, 100)], 500.0);
        let time = 1e-6;
        let lost = (1.0 - 0.81) * 2.0 * gas.frequency(2.0) / 2.0 * time;
        let cooled = 1.0 - gas.cooled(0.9, 2.0, time);
        assert!((cooled * 1.5 * 2.0 / lost - 1.0).abs() < 1e-5);
    }
}
