//! The box: its cells, and whether the particles fit in.

use super::checks::Document;
use super::dry;
use super::file::{Entry, LatticeSection, Size};
use super::kinds::Kinds;
use crate::coupling::Method;
use crate::domain::Domain;
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, PrescribedMotion, Template};
use crate::shape::{Passage, Shape};

/// More cells than any machine of today holds.
const MAX_CELLS: f64 = 1e12;
/// Edge of a box (m), and the same over the diameter of the particles (-), from which the unit is asked for.
const DOUBTFUL_EDGE: f64 = 1.0;
const DOUBTFUL_DIAMETERS: f64 = 200.0;
/// Difference of directions, and of lengths over the length, that is rounding.
const ALIGNED: f64 = 1e-9;
/// Fewest cells across a body with which the fluid resolves it.
const THINNEST_CELLS: f64 = 4.0;

/// The box in cells; what had to be rounded goes to `warnings`. Without a lattice the cells are those of a dry run.
pub(super) fn domain(
    document: &Document,
    lattice: Option<&LatticeSection>,
    kinds: &Kinds,
    warnings: &mut Vec<String>,
) -> Result<Domain> {
    let (diameter, key) = (kinds.diameter, "domain.size");
    // The unit of the edges in metres and in diameters.
    let (edges, unit, relative) = match &document.case.domain.size {
        Size::Metres(edges) => (*edges, 1.0, diameter),
        Size::Relative(relative) => (relative.diameters, diameter, 1.0),
    };
    let per_diameter = match lattice {
        Some(lattice) => lattice.cells_per_diameter,
        None => diameter / dry::cell(edges.map(|edge| unit * edge), &kinds.templates),
    };
    let dx = diameter / per_diameter;
    let doubt = match &document.case.domain.size {
        Size::Metres(edges) => doubtful_size(*edges, diameter),
        Size::Relative(_) => None,
    };
    // Without the detour by metres a box in diameters is free of rounding.
    let exact = edges.map(|edge| edge / relative * per_diameter);
    if exact.iter().map(|cells| cells.max(1.0)).product::<f64>() > MAX_CELLS {
        let title = format!("the box has more than {MAX_CELLS:e} cells");
        let remedy = doubt.unwrap_or_else(|| match lattice {
            Some(_) => "take a smaller `domain.size` or fewer `lattice.cells_per_diameter`".to_string(),
            None => "take a smaller `domain.size` or larger particles".to_string(),
        });
        return Err(document.error(key, &title, "too large", &remedy));
    }
    if let Some(doubt) = doubt {
        let [x, y, z] = edges;
        let title = format!(
            "the box is {x} x {y} x {z} m, more than {DOUBTFUL_DIAMETERS} diameters of its particles wide"
        );
        warnings.push(document.warning(key, &title, "in metres", &doubt));
    }
    let cells = exact.map(|cells| cells.round().max(1.0) as usize);
    let domain = Domain { faces: Domain::faces(document.case.domain.periodic), cells, dx };
    if (0..3).any(|i| (exact[i] - cells[i] as f64).abs() > 1e-9 * exact[i]) {
        let used = domain.size();
        let (x, y, z) = (used.x, used.y, used.z);
        warnings.push(document.warning(
            key,
            &format!("the box is not a whole number of cells; it is {x:.6e} x {y:.6e} x {z:.6e} m here"),
            &format!("rounded to {} x {} x {} cells of {dx:.6e} m", cells[0], cells[1], cells[2]),
            "volume fractions are those of the rounded box; a `domain.size` in multiples of the cell is exact",
        ));
    }
    if lattice.is_some() {
        warn_of_what_is_too_thin(document, kinds, dx, warnings);
    }
    Ok(domain)
}

