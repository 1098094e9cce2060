//! Costs of particles, from times of steps with and without them.

use super::{RankReport, median};
use serde::Serialize;

/// Bytes that move in a step for each cut cell: its solid fraction is written when bodies are mapped, and read in the sweep.
const CUT_CELL: usize = 2 * size_of::<f32>();

/// The same for each segment.
const SEGMENT: usize = 2 * size_of::<turbid::fluid::Segment>();

/// Stages in which particles take time besides contacts and motion.
const COUPLED: [&str; 3] = ["map", "fluid", "loads"];

#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    pub(super) mlups: Vec<f64>,
    /// The same without particles; empty without a fluid.
    pub(super) fluid_only: Vec<f64>,
    /// Streaming bandwidth (GB/s).
    pub(super) bandwidth: Vec<f64>,
}

/// Costs of particles beside the fluid; `None` for what a case does not have. Nanoseconds are those of one rank.
#[derive(Clone, Debug, Serialize)]
pub struct Costs {
    pub fluid_only_mlups: Option<f64>,
    pub fluid_only_mlups_samples: Vec<f64>,
    pub four_way_over_fluid_only: Option<f64>,
    pub dem_share: Option<f64>,
    pub nanoseconds_per_fluid_cell: Option<f64>,
    pub nanoseconds_per_covered_cell: Option<f64>,
    /// Time of the stage `dem` over the contacts; `None` if these are fewer than the particles, whose motion and search for
    /// neighbours then take most of it.
    pub nanoseconds_per_contact: Option<f64>,
    pub roofline_fraction_with_particles: Option<f64>,
}

impl Costs {
    /// From samples and what the ranks report; `population_bytes` are read and written for each cell.
    pub(super) fn new(samples: &Samples, ranks: &[RankReport], population_bytes: f64) -> Self {
        let Samples { mlups, fluid_only, bandwidth } = samples;
        let sum = |figure: &dyn Fn(&RankReport) -> f64| ranks.iter().map(figure).sum::<f64>();
        let count = |figure: fn(&RankReport) -> usize| sum(&|rank| figure(rank) as f64);
        let dem = sum(&|rank| rank.stages.get("dem").copied().unwrap_or(0.0));
        let added = sum(&|rank| {
            let time = |name: &&str| {
                let [with, without] = [&rank.stages, &rank.fluid_only_stages]
                    .map(|stages| stages.get(*name).copied().unwrap_or(0.0));
                with - without
            };
            COUPLED.iter().map(time).sum()
        });
        let over = |time: f64, count: f64| (count > 0.0).then(|| time / count);
        let has_fluid = !fluid_only.is_empty();
        let is_coupled = has_fluid && count(|rank| rank.particles) > 0.0;
        let pairs = |with: &[f64], over: &[f64]| {
            is_coupled.then(|| median(&with.iter().zip(over).map(|(a, b)| a / b).collect::<Vec<_>>()))
        };
        let fluid_only_mlups = has_fluid.then(|| median(fluid_only));
        let particle_bytes =
            CUT_CELL as f64 * count(|rank| rank.cut_cells) + SEGMENT as f64 * count(|rank| rank.segments);
        let bytes = population_bytes + particle_bytes / count(|rank| rank.cells);
        Self {
            fluid_only_mlups,
            fluid_only_mlups_samples: fluid_only.clone(),
            four_way_over_fluid_only: pairs(mlups, fluid_only),
            dem_share: over(dem, sum(&|rank| rank.stages.values().sum())).filter(|_| is_coupled),
            nanoseconds_per_fluid_cell: fluid_only_mlups.map(|mlups| 1e3 * ranks.len() as f64 / mlups),
            nanoseconds_per_covered_cell: over(1e9 * added, count(|rank| rank.covered_cells))
                .filter(|_| is_coupled),
            nanoseconds_per_contact: per_contact(
                1e9 * dem,
                count(|rank| rank.contacts),
                count(|rank| rank.particles),
            ),
            roofline_fraction_with_particles: pairs(mlups, bandwidth).map(|ratio| ratio * bytes / 1e3),
        }
    }
}

