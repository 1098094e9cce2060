//! Correlations for the settling velocity of suspensions.
//!
//! ```text
//! u = k (1 - phi)^n u_1
//!
//! Richardson and Zaki        k = 1                        n = 4.65                Re < 0.2
//!                                                         n = 4.35 Re^-0.03       Re < 1
//!                                                         n = 4.45 Re^-0.1        Re < 500
//!                                                         n = 2.39                else
//! Garside and Al-Dibouni,    k = 0.89 exp(-Ar / 10^5)     (5.1 - n) / (n - 2.7) = 0.1 Re^0.9
//! Yao et al.
//! ```
//!
//! `u_1` and `Re` are velocity and Reynolds number of a single particle. Velocities are relative to the mixture, the weight being carried
//! by a mean pressure gradient that acts on fluid and particles alike.
//!
//! # Reference
//! Richardson and Zaki, Trans. Inst. Chem. Eng. 32 (1954) 35-53. Garside and Al-Dibouni, Ind. Eng. Chem. Process Des. Dev. 16 (1977)
//! 206-214, doi:10.1021/i260062a008. The prefactor of Yao et al. (2021), with both exponents, from Marquardt, Hafen and Krause, Comput.
//! Phys. Commun. 304 (2024) 109321, doi:10.1016/j.cpc.2024.109321, Eqs. 22 to 24.

use crate::case::Scales;
use crate::output::ReferenceScales;
use schemars::JsonSchema;
use serde::Deserialize;

/// Arguments of the correlations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspension {
    /// Archimedes number (-).
    pub archimedes: f64,
    /// Solid volume over volume (-).
    pub volume_fraction: f64,
    /// Reynolds number of one particle (-).
    pub reynolds: f64,
    /// Velocity of one particle over that of Stokes (-).
    pub single_over_stokes: f64,
}

impl Suspension {
    /// That of a fluid with so much of particles in it.
    pub fn of(scales: &Scales, volume_fraction: f64) -> Self {
        Self {
            archimedes: scales.archimedes,
            volume_fraction,
            reynolds: scales.schiller_naumann_reynolds,
            single_over_stokes: scales.schiller_naumann_velocity / scales.stokes_velocity,
        }
    }

    /// Part of the way from this one to another.
    #[must_use]
    pub fn towards(self, other: Self, part: f64) -> Self {
        let mix = |a: f64, b: f64| a + part * (b - a);
        Self {
            archimedes: mix(self.archimedes, other.archimedes),
            volume_fraction: mix(self.volume_fraction, other.volume_fraction),
            reynolds: mix(self.reynolds, other.reynolds),
            single_over_stokes: mix(self.single_over_stokes, other.single_over_stokes),
        }
    }
}

/// A correlation for the settling velocity of a suspension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Richardson and Zaki (1954).
    RichardsonZaki,
    /// Garside and Al-Dibouni (1977) with the prefactor of Yao et al. (2021).
    GarsideAlDibouniYao,
}

impl Law {
    /// Name in legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::RichardsonZaki => "Richardson-Zaki",
            Self::GarsideAlDibouniYao => "Garside-Al-Dibouni, Yao",
        }
    }

    /// Settling velocity over that of Stokes (-).
    pub fn over_stokes(self, of: Suspension) -> f64 {
        let (prefactor, exponent) = match self {
            Self::RichardsonZaki => (1.0, richardson_zaki(of.reynolds)),
            Self::GarsideAlDibouniYao => {
                (0.89 * (-of.archimedes / 1e5).exp(), garside_al_dibouni(of.reynolds))
            }
        };
        prefactor * (1.0 - of.volume_fraction).powf(exponent) * of.single_over_stokes
    }
}

fn richardson_zaki(reynolds: f64) -> f64 {
    match reynolds {
        re if re < 0.2 => 4.65,
        re if re < 1.0 => 4.35 * re.powf(-0.03),
        re if re < 500.0 => 4.45 * re.powf(-0.1),
        _ => 2.39,
    }
}

fn garside_al_dibouni(reynolds: f64) -> f64 {
    let ratio = 0.1 * reynolds.powf(0.9);
    (5.1 + 2.7 * ratio) / (1.0 + ratio)
}

/// Settling velocities over the Stokes velocity, by the names of the laws.
pub fn settling_references(scales: &ReferenceScales, volume_fraction: f64) -> [(&'static str, f64); 2] {
    let suspension = Suspension {
        archimedes: scales.archimedes,
        volume_fraction,
        reynolds: scales.schiller_naumann_reynolds,
        single_over_stokes: scales.schiller_naumann_velocity / scales.stokes_velocity,
    };
    [Law::RichardsonZaki, Law::GarsideAlDibouniYao].map(|law| (law.name(), law.over_stokes(suspension)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that were worked out independently from Eqs. 19 to 24 of Marquardt et al. (2024).
    #[test]
    fn the_correlations_have_the_values_of_an_independent_evaluation() {
        for (archimedes, reynolds, volume_fraction, zaki, yao) in [
            (21.0, 1.01329, 0.1, 0.626_106, 0.532_142),
            (500.0, 14.3536, 0.1, 0.698_232, 0.590_706),
            (1000.0, 23.8775, 0.3, 0.314_847, 0.246_071),
            (2000.0, 38.9108, 0.2, 0.502_302, 0.413_195),
            (31684.0, 237.14, 0.15, 0.657_99, 0.407_113),
        ] {
            let of = Suspension { archimedes, volume_fraction, reynolds, single_over_stokes: 1.0 };
            let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 2e-5, "{a} is not {b}");
            near(Law::RichardsonZaki.over_stokes(of), zaki);
            near(Law::GarsideAlDibouniYao.over_stokes(of), yao);
        }
    }

    #[test]
    fn suspensions_of_slow_particles_have_the_exponents_of_stokes_flow() {
        assert!((richardson_zaki(0.01) - 4.65).abs() < 1e-12);
        assert!((garside_al_dibouni(1e-9) - 5.1).abs() < 1e-6);
        assert!((richardson_zaki(1e4) - 2.39).abs() < 1e-12);
    }

    #[test]
    fn the_references_of_a_summary_are_over_the_stokes_velocity() {
        // Archimedes number 1000, volume fraction 0.2.
        let scales = ReferenceScales {
            archimedes: 1000.0,
            stokes_velocity: 0.323145,
            schiller_naumann_velocity: 0.138886,
            schiller_naumann_reynolds: 23.8775,
            ..ReferenceScales::default()
        };
        let [zaki, yao] =
            settling_references(&scales, 0.2).map(|(_, velocity)| velocity * 0.323145 / 0.138886);
        assert!((zaki - 0.485288).abs() < 1e-5 && (yao - 0.396699).abs() < 1e-5, "{zaki} {yao}");
    }
}
