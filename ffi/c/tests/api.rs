//! The functions as a C program calls them: good calls, wrong ones, and what the errors say.

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};
use turbid_c::*;

const CASE: &str = "domain.size = [4e-3, 4e-3, 4e-3]\nfluid = { density = 1000.0, viscosity = 1e-5 }\n\
    lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }\nrun = { end.steps = 100, threads = 1 }\n\
    particles = [{ shape.sphere.diameter = 1e-3, density = 2500.0, list = [[2e-3, 2e-3, 2e-3]] }]";

fn open(caller_moves: i32) -> Handle {
    let (text, mut handle) = (CString::new(CASE).unwrap(), 0);
    // SAFETY: a text, and a handle to write to.
    let code = unsafe { turbid_open_text(text.as_ptr(), null(), caller_moves, &raw mut handle) };
    assert_eq!(code, TURBID_OK, "{}", said());
    handle
}

/// The last error.
fn said() -> String {
    // SAFETY: a text that ends with a zero.
    unsafe { CStr::from_ptr(turbid_last_error()) }.to_str().unwrap().to_owned()
}

fn particle(handle: Handle) -> Particle {
    let mut all = [Particle {
        id: 0,
        kind: 0,
        position: [0.0; 3],
        orientation: [0.0; 4],
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    }];
    // SAFETY: room for one.
    assert_eq!(unsafe { turbid_get_particles(handle, all.as_mut_ptr(), 1) }, TURBID_OK, "{}", said());
    all[0]
}

fn refused(code: i32, text: &str) {
    assert_eq!(code, TURBID_ARGUMENT);
    assert!(said().contains(text), "{}", said());
}

#[test]
fn a_case_is_opened_stepped_read_and_closed() {
    let handle = open(0);
    assert_eq!(turbid_step(handle, 10), TURBID_OK);
    assert_eq!(turbid_run_until(handle, 0.0), TURBID_OK);
    let (mut time, mut steps, mut mean, mut fraction) = (0.0, 0, [0.0; 3], 0.0);
    // SAFETY: numbers to write to; a null pointer is passed over.
    unsafe {
        assert_eq!(turbid_get_time(handle, &raw mut time, &raw mut steps), TURBID_OK);
        assert_eq!(turbid_get_time(handle, null_mut(), null_mut()), TURBID_OK);
        assert_eq!(turbid_get_mean_flow(handle, mean.as_mut_ptr(), &raw mut fraction), TURBID_OK);
    }
    assert_eq!(steps, 10);
    assert!((fraction * 64.0 * 6.0 / std::f64::consts::PI - 1.0).abs() < 0.1, "{fraction}");
    let mut info = std::mem::MaybeUninit::<Info>::uninit();
    // SAFETY: room for it, and it has been written if the code says so.
    let info = unsafe {
        assert_eq!(turbid_get_info(handle, info.as_mut_ptr()), TURBID_OK);
        info.assume_init()
    };
    assert_eq!((info.particles, info.cells, info.periodic), (1, [16; 3], [1; 3]));
    assert!((time / info.time_step - 10.0).abs() < 1e-12);
    assert!(particle(handle).velocity[2] < 0.0);
    let (mut fraction, cells) = (vec![0_f32; 16 * 16 * 16], 16 * 16 * 16);
    // SAFETY: room for all cells; the others are passed over.
    unsafe {
        assert_eq!(
            turbid_get_fields(handle, null_mut(), null_mut(), fraction.as_mut_ptr(), cells),
            TURBID_OK
        );
    }
    assert_eq!((fraction[0], fraction[8 + 16 * (8 + 16 * 7)]), (0.0, 1.0));
    assert_eq!(turbid_close(handle), TURBID_OK);
    refused(turbid_close(handle), "is none, or closed");
    refused(turbid_step(handle, 1), "is none, or closed");
}

