//! C API of Turbid: a case as the fluid of an external DEM, or stepped as it is. `include/turbid.h` is made from this file.
//!
//! Nothing that a caller passes ends the process: handles are numbers that are looked up, pointers are checked for null and
//! alignment, lengths are compared, and panics end as [`TURBID_PANIC`].

mod border;
mod types;

use border::{Failure, find, forget, guard, put, rows, store, text};
use std::ffi::{CStr, c_char};
use std::path::Path;
use turbid::case::{self, Origin};
use turbid::simulation::Session;
pub use types::{Body, Handle, Info, Load, Particle};

/// Done.
pub const TURBID_OK: i32 = 0;
/// A null pointer, an invalid handle, or an array of the wrong length.
pub const TURBID_ARGUMENT: i32 = 1;
/// A case, a file or states that are not possible, or not enough memory.
pub const TURBID_INPUT: i32 = 2;
/// The simulation diverged, or its engine or device failed.
pub const TURBID_FAILED: i32 = 3;
/// A defect of Turbid; please report it.
pub const TURBID_PANIC: i32 = 5;

/// Opens a case in `text`, from a file if `is_file`, on the communicator with a handle of Fortran's or on threads.
unsafe fn open(
    (source, is_file): (*const c_char, bool),
    options: *const c_char,
    caller_moves: i32,
    communicator: Option<i32>,
    handle: *mut Handle,
) -> i32 {
    guard(|| {
        // SAFETY: the caller of the C function vouches for texts that end with a zero.
        let options = if options.is_null() { String::new() } else { unsafe { text("options", options)? } };
        let options: Vec<String> =
            options.lines().filter(|line| !line.trim().is_empty()).map(str::to_owned).collect();
        // SAFETY: as above.
        let source = unsafe { text(if is_file { "path" } else { "text" }, source)? };
        if handle.is_null() || !handle.is_aligned() {
            return Err(Failure::argument("handle: a pointer to a turbid_handle is needed"));
        }
        let origin = if is_file { Origin::File(Path::new(&source)) } else { Origin::Text(&source, "case") };
        let session = match communicator {
            Some(handle) => Session::on_communicator(origin, &options, handle, caller_moves != 0),
            None => case::read_alone(origin, &options).and_then(|setup| match caller_moves {
                0 => Session::new(setup),
                _ => Session::caller_driven(setup),
            }),
        };
        let number = store(session?);
        // SAFETY: not null, aligned, and the caller vouches for its target.
        unsafe { handle.write(number) };
        Ok(())
    })
}

/// Opens a case from the file at `path` and stores its handle. `options` are lines that replace keys, as `--set` of the program
/// ("run.threads=1\nfluid.viscosity=1e-5"), or null. With `caller_moves` the caller moves the particles by
/// `turbid_set_particles`, else the engine of the case does.
///
/// # Safety
/// Texts end with a zero; `handle` is null or points to a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_open_file(
    path: *const c_char,
    options: *const c_char,
    caller_moves: i32,
    handle: *mut Handle,
) -> i32 {
    // SAFETY: the same contract.
    unsafe { open((path, true), options, caller_moves, None, handle) }
}

/// The same for the text of a case.
///
/// # Safety
/// As `turbid_open_file`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_open_text(
    text: *const c_char,
    options: *const c_char,
    caller_moves: i32,
    handle: *mut Handle,
) -> i32 {
    // SAFETY: the same contract.
    unsafe { open((text, false), options, caller_moves, None, handle) }
}

/// Opens a case from the file at `path` on the processes of a communicator, of which each has a block of the box: `communicator` is its
/// handle of Fortran's, `MPI_Comm_c2f(comm)`. The caller has started MPI by `MPI_Init_thread` with at least `MPI_THREAD_SERIALIZED`, as Turbid
/// calls it from a thread of its own, on a copy of the communicator. Needs a libturbid built with the feature `mpi`.
///
/// All functions with its handle are collective then, but `turbid_get_info` and `turbid_get_block`: all processes call them, in the same order.
/// Arrays of particles are of those of this process, ascending by id: those that it has set last, or those in its block if it has
/// set none.
///
/// # Safety
/// As `turbid_open_file`; `communicator` is that of a communicator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_open_comm_file(
    path: *const c_char,
    options: *const c_char,
    caller_moves: i32,
    communicator: i32,
    handle: *mut Handle,
) -> i32 {
    // SAFETY: the same contract.
    unsafe { open((path, true), options, caller_moves, Some(communicator), handle) }
}

