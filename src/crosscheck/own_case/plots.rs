//! Differences and statistics of a user's case over time: curves, and a table.

use super::compare::{Comparison, PARTED, Sample};
use crate::case::Setup;
use crate::crosscheck::Overlay;

/// The curves.
pub(super) fn overlays(setup: &Setup, found: &Comparison) -> Vec<Overlay> {
    let dt = setup.time_step;
    let curve = |name: &str, value: &dyn Fn(&Sample) -> f64| {
        let points = found.samples.iter().map(|s| [s.step as f64 * dt, value(s)]);
        (name.to_string(), points.collect::<Vec<_>>())
    };
    let both = |value: fn(&Sample) -> [f64; 2]| {
        vec![
            curve("native", &|s| value(s)[0]),
            curve("LIGGGHTS", &|s| value(s)[1]),
        ]
    };
    let overlay = |name: &str, title: &str, quantity: &str, logarithmic: bool, curves| Overlay {
        name: name.to_string(),
        title: format!("{}: {title}", setup.provenance.name),
        axes: ["time t (s)".to_string(), quantity.to_string()],
        logarithmic: [false, logarithmic],
        curves,
    };
    let speed = found.all.speed;
    let mut apart = vec![curve("distance / D", &|s| s.apart.position)];
    if speed > 0.0 {
        apart.push(curve("difference of velocity / u_max", &|s| {
            s.apart.velocity / speed
        }));
    }
    apart.push(curve("parted", &|_| PARTED));
    let mut overlays = Vec::new();
    // Zeros have no place on a logarithmic axis.
    if found.samples.iter().any(|s| s.apart.position > 0.0) {
        let title = "largest differences between the engines over all particles";
        overlays.push(overlay("apart", title, "difference (-)", true, apart));
    }
    let energy = both(|s| s.energy);
    overlays.push(overlay(
        "kinetic_energy",
        "mean kinetic energy of a particle",
        "energy E (J)",
        false,
        energy,
    ));
    if found.first_contact != [None; 2] {
        let contacts = both(|s| s.contacts.map(|n| n as f64));
        overlays.push(overlay(
            "contacts",
            "contacts",
            "number of contacts (-)",
            false,
            contacts,
        ));
        let overlap = both(|s| s.overlap);
        overlays.push(overlay(
            "overlap",
            "largest overlap",
            "overlap d / D (-)",
            false,
            overlap,
        ));
    }
    if found.samples.iter().any(|s| s.falling.iter().any(|v| *v != 0.0)) {
        let falling = both(|s| s.falling);
        overlays.push(overlay(
            "velocity",
            "mean velocity along gravity",
            "velocity u (m/s)",
            false,
            falling,
        ));
    }
    overlays
}

/// The same as a table, with its header.
pub(super) fn series(setup: &Setup, found: &Comparison) -> Vec<Vec<String>> {
    const HEADER: [&str; 14] = [
        "step (-)",
        "t (s)",
        "largest_distance_over_D (-)",
        "of_particle (-)",
        "largest_velocity_difference (m/s)",
        "largest_spin_difference (1/s)",
        "contacts_native (-)",
        "contacts_liggghts (-)",
        "mean_kinetic_energy_native (J)",
        "mean_kinetic_energy_liggghts (J)",
        "max_overlap_native (-)",
        "max_overlap_liggghts (-)",
        "mean_velocity_along_gravity_native (m/s)",
        "mean_velocity_along_gravity_liggghts (m/s)",
    ];
    let row = |s: &Sample| {
        let mut row = vec![
            s.step.to_string(),
            format!("{:?}", s.step as f64 * setup.time_step),
        ];
        row.extend([format!("{:?}", s.apart.position), s.apart.id.to_string()]);
        row.extend([s.apart.velocity, s.apart.spin].map(|x| format!("{x:?}")));
        row.extend(s.contacts.map(|n| n.to_string()));
        for pair in [s.energy, s.overlap, s.falling] {
            row.extend(pair.map(|x| format!("{x:?}")));
        }
        row
    };
    let header = HEADER.map(str::to_string).to_vec();
    std::iter::once(header)
        .chain(found.samples.iter().map(row))
        .collect()
}
