//! Differences of both engines and theory, as checks and plots.

use super::prelude::*;

/// Largest admissible difference, and the reason for it.
pub(super) type Limit = (f64, &'static str);

/// Values of a quantity: native, the other engine, analytic.
pub(super) type Values = [Option<f64>; 3];

pub(super) type Points = Vec<[f64; 2]>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Between {
    Engines,
    /// Theory and the engine that is further from it.
    Theory,
    /// Engines and theory.
    All,
}

impl Findings {
    /// Adds a check whose difference the caller has worked out.
    pub(super) fn given(
        &mut self,
        quantity: impl Into<String>,
        values: Values,
        difference: f64,
        (tolerance, reason): Limit,
    ) {
        let check = Check::new(quantity, difference, 0.0, tolerance, reason);
        self.push(Check { engines: Some(values), ..check });
    }

    /// Adds a check of the largest absolute difference.
    pub(super) fn compare(
        &mut self,
        quantity: impl Into<String>,
        values: Values,
        between: Between,
        limit: Limit,
    ) {
        self.given(quantity, values, difference(values, between), limit);
    }

    /// Adds a check of the largest difference relative to theory or, without, to the other engine.
    pub(super) fn compare_relative(
        &mut self,
        quantity: impl Into<String>,
        values: Values,
        between: Between,
        limit: Limit,
    ) {
        let unit = values[2].or(values[1]).map_or(f64::NAN, f64::abs);
        self.given(quantity, values, difference(values, between) / unit, limit);
    }

    /// Adds a plot of the native engine, which lies on the other one, and of theory under its name.
    pub(super) fn plot_both(
        &mut self,
        name: impl Into<String>,
        title: impl Into<String>,
        axes: [&str; 2],
        [native, other]: [Points; 2],
        theory: Option<(&str, Points)>,
    ) -> &mut Figure {
        let theory = theory.map(|(name, points)| reference(name, points));
        let engines = [overlaid("native", native), measured("OTHER", other)];
        self.plot(name, title, axes, engines.into_iter().chain(theory))
    }
}

fn difference([native, other, analytic]: Values, between: Between) -> f64 {
    let pairs = [(native, analytic), (other, analytic), (native, other)];
    let pairs = match between {
        Between::Engines => &pairs[2..],
        Between::Theory => &pairs[..2],
        Between::All => &pairs,
    };
    worst(pairs.iter().filter_map(|(a, b)| Some(((*a)? - (*b)?).abs())))
}

/// The largest of some numbers; NaN if one of them is, or if there are none.
pub(super) fn worst(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if b.is_nan() || b > a { b } else { a };
    numbers.into_iter().reduce(larger).unwrap_or(f64::NAN)
}

/// Every n-th point, so that about `most` of them are left, and the last one.
pub(super) fn thinned(points: impl IntoIterator<Item = [f64; 2]>, most: usize) -> Points {
    let points: Points = points.into_iter().collect();
    let every = points.len().div_ceil(most).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.iter().enumerate().filter(|(k, _)| k % every == 0 || *k == last);
    kept.map(|(_, point)| *point).collect()
}

/// Every `every`-th pair of frames of both engines at equal times (s), for VTK.
pub(super) fn moments(
    templates: &Arc<[Template]>,
    frames: [&[Vec<Particle>]; 2],
    time: impl Fn(usize) -> f64,
    every: usize,
) -> Vec<Moment> {
    let both = (0..frames[0].len()).step_by(every);
    let moment = |k: usize| Moment {
        time: time(k),
        particles: frames.map(|frames| frames[k].clone()),
        templates: templates.clone(),
    };
    both.map(moment).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_that_is_not_a_number_or_missing_fails() {
        let mut findings = Findings::default();
        findings.compare("x", [None, Some(1.0), None], Between::All, (1e9, ""));
        findings.compare_relative("x", [f64::NAN, 1.0, 1.0].map(Some), Between::Theory, (1e9, ""));
        assert!(findings.checks.iter().all(|check| !check.pass));
    }

    #[test]
    fn the_worst_of_the_differences_asked_for_decides() {
        let values = [1.0, 1.2, 1.1].map(Some);
        for (between, expected) in [(Between::Engines, 0.2), (Between::Theory, 0.1), (Between::All, 0.2)] {
            let mut findings = Findings::default();
            findings.compare("x", values, between, (0.15, ""));
            assert!((findings.checks[0].measured - expected).abs() < 1e-12);
            assert_eq!(findings.checks[0].pass, between == Between::Theory);
        }
        assert!(worst([0.0, f64::NAN, 1.0]).is_nan());
    }
}