/// The same for the text of a case.
///
/// # Safety
/// As `turbid_open_comm_file`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_open_comm_text(
    text: *const c_char,
    options: *const c_char,
    caller_moves: i32,
    communicator: i32,
    handle: *mut Handle,
) -> i32 {
    // SAFETY: the same contract.
    unsafe { open((text, false), options, caller_moves, Some(communicator), handle) }
}

/// Frees a simulation. Its handle is invalid from then on.
#[unsafe(no_mangle)]
pub extern "C" fn turbid_close(handle: Handle) -> i32 {
    guard(|| forget(handle))
}

/// Advances by `count` time steps. With particles that the caller moves: gives the loads for the states that were set last, then
/// moves the particles on at their velocities.
///
/// `TURBID_FAILED` for a failure in these steps; a fluid that is too fast is noticed in every eighth step only. From then on each
/// call gives the same error; what has been reached can still be read.
#[unsafe(no_mangle)]
pub extern "C" fn turbid_step(handle: Handle, count: u64) -> i32 {
    guard(|| Ok(find(handle)?.advance(count)?))
}

/// Advances to the step nearest to `time` (s), and checks for failures, also of the fluid.
#[unsafe(no_mangle)]
pub extern "C" fn turbid_run_until(handle: Handle, time: f64) -> i32 {
    guard(|| {
        if !time.is_finite() {
            return Err(Failure::argument("time: a finite number is needed"));
        }
        Ok(find(handle)?.run_until(time)?)
    })
}

/// Time since the start (s) and steps done; either pointer may be null.
///
/// # Safety
/// Each pointer is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_time(handle: Handle, time: *mut f64, steps: *mut u64) -> i32 {
    guard(|| {
        let session = find(handle)?;
        let done = session.steps_done()?;
        // SAFETY: the same contract.
        unsafe {
            put("time", time, 1, &[done as f64 * session.setup().time_step], true)?;
            put("steps", steps, 1, &[done], true)
        }
    })
}

/// Sizes and constants of a case.
///
/// # Safety
/// `info` is null or points to a `turbid_info`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_info(handle: Handle, info: *mut Info) -> i32 {
    // SAFETY: the same contract.
    guard(|| unsafe { put("info", info, 1, &[Info::of(find(handle)?.setup())], false) })
}

/// Number of particles of this process: of all, unless it is one of several on a communicator.
///
/// # Safety
/// `count` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_count(handle: Handle, count: *mut usize) -> i32 {
    // SAFETY: the same contract.
    guard(|| unsafe { put("count", count, 1, &[find(handle)?.count()?], false) })
}

/// First cell of this process along x, y, z, and the one after the last: of the whole box, unless it is one of several on a communicator.
///
/// # Safety
/// Each pointer is null or has room for three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_block(handle: Handle, first: *mut usize, end: *mut usize) -> i32 {
    guard(|| {
        let block = find(handle)?.block();
        // SAFETY: the same contract.
        unsafe {
            put("first", first, 3, &block.lo, true)?;
            put("end", end, 3, &block.hi, true)
        }
    })
}

/// Masses and sizes of the particles of this process, in the order of `turbid_get_particles`. `count` is their number.
///
/// # Safety
/// `bodies` is null or has room for `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_bodies(handle: Handle, bodies: *mut Body, count: usize) -> i32 {
    guard(|| {
        let session = find(handle)?;
        let setup = session.setup();
        let all: Vec<Body> = session.particles()?.iter().map(|particle| Body::of(setup, particle)).collect();
        // SAFETY: the same contract.
        unsafe { put("bodies", bodies, count, &all, false) }
    })
}

/// States of the particles of this process, ascending by id. `count` is their number.
///
/// # Safety
/// `particles` is null or has room for `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_particles(handle: Handle, particles: *mut Particle, count: usize) -> i32 {
    guard(|| {
        let all: Vec<Particle> = find(handle)?.particles()?.iter().map(Particle::of).collect();
        // SAFETY: the same contract.
        unsafe { put("particles", particles, count, &all, false) }
    })
}

