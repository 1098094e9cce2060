//! Particle surfaces as VTK polygons (`.vtp`).
//!
//! Every particle is drawn once, at its wrapped position, so that counting connected surfaces counts particles. Point data, the same on
//! all points of a particle: `id`, `kind` (section of the case, counted from 0), `equivalent_diameter` (m), `velocity` and `speed`
//! (m/s), `angular_velocity` (1/s), `contact_force` (N). If all particles are smooth, exact `Normals` make coarse meshes look round.

use super::polydata::PolyData;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::shape::{Shape, SurfaceMesh};
use std::path::Path;

/// A surface has an edge where its normal turns by more than 30 degrees this close to a corner of a triangle, as part of
/// the way to its middle.
const CORNER: f64 = 1e-3;
const EDGE_COSINE: f64 = 0.866;

/// Refinement of the surfaces of a few particles.
const FINE: u32 = 2;
/// Most triangles of that refinement that a few particles have together: 312 spheres, 8333 cubes, some 5 MB in a file.
const FEW: usize = 100_000;

/// Triangles of the fine surfaces of particles, given as numbers of particles by template.
fn fine_triangles(templates: &[Template], counts: impl IntoIterator<Item = (usize, usize)>) -> usize {
    let each: Vec<usize> =
        (templates.iter()).map(|template| template.shape.surface_mesh(FINE).triangles.len()).collect();
    (counts.into_iter())
        .map(|(template, count)| each[template].saturating_mul(count))
        .fold(0, usize::saturating_add)
}

/// True if the surfaces of particles, given as numbers of particles by template, are small enough to be fine, and to be written by
/// default.
pub fn are_few(templates: &[Template], counts: impl IntoIterator<Item = (usize, usize)>) -> bool {
    fine_triangles(templates, counts) <= FEW
}

/// Estimated triangles in a file of the surfaces of these particles.
pub fn estimated_triangles(
    templates: &[Template],
    counts: impl IntoIterator<Item = (usize, usize)>,
) -> usize {
    let fine = fine_triangles(templates, counts);
    if fine > FEW { fine / 4 } else { fine }
}

/// Writes the surfaces of all `particles` with their velocities alone; each template is a kind of its own.
pub fn write_motion(
    path: &Path,
    domain: &Domain,
    templates: &[Template],
    particles: &[Particle],
) -> Result<()> {
    let sections: Vec<usize> = (0..templates.len()).collect();
    let one_each = particles.iter().map(|p| (p.template as usize, 1));
    let surfaces = ParticleSurfaces::new(templates, &sections, one_each);
    surfaces.data(domain, particles, false).write(path)
}

/// The surfaces of all kinds of particles of a run.
#[derive(Clone, Debug)]
pub struct ParticleSurfaces {
    /// By template.
    meshes: Vec<SurfaceMesh>,
    /// Of the points of the meshes, if all particles are smooth.
    normals: Option<Vec<Vec<Vec3>>>,
    /// By template (m).
    diameters: Vec<f64>,
    /// By template.
    sections: Vec<usize>,
}

impl ParticleSurfaces {
    /// As fine as their number allows: `counts` are numbers of particles of all ranks by template, `sections` the sections of the case
    /// that the templates are of.
    pub fn new(
        templates: &[Template],
        sections: &[usize],
        counts: impl IntoIterator<Item = (usize, usize)>,
    ) -> Self {
        let refinement = if are_few(templates, counts) { FINE } else { FINE - 1 };
        let meshes: Vec<SurfaceMesh> = (templates.iter()).map(|t| t.shape.surface_mesh(refinement)).collect();
        let with_shapes = || templates.iter().zip(&meshes);
        let smooth = with_shapes().all(|(t, mesh)| is_smooth(&*t.shape, mesh));
        let normals = smooth.then(|| {
            with_shapes()
                .map(|(t, mesh)| mesh.points.iter().map(|&p| t.shape.gradient(p)).collect())
                .collect()
        });
        Self {
            diameters: templates.iter().map(|t| t.shape.equivalent_diameter()).collect(),
            sections: sections.to_vec(),
            normals,
            meshes,
        }
    }

