//! LAMMPS as an engine: one instance, commands and arrays.
//!
//! The array `held` goes with every atom, wherever it moves, and into restart files. It has the load `F` with the weight and the torque `T` of
//! the fluid, then all forces `f`, torques `t`, velocities and angular velocities at the end of the last step, and the factor `q` of torques:
//! LAMMPS takes the moment of inertia of a homogeneous sphere of the contact radius, which is `q` times that of the particle.
//!
//! A step under constant loads: `f += F - F'`, `t += q (T - T')`, as the first half kick uses the force of the step before, with the loads `F'`,
//! `T'`; then `run n pre no post no`, in which the callback of `fix external` adds `F` to the forces and makes the torques `q (t + T)`. So
//! the motion under loads alone is the exact parabola in each step.
//!
//! To write a restart file LAMMPS finds its ghosts again, and then takes the partners of contacts from lists that have the numbers of the ones
//! before: contacts across faces of blocks would lose their springs. So the lists are made again in the last sub-step of every step, whatever
//! has moved.
//!
//! `fix wall/gran` takes the damping for a coefficient of restitution in every set-up, and damps less each time. So an instance has one
//! set-up: for another time step, and after writing a restart file, the simulation is read back from that file. A set-up finds forces, and
//! shortens the springs of contacts that slide by the dashpots. So the velocities in the file are those of half a step before, at which the last
//! forces were found, and all that `held` has is put back afterwards.

use crate::deck::{Plan, plan};
use crate::library::{Instance, Outcome, rows_at, rows_of_atoms};
use std::ffi::{CStr, c_int, c_void};
use std::io::{Read, Write};
use turbid_core::dem::ContactState;
use turbid_core::math::Vec3;
use turbid_process::{
    AppliedLoad, Body, ContactForce, Hello, LoadedState, Order, Seat, Served, SetUp, SphereKind, State,
    exchange_file, id_of, kinds, open_log, path_of, tag,
};

/// Name of the array that goes with the atoms.
const HELD: &CStr = c"d2_held";
/// Columns of it: force and torque of the load, all forces, all torques, velocity, angular velocity, factor of torques.
const COLUMNS: usize = 19;
/// The last of these columns.
const RATIO: usize = 18;
/// Arrays of LAMMPS that `held` has, and their first columns.
const COPIES: [(&CStr, usize); 4] = [(c"f", 6), (c"torque", 9), (c"v", 12), (c"omega", 15)];
/// The moment of inertia of a homogeneous sphere over `m r^2`.
const SPHERE: f64 = 0.4;
/// Columns of `fix wall/gran` for each atom: touched or not, force, and others.
const OF_WALL: usize = 8;

type Held = [f64; COLUMNS];

/// Three columns of a row.
fn three(row: &Held, at: usize) -> Vec3 {
    Vec3::new(row[at], row[at + 1], row[at + 2])
}

/// LAMMPS as an engine.
#[derive(Debug)]
pub(crate) struct Engine {
    seat: Seat,
    plan: Plan,
    kinds: Vec<SphereKind>,
    bodies: Vec<Body>,
    gravity: Vec3,
    order: Order,
    instance: Option<Instance>,
    /// The present time step (s); 0 before the first step.
    time_step: f64,
}

/// Source of a simulation that is read back.
#[derive(Clone, Copy, Debug)]
struct Saved<'a> {
    time_step: f64,
    /// LAMMPS's own restart file, in the first process.
    restart: &'a [u8],
}

/// Adds the loads to the forces of a sub-step; the rest of the torques are those of the contacts.
extern "C" fn add_loads(
    handle: *mut c_void,
    _step: i64,
    count: c_int,
    _ids: *mut c_int,
    _positions: *mut *mut f64,
    forces: *mut *mut f64,
) {
    let n = count.max(0) as usize;
    // SAFETY: LAMMPS lends the forces to this function, and calls it while nobody uses the arrays of its atoms.
    let arrays = unsafe {
        (
            rows_at::<3>(forces, n, c"fexternal"),
            rows_of_atoms::<3>(handle, c"torque", n),
            rows_of_atoms::<COLUMNS>(handle, HELD, n),
        )
    };
    // There are these arrays once there is the fix: the set-up has used them.
    let (Ok(forces), Ok(torques), Ok(held)) = arrays else { return };
    for ((force, torque), held) in forces.iter_mut().zip(torques).zip(held) {
        *force = three(held, 0).into();
        *torque = ((Vec3::from(*torque) + three(held, 3)) * held[RATIO]).into();
    }
}

