//! Numbers of the lattice, of settling and of driven flows.

use super::diameters;
use crate::cli::terminal::{Row, row};
use turbid::case::{Bound, FluidSetup, Setup};
use turbid::engine::EngineChoice;
use turbid::fluid::Collision;

/// A velocity in lattice units.
fn on_lattice(setup: &Setup, velocity: f64) -> String {
    let lattice = velocity / setup.units().velocity();
    format!("on the lattice {lattice:.5}, Mach {:.4}", 3.0_f64.sqrt() * lattice)
}

/// Gaps whose forces the lattice does not resolve, or to which lubrication is added.
fn gap_row(setup: &Setup) -> Option<Row> {
    let particles = setup.expected_particles();
    if particles == 0 || particles.saturating_add(setup.walls.len()) < 2 {
        return None;
    }
    let touch = setup.contact.as_ref().map_or(String::new(), |contact| {
        let gap = 2.0 * contact.enlargement;
        format!("; surfaces touch at {gap:.3e} m, {:.2} cells", gap / setup.domain.dx)
    });
    if let Some(film) = setup.contact.as_ref().and_then(|contact| contact.lubrication) {
        let radii = film.roughness / (0.5 * setup.diameter);
        let remark = format!(
            "{} cells; down to the roughness of {:.3e} m, {radii:.1e} radii{touch}",
            film.unresolved.range, film.roughness
        );
        return Some(row("lubrication below", format!("{:.3e} m", film.range()), remark));
    }
    let native = matches!(setup.engine, EngineChoice::Native) && setup.contact.is_some();
    let mut shapes = setup.templates.iter().map(|template| &template.shape);
    let films =
        native && shapes.all(|shape| shape.as_sphere().or(shape.as_ellipsoid().map(|axes| axes.x)).is_some());
    let without = if films { " without `contact.lubrication`" } else { "" };
    let remark = format!("one cell: forces in narrower gaps are too weak{without} (docs/limits.md){touch}");
    Some(row("unresolved gaps", format!("{:.3e} m", setup.domain.dx), remark))
}

/// The flow that a body acceleration drives, and the controller of the net flux.
fn driven_rows(setup: &Setup, fluid: &FluidSetup) -> Vec<Row> {
    let mut rows = Vec::new();
    if let Some(flow) = setup.driven_flow() {
        let bound = match flow.bound {
            Bound::Run => "at the end of the run, were it free",
            Bound::Walls => "between its walls",
            Bound::Bodies => "by the drag of the bodies at rest",
        };
        let remark = format!("by body_acceleration, at most, {bound}; {}", on_lattice(setup, flow.speed));
        rows.push(row("driven flow", format!("{:.6e} m/s", flow.speed), remark));
        let reynolds = flow.speed * flow.length / fluid.viscosity;
        let remark = format!("over {:.4e} m", flow.length);
        rows.push(row("Re of that flow", format!("{reynolds:.4}"), remark));
    }
    let axes: Vec<&str> = (["x", "y", "z"].into_iter().zip(fluid.net_flux))
        .filter_map(|(axis, flux)| flux.map(|_| axis))
        .collect();
    let target = fluid.net_flux.map(Option::unwrap_or_default);
    let vanishes = target.iter().all(|&flux| flux == 0.0);
    rows.push(if axes.is_empty() {
        row("zero_net_flux", "off", "the mean volume flux is free")
    } else {
        let kept = |axis: usize| match setup.resistance_rate(fluid, axis) {
            None => format!("at a rate of {:.3e} 1/s", fluid.control_rate),
            Some(rate) => format!("within some 150 steps against a resistance of {rate:.3e} 1/s"),
        };
        let mut ways: Vec<String> = (0..3).filter(|&a| fluid.net_flux[a].is_some()).map(kept).collect();
        ways.dedup();
        let what = if vanishes {
            "removes the mean volume flux along these".to_string()
        } else {
            format!(
                "keeps a mean volume flux of ({:.3e}, {:.3e}, {:.3e}) m/s",
                target[0], target[1], target[2]
            )
        };
        let name = if vanishes { "zero_net_flux" } else { "net_flux" };
        row(name, axes.join(", "), format!("a controller {what}, {}", ways.join("; ")))
    });
    rows
}

/// Numbers of the lattice and of settling.
pub(super) fn rows(setup: &Setup, fluid: &FluidSetup) -> Vec<Row> {
    let scales = &fluid.scales;
    let collision = match fluid.collision {
        Collision::Bgk => "one relaxation time".to_string(),
        Collision::Trt { magic } => format!("two relaxation times, magic parameter {magic:.5}"),
        Collision::RecursiveRegularised { smagorinsky, .. } if smagorinsky > 0.0 => {
            format!("recursive regularised, eddies with Smagorinsky's constant {smagorinsky}")
        }
        Collision::RecursiveRegularised { .. } => "recursive regularised".to_string(),
    };
    let (least, most) = diameters(setup);
    let of_diameter = if most - least > 1e-9 * most {
        format!(
            "of the first kind as its shape has it, by which all is scaled; particles have {least:.4e} to {most:.4e} m"
        )
    } else {
        "of the sphere of equal volume".to_string()
    };
    let mut rows = vec![
        row("density ratio", format!("{:.5}", scales.density_ratio), ""),
        row("diameter", format!("{:.6e} m", setup.diameter), of_diameter),
        row("cells per diameter", format!("{:.3}", setup.diameter / setup.domain.dx), ""),
        row("cell", format!("{:.6e} m", setup.domain.dx), ""),
        row("time step", format!("{:.6e} s", setup.time_step), ""),
        row("relaxation time", format!("{:.5}", fluid.relaxation_time), format!("time steps; {collision}")),
        row("coupling", fluid.coupling.name(), fluid.coupling.to_string()),
        row("viscosity", format!("{:.6e} m^2/s", fluid.viscosity), "kinematic"),
    ];
    rows.extend(gap_row(setup));
    rows.extend(driven_rows(setup, fluid));
    let averages = format!("averages from step {}", setup.plan.average_from_step);
    if !scales.stokes_time.is_finite() {
        rows.push(row("steps", setup.plan.end_step.to_string(), averages));
        return rows;
    }
    let on_lattice = |u: f64| on_lattice(setup, u);
    let star = scales.schiller_naumann_velocity;
    let per_stokes_time = scales.stokes_time / setup.time_step;
    let stokes_times = setup.plan.end_step as f64 / per_stokes_time;
    rows.extend([
        row("Archimedes number", format!("{:.4}", scales.archimedes), ""),
        row("u_Stokes", format!("{:.6e} m/s", scales.stokes_velocity), on_lattice(scales.stokes_velocity)),
        row("u* (one sphere)", format!("{star:.6e} m/s"), format!("Schiller-Naumann; {}", on_lattice(star))),
        row("Re at u*", format!("{:.4}", scales.schiller_naumann_reynolds), ""),
        row(
            "steps per t*",
            format!("{per_stokes_time:.2}"),
            format!("t* = D / u_Stokes = {:.6e} s", scales.stokes_time),
        ),
        row("steps", setup.plan.end_step.to_string(), format!("{stokes_times:.2} t*, {averages}")),
    ]);
    rows
}
