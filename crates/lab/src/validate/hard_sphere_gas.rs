//! Pair distribution, structure factor and self-diffusion of elastic spheres: `validation/hard_sphere_gas`.

use super::context::{Written, written};
use super::prelude::*;
use std::f64::consts::PI;
use turbid::output::directory::{DYNAMICS_MEANS, PAIR_DISTRIBUTION_MEANS, STRUCTURE_FACTOR_MEANS};

const TEXT: &str = include_str!("../../../../validation/hard_sphere_gas/case.toml");

pub(super) const CASE: Case = Case {
    name: "hard_sphere_gas",
    question: "pair distribution, structure factor and self-diffusion of a gas of elastic spheres",
    source: STARLING,
    parts: &[Part::quick(8.0, pairs), Part::full(120.0, diffusion)],
};

const STARLING: &str = "Carnahan and Starling (1969), doi:10.1063/1.1672048";
const PERCUS: &str = "Percus and Yevick (1958), doi:10.1103/PhysRev.110.1, by the solution of Wertheim (1963), doi:10.1103/PhysRevLett.10.321";
const ENSKOG: &str = "Enskog: Chapman and Cowling (1970), section 16.6, second approximation of the coefficient of Chapman and Enskog";
/// Of the value at contact and of the coefficient of diffusion, as a part; of the distribution and the structure factor, in the mean.
const CONTACT: f64 = 0.03;
const DIFFUSION: f64 = 0.05;
const DEVIATION: f64 = 0.03;
/// Distances over the diameter: bins from contact on through which the parabola goes, and those that are compared.
const FITTED: [f64; 2] = [1.0, 1.3];
const COMPARED: [f64; 2] = [1.1, 2.5];

/// Value of the pair distribution at contact.
fn at_contact(phi: f64) -> f64 {
    (1.0 - 0.5 * phi) / (1.0 - phi).powi(3)
}

fn pairs(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let Written { tables, .. } =
        written(&setup, context.threads, &[PAIR_DISTRIBUTION_MEANS, STRUCTURE_FACTOR_MEANS])?;
    let curve = |table: usize, names: [&str; 2], unit: f64| -> Vec<[f64; 2]> {
        let [x, y] = names.map(|name| tables[table].get(name).unwrap_or_default());
        x.iter().zip(y).map(|(x, y)| [x * unit, *y]).collect()
    };
    let points = curve(0, ["separation", "pair_distribution"], 1.0 / setup.diameter);
    let phi = setup.volume_fraction;
    let within = |[from, to]: [f64; 2]| points.iter().filter(move |at| at[0] > from && at[0] < to);
    let contact = parabola_at(1.0, &within(FITTED).copied().collect::<Vec<_>>());
    let quantity = format!("pair distribution at contact, volume fraction {phi:.3} (-)");
    found.relative(quantity, contact, at_contact(phi), CONTACT);
    let theory = percus_yevick(phi);
    let mean = mean_deviation(&within(COMPARED).copied().collect::<Vec<_>>(), &theory);
    let quantity = "mean deviation of the pair distribution from 1.1 to 2.5 diameters (-)";
    found.absolute(quantity, mean, 0.0, DEVIATION).source(PERCUS);
    // Nearer to contact the damped transform is rounded.
    let of_theory = (106..=300).map(|n| 0.01 * f64::from(n)).map(|r| [r, theory(r)]);
    found.plot(
        "pairs",
        format!("Pair distribution of elastic spheres, volume fraction {phi:.3}"),
        ["distance over diameter (-)", "pair distribution (-)"],
        [reference("Percus and Yevick", of_theory.collect::<Vec<_>>()), measured("measured", points)],
    );
    let points = curve(1, ["wave_number", "structure_factor"], setup.diameter);
    let theory = structure_factor(phi);
    let mean = mean_deviation(&points, &theory);
    let quantity = "mean deviation of the structure factor, wavelengths from half a diameter to the box (-)";
    found.absolute(quantity, mean, 0.0, DEVIATION).source(PERCUS);
    let of_theory = (1..=260).map(|n| 0.05 * f64::from(n)).map(|k| [k, theory(k)]);
    found.plot(
        "structure_factor",
        format!("Structure factor of elastic spheres, volume fraction {phi:.3}"),
        ["wave number times diameter (-)", "structure factor (-)"],
        [reference("Percus and Yevick", of_theory.collect::<Vec<_>>()), measured("measured", points)],
    );
    Ok(())
}

fn mean_deviation(points: &[[f64; 2]], theory: impl Fn(f64) -> f64) -> f64 {
    points.iter().map(|at| (at[1] - theory(at[0])).abs()).sum::<f64>() / points.len() as f64
}