/// Asks for the unit of edges (m) that are very long for particles of this diameter (m).
fn doubtful_size(edges: [f64; 3], diameter: f64) -> Option<String> {
    let shortest = edges.iter().copied().fold(f64::INFINITY, f64::min);
    let doubtful = shortest >= DOUBTFUL_EDGE && shortest > DOUBTFUL_DIAMETERS * diameter;
    let [diameters, millimetres] =
        ["", "e-3"].map(|unit| edges.map(|edge| format!("{edge}{unit}")).join(", "));
    doubtful.then(|| {
        format!(
            "lengths are in metres: are diameters meant, size = {{ diameters = [{diameters}] }}, or millimetres, \
             size = [{millimetres}]?"
        )
    })
}

/// An edge of the box that is a whole number of cells and at least `length` (m), with enough digits to stay one.
fn whole_cells(domain: &Domain, diameter: f64, length: f64) -> String {
    let cells = (length / domain.dx).ceil();
    let edge = if cells * domain.dx < length { cells + 1.0 } else { cells } * domain.dx;
    let [metres, diameters] = [edge, edge / diameter].map(|edge| {
        let text = format!("{edge:.10e}");
        let (digits, exponent) = text.split_once('e').expect("a number in scientific notation");
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        if exponent == "0" { digits.to_string() } else { format!("{digits}e{exponent}") }
    });
    format!("{metres} m or {diameters} diameters")
}

/// Largest distance of a point of a body from its centre (m), of one that goes through the box from its axis.
fn width_of(shape: &dyn Shape) -> f64 {
    shape.passage().map_or_else(|| shape.circumradius(), |passage| passage.radius)
}

/// Refuses bodies that go through the box, but are not as long as it, turn about another axis, lie askew, are placed at random, or are moved
/// by an external engine.
pub(super) fn refuse_passages(
    document: &Document,
    domain: &Domain,
    (templates, sections): (&[Template], &[usize]),
    (motions, engine): (&[PrescribedMotion], &EngineChoice),
    particles: &[Particle],
) -> Result<()> {
    let at_random = |section: usize| {
        let kind = &document.case.particles[section];
        kind.is_random() && !kind.is_empty()
    };
    for (template, (Template { shape, .. }, section)) in templates.iter().zip(sections).enumerate() {
        let Some(Passage { axis, along, length, .. }) = shape.passage() else { continue };
        let (name, edge, motion) = (["x", "y", "z"][axis], domain.size()[axis], &motions[*section]);
        let key = |key: &str| format!("particles.{section}{key}");
        let turns = motion.angular_velocity.largest();
        let askew = |particle: &&Particle| {
            let lies = particle.orientation() * along;
            particle.template == template as u64 && (lies - Vec3::ith(axis, 1.0)).norm() > ALIGNED
        };
        let turned = |entry: &Entry| match entry {
            Entry::Position(_) => false,
            Entry::Moving(moving) => (0..3).any(|i| i != axis && moving.angular_velocity[i] != 0.0),
        };
        let (at, title, remedy) = if !domain.is_periodic(axis) {
            let remedy = "between walls a body of their distance touches both; remove the key".to_string();
            (key(".through"), format!("the box is not periodic in {name}"), remedy)
        } else if (length - edge).abs() > ALIGNED * edge {
            let title = format!("the body is {length} m long, but the box {edge} m in {name}");
            (key(".shape"), title, format!("make it {edge} m long"))
        } else if *engine != EngineChoice::Native {
            let title = "only the native engine has bodies that go through the box".to_string();
            (key(".through"), title, "take dem.engine = \"native\"".to_string())
        } else if (0..3).any(|i| i != axis && turns[i] != 0.0) {
            let title = format!("bodies that go through the box in {name} turn about {name} alone");
            (key(".motion"), title, "remove the other components of `angular_velocity`".to_string())
        } else if let Some(entry) = document.case.particles[*section].list().iter().position(turned) {
            let title = format!("bodies that go through the box in {name} turn about {name} alone");
            let remedy = "remove the other components of its `angular_velocity`".to_string();
            (key(&format!(".list.{entry}")), title, remedy)
        } else if at_random(*section) {
            let title = "bodies that go through the box are not placed at random".to_string();
            (key(".through"), title, "give their places in `list` or `file`".to_string())
        } else if let Some(particle) = particles.iter().find(askew) {
            let title =
                format!("particle {} goes through the box in {name}, but does not lie along it", particle.id);
            (key(""), title, format!("turn it about {name} alone: its z axis is along {name} already"))
        } else {
            continue;
        };
        return Err(document.error(&at, &title, "not through this box", &remedy));
    }
    Ok(())
}

