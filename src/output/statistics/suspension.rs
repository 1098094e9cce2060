//! Standard errors of a suspension that settles or is sheared: they know how long its arrangement lasts.
//!
//! The velocity of a suspension depends on the arrangement of its particles, which takes them some way to change: the integrated
//! autocorrelation time is that in which they settle, relative to the mixture, by 1.2 to 1.9 diameters (spheres, Archimedes number 1000, volume
//! fractions 0.1 to 0.4, boxes of 6 diameters, five runs of 550 `t*` each). A run over a few diameters cannot find this by itself: all of
//! its values are of one arrangement. So the autocorrelation time is at least that of [`ARRANGEMENT`] diameters, and over less than
//! [`LEAST_DISTANCE`] nothing is known of the error, nor whether the suspension has settled.
//!
//! In shear it is the strain that changes the arrangement: the integrated autocorrelation time is that of 0.5 to 0.9 units for the stress on the
//! plates, up to 1.7 for the stress in particles (spheres and spheroids, volume fraction 0.16, `cases/shear_cell.toml` over 66 units of
//! strain; means over 1 to 12 units scatter as these times say).

use super::{Estimate, Settled, estimate_correlated, settled};

/// Diameters settled in the autocorrelation time (-).
const ARRANGEMENT: f64 = 1.5;
/// Least distance settled in diameters from which an error is taken (-).
pub const LEAST_DISTANCE: f64 = 4.0;

/// Units of strain in the autocorrelation time (-).
const ARRANGEMENT_STRAIN: f64 = 1.0;
/// Least strain from which an error is taken (-).
const LEAST_STRAIN: f64 = 3.0;

/// Mean of equally spaced values of one quantity while the particles settle by `distance` diameters, infinite where their arrangement does
/// not matter; without an error below [`LEAST_DISTANCE`]. `None` if there are no values.
pub fn estimate_settling(series: &[f64], distance: f64) -> Option<Estimate> {
    estimate(series, distance, ARRANGEMENT, LEAST_DISTANCE)
}

/// Mean of equally spaced values of one quantity of particles that are sheared by `strain` meanwhile, infinite where their arrangement does not
/// matter; without an error below 3 units. `None` if there are no values.
pub fn estimate_sheared(series: &[f64], strain: f64) -> Option<Estimate> {
    estimate(series, strain, ARRANGEMENT_STRAIN, LEAST_STRAIN)
}

/// Mean of values meanwhile the arrangement has changed by `change`, with an error if it is `least` at least; it lasts for `lasts`.
fn estimate(series: &[f64], change: f64, lasts: f64, least: f64) -> Option<Estimate> {
    let estimate = estimate_correlated(series, lasts * series.len() as f64 / change)?;
    Some(Estimate { standard_error: estimate.standard_error.filter(|_| change >= least), ..estimate })
}

/// Rest of a series of settling velocities after its transient, as [`settled`], in which the particles settle by [`LEAST_DISTANCE`] at least;
/// `distance` is that of a number of last values (diameters).
pub fn settled_suspension(series: &[f64], distance: impl Fn(usize) -> f64) -> Option<Settled> {
    let found = settled(series)?;
    let rest = &series[found.first..];
    let distance = distance(rest.len());
    let estimate = estimate_settling(rest, distance)?;
    (distance >= LEAST_DISTANCE).then_some(Settled { estimate, ..found })
}

#[cfg(test)]
mod tests {
    use super::super::tests::auto_regressive;
    use super::*;

    #[test]
    fn over_few_diameters_the_error_is_that_of_one_arrangement_or_unknown() {
        // Values that seem independent, and so have a small error by themselves.
        let series: Vec<f64> = auto_regressive(0.0, 400, 1).iter().map(|x| 1.0 + 0.01 * x).collect();
        let error = |distance| estimate_settling(&series, distance).unwrap().standard_error;
        let alone = error(f64::INFINITY).unwrap();
        assert!(error(6.0).unwrap() > 6.0 * alone && error(1e4).unwrap() < 1.2 * alone);
        assert!(error(6.0).unwrap() > error(12.0).unwrap());
        assert_eq!(error(3.9), None);
        assert_eq!(error(0.0), None);
        assert_eq!(error(f64::NAN), None);
    }

    #[test]
    fn in_shear_the_error_is_at_least_that_of_an_arrangement_for_each_unit_of_strain() {
        let series: Vec<f64> = auto_regressive(0.0, 400, 2).iter().map(|x| 1.0 + 0.01 * x).collect();
        let error = |strain| estimate_sheared(&series, strain).unwrap().standard_error;
        let alone = error(f64::INFINITY).unwrap();
        // As many independent values as half the units of strain.
        assert!((error(50.0).unwrap() / alone / (400.0_f64 / 25.0).sqrt() - 1.0).abs() < 0.05);
        assert!(error(10.0).unwrap() > 2.0 * error(50.0).unwrap());
        assert_eq!(error(2.9), None);
    }

    #[test]
    fn a_suspension_that_has_sunk_by_a_third_of_a_diameter_has_not_settled() {
        let series = [1.0; 200];
        assert!(settled_suspension(&series, |values| 0.3 * values as f64 / 200.0).is_none());
        let found = settled_suspension(&series, |values| 5.0 * values as f64 / 200.0).unwrap();
        assert_eq!((found.first, found.estimate.mean), (0, 1.0));
    }
}
