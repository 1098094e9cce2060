//! Sizes of particles: factors on the lengths of their shape, listed or spread by a distribution.
//!
//! ```text
//! normal        exp(-((d - mean) / deviation)^2 / 2)
//! log-normal    exp(-(ln(d / median) / ln(deviation))^2 / 2) / d         deviation: geometric
//! Weibull       (d / scale)^(shape - 1) exp(-(d / scale)^shape)
//! sieve         1 / d between two openings, so that what passes is a line over ln d
//! ```
//!
//! are densities over the diameter `d`, by number or by mass. The range is cut into classes whose ends are evenly spaced in `ln d`, those of a sieve
//! curve between each two openings. A class becomes one size: as many particles as it has, of their mean mass.
//!
//! # Reference
//! Rosin, Rammler (1933), J. Inst. Fuel 7, 29, by mass; Weibull (1951), doi:10.1115/1.4010337.

use super::checks::Document;
use super::file::{ParticleSection, SharesOf, SizeSpread, Sizes};
use crate::error::Result;

/// Factor on lengths below which it may be a length itself.
const DOUBTFUL_FACTOR: f64 = 0.05;
/// Factor below which no run resolves a body beside one of the shape as written.
const LEAST_FACTOR: f64 = 5e-3;
/// Sizes that are evenly spread, and classes of any other distribution, if not said otherwise.
const EVEN: u32 = 5;
const CLASSES: u32 = 20;
/// Parts of a class in which its density is evaluated.
const PARTS: u32 = 64;
/// Largest factor over the smallest one.
const WIDEST: f64 = 1e3;
/// Standard deviations that the range of a normal distribution extends to both sides, and the share beyond either end of that of Weibull.
const DEVIATIONS: f64 = 3.0;
const TAIL: f64 = 1e-3;

/// Factors that were given, and all with their shares.
type Given = (Vec<f64>, Vec<(f64, f64)>);

/// Factors on all lengths of a shape of this diameter (m), and the share of the particles that has each.
pub(super) fn sizes(
    document: &Document,
    key: &str,
    section: &ParticleSection,
    diameter: f64,
    warnings: &mut Vec<String>,
) -> Result<Vec<(f64, f64)>> {
    let (given, sizes): (Vec<f64>, Vec<(f64, f64)>) = match &section.sizes {
        None => return Ok(vec![(1.0, 1.0)]),
        Some(Sizes::Shares(list)) if list.is_empty() => {
            let remedy = "scales are factors on the lengths of the shape, e.g. 0.8";
            return Err(document.error(key, &format!("`{key}` is empty"), "no size", remedy));
        }
        Some(Sizes::Shares(list)) => list.iter().map(|size| (size.scale, (size.scale, size.share))).unzip(),
        Some(Sizes::Spread(spread)) => spread_sizes(document, key, spread)?,
    };
    // Of a shape a few millimetres wide no factor is a few thousandths, but a length is.
    let is_length = |size: &f64| (0.1..10.0).contains(&(size / diameter));
    if diameter < DOUBTFUL_FACTOR && given.iter().all(|size| *size < DOUBTFUL_FACTOR && is_length(size)) {
        let list =
            |unit: f64| given.iter().map(|size| (size / unit).to_string()).collect::<Vec<_>>().join(", ");
        let title = format!(
            "`{key}` are factors on the lengths of the shape, whose diameter is {diameter} m: are lengths meant, {} m?",
            list(1.0)
        );
        let remedy = format!(
            "if so, divide them by the diameter: {}; if not, write a smaller shape with larger factors",
            list(diameter)
        );
        let label = "factors, not metres";
        if given.iter().all(|size| *size < LEAST_FACTOR) {
            return Err(document.error(key, &title, label, &remedy));
        }
        warnings.push(document.warning(key, &title, label, &remedy));
    }
    Ok(sizes)
}