/// Length (m) that periodic directions must have for a body that reaches `reach` (m) from its centre with contacts, which it has or not:
/// it may not overlap images of itself, and an engine does not look at all images. An external one looks at the nearest alone.
fn least_edge(shape: &dyn Shape, reach: Option<f64>, engine: &EngineChoice) -> f64 {
    let width = 2.0 * width_of(shape);
    match (engine, reach) {
        // What it reaches beyond its surface is a small part of the box, also of one that goes through it.
        (EngineChoice::Native, reach) => {
            let beyond = reach.map_or(0.0, |reach| reach - shape.circumradius());
            width.max((width + 2.0 * beyond) / Domain::MOST_REACH)
        }
        (_, reach) => 2.0 * width.max(2.0 * reach.unwrap_or(0.0)),
    }
}

/// A body may not be larger than the box, and must fit between walls. `reaches` (m) are those of the templates, grown for contacts; 0 of
/// those without particles. For an external engine a body may not be larger than half the box; the remedy then has room for
/// [two bodies](refuse_double_contacts) of the largest kind, if they touch each other.
pub(super) fn refuse_what_is_too_large(
    document: &Document,
    kinds: &Kinds,
    domain: &Domain,
    (reaches, engine): (&[f64], &EngineChoice),
) -> Result<()> {
    let used = domain.size();
    let touching = |reach: f64| document.case.contact.enabled.then_some(reach);
    let widest = (kinds.templates.iter().zip(reaches))
        .filter(|(_, reach)| **reach > 0.0)
        .map(|(template, reach)| least_edge(&*template.shape, touching(*reach), engine))
        .fold(0.0, f64::max);
    for (index, kind) in kinds.sections.iter().enumerate() {
        let shape = format!("particles.{index}.shape");
        let unit = document.case.particles[index]
            .shape
            .doubtful_unit()
            .map_or(String::new(), |doubt| format!("; {doubt}"));
        let marks = [(&*shape, "too large for"), ("domain.size", "this box")];
        for template in kind.templates().filter(|template| reaches[*template] > 0.0) {
            let shape = &kinds.templates[template].shape;
            let (width, thickness) = (2.0 * width_of(&**shape), shape.thickness());
            let native = *engine == EngineChoice::Native;
            let least =
                if native { least_edge(&**shape, touching(reaches[template]), engine) } else { 2.0 * width };
            let along = shape.passage().map(|passage| passage.axis);
            for i in (0..3).filter(|i| Some(*i) != along) {
                let (edge, axis) = (used[i], ["x", "y", "z"][i]);
                if domain.is_periodic(i) && least > edge * (1.0 + 1e-9) {
                    let title = if native {
                        format!("a particle of {width} m is too large for the box, {edge:.6e} m in {axis}")
                    } else {
                        let half = 0.5 * edge;
                        format!(
                            "a particle of {width} m is larger than half the box, {half:.6e} m in {axis}, which the native engine \
                             alone knows"
                        )
                    };
                    let remedy = format!(
                        "make periodic directions at least {} wide{unit}",
                        whole_cells(domain, kinds.diameter, widest)
                    );
                    return Err(document.error_at(&marks, &title, &remedy));
                }
                if !domain.is_periodic(i) && thickness > edge * (1.0 + 1e-9) {
                    let title = format!(
                        "a particle {thickness:.6e} m thick does not fit between walls {edge:.6e} m apart in {axis}"
                    );
                    let remedy = format!("take a larger box or a smaller particle{unit}");
                    return Err(document.error_at(&marks, &title, &remedy));
                }
            }
        }
    }
    Ok(())
}

