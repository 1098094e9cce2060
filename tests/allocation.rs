//! A run in which the n-th large allocation fails, for every n: each ends with exit code 2 and words on all ranks.
//!
//! Each is a process of its own, this program again, as what fails is the allocator of the whole process.

#[path = "common/child.rs"]
mod child;

use child::{Guard, poll};
use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Read;
use std::path::Path;
use std::process::{Command, exit};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicUsize, Ordering};
use turbid::{case, simulation};
use turbid_cli::cli::Guarded;

const CASE: &str = r#"
[domain]
size = { diameters = [8, 8, 8] }
[fluid]
density = 1000.0
archimedes = 1000
precision = "f64"
[lattice]
cells_per_diameter = 8
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 2
[run]
end = { steps = 1 }
[output]
fields_every = { steps = 1 }
picture_every = "never"
particles_every = "never"
"#;

/// Smallest size of the allocations that count (bytes).
const LARGE: usize = 128 << 10;
/// From this size on they do not (bytes): the case needs none, but a thread that starts asks whether there would be room.
const PROBE: usize = 64 << 20;
/// The one that fails, and the folder that the run writes to.
const NTH: &str = "TURBID_TEST_ALLOCATION";
const OUT: &str = "TURBID_TEST_OUT";

#[global_allocator]
static ALLOCATOR: Guarded<Failing> = Guarded(Failing);

/// The number of the large allocation that fails, from one; before the run none does.
static FAILS: AtomicUsize = AtomicUsize::new(usize::MAX);
static COUNT: AtomicUsize = AtomicUsize::new(0);

struct Failing;

impl Failing {
    fn fails(bytes: usize) -> bool {
        let fails = FAILS.load(Ordering::Relaxed);
        (LARGE..PROBE).contains(&bytes)
            && fails < usize::MAX
            && COUNT.fetch_add(1, Ordering::Relaxed) + 1 == fails
    }
}

// SAFETY: what does not fail is the system's.
unsafe impl GlobalAlloc for Failing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if Self::fails(layout.size()) {
            return null_mut();
        }
        // SAFETY: by the contract of this method.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if Self::fails(layout.size()) {
            return null_mut();
        }
        // SAFETY: by the contract of this method.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, start: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if Self::fails(size) {
            return null_mut();
        }
        // SAFETY: by the contract of this method.
        unsafe { System.realloc(start, layout, size) }
    }

    unsafe fn dealloc(&self, start: *mut u8, layout: Layout) {
        // SAFETY: by the contract of this method.
        unsafe { System.dealloc(start, layout) }
    }
}

fn main() {
    match (std::env::var(NTH), std::env::var_os(OUT)) {
        (Ok(nth), Some(out)) => run(nth.parse().unwrap(), Path::new(&out)),
        _ => each_fails(),
    }
}

/// Runs the case on two ranks, with one large allocation less than it asks for.
fn run(nth: usize, out: &Path) -> ! {
    let mut setup = case::from_text(CASE, "case", &[]).unwrap();
    (setup.plan.threads, setup.plan.output.directory) = (2, out.to_path_buf());
    let options = simulation::RunOptions::default();
    FAILS.store(nth, Ordering::Relaxed);
    let result = simulation::run(&setup, &options);
    let tried = COUNT.load(Ordering::Relaxed);
    FAILS.store(usize::MAX, Ordering::Relaxed);
    exit(match result {
        Err(error) => {
            eprintln!("error: {error}");
            error.exit_code()
        }
        Ok(_) if tried < nth => 0,
        // Somebody has got along without.
        Ok(_) => 1,
    })
}

fn each_fails() {
    let program = std::env::current_exe().unwrap();
    let mut messages = Vec::new();
    for nth in 1.. {
        assert!(nth < 1000, "a run of one step has no end");
        let out = tempfile::tempdir().unwrap();
        let mut command = Command::new(&program);
        command.env(NTH, nth.to_string()).env(OUT, out.path().join("out"));
        let mut child = Guard::of(command);
        let status = poll("a run that is out of memory", || child.0.try_wait().unwrap());
        let mut said = String::new();
        child.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        if status.code() == Some(0) {
            break;
        }
        assert_eq!(status.code(), Some(2), "allocation {nth}: {status}\n{said}");
        assert!(
            said.contains("cannot allocate ") || said.contains("out of memory"),
            "allocation {nth}: {said}"
        );
        messages.push(said);
    }
    for what in [
        "for the populations of a block of ",
        "for the messages between neighbouring blocks",
        "for a file of fields",
    ] {
        assert!(messages.iter().any(|said| said.contains(what)), "{what}: {messages:?}");
    }
}
