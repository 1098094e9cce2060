//! A made-up run written to disk through the public interface, as a program would do it.
//!
//! With `TURBID_SAMPLE_OUTPUT=DIR` it is kept, for `validation/check_vtk.py DIR` and for looking at the pictures.

use crate::common::files_below;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::sync::Arc;
use turbid::dem::ContactState;
use turbid::domain::{Block, Domain};
use turbid::math::{Quat, Vec3};
use turbid::output::picture::{
    Chains, Colours, Plane, Scale, Scene, SettlingPlot, Slice, Snapshot, write_settling, write_slice,
    write_view,
};
use turbid::output::{
    self, Collection, Fields, OutputFiles, ParticlePoints, ParticleSurfaces, SeriesRow, SeriesWriter,
    directory, estimate_mean, write_fields, write_walls,
};
use turbid::particle::{Particle, Template};
use turbid::shape::{Capsule, Cuboid, Cylinder, Ellipsoid, Polyhedron, Shape, Sphere, Superellipsoid};
use turbid::wall::{Motion, Surface, Wall};

const DIAMETER: f64 = 1.5e-3;
const STOKES_VELOCITY: f64 = 0.32;
const FRAMES: u64 = 3;
const DOMAIN: Domain = Domain { faces: Domain::faces([true; 3]), cells: [64, 64, 80], dx: DIAMETER / 12.0 };

/// Non-overlapping spheres of random velocities, some across periodic faces.
fn particles(frame: u64) -> Vec<Particle> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut unit = || random.next_u64() as f64 / u64::MAX as f64;
    let size = DOMAIN.size();
    let mut particles: Vec<Particle> = Vec::new();
    while particles.len() < 70 {
        let position = size.map(|length| length * unit());
        let free =
            |other: &Particle| DOMAIN.nearest_image(position - other.position()).norm() > 1.02 * DIAMETER;
        if particles.iter().all(free) {
            let mut particle = Particle::at(particles.len() as u64, 0, position);
            let scale = 0.02 * (frame as f64 + 1.0);
            particle.velocity = [scale * (unit() - 0.5), scale * (unit() - 0.5), -scale * (1.0 + unit())];
            particle.angular_velocity = [10.0 * unit(), 0.0, -5.0 * unit()];
            particle.contact_force = [1e-6 * unit(), 0.0, 0.0];
            particles.push(particle);
        }
    }
    particles
}

/// The two files of particles of a step, and their collections.
struct ParticleFiles {
    points: ParticlePoints,
    surfaces: ParticleSurfaces,
    collections: [Collection; 2],
}

impl ParticleFiles {
    fn new(files: &OutputFiles, templates: &[Template], particles: &[Particle]) -> Self {
        let sections: Vec<usize> = (0..templates.len()).collect();
        let frames = vec![Quat::identity(); templates.len()];
        Self {
            points: ParticlePoints::new(templates, &sections, &frames),
            surfaces: ParticleSurfaces::new(
                templates,
                &sections,
                particles.iter().map(|p| (p.template as usize, 1)),
            ),
            collections: [files.collection(directory::PARTICLES), files.collection(directory::SURFACES)]
                .map(Collection::new),
        }
    }

    fn write(&mut self, files: &OutputFiles, domain: &Domain, step: u64, time: f64, particles: &[Particle]) {
        let paths = [files.file(directory::PARTICLES, step), files.file(directory::SURFACES, step)];
        self.points.data(domain, particles, None).write(&paths[0]).unwrap();
        self.surfaces.data(domain, particles, true).write(&paths[1]).unwrap();
        for (collection, path) in self.collections.iter_mut().zip(&paths) {
            collection.add(time, path).unwrap();
        }
    }
}

