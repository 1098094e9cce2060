//! The commands that set LAMMPS up: `pair_style granular` with Hertz's law, Tsuji's damping and Mindlin's friction, adhesion by `dmt` and
//! `jkr`, and planes as walls.
//!
//! LAMMPS takes a polynomial of the coefficient of restitution that it is given for the damping; [`tsuji`] inverts it. Its one coefficient of
//! friction is the kinetic one; radii are those of contacts, enlargement included.

use std::f64::consts::PI;
use std::ffi::CString;
use std::path::PathBuf;
use turbid_core::contact::{CohesionLaw, FrictionLaw, Material};
use turbid_process::{AXES, ContactSection, Outcome, SetUp, SphereKind, SurfaceSection, sliding_plane};

/// Distance beyond contact within which pairs are listed, over the smallest radius.
const SKIN: f64 = 0.3;

/// Largest number whose damping is found; the polynomial vanishes at 1.00065.
const MOST: f64 = 1.001;

/// LAMMPS's polynomial for the damping, ascending.
const POLYNOMIAL: [f64; 7] = [1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218];

/// The commands of the set-up.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    /// Commands before there is a box.
    pub(crate) before: Vec<String>,
    /// Commands that make the box; a restart file brings its own.
    pub(crate) space: Vec<String>,
    /// Commands that need the particles.
    pub(crate) last: Vec<String>,
    /// Fixes of the walls, and the indices of these.
    pub(crate) walls: Vec<(CString, usize)>,
    /// File for the log of the set-up.
    pub(crate) log_file: Option<PathBuf>,
}

/// The commands for a case, with the kinds of its spheres and the blocks of its processes along each axis, the first one fastest.
pub(crate) fn plan(case: &SetUp, kinds: &[SphereKind], grid: [usize; 3]) -> Outcome<Plan> {
    let texts = |commands: &[&str]| -> Vec<String> { commands.iter().map(ToString::to_string).collect() };
    let axes = case.domain.periodic.map(|periodic| if periodic { "p" } else { "f" }).join(" ");
    let mut before = texts(&[
        "units si",
        "atom_style sphere",
        "atom_modify map array sort 0 0.0",
        "newton off",
        &format!("boundary {axes}"),
        "comm_modify vel yes",
    ]);
    if grid != [1; 3] {
        let [x, y, z] = grid;
        before.push(format!("processors {x} {y} {z} map xyz"));
    }
    let ([x, y, z], contact) = (case.domain.size, case.contact.as_ref());
    let types = contact.map_or(1, |contact| contact.materials.len());
    let space = texts(&[
        &format!("region box block 0 {x:e} 0 {y:e} 0 {z:e} units box"),
        &format!("create_box {types} box"),
    ]);
    let smallest = kinds.iter().map(|kind| kind.radius).fold(f64::INFINITY, f64::min);
    let mut last = texts(&[
        &format!("neighbor {:e} bin", SKIN * smallest),
        "neigh_modify delay 0 every 1 check yes",
        "pair_style granular",
    ]);
    for a in 0..types {
        for b in a..types {
            let law = match contact {
                Some(contact) => law(contact, a, b)?,
                None => "hertz 1.0 1.0 tangential mindlin 1.0 1.0 0.0".to_owned(),
            };
            last.push(format!("pair_coeff {} {} {law}", a + 1, b + 1));
        }
    }
    let mut walls = Vec::new();
    match contact {
        Some(contact) => walls = add_walls(case, contact, &mut last)?,
        None => last.push("neigh_modify exclude group all all".to_owned()),
    }
    last.extend(texts(&[
        // After the walls, whose torques its callback scales too.
        "fix loads all external pf/callback 1 1",
        "fix motion all nve/sphere",
        "thermo_style custom step",
        "thermo 1000000000",
        // Turbid says which one.
        "thermo_modify lost ignore",
        "compute pairs all property/local patom1 patom2 cutoff radius",
        "compute forces all pair/local fx fy fz p1 p2 p3 cutoff radius",
    ]));
    let log_file = case.options["log_file"].as_str().map(PathBuf::from);
    Ok(Plan { before, space, last, walls, log_file })
}

