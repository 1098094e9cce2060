//! Rows on shapes and walls before a run.

use crate::cli::terminal::{Row, row};
use turbid::case::Setup;
use turbid::case::insertion::{Amount, RemovedFrom};

/// Templates and walls that get a row of their own.
const SHOWN: usize = 8;
/// Sizes of a section that their own rows say enough of.
const SIZES_SHOWN: usize = 2;

/// Number of the particles of each template, those that come during the run included.
fn counts(setup: &Setup) -> Vec<usize> {
    let mut counts = vec![0_usize; setup.templates.len()];
    for (template, count) in setup.expected_counts() {
        counts[template] = counts[template].saturating_add(count);
    }
    counts
}

/// One row for each kind and size of particle, and one for each section with several sizes.
pub(super) fn particle_rows(setup: &Setup) -> Vec<Row> {
    let counts = counts(setup);
    let sections = setup.sections.iter().max().map_or(0, |last| last + 1);
    let mut rows = shape_rows(setup, &counts);
    rows.extend((0..sections).filter_map(|section| size_row(setup, &counts, section)));
    rows
}

fn shape_rows(setup: &Setup, counts: &[usize]) -> Vec<Row> {
    let one = |index: usize| {
        let (template, count) = (&setup.templates[index], counts[index]);
        let shape = &template.shape;
        let diameter = shape.equivalent_diameter();
        let aspect = 2.0 * shape.circumradius() / shape.thickness();
        let cells = setup.fluid.as_ref().map_or_else(String::new, |_| {
            format!(", {:.2} cells thick", shape.thickness() / setup.domain.dx)
        });
        let speed = setup.motions[index].largest_speed(shape.circumradius());
        let motion = match &setup.motions[index] {
            motion if motion.is_free() => String::new(),
            motion if motion.is_complete() && speed == 0.0 => ", fixed".to_string(),
            _ => format!(", motion prescribed: surface up to {speed:.4e} m/s"),
        };
        let parts = match shape.parts().len() {
            0 => String::new(),
            parts => format!(", {parts} convex parts"),
        };
        let remark = format!(
            "{count} of volume {:.4e} m^3, diameter of that sphere {diameter:.4e} m, length over thickness {aspect:.2}{parts}{cells}{motion}",
            shape.volume()
        );
        row("shape", shape.kind().to_string(), remark)
    };
    let mut rows: Vec<Row> = (0..counts.len().min(SHOWN)).map(one).collect();
    if setup.templates.len() > SHOWN {
        rows.push(row("", format!("and {} more", setup.templates.len() - SHOWN), ""));
    }
    rows
}

/// The distribution of a section with several sizes.
fn size_row(setup: &Setup, counts: &[usize], section: usize) -> Option<Row> {
    let own = |(template, count): &(usize, usize)| setup.sections[*template] == section && *count > 0;
    let mut sizes: Vec<[f64; 2]> = (counts.iter().copied().enumerate())
        .filter(own)
        .map(|(template, count)| {
            let shape = &setup.templates[template].shape;
            [shape.equivalent_diameter(), count as f64 * shape.volume()]
        })
        .collect();
    if sizes.len() <= SIZES_SHOWN {
        return None;
    }
    sizes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let whole: f64 = sizes.iter().map(|[_, volume]| volume).sum();
    let below = |part: f64| {
        let mut sum = 0.0;
        let reached = sizes.iter().find(|[_, volume]| {
            sum += volume;
            sum >= part * whole
        });
        reached.or(sizes.last()).map_or(0.0, |[diameter, _]| *diameter)
    };
    let surface: f64 = sizes.iter().map(|[diameter, volume]| volume / diameter).sum();
    let remark = format!(
        "of particles.{section}, {:.4e} to {:.4e} m; 10, 50, 90 % of the mass up to {:.4e}, {:.4e}, {:.4e} m; Sauter mean {:.4e} m",
        sizes[0][0],
        sizes[sizes.len() - 1][0],
        below(0.1),
        below(0.5),
        below(0.9),
        whole / surface
    );
    Some(row("sizes", sizes.len().to_string(), remark))
}

/// Rows on particles that come and go, and on the volume fraction with all that come.
pub(super) fn change_rows(setup: &Setup) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut solid = setup.volume_fraction * setup.free_volume;
    for (n, insertion) in setup.insertions.iter().enumerate() {
        let count = insertion.expected(setup.plan.end_step, setup.time_step);
        let volume = count as f64 * insertion.volume;
        solid += volume;
        let amount = match insertion.amount {
            Amount::Rate(rate) => format!("{rate:.4e} per second"),
            Amount::VolumeFraction(fraction) => {
                format!("to a volume fraction of {fraction} in the region, about")
            }
        };
        let from = insertion.steps[0] as f64 * setup.time_step;
        let remark = format!(
            "of particles.{}, {volume:.4e} m^3, from {from:.4} s on: {amount}, every {} steps, as far as there is room",
            insertion.section, insertion.every
        );
        rows.push(row(format!("insertion {n}"), count.to_string(), remark));
    }
    for (n, removal) in setup.removals.iter().enumerate() {
        let what = match removal.from {
            RemovedFrom::Region(_) => "in a region",
            RemovedFrom::Plane(_) => "behind a plane",
            RemovedFrom::Outlet(_) => "at an outlet",
        };
        let of =
            removal.section.map_or("all free particles".to_string(), |n| format!("those of particles.{n}"));
        rows.push(row(format!("removal {n}"), what, of));
    }
    if !setup.insertions.is_empty() {
        let remark = if setup.removals.is_empty() { "" } else { "if none were removed" };
        rows.push(row("fraction at the end", format!("{:.5}", solid / setup.free_volume), remark));
    }
    rows
}

/// One row for each wall.
pub(super) fn wall_rows(setup: &Setup) -> Vec<Row> {
    let mut rows = Vec::new();
    for (number, wall) in setup.walls.iter().take(SHOWN).enumerate() {
        if let Some(remark) = setup.passage(number) {
            rows.push(row("face", wall.name.clone(), remark));
            continue;
        }
        let [v, w] = [&wall.motion.velocity, &wall.motion.angular_velocity]
            .map(|of| of.constant().unwrap_or_else(|| of.largest()));
        let mut motion = Vec::new();
        if !wall.motion.is_steady() {
            motion.push("varying, at most".to_string());
        }
        if v.norm() > 0.0 {
            motion.push(format!("velocity ({:.3e}, {:.3e}, {:.3e}) m/s", v.x, v.y, v.z));
        }
        if w.norm() > 0.0 {
            motion.push(format!("turns at ({:.3e}, {:.3e}, {:.3e}) 1/s", w.x, w.y, w.z));
        }
        if motion.is_empty() {
            motion.push("at rest".to_string());
        }
        let kind = wall
            .surface
            .mesh()
            .map_or_else(|| wall.surface.kind().to_owned(), |placed| placed.mesh.to_string());
        let remark = format!("{kind}, {}", motion.join(", "));
        rows.push(row("wall", wall.name.clone(), remark));
    }
    if setup.walls.len() > SHOWN {
        rows.push(row("", format!("and {} more", setup.walls.len() - SHOWN), ""));
    }
    rows
}
