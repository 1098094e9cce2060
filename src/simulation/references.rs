//! Correlations for hindered settling, to draw beside the result.

use crate::case::Scales;
use crate::output::ReferenceScales;

/// Settling velocities over the Stokes velocity by name, for the Reynolds number and volume fraction of a case:
/// `u / u_Stokes = k (1 - phi)^n u* / u_Stokes`, `u*` the terminal velocity of one particle after Schiller and Naumann.
///
/// - Richardson and Zaki (1954): `k = 1`, `n = 4.65` for `Re < 0.2`, `4.35 Re^-0.03` below 1, `4.45 Re^-0.1` below 500,
///   then 2.39;
/// - Garside and Al-Dibouni (1977): `(5.1 - n) / (n - 2.7) = 0.1 Re^0.9`, with the prefactor of Yao et al. (2021),
///   `k = 0.89 exp(-Ar / 1e5)`.
pub(super) fn references(scales: &Scales) -> [(&'static str, f64); 2] {
    let re = scales.schiller_naumann_reynolds;
    let single = scales.schiller_naumann_velocity / scales.stokes_velocity;
    let richardson_zaki = match re {
        re if re < 0.2 => 4.65,
        re if re < 1.0 => 4.35 * re.powf(-0.03),
        re if re < 500.0 => 4.45 * re.powf(-0.1),
        _ => 2.39,
    };
    let ratio = 0.1 * re.powf(0.9);
    let garside = (5.1 + 2.7 * ratio) / (1.0 + ratio);
    let hindered = |k: f64, n: f64| k * (1.0 - scales.volume_fraction).powf(n) * single;
    [
        ("Richardson-Zaki", hindered(1.0, richardson_zaki)),
        (
            "Garside-Al-Dibouni, Yao",
            hindered(0.89 * (-scales.archimedes / 1e5).exp(), garside),
        ),
    ]
}

/// The same from what a summary keeps of the scales of its case; `volume_fraction` is without unit.
pub fn settling_references(scales: &ReferenceScales, volume_fraction: f64) -> [(&'static str, f64); 2] {
    references(&Scales {
        diameter: scales.diameter,
        viscosity: scales.viscosity,
        density_ratio: scales.density_ratio,
        archimedes: scales.archimedes,
        stokes_velocity: scales.stokes_velocity,
        stokes_time: scales.stokes_time,
        schiller_naumann_velocity: scales.schiller_naumann_velocity,
        schiller_naumann_reynolds: scales.schiller_naumann_reynolds,
        volume_fraction,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correlations_have_their_published_values() {
        // Archimedes number 1000, volume fraction 0.2.
        let scales = Scales {
            diameter: 1.5e-3,
            viscosity: 8.72491e-6,
            density_ratio: 3.3,
            archimedes: 1000.0,
            stokes_velocity: 0.323145,
            stokes_time: 0.00464188,
            schiller_naumann_velocity: 0.138886,
            schiller_naumann_reynolds: 23.8775,
            volume_fraction: 0.2,
        };
        let [(_, rz), (_, yao)] = references(&scales).map(|(n, v)| (n, v * 0.323145 / 0.138886));
        assert!(
            (rz - 0.485288).abs() < 1e-5 && (yao - 0.396699).abs() < 1e-5,
            "{rz} {yao}"
        );
    }
}