/// Sizes of a distribution.
fn spread_sizes(document: &Document, key: &str, spread: &SizeSpread) -> Result<Given> {
    if let Some(range) = spread.uniform {
        ascending(document, &format!("{key}.uniform"), range)?;
        refuse_range(document, key, spread)?;
    }
    if let (Some([low, high]), None | Some(SharesOf::Number)) = (spread.uniform, spread.by) {
        let steps = spread.steps.unwrap_or(EVEN);
        let middle = |step: u32| low + (high - low) * (f64::from(step) + 0.5) / f64::from(steps);
        return Ok((vec![low, high], (0..steps).map(|step| (middle(step), 1.0)).collect()));
    }
    let (density, by, [low, high]) = density(document, key, spread)?;
    let [low, high] = match spread.range {
        Some(range) => ascending(document, &format!("{key}.range"), range)?,
        None => [low, high],
    };
    if !(low > 0.0 && high <= WIDEST * low) {
        let key = format!("{key}.range");
        let title = format!("the sizes of this distribution go from {low:.4} to {high:.4}");
        let remedy = format!("cut it off by `{key} = [smallest, largest]`, at most {WIDEST} times as large");
        return Err(document.error(&key, &title, "too wide", &remedy));
    }
    let steps = spread.steps.unwrap_or(CLASSES);
    let openings: Vec<f64> = spread.sieve.iter().flatten().map(|row| row[0]).collect();
    let within = openings.iter().copied().filter(|size| (low..high).contains(size) && *size > low);
    let ends: Vec<f64> = [low].into_iter().chain(within).chain([high]).collect();
    let intervals = ends.len() as u32 - 1;
    let classes = ends.windows(2).flat_map(|ends| {
        let [from, to] = [ends[0], ends[1]].map(libm::log);
        let count = steps.div_ceil(intervals);
        (0..count).map(move |class| {
            let end = |class: u32| from + (to - from) * f64::from(class) / f64::from(count);
            [end(class), end(class + 1)]
        })
    });
    let sizes = classes.filter_map(|[from, to]| {
        let (mut number, mut mass) = (0.0, 0.0);
        for part in 0..PARTS {
            let d = libm::exp(from + (to - from) * (f64::from(part) + 0.5) / f64::from(PARTS));
            let (share, volume) = (density(d) * d * (to - from), d * d * d);
            match by {
                SharesOf::Number => (number, mass) = (number + share, mass + share * volume),
                SharesOf::Mass => (number, mass) = (number + share / volume, mass + share),
            }
        }
        (number > 0.0).then(|| (libm::cbrt(mass / number), number))
    });
    let sizes: Vec<(f64, f64)> = sizes.collect();
    if sizes.is_empty() {
        let key = format!("{key}.range");
        let title = format!("no particle has a size from {low} to {high}");
        return Err(document.error(&key, &title, "beside the distribution", "take a range that it reaches"));
    }
    Ok((vec![low, high], sizes))
}

/// A density over the factor, what its shares are of, and where it begins and ends.
type Density<'a> = (Box<dyn Fn(f64) -> f64 + 'a>, SharesOf, [f64; 2]);