    /// The file of `particles`, with the `forces` of their contacts or with their motion alone.
    pub fn data(&self, domain: &Domain, particles: &[Particle], forces: bool) -> PolyData {
        let of = |particle: &Particle| &self.meshes[particle.template as usize];
        let mut data = PolyData::default();
        for particle in particles {
            let mesh = of(particle);
            let (centre, orientation) = (domain.wrap(particle.position()), particle.orientation());
            let points: Vec<u64> =
                (mesh.points.iter()).map(|corner| data.point(centre + orientation * corner)).collect();
            for triangle in &mesh.triangles {
                data.polygon(triangle.map(|corner| points[corner as usize]));
            }
        }

        // Every point of a particle has its values.
        let all = || particles.iter().flat_map(move |p| std::iter::repeat_n(p, of(p).points.len()));
        data.scalars("speed (m/s)", all().map(|p| p.velocity().norm()));
        data.integers("id", all().map(|p| p.id).collect());
        data.integers("kind", all().map(|p| self.sections[p.template as usize] as u32).collect());
        data.scalars("equivalent_diameter (m)", all().map(|p| self.diameters[p.template as usize]));
        data.vectors("velocity (m/s)", all().map(Particle::velocity));
        data.vectors("angular_velocity (1/s)", all().map(Particle::angular_velocity));
        if forces {
            data.vectors("contact_force (N)", all().map(|p| p.contact_force.into()));
        }
        if let Some(normals) = &self.normals {
            data.normals(particles.iter().flat_map(|p| {
                let orientation = p.orientation();
                (normals[p.template as usize].iter()).map(move |normal| orientation * normal)
            }));
        }
        data
    }
}