/// Rigid motion in spheres, decaying around them.
fn fields(particles: &[Particle]) -> Fields {
    let cells = DOMAIN.cells;
    let mut fields = Fields::default();
    for index in 0..DOMAIN.cell_count() {
        let cell = [index % cells[0], index / cells[0] % cells[1], index / cells[0] / cells[1]];
        let centre = Vec3::from_fn(|i, _| (cell[i] as f64 + 0.5) * DOMAIN.dx);
        let mut u = Vec3::new(0.0, 0.0, 0.008);
        let mut solid: f64 = 0.0;
        for particle in particles {
            let arm = DOMAIN.nearest_image(centre - particle.position());
            let distance = arm.norm() / (0.5 * DIAMETER);
            u += (particle.velocity() + particle.angular_velocity().cross(&arm))
                * (2.0 * (1.0 - distance)).exp().min(1.0);
            solid = solid.max((0.5 - 6.0 * (distance - 1.0)).clamp(0.0, 1.0));
        }
        fields.velocity.push([u.x as f32, u.y as f32, u.z as f32]);
        fields.pressure.push((centre.z * 1e3) as f32);
        fields.solid_fraction.push(solid as f32);
    }
    fields
}

/// The speed in the plane of a picture, out of the velocity of all cells.
fn slice(plane: &Plane, cells: [usize; 3], velocity: &[[f32; 3]]) -> Vec<f32> {
    let [nx, ny, _] = cells;
    let mut flow = vec![[0.0; 4]; plane.values()];
    for cell @ [x, y, z] in plane.cells().cells() {
        let [u, v, w] = velocity[x + nx * (y + ny * z)];
        plane.add(&mut flow, cell, [u, v, w, 0.0]);
    }
    flow.iter().map(|u| (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt()).collect()
}

/// A scale of speeds.
fn speed_scale(top: f64) -> Scale {
    Scale { label: "speed |u|", unit: "m/s", range: (0.0, top), colours: Colours::Viridis }
}

fn write_run(root: &Path) {
    let templates =
        [Template { shape: Arc::new(Sphere { radius: 0.5 * DIAMETER }), material: 0, density: 3250.0 }];
    directory::create(root).unwrap();
    let files = OutputFiles::new(root);
    let mut series = SeriesWriter::create(&files.series(), &[], &[], &[], &[]).unwrap();
    let mut all_fields = Collection::new(files.collection(directory::FIELDS));
    let mut particle_files = ParticleFiles::new(&files, &templates, &particles(0));
    for frame in 0..FRAMES {
        let (step, time) = (100 * frame, 1.3e-3 * frame as f64);
        let particles = particles(frame);
        let fields = fields(&particles);
        let block = Block { lo: [0; 3], hi: DOMAIN.cells };
        write_fields(&files.file(directory::FIELDS, step), &DOMAIN, &block, time, &fields).unwrap();
        all_fields.add(time, &files.file(directory::FIELDS, step)).unwrap();
        particle_files.write(&files, &DOMAIN, step, time, &particles);

        let count = particles.len() as f64;
        let speeds = || particles.iter().map(|p| p.velocity().norm());
        series
            .write(&[SeriesRow {
                step,
                time,
                t_star: time * STOKES_VELOCITY / DIAMETER,
                mean_particle_velocity: (particles.iter().map(Particle::velocity).sum::<Vec3>() / count)
                    .into(),
                mean_particle_speed: speeds().sum::<f64>() / count,
                max_particle_speed: speeds().fold(0.0, f64::max),
                ..SeriesRow::default()
            }])
            .unwrap();
        let snapshot = Snapshot {
            case: "hindered_settling",
            time,
            stokes_time: Some(DIAMETER / STOKES_VELOCITY),
            domain: DOMAIN,
            diameter: DIAMETER,
            gravity: -Vec3::z(),
            templates: &templates,
            particles: &particles,
            walls: &[],
        };
        let (plane, scale) = (Plane::new(&DOMAIN, -Vec3::z(), None), speed_scale(0.1));
        let values = slice(&plane, DOMAIN.cells, &fields.velocity);
        let slice = Slice { plane, values, scale };
        write_slice(&directory::PICTURES.named_file(root, "speed", step), &snapshot, &slice).unwrap();
    }

    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut wander = 0.0;
    let t_star: Vec<f64> = (0..1500).map(|i| 0.1 * f64::from(i)).collect();
    let velocity: Vec<f64> = t_star
        .iter()
        .map(|t| {
            wander = 0.97 * wander + 0.003 * (random.next_u64() as f64 / u64::MAX as f64 - 0.5);
            0.243 * (1.0 - (-t / 2.0).exp()) + 0.03 * (-t / 12.0).exp() * (t / 3.0).sin() + wander
        })
        .collect();
    let mean = estimate_mean(&velocity[500..]).unwrap();
    let plot = SettlingPlot {
        case: "hindered_settling",
        t_star: &t_star,
        velocity: &velocity,
        mean: Some(([50.0, 149.9], mean)),
        settled: Some((28.5, mean)),
        references: &[
            ("Garside and Al-Dibouni", 0.252),
            ("Richardson and Zaki", 0.262),
            ("one particle", 0.523),
        ],
    };
    write_settling(&files.settling_plot(), &plot).unwrap();
}

#[test]
fn a_run_leaves_every_file_it_promises_under_its_final_name() {
    let kept = std::env::var_os("TURBID_SAMPLE_OUTPUT");
    let temporary = tempfile::tempdir().unwrap();
    let root = kept.as_ref().map_or(temporary.path(), Path::new);
    write_run(root);

    let mut found: Vec<String> = (files_below(root).into_keys())
        .filter(|path| !path.starts_with("tank"))
        .map(|path| path.to_str().unwrap().to_owned())
        .collect();
    found.sort();
    let mut expected: Vec<String> =
        ["fields.pvd", "particles.pvd", "series.csv", "settling_velocity.png", "surfaces.pvd"]
            .map(String::from)
            .into();
    for step in ["0000000000", "0000000100", "0000000200"] {
        expected.push(format!("fields/fields_{step}.vti"));
        expected.push(format!("particles/particles_{step}.vtp"));
        expected.push(format!("surfaces/surfaces_{step}.vtp"));
        expected.push(format!("pictures/speed_{step}.png"));
    }
    expected.sort();
    assert_eq!(found, expected);
    for picture in found.iter().filter(|name| Path::new(name).extension().is_some_and(|e| e == "png")) {
        let file = std::io::BufReader::new(std::fs::File::open(root.join(picture)).unwrap());
        let info = png::Decoder::new(file).read_info().unwrap();
        assert!(info.info().width >= 900 && info.info().height >= 900, "{picture}");
    }
}

const TANK: Domain =
    Domain { faces: Domain::faces([false, true, false]), cells: [80, 60, 80], dx: DIAMETER / 12.0 };

/// One template of every kind of shape.
fn mixture() -> Vec<Template> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut unit = || 2.0 * (random.next_u64() as f64 / u64::MAX as f64) - 1.0;
    let stone: Vec<Vec3> = (0..24)
        .map(|_| Vec3::new(unit(), unit(), unit()).normalize() * (0.5 * DIAMETER) * (1.0 + 0.2 * unit()))
        .collect();
    let shapes: [Arc<dyn Shape>; 8] = [
        Arc::new(Sphere { radius: 0.5 * DIAMETER }),
        Arc::new(Cuboid::new(Vec3::repeat(0.8 * DIAMETER)).unwrap()),
        Arc::new(Cuboid::new(Vec3::new(1.4, 0.9, 0.35) * DIAMETER).unwrap()),
        Arc::new(Polyhedron::hull(&stone, 1e-9).unwrap().0),
        Arc::new(Ellipsoid::new(Vec3::new(0.7, 0.5, 0.3) * DIAMETER).unwrap()),
        Arc::new(Capsule::new(0.35 * DIAMETER, 0.7 * DIAMETER).unwrap()),
        Arc::new(Cylinder::new(0.45 * DIAMETER, 0.9 * DIAMETER).unwrap()),
        Arc::new(Superellipsoid::new(Vec3::repeat(0.45 * DIAMETER), [0.4, 0.4]).unwrap()),
    ];
    shapes.into_iter().map(|shape| Template { shape, material: 0, density: 2500.0 }).collect()
}