/// The value at `x` of the parabola by least squares through points.
fn parabola_at(x: f64, points: &[[f64; 2]]) -> f64 {
    use turbid::math::{Mat3, nalgebra::Matrix3x1};
    let (mut matrix, mut right) = (Mat3::zeros(), Matrix3x1::zeros());
    for [at, value] in points {
        let powers = Matrix3x1::new(1.0, at - x, (at - x).powi(2));
        matrix += powers * powers.transpose();
        right += powers * *value;
    }
    matrix.try_inverse().map_or(f64::NAN, |inverse| (inverse * right)[0])
}

/// The structure factor of the equation of Percus and Yevick over the wave number times the diameter: from the direct correlation
/// `-(a + 6 phi b r + phi a r^3 / 2)` inside by the equation of Ornstein and Zernike.
fn structure_factor(phi: f64) -> impl Fn(f64) -> f64 {
    let a = (1.0 + 2.0 * phi).powi(2) / (1.0 - phi).powi(4);
    let b = -(1.0 + 0.5 * phi).powi(2) / (1.0 - phi).powi(4);
    let density = 6.0 * phi / PI;
    move |k| {
        // 4 pi / k int c r sin(k r) dr by the midpoint rule.
        let cells = 200_u32.max((4.0 * k) as u32);
        let width = 1.0 / f64::from(cells);
        let sum: f64 = (0..cells)
            .map(|n| (f64::from(n) + 0.5) * width)
            .map(|r| -(a + 6.0 * phi * b * r + 0.5 * phi * a * r.powi(3)) * r * (k * r).sin())
            .sum();
        1.0 / (1.0 - density * 4.0 * PI / k * sum * width)
    }
}

/// The pair distribution of the same equation beyond contact, over the distance in diameters: the inverse transform, damped at large wave
/// numbers.
fn percus_yevick(phi: f64) -> impl Fn(f64) -> f64 {
    let (of_waves, density) = (structure_factor(phi), 6.0 * phi / PI);
    let (step, count) = (0.05, 4000_u32);
    let structure: Vec<[f64; 2]> =
        (1..=count).map(|n| f64::from(n) * step).map(|k| [k, of_waves(k) - 1.0]).collect();
    let damped = move |k: f64| (-(2.5 * k / (f64::from(count) * step)).powi(2)).exp();
    move |r| {
        let sum: f64 = structure.iter().map(|[k, s]| k * (k * r).sin() * s * damped(*k)).sum();
        1.0 + sum * step / (2.0 * PI * PI * density * r)
    }
}

fn diffusion(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = [
        "domain.size={ diameters = [20.75, 20.75, 20.75] }",
        "particles.0.volume_fraction=0.03",
        "contact.youngs_modulus=4e5",
        "dry.time_step=6e-5",
        "run.end={ time = 26 }",
        "run.average_from={ time = 1 }",
        "output.series_every={ time = 0.1 }",
        "output.structure.every=\"never\"",
        "output.dynamics={ every = { time = 0.025 }, lags = 100 }",
    ];
    let setup = context.setup(TEXT, CASE.name, &own.map(String::from))?;
    let Written { tables, summary } = written(&setup, context.threads, &[DYNAMICS_MEANS])?;
    let (phi, diameter) = (setup.volume_fraction, setup.diameter);
    let column = |name: &str| tables[0].get(name).unwrap_or_default();
    let mean = |name: &str, row: usize| {
        ["x", "y", "z"].iter().map(|axis| column(&format!("{name}_{axis}"))[row]).sum::<f64>() / 3.0
    };
    let temperature = mean("velocity_autocorrelation", 0);
    let density = 6.0 * phi / (PI * diameter.powi(3));
    let dilute = 1.01896 * 0.375 / (density * diameter * diameter) * (temperature / PI).sqrt();
    let theory = dilute / at_contact(phi);
    let average = &summary.averages["diffusion"];
    let quantity = format!("coefficient of self-diffusion, volume fraction {phi:.3} (m^2/s)");
    found.relative(quantity, average.mean, theory, DIFFUSION).source(ENSKOG);
    found.notes.push((
        "standard error of the coefficient of self-diffusion over the blocks (m^2/s)".into(),
        average.standard_error.unwrap_or(f64::NAN),
    ));
    let lags = column("lag");
    // Memory that fades exponentially with the time D / T.
    let time = theory / temperature;
    let curve = lags.iter().map(|&lag| {
        let ways = 2.0 * theory * (lag - time * (1.0 - (-lag / time).exp()));
        [lag, ways * 1e6]
    });
    let own = (0..lags.len()).map(|row| [lags[row], mean("mean_squared_displacement", row) * 1e6]);
    found.plot(
        "diffusion",
        format!("Displacements of elastic spheres, volume fraction {phi:.3}"),
        ["time lag (s)", "mean squared displacement along an axis (mm2)"],
        [reference("Enskog", curve.collect::<Vec<_>>()), measured("measured", own.collect::<Vec<_>>())],
    );
    Ok(())
}