impl Engine {
    pub(crate) fn new(seat: Seat) -> Self {
        Self {
            seat,
            plan: Plan::default(),
            kinds: Vec::new(),
            bodies: Vec::new(),
            gravity: Vec3::zeros(),
            order: Order::default(),
            instance: None,
            time_step: 0.0,
        }
    }

    fn instance(&mut self) -> Outcome<&mut Instance> {
        self.instance.as_mut().ok_or_else(|| "LAMMPS has not been set up".to_owned())
    }

    /// A simulation with the particles of the set-up, or what was saved. Its first set-up is that of the first step, or this one if there was
    /// one before.
    fn open(&mut self, saved: Option<Saved>) -> Outcome<()> {
        let is_first = self.seat.part == 0;
        // One file for all.
        let log = self.plan.log_file.as_ref().filter(|_| is_first).map(|path| open_log(path)).transpose()?;
        self.instance = None;
        let mut instance = Instance::open(self.seat.communicator, log)?;
        instance.commands(&self.plan.before)?;
        let held = format!("fix held all property/atom d2_held {COLUMNS}");
        if let Some(Saved { restart, .. }) = saved {
            let mut file = exchange_file()?;
            let bytes = if is_first { restart } else { &[] };
            file.write_all(bytes).map_err(|e| format!("cannot give back what LAMMPS saved: {e}"))?;
            instance.command(&format!("read_restart {}", path_of(&file)))?;
            instance.command(&held)?;
        } else {
            instance.commands(&self.plan.space)?;
            instance.command(&held)?;
            self.create(&mut instance)?;
        }
        instance.commands(&self.plan.last)?;
        instance.set_callback(c"loads", add_loads);
        (self.instance, self.time_step) = (Some(instance), 0.0);
        match saved {
            Some(Saved { time_step, .. }) if time_step > 0.0 => self.begin(time_step, true),
            _ => Ok(()),
        }
    }

    /// Makes the atoms, and sends them to the processes whose blocks they lie in.
    fn create(&self, instance: &mut Instance) -> Outcome<()> {
        let tags: Vec<i32> = self.bodies.iter().map(|body| tag(body.id)).collect::<Outcome<_>>()?;
        let kinds: Vec<SphereKind> =
            self.bodies.iter().map(|body| self.kinds[body.template as usize]).collect();
        let types: Vec<i32> = kinds.iter().map(|kind| kind.material as i32 + 1).collect();
        instance.create(&tags, &types)?;
        let fill = |array: &mut [[f64; 3]], value: fn(&Body) -> [f64; 3]| {
            array.iter_mut().zip(&self.bodies).for_each(|(place, body)| *place = value(body));
        };
        fill(instance.rows_of_atoms(c"x")?, |body| body.position);
        fill(instance.rows_of_atoms(c"v")?, |body| body.velocity);
        fill(instance.rows_of_atoms(c"omega")?, |body| body.angular_velocity);
        let fill = |array: &mut [f64], value: fn(&SphereKind) -> f64| {
            array.iter_mut().zip(&kinds).for_each(|(place, kind)| *place = value(kind));
        };
        fill(instance.of_atoms(c"radius")?, |kind| kind.radius);
        fill(instance.of_atoms(c"rmass")?, |kind| kind.mass);
        for (held, kind) in instance.rows_of_atoms::<COLUMNS>(HELD)?.iter_mut().zip(&kinds) {
            *held = [0.0; COLUMNS];
            held[RATIO] = kind.inertia_ratio;
        }
        instance.command("displace_atoms all move 0 0 0 units box")
    }