/// Adds the fixes of all walls, one for each material of particles.
fn add_walls(
    case: &SetUp,
    contact: &ContactSection,
    commands: &mut Vec<String>,
) -> Outcome<Vec<(CString, usize)>> {
    let (mut walls, types) = (Vec::new(), contact.materials.len());
    commands.extend((1..=types).map(|kind| format!("group material{kind} type {kind}")));
    for (index, wall) in case.walls.iter().enumerate() {
        let cannot = |why| format!("wall `{}`: LAMMPS's {why}", wall.name);
        let SurfaceSection::Plane { point, normal } = wall.surface else {
            return Err(cannot("walls are planes"));
        };
        let (axis, shear) = sliding_plane(wall, normal).map_err(cannot)?;
        let mut place = [String::from("NULL"), String::from("NULL")];
        place[usize::from(normal[axis] < 0.0)] = format!("{:e}", point[axis]);
        for kind in 1..=types {
            let (fix, law) = (format!("wall{index}_{kind}"), law(contact, kind - 1, wall.material)?);
            commands.push(format!(
                "fix {fix} material{kind} wall/gran granular {law} {}plane {}{shear} contacts",
                AXES[axis],
                place.join(" ")
            ));
            walls.push((CString::new(fix).map_err(|e| e.to_string())?, index));
        }
    }
    Ok(walls)
}

/// Coefficients of `granular` for two materials, given by their indices.
fn law(contact: &ContactSection, a: usize, b: usize) -> Outcome<String> {
    let (materials, pair) = ([&contact.materials[a], &contact.materials[b]], contact.pair(a, b));
    let compliance = |m: &Material| (1.0 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus;
    let shear = |m: &Material| 2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.youngs_modulus;
    let e_star = 1.0 / materials.map(compliance).iter().sum::<f64>();
    let g_star = 1.0 / materials.map(shear).iter().sum::<f64>();
    // LIGGGHTS's damping along the surface: in proportion to the roots of the stiffnesses.
    let tangential = (4.0 * g_star / e_star).sqrt();
    let friction = if pair.friction_static > 0.0 { pair.friction_kinetic } else { 0.0 };
    let spring = if contact.friction == FrictionLaw::Mindlin { "mindlin_rescale/force" } else { "mindlin" };
    let damping = tsuji(pair.restitution)?;
    let adhesive = |name: &str| {
        // With Poisson's ratio 0 the modulus is E / 2 for pairs and at walls; LAMMPS has the surface energy, half of the work of adhesion.
        format!("{name} {:e} {damping:e} 0.0 {:e}", 2.0 * e_star, pair.work_of_adhesion / 2.0)
    };
    let normal = match contact.cohesion {
        CohesionLaw::None => format!("hertz {:e} {damping:e}", 4.0 / 3.0 * e_star),
        CohesionLaw::Dmt => adhesive("dmt"),
        CohesionLaw::Jkr => adhesive("jkr"),
        CohesionLaw::Sjkr => return Err("LAMMPS has no cohesion \"sjkr\"".to_owned()),
    };
    Ok(format!("{normal} tangential {spring} {:e} {tangential:e} {friction:e} damping tsuji", 8.0 * g_star))
}

/// The number that LAMMPS must be given for a coefficient of restitution.
///
/// Of Hertz's law with a dashpot `c sqrt(m F / d)` the damping is exactly `c = sqrt(5) beta`, `beta = -ln e / sqrt(ln^2 e + pi^2)`.
fn tsuji(restitution: f64) -> Outcome<f64> {
    let log = restitution.ln();
    let wanted = -5.0_f64.sqrt() * log / log.hypot(PI);
    if wanted > POLYNOMIAL[0] {
        return Err(format!(
            "a coefficient of restitution of {restitution} is too small: LAMMPS has those from 0.12"
        ));
    }
    let (mut low, mut high) = (0.0, MOST);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        (low, high) = if damping(middle) > wanted { (middle, high) } else { (low, middle) };
    }
    Ok(low)
}

/// The damping that LAMMPS takes for a number, over `sqrt(k m)` (-).
fn damping(number: f64) -> f64 {
    POLYNOMIAL.iter().rev().fold(0.0, |sum, coefficient| sum * number + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restitution_becomes_the_number_that_has_its_damping() {
        // Measured: impacts of spheres in LAMMPS.
        for (restitution, number) in [(0.9, 0.86212), (0.8, 0.72923), (0.5, 0.36665)] {
            let found = tsuji(restitution).unwrap();
            assert!((found - number).abs() < 1e-5, "{restitution}: {found}");
        }
        assert!(damping(tsuji(1.0).unwrap()).abs() < 1e-14);
        assert!(tsuji(0.1).unwrap_err().contains("from 0.12"));
    }
}