#[test]
fn a_caller_moves_a_sphere_and_gets_its_load() {
    let handle = open(1);
    let mut sphere = particle(handle);
    sphere.velocity = [0.0, 0.0, -1e-2];
    let mut load = Load { force: [0.0; 3], torque: [0.0; 3] };
    // SAFETY: a particle to read, and room for a load.
    unsafe {
        assert_eq!(turbid_set_particles(handle, &raw const sphere, 1), TURBID_OK, "{}", said());
        assert_eq!(turbid_step(handle, 5), TURBID_OK);
        assert_eq!(turbid_get_loads(handle, &raw mut load, 1), TURBID_OK);
    }
    // Drag and buoyancy point upwards.
    assert!(load.force[2] > 1000.0 * 9.80665 * 5.2e-10, "{:?}", load.force);
    assert!(particle(handle).position[2] < 2e-3);
    sphere.velocity[0] = f64::NAN;
    // SAFETY: as above.
    assert_eq!(unsafe { turbid_set_particles(handle, &raw const sphere, 1) }, TURBID_INPUT);
    assert!(said().contains("the velocity of particle 0 is not finite"), "{}", said());
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn a_communicator_before_mpi_is_started_is_an_error() {
    let (text, mut handle) = (CString::new(CASE).unwrap(), 0);
    // SAFETY: a text, and a handle to write to.
    let code = unsafe { turbid_open_comm_text(text.as_ptr(), null(), 1, 0, &raw mut handle) };
    assert_eq!((code, handle), (TURBID_INPUT, 0));
    assert!(said().contains("MPI"), "{}", said());
}

#[test]
fn a_process_alone_has_all_particles_and_cells() {
    let (handle, mut count, mut first, mut end) = (open(1), 0, [9; 3], [0; 3]);
    // SAFETY: numbers to write to.
    unsafe {
        assert_eq!(turbid_get_count(handle, &raw mut count), TURBID_OK);
        assert_eq!(turbid_get_block(handle, first.as_mut_ptr(), end.as_mut_ptr()), TURBID_OK);
    }
    assert_eq!((count, first, end), (1, [0; 3], [16; 3]));
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn what_would_be_ignored_or_never_end_is_an_error() {
    let handle = open(1);
    let load = Load { force: [0.0; 3], torque: [0.0; 3] };
    // SAFETY: a load to read.
    assert_eq!(unsafe { turbid_set_external_loads(handle, &raw const load, 1) }, TURBID_INPUT);
    assert!(said().contains("the caller moves the particles"), "{}", said());
    for time in [1e300, -1e300, 1e15] {
        assert_eq!(turbid_run_until(handle, time), TURBID_INPUT);
        assert!(said().contains("steps of"), "{}", said());
    }
    assert_eq!(turbid_step(handle, u64::MAX), TURBID_INPUT, "-1 in C");
    let mut sphere = particle(handle);
    sphere.position[0] = 1e300;
    // SAFETY: a particle to read.
    assert_eq!(unsafe { turbid_set_particles(handle, &raw const sphere, 1) }, TURBID_INPUT);
    assert!(said().contains("too far to be wrapped"), "{}", said());
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn a_simulation_of_the_parent_is_an_error_in_a_forked_process() {
    let handle = open(0);
    // SAFETY: the child makes calls of this library only, and ends without those of the parent's exit; one that waits is ended.
    let child = unsafe { libc::fork() };
    if child == 0 {
        // SAFETY: as above.
        unsafe { libc::alarm(20) };
        let told = turbid_step(handle, 1) == TURBID_INPUT && said().contains("is a fork");
        let closed = turbid_close(handle) == TURBID_OK;
        // SAFETY: as above.
        unsafe { libc::_exit(i32::from(!(told && closed))) };
    }
    let mut status = 0;
    // SAFETY: a number to write to.
    assert_eq!(unsafe { libc::waitpid(child, &raw mut status, 0) }, child);
    assert_eq!(status, 0, "the child got no error, or waited");
    assert_eq!(turbid_step(handle, 1), TURBID_OK, "{}", said());
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn loads_of_the_caller_bear_the_sphere() {
    let handle = open(0);
    let mut body = std::mem::MaybeUninit::<Body>::uninit();
    // SAFETY: room for it, and it has been written if the code says so.
    let body = unsafe {
        assert_eq!(turbid_get_bodies(handle, body.as_mut_ptr(), 1), TURBID_OK);
        body.assume_init()
    };
    let weight = 9.80665 * (body.mass - 1000.0 * body.volume);
    let load = Load { force: [0.0, 0.0, weight], torque: [0.0; 3] };
    // SAFETY: a load to read.
    assert_eq!(unsafe { turbid_set_external_loads(handle, &raw const load, 1) }, TURBID_OK);
    assert_eq!(turbid_step(handle, 20), TURBID_OK);
    assert!(particle(handle).velocity[2].abs() < 1e-3, "{:?}", particle(handle).velocity);
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn null_pointers_wrong_handles_and_wrong_lengths_get_an_error_code() {
    let handle = open(1);
    let (text, mut other) = (CString::new(CASE).unwrap(), 0);
    let mut load = Load { force: [0.0; 3], torque: [0.0; 3] };
    // SAFETY: null pointers, and room for what is said to have room.
    unsafe {
        refused(turbid_open_text(null(), null(), 0, &raw mut other), "text: null");
        refused(turbid_open_file(null(), null(), 0, &raw mut other), "path: null");
        refused(turbid_open_text(text.as_ptr(), null(), 0, null_mut()), "handle: a pointer");
        refused(turbid_open_text(c"\xff".as_ptr(), null(), 0, &raw mut other), "text: not UTF-8");
        refused(turbid_get_info(handle, null_mut()), "info: null");
        refused(turbid_get_particles(handle, null_mut(), 1), "particles: null");
        refused(turbid_set_particles(handle, null(), 1), "particles: null");
        refused(turbid_get_loads(handle, &raw mut load, 2), "loads: 2 where 1 are needed");
        refused(turbid_set_external_loads(handle, &raw const load, 0), "loads: 0 where 1 are needed");
        refused(turbid_get_bodies(handle, null_mut(), 1), "bodies: null");
        let misaligned = (&raw mut load).byte_add(1);
        refused(turbid_get_loads(handle, misaligned, 1), "loads: null or not aligned");
        let mut pressure = [0_f32; 8];
        refused(
            turbid_get_fields(handle, null_mut(), pressure.as_mut_ptr(), null_mut(), 8),
            "8 where 4096 are needed",
        );
        for wrong in [0, -1, i64::MIN, handle + 1000] {
            refused(turbid_step(wrong, 1), "is none, or closed");
            refused(turbid_get_time(wrong, null_mut(), null_mut()), "is none, or closed");
            refused(turbid_get_particles(wrong, null_mut(), 1), "is none, or closed");
            refused(turbid_get_mean_flow(wrong, null_mut(), null_mut()), "is none, or closed");
        }
    }
    refused(turbid_run_until(handle, f64::NAN), "time: a finite number");
    assert_eq!(other, 0);
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn errors_of_a_case_and_of_a_file_have_their_texts_and_options_replace_keys() {
    let (text, mut handle) = (CString::new(CASE).unwrap(), 0);
    // SAFETY: texts, and a handle to write to.
    unsafe {
        let wrong = c"lattice.relaxation_time=0.4";
        assert_eq!(turbid_open_text(text.as_ptr(), wrong.as_ptr(), 0, &raw mut handle), TURBID_INPUT);
        assert!(said().contains("must be a finite number above 0.5"), "{}", said());
        assert_eq!(turbid_open_file(c"/nowhere.toml".as_ptr(), null(), 0, &raw mut handle), TURBID_INPUT);
        assert!(said().contains("/nowhere.toml"), "{}", said());
        let good = c"lattice.relaxation_time=0.7\n\nrun.threads=2\n";
        assert_eq!(
            turbid_open_text(text.as_ptr(), good.as_ptr(), 0, &raw mut handle),
            TURBID_OK,
            "{}",
            said()
        );
        assert!(!CStr::from_ptr(turbid_version()).is_empty());
    }
    assert_eq!(turbid_close(handle), TURBID_OK);
}

#[test]
fn a_simulation_that_diverges_says_so_at_once_and_in_every_later_call() {
    let handle = open(0);
    let load = Load { force: [1.0, 0.0, 0.0], torque: [0.0; 3] };
    // SAFETY: a load to read.
    assert_eq!(unsafe { turbid_set_external_loads(handle, &raw const load, 1) }, TURBID_OK);
    // At once, and from then on.
    for _ in 0..3 {
        assert_eq!(turbid_step(handle, 1), TURBID_FAILED);
        assert!(said().contains("diverged at step 0: "), "{}", said());
    }
    assert_eq!(turbid_run_until(handle, 1.0), TURBID_FAILED);
    assert!(particle(handle).position[0].is_finite());
    assert_eq!(turbid_close(handle), TURBID_OK);
}