/// Refuses homogenised cells that two images of one body could share, each of which would receive all of their momentum.
pub(super) fn refuse_shared_cells(
    document: &Document,
    (kinds, reaches): (&Kinds, &[f64]),
    domain: &Domain,
    method: Method,
) -> Result<()> {
    let Method::Homogenised(_) = method else { return Ok(()) };
    // A cell more, by which a body moves at most in a step.
    let layer = 2.0 * (method.half_layer() + 1.0) * domain.dx;
    let present = kinds.templates.iter().zip(reaches).filter(|(_, reach)| **reach > 0.0);
    let widest = present.map(|(template, _)| 2.0 * width_of(&*template.shape)).fold(0.0, f64::max);
    let narrow = (0..3).find(|&i| domain.is_periodic(i) && domain.size()[i] < widest + layer);
    let Some(i) = narrow.filter(|_| widest > 0.0) else { return Ok(()) };
    let (edge, axis) = (domain.size()[i], ["x", "y", "z"][i]);
    let title = format!(
        "a particle of {widest} m shares homogenised cells with its own image in {axis}, {edge:.6e} m away"
    );
    let remedy = format!(
        "take `lattice.coupling = \"saturated\"`, or make periodic directions at least {} wide",
        whole_cells(domain, kinds.diameter, widest + layer)
    );
    Err(document.error_at(
        &[("lattice.coupling", "these cells"), ("domain.size", "this box")],
        &title,
        &remedy,
    ))
}

fn warn_of_what_is_too_thin(document: &Document, kinds: &Kinds, dx: f64, warnings: &mut Vec<String>) {
    let sections = kinds.sections.iter().enumerate();
    for (index, kind) in sections.filter(|(index, _)| document.case.has_particles(*index)) {
        let templates = kinds.templates[kind.templates()].iter();
        let thinnest =
            templates.map(|template| template.shape.thickness() / dx).fold(f64::INFINITY, f64::min);
        if thinnest < THINNEST_CELLS {
            let (key, cells) =
                (format!("particles.{index}.shape"), kinds.diameter / dx * THINNEST_CELLS / thinnest);
            let title = format!(
                "`{key}` is {thinnest:.2} cells thick, below {THINNEST_CELLS}: the fluid resolves it poorly"
            );
            // Rounded up, and so to more than there are.
            let remedy =
                format!("take lattice.cells_per_diameter = {:.1} or more", (10.0 * cells).ceil() / 10.0);
            warnings.push(document.warning(&key, &title, "thin", &remedy));
        }
    }
}