/// Time of the motion of particles with contacts over the contacts, where there are enough to say something of them.
fn per_contact(time: f64, contacts: f64, particles: f64) -> Option<f64> {
    (contacts > 0.0 && contacts >= particles).then(|| time / contacts)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CASE, report, setup};
    use super::super::{BenchOptions, bench};
    use super::per_contact;
    use turbid::case::from_text;

    #[test]
    fn particles_cost_time_and_bytes_on_3_ranks() {
        let report = report(3);
        let costs = &report.costs;
        assert_eq!(costs.fluid_only_mlups_samples.len(), report.mlups_samples.len());
        // Times say nothing on a busy machine.
        assert!(costs.four_way_over_fluid_only.unwrap() > 0.0, "{costs:?}");
        assert!((0.0..1.0).contains(&costs.dem_share.unwrap()), "{costs:?}");
        assert!(costs.nanoseconds_per_covered_cell.unwrap().is_finite(), "{costs:?}");
        let has_many = report.contacts >= report.particles;
        assert_eq!(costs.nanoseconds_per_contact.is_some(), has_many, "{costs:?}");
        // A sphere of 6 cells: most of what it covers is cut.
        for rank in &report.by_rank {
            assert!((1..rank.covered_cells).contains(&rank.segments), "{rank:?}");
            assert!((rank.covered_cells / 2..rank.covered_cells).contains(&rank.cut_cells), "{rank:?}");
        }
        let with = costs.roofline_fraction_with_particles.unwrap() / report.roofline_fraction;
        assert!((1.01..1.2).contains(&with), "{with}");
    }

    #[test]
    fn a_contact_has_a_cost_only_where_there_are_as_many_as_particles() {
        assert_eq!(per_contact(1e6, 500.0, 500.0), Some(2000.0));
        assert_eq!(per_contact(1e6, 499.0, 500.0), None);
        assert_eq!(per_contact(0.0, 0.0, 0.0), None);
    }

    #[test]
    fn a_fluid_without_particles_has_the_cost_of_its_cells_alone() {
        let options =
            BenchOptions { steps: 2, warm_up: 2, no_contact: false, fluid_only: true, allow_engine: false };
        let report = bench(&setup(1), &options).unwrap();
        let costs = &report.costs;
        assert_eq!(costs.fluid_only_mlups, Some(report.mlups));
        assert!((costs.nanoseconds_per_fluid_cell.unwrap() * report.mlups / 1e3 - 1.0).abs() < 1e-12);
        let none = [
            costs.four_way_over_fluid_only,
            costs.dem_share,
            costs.nanoseconds_per_covered_cell,
            costs.nanoseconds_per_contact,
            costs.roofline_fraction_with_particles,
        ];
        assert_eq!(none, [None; 5]);
    }

    #[test]
    fn a_dry_case_has_at_most_the_cost_of_a_contact() {
        let (fluid, dry) = (CASE.find("[fluid]").unwrap(), CASE.find("[[particles]]").unwrap());
        let text = CASE.replace(&CASE[fluid..dry], "[dry]\nimpact_speed = 0.3\nenlargement = 1e-4\n");
        let setup = from_text(&text.replace("enlargement = 0.5", ""), "dry", &["run.threads=1".to_string()]);
        let mut setup = setup.unwrap();
        for (particle, way) in setup.particles.iter_mut().zip([0.1, -0.1].into_iter().cycle()) {
            particle.velocity = [way, 0.0, 0.0];
        }
        let options =
            BenchOptions { steps: 2, warm_up: 16, no_contact: false, fluid_only: false, allow_engine: false };
        let report = bench(&setup, &options).unwrap();
        let costs = &report.costs;
        assert!(report.contacts > 0);
        assert_eq!(costs.nanoseconds_per_contact.is_some(), report.contacts >= report.particles);
        assert!(costs.fluid_only_mlups_samples.is_empty());
        let none = [
            costs.fluid_only_mlups,
            costs.four_way_over_fluid_only,
            costs.dem_share,
            costs.nanoseconds_per_fluid_cell,
            costs.nanoseconds_per_covered_cell,
            costs.roofline_fraction_with_particles,
        ];
        assert_eq!(none, [None; 6]);
    }
}