fn density<'a>(document: &Document, key: &str, spread: &'a SizeSpread) -> Result<Density<'a>> {
    let by = |usual: SharesOf| spread.by.unwrap_or(usual);
    if let Some(range) = spread.uniform {
        return Ok((Box::new(|_| 1.0), by(SharesOf::Number), range));
    }
    if let Some(normal) = &spread.normal {
        let (mean, deviation) = (normal.mean, normal.deviation);
        let density = move |d: f64| {
            let x = (d - mean) / deviation;
            libm::exp(-0.5 * x * x)
        };
        let range = [mean - DEVIATIONS * deviation, mean + DEVIATIONS * deviation];
        return Ok((Box::new(density), by(SharesOf::Number), range));
    }
    if let Some(of) = &spread.log_normal {
        if of.deviation <= 1.0 {
            let key = format!("{key}.log_normal.deviation");
            let why = "84 % of the particles are smaller than the median times it";
            return Err(document.out_of_range(&key, of.deviation, "a number above 1", why));
        }
        let (median, width) = (of.median, libm::log(of.deviation));
        let density = move |d: f64| {
            let x = libm::log(d / median) / width;
            libm::exp(-0.5 * x * x) / d
        };
        let reach = libm::exp(DEVIATIONS * width);
        return Ok((Box::new(density), by(SharesOf::Number), [median / reach, median * reach]));
    }
    if let Some(of) = &spread.weibull {
        let (scale, shape) = (of.scale, of.shape);
        let density = move |d: f64| {
            let x = d / scale;
            libm::pow(x, shape - 1.0) * libm::exp(-libm::pow(x, shape))
        };
        let beyond = |share: f64| scale * libm::pow(-libm::log(share), 1.0 / shape);
        return Ok((Box::new(density), by(SharesOf::Mass), [beyond(1.0 - TAIL), beyond(TAIL)]));
    }
    let sieve = spread.sieve.as_deref().unwrap_or_default();
    let key = format!("{key}.sieve");
    let remedy = "rows are `[size, mass fraction that passes]`, sizes ascending, fractions from 0 to 1";
    let (Some([smallest, first]), Some([largest, last])) = (sieve.first(), sieve.last()) else {
        return Err(document.error(&key, &format!("`{key}` is empty"), "no size", remedy));
    };
    if spread.by == Some(SharesOf::Number) {
        let title = format!("`{key}` is of mass fractions, not of numbers");
        return Err(document.error(&key, &title, "of mass", "leave out `by`"));
    }
    for (row, pair) in sieve.windows(2).enumerate() {
        if pair[1][0] <= pair[0][0] || pair[1][1] < pair[0][1] {
            let title = format!("row {} of `{key}`, {:?}, comes after {:?}", row + 1, pair[1], pair[0]);
            return Err(document.error(&key, &title, "not ascending", remedy));
        }
    }
    #[allow(clippy::float_cmp)] // given as such
    let is_whole = *first == 0.0 && *last == 1.0;
    if *smallest <= 0.0 || !is_whole {
        let title = format!("`{key}` goes from {:?} to {:?}", [smallest, first], [largest, last]);
        return Err(document.error(&key, &title, "not from 0 to 1", remedy));
    }
    let (smallest, largest) = (*smallest, *largest);
    let density = move |d: f64| {
        if !(smallest..=largest).contains(&d) {
            return 0.0;
        }
        let above = sieve.partition_point(|row| row[0] <= d).clamp(1, sieve.len() - 1);
        let ([from, passes], [to, passes_next]) = (sieve[above - 1], sieve[above]);
        (passes_next - passes) / (libm::log(to / from) * d)
    };
    Ok((Box::new(density), SharesOf::Mass, [smallest, largest]))
}

fn ascending(document: &Document, key: &str, [low, high]: [f64; 2]) -> Result<[f64; 2]> {
    if high < low {
        let wanted = format!("a number of at least {low}");
        return Err(document.out_of_range(key, high, &wanted, "the smallest factor comes first"));
    }
    Ok([low, high])
}