    /// The one set-up, with this time step (s), and with the forces that are held if there were steps before.
    fn begin(&mut self, step: f64, resumes: bool) -> Outcome<()> {
        self.time_step = step;
        let instance = self.instance()?;
        instance.command(&format!("timestep {step:e}"))?;
        instance.command("run 0 post no")?;
        instance.set_up_ends();
        if resumes {
            let held = instance.rows_of_atoms::<COLUMNS>(HELD)?.to_vec();
            for (array, at) in COPIES {
                let rows = instance.rows_of_atoms::<3>(array)?.iter_mut();
                rows.zip(&held).for_each(|(row, held)| *row = three(held, at).into());
            }
        }
        Ok(())
    }

    /// Copies what `held` has of the arrays.
    fn hold(&mut self) -> Outcome<()> {
        let instance = self.instance()?;
        for (array, at) in COPIES {
            let now = instance.rows_of_atoms::<3>(array)?.to_vec();
            let rows = instance.rows_of_atoms::<COLUMNS>(HELD)?.iter_mut();
            rows.zip(now).for_each(|(held, now)| held[at..at + 3].copy_from_slice(&now));
        }
        Ok(())
    }

    /// LAMMPS's own restart file, in the first process. The simulation must be read back from it.
    fn write(&mut self) -> Outcome<Vec<u8>> {
        let mut file = exchange_file()?;
        let half_step = 0.5 * self.time_step;
        let instance = self.instance()?;
        let held = instance.rows_of_atoms::<COLUMNS>(HELD)?.to_vec();
        let mass = instance.of_atoms::<f64>(c"rmass")?.to_vec();
        let radius = instance.of_atoms::<f64>(c"radius")?.to_vec();
        let kick = |row: &mut [f64; 3], force: Vec3, inertia: f64| {
            *row = (Vec3::from(*row) - force * (half_step / inertia)).into();
        };
        for (k, row) in instance.rows_of_atoms(c"v")?.iter_mut().enumerate() {
            kick(row, three(&held[k], 6), mass[k]);
        }
        for (k, row) in instance.rows_of_atoms(c"omega")?.iter_mut().enumerate() {
            kick(row, three(&held[k], 9), SPHERE * mass[k] * radius[k] * radius[k]);
        }
        instance.command(&format!("write_restart {}", path_of(&file)))?;
        let mut restart = Vec::new();
        file.read_to_end(&mut restart).map_err(|e| format!("cannot read back what LAMMPS saved: {e}"))?;
        Ok(restart)
    }

    /// Sets the loads of the coming step, by ascending id.
    fn set_loads(&mut self, loads: &[AppliedLoad]) -> Outcome<()> {
        let gravity = self.gravity;
        let instance = self.instance.as_mut().ok_or("LAMMPS has not been set up")?;
        self.order.note_loaded(instance.of_atoms::<i32>(c"id")?, loads)?;
        let places = self.order.places.iter().map(|&k| k as usize);
        let mass = instance.of_atoms::<f64>(c"rmass")?.to_vec();
        let mut change = vec![[Vec3::zeros(); 2]; loads.len()];
        let held = instance.rows_of_atoms::<COLUMNS>(HELD)?;
        for (k, load) in places.zip(loads) {
            let now = [Vec3::from(load.force) + gravity * mass[k], load.torque.into()];
            let held = &mut held[k];
            change[k] = [now[0] - three(held, 0), (now[1] - three(held, 3)) * held[RATIO]];
            held[..3].copy_from_slice(now[0].as_slice());
            held[3..6].copy_from_slice(now[1].as_slice());
        }
        for (array, which) in [(c"f", 0), (c"torque", 1)] {
            let rows = instance.rows_of_atoms::<3>(array)?.iter_mut();
            rows.zip(&change).for_each(|(row, change)| *row = (Vec3::from(*row) + change[which]).into());
        }
        Ok(())
    }
}

impl Served for Engine {
    fn hello(&self) -> Hello {
        Hello {
            name: "LAMMPS".to_owned(),
            shapes: vec!["sphere".to_owned()],
            walls: vec!["plane".to_owned()],
            contacts: true,
            saves: true,
            ..Hello::default()
        }
    }