/// Refuses a box in which a pair could touch through two images: an external engine sees only the nearest one.
///
/// `reaches` (m) are those of the templates, grown for contacts.
pub(super) fn refuse_double_contacts(
    document: &Document,
    domain: &Domain,
    reaches: &[f64],
    (diameter, particles): (f64, &[Particle]),
) -> Result<()> {
    let mut widest: Vec<f64> = particles.iter().map(|p| reaches[p.template as usize]).collect();
    widest.sort_unstable_by(|a, b| b.total_cmp(a));
    let [largest, other, ..] = widest[..] else { return Ok(()) };
    let (size, needed) = (domain.size(), 2.0 * (largest + other));
    let Some(i) = (0..3).find(|&i| domain.is_periodic(i) && size[i] < needed) else {
        return Ok(());
    };
    let (edge, axis) = (size[i], ["x", "y", "z"][i]);
    let title = format!(
        "the box is {edge:.6e} m wide in {axis}, where two particles could touch through two periodic images at once, which the native engine alone \
         knows"
    );
    let remedy = format!(
        "make periodic directions at least {} wide: two particles reach {largest:.6e} m and {other:.6e} m from their \
         centres, contact enlargement included",
        whole_cells(domain, diameter, needed)
    );
    Err(document.error("domain.size", &title, "too narrow", &remedy))
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};
    use crate::error::{Error, Result};

    fn load(options: &[&str]) -> Result<Setup> {
        let text = "domain.size.diameters = [4, 4, 4]\n\
                    fluid = { density = 1000, viscosity = 1e-6 }\n\
                    lattice = { cells_per_diameter = 7, relaxation_time = 0.8 }\n\
                    driving = { gravity = 0 }\n\
                    run.end.steps = 1\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1.1e-3\n\
                    density = 1000.0\n\
                    count = 2\n";
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        from_text(text, "box", &options)
    }

    /// The edges that a refusal names, in metres and in diameters.
    fn suggested(options: &[&str]) -> [String; 2] {
        let Err(Error::Case { remedy, .. }) = load(options) else { panic!("{options:?} is refused") };
        let (_, rest) = remedy.split_once("at least ").unwrap_or_else(|| panic!("{remedy}"));
        let words: Vec<&str> = rest.split(' ').collect();
        assert_eq!([words[1], words[2], words[4]], ["m", "or", "diameters"], "{remedy}");
        let (metres, diameters) = (words[0], words[3]);
        [
            format!("domain.size=[{metres}, {metres}, {metres}]"),
            format!("domain.size={{ diameters = [{diameters}, {diameters}, {diameters}] }}"),
        ]
    }

    #[test]
    fn a_box_of_the_edge_that_a_refusal_names_is_taken_without_a_word() {
        let body = |shape: &str| format!("particles.0={{ {shape}, density = 1000, list = [[0, 0, 0]] }}");
        let sphere = body("shape.sphere.diameter = 1.1e-3");
        let capsule = body("shape.capsule = { diameter = 0.7e-3, length = 1.9e-3 }");
        let mut refused = 0;
        for size in ["[0.2e-3, 3e-3, 3e-3]", "{ diameters = [1, 1, 1] }", "{ diameters = [1.1, 3, 3] }"] {
            for (body, change) in [
                (&sphere, "contact.enlargement=0.2"),
                (&sphere, "contact.enlargement=2.9"),
                (&sphere, "contact.enabled=false"),
                (&capsule, "contact.substeps=2"),
            ] {
                let size = format!("domain.size={size}");
                if load(&[body, &size, change]).is_ok() {
                    continue;
                }
                refused += 1;
                for edges in suggested(&[body, &size, change]) {
                    let taken = load(&[body, &edges, change]).unwrap_or_else(|e| panic!("{edges}: {e}"));
                    let warnings = taken.provenance.warnings;
                    assert!(warnings.is_empty(), "{edges}: {warnings:?}");
                }
            }
        }
        assert_eq!(refused, 4 + 2 + 2);
    }

    #[test]
    fn a_kind_without_particles_needs_no_room_and_has_no_volume() {
        let none = load(&["particles.0.count=0", "domain.size={ diameters = [1, 1, 1] }"]).unwrap();
        assert!(none.volume_fraction == 0.0 && none.volume_fraction.is_sign_positive());
        assert!(none.impacts().is_empty() && none.resting_depths().is_empty());
    }

    #[test]
    fn unit_cells_of_one_or_two_bodies_are_taken_and_homogenised_cells_that_images_share_are_not() {
        let one = "particles=[{ shape.sphere.diameter = 1e-3, density = 2000, list = [[0, 0, 0]] }]";
        let cell = ["domain.size={ diameters = [1.053, 1.053, 1.053] }", one];
        let setup = load(&[&cell[..], &["lattice.cells_per_diameter=19"]].concat()).unwrap();
        assert!((setup.volume_fraction - 0.45).abs() < 0.01, "{}", setup.volume_fraction);
        let centred = "particles=[{ shape.sphere.diameter = 1e-3, density = 2000, list = [[0, 0, 0], [6e-4, 6e-4, 6e-4]] }]";
        load(&[centred, "domain.size={ diameters = [1.2, 1.2, 1.2] }", "lattice.cells_per_diameter=20"])
            .unwrap();
        let options = ["lattice.cells_per_diameter=19", "lattice.coupling=\"homogenised\""];
        let refused = load(&[&cell[..], &options].concat()).unwrap_err().to_string();
        assert!(refused.contains("shares homogenised cells with its own image in x"), "{refused}");
    }
}
