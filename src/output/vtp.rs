//! Particle surfaces as VTK polygons (`.vtp`).
//!
//! Every particle is drawn once, at its wrapped position: one that crosses a periodic face sticks out of the box
//! and its images are not drawn, so that counting connected surfaces counts particles. All data are point data,
//! the same on all points of one particle, so `ParaView` colours by any of them: `id`, `velocity` (m/s), `speed`
//! (m/s), `angular_velocity` (1/s), `contact_force` (N). If all particles are spheres, exact `Normals` make the
//! coarse mesh look round. Time is in the `.pvd`: vtkio cannot write it here.

use super::atomic::write_bytes;
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::shape::SurfaceMesh;
use std::io;
use std::path::Path;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, DataArray, DataSet, PolyDataPiece, Version, VertexNumbers,
};
use vtkio::{IOBuffer, Vtk, xml::Compressor};

/// Most triangles in one file for which the finer of two refinements is still taken.
const TRIANGLE_BUDGET: usize = 200_000;

/// Writes the surfaces of `particles` with their velocities and forces.
pub fn write_particles(
    path: &Path,
    domain: &Domain,
    templates: &[Template],
    particles: &[Particle],
) -> Result<()> {
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::inline(surfaces(domain, templates, particles)),
        file_path: None,
    };
    // vtkio drops errors of files (a full disk is `Ok`), but not of memory.
    let mut bytes = Vec::new();
    let compressor = if particles.is_empty() {
        Compressor::None
    } else {
        Compressor::LZ4
    };
    vtk.try_into_xml_format(compressor, 1)
        .and_then(|file| file.write(&mut bytes))
        .map_err(|error| Error::io("encode", path, io::Error::other(error.to_string())))?;
    if particles.is_empty() {
        // vtkio leaves out counts that are zero, but VTK refuses a piece without them.
        let text = String::from_utf8_lossy(&bytes);
        bytes = text
            .replace("<Piece>", "<Piece NumberOfPoints=\"0\" NumberOfPolys=\"0\">")
            .into_bytes();
    }
    write_bytes(path, &bytes)
}

fn surfaces(domain: &Domain, templates: &[Template], particles: &[Particle]) -> PolyDataPiece {
    let meshes = meshes(templates, particles);
    let of = |particle: &Particle| &meshes[particle.template as usize];
    let triangles: usize = particles.iter().map(|p| of(p).triangles.len()).sum();
    let mut points = Vec::new();
    let mut normals = Vec::new();
    let mut connectivity = Vec::with_capacity(3 * triangles);
    for particle in particles {
        let mesh = of(particle);
        let first = (points.len() / 3) as u64;
        let (centre, orientation) = (domain.wrap(particle.position()), particle.orientation());
        for corner in &mesh.points {
            let arm = orientation * corner;
            points.extend((centre + arm).iter().map(|&x| x as f32));
            normals.extend(arm.normalize().iter().map(|&x| x as f32));
        }
        connectivity.extend(mesh.triangles.iter().flatten().map(|&i| first + u64::from(i)));
    }

    let counts: Vec<usize> = particles.iter().map(|p| of(p).points.len()).collect();
    let per_point = |value: &dyn Fn(&Particle) -> Vec3| -> Vec<f32> {
        let mut all = Vec::with_capacity(points.len());
        for (particle, &count) in particles.iter().zip(&counts) {
            let value: [f64; 3] = value(particle).into();
            all.extend(std::iter::repeat_n(value.map(|x| x as f32), count).flatten());
        }
        all
    };
    let repeat = |value: &dyn Fn(&Particle) -> f32| -> Vec<f32> {
        particles
            .iter()
            .zip(&counts)
            .flat_map(|(p, &count)| std::iter::repeat_n(value(p), count))
            .collect()
    };
    let id: Vec<u64> = particles
        .iter()
        .zip(&counts)
        .flat_map(|(p, &count)| std::iter::repeat_n(p.id, count))
        .collect();
    let mut data = vec![
        DataArray::scalars("speed", 1).with_data(repeat(&|p| p.velocity().norm() as f32)),
        DataArray::scalars("id", 1).with_data(id),
        DataArray::vectors("velocity").with_data(per_point(&Particle::velocity)),
        DataArray::vectors("angular_velocity").with_data(per_point(&Particle::angular_velocity)),
        DataArray::vectors("contact_force").with_data(per_point(&|p| p.contact_force.into())),
    ];
    if templates.iter().all(|t| t.shape.as_sphere().is_some()) {
        data.push(DataArray::normals("Normals").with_data(normals));
    }
    PolyDataPiece {
        points: IOBuffer::F32(points),
        polys: Some(VertexNumbers::XML {
            offsets: (1..=triangles as u64).map(|n| 3 * n).collect(),
            connectivity,
        }),
        data: Attributes {
            point: data.into_iter().map(Attribute::DataArray).collect(),
            cell: Vec::new(),
        },
        ..PolyDataPiece::default()
    }
}

