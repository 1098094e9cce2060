//! Profiles along the axes of the box, `profiles.csv`, and their means over time, `profile_means.csv`.

use super::means::Bins;
use super::series::{definitions, heads};
use std::sync::LazyLock;

/// Quantities of `profiles.csv`, one row per profile, time and bin: names, units and definitions of their columns. Number densities by section follow.
const QUANTITIES: &str = "\
profile (-): Number of the profile in `output.profiles`, from 0.
step (-): Steps done.
t (s): Time, `step * time_step`.
position (m): Middle of the bin along the axis.
solid_fraction (-): Volume of the bodies within the bin over that of the bin; bodies are cut at its ends, spheres and polyhedra exactly.
number_density (1/m^3): Particles whose centres are in the bin over its volume.
particle_velocity_{x,y,z} (m/s): Their mean velocity; empty without particles, as are the next two.
particle_velocity_variance_{xx,yy,zz,xy,xz,yz} (m^2/s^2): Mean of `(v_i - <v_i>) (v_j - <v_j>)`; a third of the trace is the granular temperature.
angular_velocity_{x,y,z} (1/s): Their mean angular velocity.
contact_stress_{xx,yy,zz,xy,xz,yz} (Pa): As in `series.csv`, of the contacts whose point is in the bin, over its volume; empty if the engine does not tell its contacts.
hydrodynamic_stress_{xx,yy,zz,xy,xz,yz} (Pa): As in `series.csv`, of the bodies whose centres are in the bin, over its volume; empty without \
    `hydrodynamic_stress = true` of the profile.
fluid_velocity_{x,y,z} (m/s): Mean over the part of the cells that no body covers; empty without a fluid, as are the next two.
fluid_velocity_variance_{xx,yy,zz,xy,xz,yz} (m^2/s^2): Mean of `(u_i - <u_i>) (u_j - <u_j>)` there.
pressure (Pa): Mean pressure there.
";

/// The bins of `profiles.csv`.
pub const BINS: Bins = Bins { keys: &["profile", "position"], time: "t", front: 4, independent: false };

/// Header of `profiles.csv`: name and unit of every column but those of the number densities by section.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));

/// Definition of every quantity, by the name of its column without the axis.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| definitions(QUANTITIES));

/// Head of the column of the number density of a section.
fn of_section(section: usize) -> String {
    format!("number_density_particles.{section} (1/m^3)")
}

/// Header of `profiles.csv` of a case with this number of sections of particles.
pub fn head(sections: usize) -> Vec<String> {
    COLUMNS.iter().cloned().chain((0..sections).map(of_section)).collect()
}