/// Bodies falling onto a floor between walls, in loose order.
fn pile(templates: &[Template]) -> Vec<Particle> {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut unit = || random.next_u64() as f64 / u64::MAX as f64;
    let height = TANK.size().z;
    let site = |id: usize| Vec3::new((id % 6) as f64, (id / 6 % 4) as f64, (id / 24) as f64);
    (0..100)
        .map(|id| {
            let jitter = Vec3::from_fn(|_, _| 0.2 * (unit() - 0.5));
            let position =
                (site(id).component_mul(&Vec3::new(1.1, 1.25, 1.0)) + jitter + Vec3::new(0.58, 0.0, 0.58))
                    * DIAMETER;
            let mut particle = Particle::at(id as u64, id * 5 % templates.len(), position);
            particle.velocity = [0.0, 0.0, -0.3 * position.z / height];
            let turn = Quat::from_euler_angles(6.0 * unit(), 1.5 * unit(), 6.0 * unit());
            particle.set_orientation(&turn);
            particle
        })
        .collect()
}

fn tank_walls() -> Vec<Wall> {
    let plane = |name: &str, point: Vec3, normal: Vec3, velocity: Vec3| Wall {
        name: name.to_owned(),
        surface: Surface::Plane { point, normal },
        motion: Motion { velocity: velocity.into(), ..Motion::default() },
        material: 0,
    };
    let size = TANK.size();
    let mut walls = vec![
        plane("x-", Vec3::zeros(), Vec3::x(), Vec3::zeros()),
        plane("x+", size, -Vec3::x(), Vec3::zeros()),
        plane("z-", Vec3::zeros(), Vec3::z(), Vec3::zeros()),
        plane("z+", size, -Vec3::z(), Vec3::new(0.1, 0.0, 0.0)),
        plane(
            "slope",
            Vec3::new(0.75 * size.x, 0.0, 0.0),
            Vec3::new(-1.0, 0.0, 1.0).normalize(),
            Vec3::zeros(),
        ),
    ];
    walls.push(Wall {
        name: "rod".to_owned(),
        surface: Surface::Cylinder {
            point: Vec3::new(0.2 * size.x, 0.0, 0.85 * size.z),
            axis: Vec3::y(),
            radius: DIAMETER,
            pipe: false,
        },
        motion: Motion::default(),
        material: 0,
    });
    walls
}