/// Returns true if the surface has no edges, as far as the mesh shows.
fn is_smooth(shape: &dyn Shape, mesh: &SurfaceMesh) -> bool {
    if shape.as_polyhedron().is_some() || !shape.parts().is_empty() {
        return false;
    }
    mesh.triangles.iter().all(|triangle| {
        let corners = triangle.map(|i| mesh.points[i as usize]);
        let middle = corners.iter().sum::<Vec3>() / 3.0;
        corners.iter().all(|corner| {
            let beside = shape.gradient(corner.lerp(&middle, CORNER));
            beside.dot(&shape.gradient(*corner)) > EDGE_COSINE
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::vtk_reader::{piece as read, point_data as array};
    use super::*;
    use crate::math::Quat;
    use crate::shape::{Capsule, Cuboid, Cylinder, Ellipsoid, Sphere, Superellipsoid};
    use std::sync::Arc;
    use vtkio::model::Attribute;

    const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [10, 10, 20], dx: 0.1 };

    fn templates() -> Vec<Template> {
        vec![Template { shape: Arc::new(Sphere { radius: 0.25 }), material: 0, density: 2.0 }]
    }

    fn write_surfaces(
        path: &Path,
        domain: &Domain,
        templates: &[Template],
        particles: &[Particle],
    ) -> Result<()> {
        let sections: Vec<usize> = (0..templates.len()).collect();
        let one_each = particles.iter().map(|p| (p.template as usize, 1));
        ParticleSurfaces::new(templates, &sections, one_each).data(domain, particles, true).write(path)
    }

    #[test]
    fn surfaces_lie_on_the_particles_and_carry_their_numbers() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("surfaces.vtp");
        let particles: Vec<Particle> = (0..3_u32)
            .map(|i| {
                let k = f64::from(i);
                let mut particle = Particle::at(u64::from(7 + i), 0, Vec3::new(0.05, 0.5, 0.3 + 0.6 * k));
                particle.velocity = [0.3 * k, 0.0, -0.4 * k];
                particle.angular_velocity = [k, 2.0, 3.0];
                particle.contact_force = [0.0, -1.5, k];
                particle.set_orientation(&Quat::from_euler_angles(0.1 * k, 0.2, 0.3));
                particle
            })
            .collect();
        write_surfaces(&path, &BOX, &templates(), &particles).unwrap();

        let piece = read(&path);
        let points: Vec<f64> = piece.points.cast_into().unwrap();
        let (ids, speeds) = (array(&piece, "id"), array(&piece, "speed"));
        let (spins, forces) = (array(&piece, "angular_velocity"), array(&piece, "contact_force"));
        let normals = array(&piece, "Normals");
        assert_eq!(ids.len(), 3 * 162, "two refinements of an icosahedron");
        for (i, point) in points.chunks(3).enumerate() {
            let particle = &particles[ids[i] as usize - 7];
            let arm = Vec3::from_row_slice(point) - particle.position();
            assert!((arm.norm() / 0.25 - 1.0).abs() < 1e-6);
            assert!((speeds[i] - particle.velocity().norm()).abs() < 1e-7);
            assert_eq!(spins[3 * i..3 * i + 3], particle.angular_velocity);
            assert_eq!(forces[3 * i..3 * i + 3], particle.contact_force);
            let normal = Vec3::from_row_slice(&normals[3 * i..3 * i + 3]);
            assert!((normal - arm / 0.25).norm() < 1e-5);
        }
        assert_eq!(array(&piece, "kind"), vec![0.0; ids.len()]);
        assert!(array(&piece, "equivalent_diameter").iter().all(|d| (d - 0.5).abs() < 1e-6));
        assert_eq!(piece.polys.unwrap().num_cells(), 3 * 320);
    }

    #[test]
    fn bodies_with_edges_are_turned_and_have_no_normals() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("surfaces.vtp");
        let edges = Vec3::new(0.1, 0.2, 0.3);
        let mut templates = templates();
        templates.push(Template { shape: Arc::new(Cuboid::new(edges).unwrap()), ..templates[0].clone() });
        let mut particle = Particle::at(1, 1, Vec3::repeat(0.5));
        // A quarter turn about y takes z to x.
        particle.set_orientation(&Quat::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_2));
        write_surfaces(&path, &BOX, &templates, &[particle]).unwrap();
        let piece = read(&path);
        let points: Vec<f64> = piece.points.cast_into().unwrap();
        for point in points.chunks(3) {
            let arm = (Vec3::from_row_slice(point) - Vec3::repeat(0.5)).abs();
            assert!((arm - Vec3::new(0.15, 0.1, 0.05)).norm() < 1e-6, "{arm}");
        }
        assert!(array(&piece, "kind").iter().all(|&t| (t - 1.0).abs() < 1e-9));
        let named =
            |attribute: &Attribute| matches!(attribute, Attribute::DataArray(a) if a.name == "Normals");
        assert!(!piece.data.point.iter().any(named));
    }

    #[test]
    fn only_bodies_without_edges_are_smooth() {
        let axes = Vec3::new(0.1, 0.2, 0.4);
        let shapes: [(Arc<dyn Shape>, bool); 6] = [
            (Arc::new(Sphere { radius: 0.1 }), true),
            (Arc::new(Ellipsoid::new(axes).unwrap()), true),
            (Arc::new(Superellipsoid::new(axes, [0.5, 0.7]).unwrap()), true),
            (Arc::new(Capsule::new(0.1, 0.3).unwrap()), true),
            (Arc::new(Cylinder::new(0.1, 0.3).unwrap()), false),
            (Arc::new(Cuboid::new(axes).unwrap()), false),
        ];
        for (shape, smooth) in shapes {
            for refinement in [1, 2] {
                let mesh = shape.surface_mesh(refinement);
                assert_eq!(is_smooth(&*shape, &mesh), smooth, "{}", shape.kind());
            }
        }
    }

    #[test]
    fn no_particles_make_a_readable_empty_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("surfaces.vtp");
        write_surfaces(&path, &BOX, &[], &[]).unwrap();
        assert_eq!(read(&path).num_points(), 0);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("NumberOfPoints=\"0\""), "VTK's own reader needs the count");
    }

    #[test]
    fn thousands_of_particles_stay_small() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("surfaces.vtp");
        let particles: Vec<Particle> = (0..2000_u32)
            .map(|i| {
                let k = f64::from(i);
                let mut particle =
                    Particle::at(u64::from(i), 0, BOX.wrap(Vec3::new(0.17 * k, 0.31 * k, 0.73 * k)));
                particle.velocity = [k.sin(), k.cos(), (2.0 * k).sin()];
                particle
            })
            .collect();
        write_surfaces(&path, &BOX, &templates(), &particles).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len();
        assert!(bytes < 5_000 * 2000, "{bytes} bytes for 2000 spheres");
    }
}