/// Number of particles that a process gives: all, or any of them if it is one of several, which all of them check together.
fn needed(session: &Session, count: usize) -> usize {
    if session.is_of_several() { count } else { session.setup().particles.len() }
}

/// Sets the states of all particles, ascending by id; one of several processes on a communicator gives any of them, and has these from then on.
/// Positions are wrapped, orientations normalised. The fluid meets them in the
/// next step. Refused are states that are not finite, that move by more than a cell or half a turn in a step, that overlap others or
/// walls by more than a quarter of the thickness; and, where the caller moves the particles, positions more than a cell from those
/// before the last step, if there was one. On an error nothing has changed.
///
/// # Safety
/// `particles` is null or points to `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_set_particles(
    handle: Handle,
    particles: *const Particle,
    count: usize,
) -> i32 {
    guard(|| {
        let session = find(handle)?;
        // SAFETY: the same contract.
        let states = unsafe { rows("particles", particles, count, needed(&session, count))? };
        Ok(session.set_particles(states.iter().map(Particle::state).collect())?)
    })
}

/// Loads of the fluid on the particles of this process in the last step: with buoyancy, without weight. Zeros before the first step.
///
/// # Safety
/// `loads` is null or has room for `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_loads(handle: Handle, loads: *mut Load, count: usize) -> i32 {
    guard(|| {
        let all: Vec<Load> = find(handle)?.loads()?.iter().map(Load::of).collect();
        // SAFETY: the same contract.
        unsafe { put("loads", loads, count, &all, false) }
    })
}

/// Loads of the caller that the engine of the case adds to those of the fluid, from now on in every step. Refused where the caller
/// moves the particles.
///
/// # Safety
/// `loads` is null or points to `count` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_set_external_loads(handle: Handle, loads: *const Load, count: usize) -> i32 {
    guard(|| {
        let session = find(handle)?;
        // SAFETY: the same contract.
        let loads = unsafe { rows("loads", loads, count, needed(&session, count))? };
        Ok(session.set_external_loads(loads.iter().map(Load::state).collect())?)
    })
}

/// Fields of the cells of this process (`turbid_get_block`), of which `cells` is the number: `velocity` (m/s, three numbers a cell), `pressure` (Pa above that of the
/// fluid at rest) and `solid_fraction` (-). Cell (x, y, z), counted from the first one, is number
/// x + nx (y + ny z). Any of the pointers may be null.
///
/// # Safety
/// Each pointer is null or has room for its numbers: `3 * cells` of `velocity`, `cells` of the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_fields(
    handle: Handle,
    velocity: *mut f32,
    pressure: *mut f32,
    solid_fraction: *mut f32,
    cells: usize,
) -> i32 {
    guard(|| {
        let fields = find(handle)?.fields()?;
        let velocities: Vec<f32> = fields.velocity.iter().flatten().copied().collect();
        // SAFETY: the same contract.
        unsafe {
            put("velocity", velocity, cells.saturating_mul(3), &velocities, true)?;
            put("pressure", pressure, cells, &fields.pressure, true)?;
            put("solid_fraction", solid_fraction, cells, &fields.solid_fraction, true)
        }
    })
}

/// Mean velocity of fluid and particles together (m/s, three numbers) and solid volume fraction (-) of the box.
///
/// # Safety
/// `velocity` is null or has room for three numbers, `solid_fraction` is null or points to one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn turbid_get_mean_flow(
    handle: Handle,
    velocity: *mut f64,
    solid_fraction: *mut f64,
) -> i32 {
    guard(|| {
        let mean = find(handle)?.on_ranks(|simulation| Ok(simulation.measure().mean))?[0];
        // SAFETY: the same contract.
        unsafe {
            put("velocity", velocity, 3, mean.velocity.as_slice(), true)?;
            put("solid_fraction", solid_fraction, 1, &[mean.solid_fraction], true)
        }
    })
}

/// Text of the last error on this thread; empty before the first. It stays until the next error on this thread.
#[unsafe(no_mangle)]
pub extern "C" fn turbid_last_error() -> *const c_char {
    border::last_error()
}

/// Version of Turbid.
#[unsafe(no_mangle)]
pub extern "C" fn turbid_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => panic!("a version has no zero"),
        };
    VERSION.as_ptr()
}