/// A contact between all that come near each other, of made-up strength.
fn contacts(particles: &[Particle]) -> Vec<ContactState> {
    let mut contacts = Vec::new();
    for (i, a) in particles.iter().enumerate() {
        for b in &particles[i + 1..] {
            let arm = TANK.nearest_image(b.position() - a.position());
            if arm.norm() < 1.1 * DIAMETER {
                let normal = arm.normalize();
                contacts.push(ContactState {
                    first: a.id,
                    second: b.id,
                    parts: [0; 2],
                    point: TANK.wrap(a.position() + 0.5 * arm).into(),
                    normal: normal.into(),
                    force: (-1e-3 * normal).into(),
                    depth: 1e-6,
                    volume: 1e-15,
                });
            }
        }
        if a.position().z < 0.6 * DIAMETER {
            let foot = [a.position().x, a.position().y, 0.0];
            contacts.push(ContactState {
                first: a.id,
                second: ContactState::of_wall(2),
                parts: [0; 2],
                point: foot,
                normal: [0.0, 0.0, -1.0],
                force: [0.0, 0.0, 2e-3],
                depth: 1e-6,
                volume: 1e-15,
            });
        }
    }
    contacts
}

/// A stirred tank without and with its fluid in the pictures.
fn write_tank(root: &Path) {
    let (templates, walls) = (mixture(), tank_walls());
    directory::create(root).unwrap();
    let files = OutputFiles::new(root);
    let mut all_contacts = Collection::new(files.collection(directory::CONTACTS));
    let mut all_chains = Collection::new(files.collection(directory::FORCE_CHAINS));
    let particles = pile(&templates);
    let mut particle_files = ParticleFiles::new(&files, &templates, &particles);
    let touching = contacts(&particles);
    assert!(touching.len() > 20 && touching.iter().any(|c| c.wall().is_some()));
    write_walls(&files.walls(), &TANK, &walls).unwrap();
    // Nothing touches in the first frame.
    for (step, contacts) in [(0, &[][..]), (100, &touching)] {
        let time = 1e-5 * step as f64;
        particle_files.write(&files, &TANK, step, time, &particles);
        output::contacts(contacts).write(&files.file(directory::CONTACTS, step)).unwrap();
        all_contacts.add(time, &files.file(directory::CONTACTS, step)).unwrap();
        output::force_chains(&TANK, &particles, contacts)
            .write(&files.file(directory::FORCE_CHAINS, step))
            .unwrap();
        all_chains.add(time, &files.file(directory::FORCE_CHAINS, step)).unwrap();
    }
    let velocity: Vec<[f32; 3]> = (0..TANK.cell_count())
        .map(|cell| {
            let (x, z) = ((cell % 80) as f32 / 80.0 - 0.5, (cell / 4800) as f32 / 80.0 - 0.5);
            let strength = 0.4 * (0.25 - x * x) * (0.25 - z * z);
            [strength * z, 0.0, -strength * x]
        })
        .collect();
    let snapshot = Snapshot {
        case: "tank",
        time: 1e-3,
        stokes_time: None,
        domain: TANK,
        diameter: DIAMETER,
        gravity: -Vec3::z(),
        templates: &templates,
        particles: &particles,
        walls: &walls,
    };
    let (plane, scale) = (Plane::new(&TANK, -Vec3::z(), None), speed_scale(0.03));
    let values = slice(&plane, TANK.cells, &velocity);
    let slice = Slice { plane, values, scale };
    write_slice(&directory::PICTURES.named_file(root, "speed", 100), &snapshot, &slice).unwrap();
    let force = Scale { label: "force", unit: "N", range: (0.0, 2e-3), colours: Colours::Warm };
    let scene = Scene {
        from: None,
        zoom: 1.0,
        size: [1200, 900],
        bodies: vec![[220; 3]; particles.len()],
        scale: None,
        slice: Some(slice),
        chains: Some(Chains { contacts: &touching, scale: force }),
        threads: 2,
    };
    write_view(&directory::PICTURES.named_file(root, "view", 100), &snapshot, &scene).unwrap();
}

#[test]
fn walls_contacts_and_bodies_of_every_kind_leave_their_files() {
    let kept = std::env::var_os("TURBID_SAMPLE_OUTPUT").map(|root| Path::new(&root).join("tank"));
    let temporary = tempfile::tempdir().unwrap();
    let root = kept.as_deref().unwrap_or(temporary.path());
    write_tank(root);
    let files = OutputFiles::new(root);
    let picture = |name| directory::PICTURES.named_file(root, name, 100);
    let numbered = [
        files.file(directory::CONTACTS, 100),
        files.file(directory::FORCE_CHAINS, 100),
        files.file(directory::PARTICLES, 100),
        files.file(directory::SURFACES, 100),
    ];
    for path in [files.walls(), picture("speed"), picture("view")].iter().chain(&numbered) {
        assert!(std::fs::metadata(path).unwrap().len() > 1000, "{}", path.display());
    }
}
