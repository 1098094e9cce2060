//! Costs of a time step and memory of a run, for the estimates of `check`, `study` and `bench` and for the cuts of the box.
//!
//! Times of the stages by `turbid bench CASE --threads 1 --json` on a shared 2-core virtual machine (AMD EPYC), means over 25 to 100
//! steps, least of four runs; cells and covered cells with one thread on each of its cores, which share the memory. Processors with
//! wider registers are no faster where memory is the limit. The cuts depend on ratios only. `N` is cells per diameter, `ellipsoids` is `hindered_settling` with
//! axes 2 : 1 : 1.
//!
//! | constant | from |
//! |---|---|
//! | cell | a fluid of 216^3 cells on two threads: 236 MLUPS in f32, 118 in f64, 239 in f16 (AVX2) |
//! | covered cell | `fluid` + `map` less those of `--fluid-only`, over the covered cells and the time of a cell (AVX2, another machine): spheres 5.2 at N 10, 4.7 at N 9, 2.9 at N 18; `cubes_settling` 7.1, `stl_particles` 8; `shear_cell` (ellipsoids) 4.4 |
//! | particle | `dem` of `--no-contact` (60 ns) and the search for pairs (190 ns, `hindered_settling` at N 18 without a contact) |
//! | contact | rest of `dem` over the contacts: `hindered_settling` at volume fraction 0.3, `cubes_settling`, `ellipsoids`, and `hindered_settling` with `contact.geometry = "sampled"` |
//! | message, byte | `seconds_per_message` and `seconds_per_byte` of `mpirun -n 2 turbid bench hindered_settling.toml --json` |
//! | face | `halo` of `hindered_settling --fluid-only` over the cells of the four faces |

use crate::contact::{ContactModel, Geometry, sampled};
use crate::fluid::Precision;
use crate::particle::Template;
use crate::shape::Shape;

/// The value for populations in half, in single or in double precision.
pub(super) fn by_precision<V>(precision: Precision, half: V, single: V, double: V) -> V {
    match precision {
        Precision::F16 => half,
        Precision::F32 => single,
        Precision::F64 => double,
    }
}

/// A cell update (s).
pub(super) fn cell(precision: Precision) -> f64 {
    by_precision(precision, 8.4e-9, 8.5e-9, 17e-9)
}

/// Memory of a run per cell (bytes): 19 populations, and room for halos, solids and output.
pub fn bytes_per_cell(precision: Precision) -> f64 {
    by_precision(precision, 60.0, 110.0, 190.0)
}

/// A cell of a face: packing, unpacking (s).
pub(super) fn face(precision: Precision) -> f64 {
    by_precision(precision, 2.4e-9, 2.9e-9, 4.5e-9)
}

/// A particle on a rank, owned or ghost, with the search for pairs (s).
pub(super) const PARTICLE: f64 = 0.25e-6;

/// Time a message takes beyond that of its bytes (s), and time a byte takes (s). `mpirun -n 2 turbid bench` found 1.85 us and
/// 0.086 ns between processes of one machine (Open MPI 4.1); networks of clusters are about as fast.
pub(super) const MESSAGE: f64 = 2e-6;
/// See [`MESSAGE`].
pub(super) const BYTE: f64 = 0.1e-9;

/// Properties on which the cost of a body depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Sphere,
    /// Flat faces only.
    Flat,
    Ellipsoid,
    Other,
}

impl Form {
    pub(super) fn of(template: &Template) -> Self {
        let all = |is: fn(&dyn Shape) -> bool| template.parts().all(|(part, _)| is(&**part));
        if template.shape.as_sphere().is_some() {
            Self::Sphere
        } else if all(|part| part.as_polyhedron().is_some()) {
            Self::Flat
        } else if template.shape.as_ellipsoid().is_some() {
            Self::Ellipsoid
        } else {
            Self::Other
        }
    }

    /// Cost of a covered cell beyond that of one of the fluid (s).
    pub(super) fn covered_cell(self) -> f64 {
        match self {
            Self::Sphere | Self::Ellipsoid => 37e-9,
            Self::Flat => 63e-9,
            Self::Other => 119e-9,
        }
    }

    /// Returns true if the overlap of such bodies is found without sampling.
    fn has_overlap(self) -> bool {
        matches!(self, Self::Sphere | Self::Flat)
    }

    /// A contact of two bodies in one sub-step (s).
    pub(super) fn contact(self, other: Self, model: &ContactModel) -> f64 {
        let samples = match model.geometry {
            Geometry::Exact if self.has_overlap() && other.has_overlap() => {
                return if self == Self::Sphere && other == Self::Sphere { 0.17e-6 } else { 1e-6 };
            }
            Geometry::Exact => sampled::DEFAULT_SAMPLES,
            Geometry::Sampled { samples } => samples,
        };
        // One line per sample in two directions.
        let lines = f64::from(samples * samples) / 64.0;
        let sphere = self == Self::Sphere && other == Self::Sphere;
        lines * if sphere { 80e-6 } else { 300e-6 }
    }
}