/// One mesh per template, as fine as the number of particles allows.
fn meshes(templates: &[Template], particles: &[Particle]) -> Vec<SurfaceMesh> {
    let at = |refinement| -> Vec<SurfaceMesh> {
        templates
            .iter()
            .map(|t| t.shape.surface_mesh(refinement))
            .collect()
    };
    let fine = at(2);
    let triangles: usize = particles
        .iter()
        .map(|p| fine[p.template as usize].triangles.len())
        .sum();
    if triangles <= TRIANGLE_BUDGET { fine } else { at(1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Quat;
    use crate::shape::Sphere;
    use std::sync::Arc;
    use vtkio::model::Piece;

    const BOX: Domain = Domain {
        periodic: [true; 3],
        cells: [10, 10, 20],
        dx: 0.1,
    };

    fn templates() -> Vec<Template> {
        vec![Template {
            shape: Arc::new(Sphere { radius: 0.25 }),
            material: 0,
            density: 2.0,
        }]
    }

    fn read(path: &Path) -> PolyDataPiece {
        match Vtk::import(path).unwrap().data {
            DataSet::PolyData { mut pieces, .. } => match pieces.pop() {
                Some(Piece::Inline(piece)) => *piece,
                other => panic!("no inline piece but {other:?}"),
            },
            other => panic!("no polygons but {other:?}"),
        }
    }

    fn array(piece: &PolyDataPiece, name: &str) -> Vec<f64> {
        piece
            .data
            .point
            .iter()
            .find_map(|attribute| match attribute {
                Attribute::DataArray(array) if array.name == name => array.data.cast_into::<f64>(),
                _ => None,
            })
            .unwrap()
    }

    #[test]
    fn surfaces_lie_on_the_particles_and_carry_their_numbers() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
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
        write_particles(&path, &BOX, &templates(), &particles).unwrap();

        let piece = read(&path);
        let points: Vec<f64> = piece.points.cast_into().unwrap();
        let (ids, speeds) = (array(&piece, "id"), array(&piece, "speed"));
        let (spins, forces) = (array(&piece, "angular_velocity"), array(&piece, "contact_force"));
        assert_eq!(ids.len(), 3 * 162, "two refinements of an icosahedron");
        for (i, point) in points.chunks(3).enumerate() {
            let particle = &particles[ids[i] as usize - 7];
            let arm = Vec3::from_row_slice(point) - particle.position();
            assert!((arm.norm() / 0.25 - 1.0).abs() < 1e-6);
            assert!((speeds[i] - particle.velocity().norm()).abs() < 1e-7);
            assert_eq!(spins[3 * i..3 * i + 3], particle.angular_velocity);
            assert_eq!(forces[3 * i..3 * i + 3], particle.contact_force);
        }
        assert_eq!(piece.polys.unwrap().num_cells(), 3 * 320);
    }

    #[test]
    fn no_particles_make_a_readable_empty_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        write_particles(&path, &BOX, &[], &[]).unwrap();
        assert_eq!(read(&path).num_points(), 0);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.contains("NumberOfPoints=\"0\""),
            "VTK's own reader needs the count"
        );
    }

    #[test]
    fn thousands_of_particles_stay_small() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("particles.vtp");
        let particles: Vec<Particle> = (0..2000_u32)
            .map(|i| {
                let k = f64::from(i);
                let mut particle =
                    Particle::at(u64::from(i), 0, BOX.wrap(Vec3::new(0.17 * k, 0.31 * k, 0.73 * k)));
                particle.velocity = [k.sin(), k.cos(), (2.0 * k).sin()];
                particle
            })
            .collect();
        write_particles(&path, &BOX, &templates(), &particles).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len();
        assert!(bytes < 5_000 * 2000, "{bytes} bytes for 2000 spheres");
    }
}