    fn set_up(&mut self, case: SetUp, bodies: Vec<Body>) -> Outcome<()> {
        self.kinds = kinds(&case)?;
        let grid = self.seat.blocks();
        (self.plan, self.gravity) = (plan(&case, &self.kinds, grid)?, case.gravity.into());
        self.bodies = bodies;
        self.open(None)
    }

    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<()> {
        if self.time_step.to_bits() != step.to_bits() {
            if self.time_step > 0.0 {
                let restart = self.write()?;
                self.open(Some(Saved { time_step: step, restart: &restart }))?;
            } else {
                self.begin(step, false)?;
            }
        }
        // Other processes would wait for this one: it takes part, and says then why it has failed.
        let set = self.set_loads(loads);
        let instance = self.instance()?;
        if substeps > 1 {
            instance.command(&format!("run {} pre no post no", substeps - 1))?;
        }
        for command in ["neigh_modify check no", "run 1 pre no post no", "neigh_modify check yes"] {
            instance.command(command)?;
        }
        self.hold()?;
        set
    }

    fn states(&mut self) -> Outcome<Vec<LoadedState>> {
        let gravity = self.gravity;
        let instance = self.instance()?;
        let held = instance.rows_of_atoms::<COLUMNS>(HELD)?.to_vec();
        let ids = instance.of_atoms::<i32>(c"id")?.to_vec();
        let mass = instance.of_atoms::<f64>(c"rmass")?.to_vec();
        let [x, v, w] =
            [c"x", c"v", c"omega"].map(|name| instance.rows_of_atoms(name).map(|rows| rows.to_vec()));
        let (x, v, w) = (x?, v?, w?);
        let state = |(k, held): (usize, &Held)| {
            let (force, torque) = (three(held, 0), three(held, 3));
            let state = State {
                id: id_of(ids[k]),
                orientation: [0.0, 0.0, 0.0, 1.0],
                position: x[k],
                velocity: v[k],
                angular_velocity: w[k],
                contact_force: (three(held, 6) - force).into(),
                contact_torque: (three(held, 9) / held[RATIO] - torque).into(),
            };
            LoadedState { state, force: (force - gravity * mass[k]).into(), torque: torque.into() }
        };
        Ok(held.iter().enumerate().map(state).collect())
    }

    fn contacts(&mut self) -> Outcome<Vec<ContactForce>> {
        if self.time_step <= 0.0 {
            return Ok(Vec::new());
        }
        let instance = self.instance.as_mut().ok_or("LAMMPS has not been set up")?;
        // The rows of one may move when the other is computed.
        let forces = instance.rows_of_pairs::<6>(c"forces")?;
        let pairs = instance.rows_of_pairs::<2>(c"pairs")?;
        let mut contacts = Vec::new();
        for (force, pair) in forces.iter().zip(&pairs) {
            let force = Vec3::new(force[0] + force[3], force[1] + force[4], force[2] + force[5]);
            let [a, b] = pair.map(|tag| id_of(tag as i32));
            if force != Vec3::zeros() {
                let force = if a < b { force } else { -force };
                contacts.push(ContactForce { first: a.min(b), second: a.max(b), force: force.into() });
            }
        }
        let ids = instance.of_atoms::<i32>(c"id")?.to_vec();
        for (fix, wall) in &self.plan.walls {
            for (row, &tag) in instance.rows_of_fix::<OF_WALL>(fix)?.iter().zip(&ids) {
                if row[0] != 0.0 {
                    let second = ContactState::of_wall(*wall);
                    contacts.push(ContactForce {
                        first: id_of(tag),
                        second,
                        force: [row[1], row[2], row[3]],
                    });
                }
            }
        }
        Ok(contacts)
    }

    fn save(&mut self) -> Outcome<Vec<u8>> {
        let (time_step, restart) = (self.time_step, self.write()?);
        self.open(Some(Saved { time_step, restart: &restart }))?;
        let first = [&time_step.to_bits().to_le_bytes()[..], &restart].concat();
        Ok(if self.seat.part == 0 { first } else { Vec::new() })
    }

    fn restore(&mut self, saved: &[u8]) -> Outcome<()> {
        let (time_step, restart) = saved.split_first_chunk().ok_or("what LAMMPS saved is not whole")?;
        let time_step = f64::from_bits(u64::from_le_bytes(*time_step));
        if !(time_step >= 0.0 && time_step.is_finite()) {
            return Err("what LAMMPS saved is not whole".to_owned());
        }
        self.open(Some(Saved { time_step, restart }))
    }
}