/// Refuses a range beside that of `uniform`.
fn refuse_range(document: &Document, key: &str, spread: &SizeSpread) -> Result<()> {
    if spread.range.is_none() {
        return Ok(());
    }
    let key = format!("{key}.range");
    let title = format!("`{key}` is given beside `uniform`, which is one");
    Err(document.error(&key, &title, "a second range", "leave it out"))
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};
    use crate::error::Result;
    use std::f64::consts::E;

    const CURVE: &str = "sieve = [[0.5, 0], [0.7, 0.15], [1, 0.5], [1.4, 0.85], [2, 1]]";

    fn case(sizes: &str, count: u32) -> Result<Setup> {
        let text = format!(
            "domain.size = [3e-2, 3e-2, 3e-2]\ndry.time_step = 1e-6\nrun.end.steps = 1\noutput.directory = \"out\"\n\
             [[particles]]\nshape.sphere.diameter = 1e-3\ndensity = 2000\ncount = {count}\nsizes = {{ {sizes} }}\n"
        );
        from_text(&text, "sizes", &[])
    }

    /// Factors, numbers and masses of the particles, each over their sum.
    fn found(sizes: &str, count: u32) -> Vec<[f64; 3]> {
        let setup = case(sizes, count).unwrap_or_else(|e| panic!("{e}"));
        let mut numbers = vec![0.0; setup.templates.len()];
        setup.particles.iter().for_each(|particle| numbers[particle.template as usize] += 1.0);
        let of_each = setup.templates.iter().zip(numbers);
        let mut all: Vec<[f64; 3]> = of_each
            .map(|(template, number)| {
                [template.shape.equivalent_diameter() / 1e-3, number, number * template.shape.volume()]
            })
            .collect();
        let sums = [1, 2].map(|i| all.iter().map(|of| of[i]).sum::<f64>());
        for [_, number, mass] in &mut all {
            (*number, *mass) = (*number / sums[0], *mass / sums[1]);
        }
        all
    }

    #[test]
    fn a_sieve_curve_comes_out_of_two_thousand_particles_within_one_per_cent_of_the_mass_per_class() {
        for steps in [4, 20, 60] {
            let all = found(&format!("{CURVE}, steps = {steps}"), 2000);
            assert_eq!(all.len() as u32, steps);
            for (openings, part) in
                [([0.5, 0.7], 0.15), ([0.7, 1.0], 0.35), ([1.0, 1.4], 0.35), ([1.4, 2.0], 0.15)]
            {
                let between = all.iter().filter(|[size, ..]| (openings[0]..openings[1]).contains(size));
                let mass: f64 = between.map(|[.., mass]| mass).sum();
                assert!((mass - part).abs() < 0.01, "{steps} {openings:?}: {mass} of {part}");
            }
        }
    }

    #[test]
    fn distributions_by_number_and_by_mass_have_the_moments_of_their_formulas() {
        let mean = |all: &[[f64; 3]], weight: usize, of: fn(f64) -> f64| -> f64 {
            all.iter().map(|row| row[weight] * of(row[0])).sum()
        };
        let normal = found("normal = { mean = 1, deviation = 0.1 }, steps = 50", 1500);
        assert!((mean(&normal, 1, |d| d) - 1.0).abs() < 2e-3);
        let spread = mean(&normal, 1, |d| (d - 1.0) * (d - 1.0)).sqrt();
        // Cut off at three deviations.
        assert!((spread - 0.0987).abs() < 1e-3, "{spread}");
        let width = 1.25_f64.ln();
        let of_number =
            found("log_normal = { median = 1, deviation = 1.25 }, range = [0.3, 3], steps = 80", 1500);
        assert!(mean(&of_number, 1, f64::ln).abs() < 3e-3);
        // Hatch and Choate (1929), doi:10.1016/S0016-0032(29)91451-4.
        let of_mass = found(
            "log_normal = { median = 1, deviation = 1.25 }, by = \"mass\", range = [0.3, 3], steps = 80",
            1500,
        );
        let shift = mean(&of_mass, 1, f64::ln);
        assert!((shift + 3.0 * width * width).abs() < 5e-3, "{shift}");
        let rosin = found("weibull = { scale = 1, shape = 3.5 }, range = [0.3, 1.8], steps = 100", 1500);
        let below: f64 = rosin.iter().filter(|[d, ..]| *d < 1.0).map(|[.., mass]| mass).sum();
        assert!((below - (1.0 - 1.0 / E)).abs() < 0.015, "{below}");
        let uniform = found("uniform = [0.8, 1.2], by = \"mass\", steps = 10", 1500);
        let below: f64 = uniform.iter().filter(|[d, ..]| *d < 1.0).map(|[.., mass]| mass).sum();
        assert!((below - 0.5).abs() < 0.06 && uniform[0][1] > uniform[9][1] * 2.0, "{below}");
    }

    #[test]
    fn distributions_that_are_none_are_refused_with_key_and_remedy() {
        for (sizes, expected) in [
            ("sieve = []", "is empty"),
            ("sieve = [[0.5, 0], [0.4, 1]]", "row 1"),
            ("sieve = [[0.5, 0], [0.6, 0.5], [0.8, 0.4], [1, 1]]", "row 2"),
            ("sieve = [[0.5, 0.1], [1, 1]]", "not from 0 to 1"),
            ("sieve = [[0.5, 0], [1, 1]], by = \"number\"", "leave out `by`"),
            ("normal = { mean = 1, deviation = 0.4 }", "range = [smallest, largest]"),
            ("log_normal = { median = 1, deviation = 0.9 }", "a number above 1"),
            ("weibull = { scale = 1, shape = 0.5 }", "range = [smallest, largest]"),
            ("uniform = [0.8, 1.2], range = [0.9, 1.1]", "a second range"),
            ("sieve = [[0.5, 0], [1, 1]], range = [2, 3]", "take a range that it reaches"),
            ("normal = { mean = 1, deviation = 0.1 }, range = [1.1, 0.9]", "the smallest factor comes first"),
            ("uniform = [0.8, 1.2], normal = { mean = 1, deviation = 0.1 }", "normal"),
            ("steps = 3", "uniform"),
        ] {
            let error = case(sizes, 10).err().unwrap_or_else(|| panic!("{sizes} is taken")).to_string();
            assert!(error.contains(expected) && error.contains("sizes"), "{sizes}: {error}");
        }
    }
}
