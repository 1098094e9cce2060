//! The file operations of this process: counted, and one of them made to fail.
//!
//! The functions below have the names of those of the C library through which the standard library works, and the linker
//! prefers them. Each does what its namesake does, by a system call, unless it is its turn to fail.

use libc::{c_char, c_int, c_long, c_uint, c_void, off64_t, size_t, ssize_t};
use std::ffi::CStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The operations up to now, while somebody counts them.
#[derive(Default)]
struct Watch {
    on: bool,
    /// The operation that fails.
    fail: Option<usize>,
    /// The disk is full from now on.
    full: bool,
    /// All operations, in order.
    seen: Vec<String>,
}

static WATCH: Mutex<Watch> = Mutex::new(Watch { on: false, fail: None, full: false, seen: Vec::new() });
/// One test at a time.
static TURN: Mutex<()> = Mutex::new(());

fn watch() -> MutexGuard<'static, Watch> {
    WATCH.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits until no other test counts: all threads of the process are counted.
pub(super) fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does something of which the operation `fail` fails; returns its result, and all operations up to the end.
pub(super) fn count_and_fail<R>(fail: Option<usize>, work: impl FnOnce() -> R) -> (R, Vec<String>) {
    *watch() = Watch { on: true, fail, ..Watch::default() };
    let result = work();
    (result, std::mem::take(&mut *watch()).seen)
}

/// Counts an operation; `true` if it must fail.
fn fails(name: &str, what: impl FnOnce() -> String) -> bool {
    let mut watch = watch();
    if !watch.on {
        return false;
    }
    let n = watch.seen.len();
    watch.seen.push(format!("{name} {}", what()));
    watch.fail == Some(n)
}

fn text(path: *const c_char) -> String {
    // SAFETY: callers hand over a path, which ends in a zero.
    unsafe { CStr::from_ptr(path) }.to_string_lossy().into_owned()
}

fn refuse(error: c_int) -> c_long {
    // SAFETY: the place of `errno` of this thread.
    unsafe { *libc::__errno_location() = error };
    -1
}

/// Files of the system and of the terminal are not meant.
fn is_ours(path: &str) -> bool {
    !["/proc", "/sys", "/dev", "/etc"].iter().any(|of_system| path.starts_with(of_system))
}

/// A function that takes a path: its name, arguments, system call.
macro_rules! with_path {
    ($name:ident($path:ident $(, $argument:ident: $kind:ty)*), $call:expr) => {
        #[unsafe(no_mangle)]
        extern "C" fn $name($path: *const c_char $(, $argument: $kind)*) -> c_int {
            let shown = text($path);
            if is_ours(&shown) && fails(stringify!($name), || shown) {
                return refuse(libc::EIO) as c_int;
            }
            // SAFETY: the arguments are those of the caller, as this system call takes them.
            unsafe { $call as c_int }
        }
    };
}

// As the namesakes with a variable number of arguments: `mode` is passed in the same place.
with_path!(open64(path, flags: c_int, mode: c_uint), libc::syscall(libc::SYS_openat, libc::AT_FDCWD, path, flags, mode));
with_path!(mkdir(path, mode: c_uint), libc::syscall(libc::SYS_mkdirat, libc::AT_FDCWD, path, mode));
with_path!(unlink(path), libc::syscall(libc::SYS_unlinkat, libc::AT_FDCWD, path, 0));
with_path!(rmdir(path), libc::syscall(libc::SYS_unlinkat, libc::AT_FDCWD, path, libc::AT_REMOVEDIR));
with_path!(rename(from, to: *const c_char), libc::syscall(libc::SYS_renameat2, libc::AT_FDCWD, from, libc::AT_FDCWD, to, 0));

#[unsafe(no_mangle)]
extern "C" fn unlinkat(folder: c_int, path: *const c_char, flags: c_int) -> c_int {
    if fails("unlinkat", || text(path)) {
        return refuse(libc::EIO) as c_int;
    }
    // SAFETY: the arguments are those of the caller.
    unsafe { libc::syscall(libc::SYS_unlinkat, folder, path, flags) as c_int }
}

#[unsafe(no_mangle)]
extern "C" fn fsync(file: c_int) -> c_int {
    if fails("fsync", String::new) {
        return refuse(libc::EIO) as c_int;
    }
    // SAFETY: the argument is that of the caller.
    unsafe { libc::syscall(libc::SYS_fsync, file) as c_int }
}

#[unsafe(no_mangle)]
extern "C" fn ftruncate64(file: c_int, length: off64_t) -> c_int {
    if fails("ftruncate", String::new) {
        return refuse(libc::EIO) as c_int;
    }
    // SAFETY: the arguments are those of the caller.
    unsafe { libc::syscall(libc::SYS_ftruncate, file, length) as c_int }
}

#[unsafe(no_mangle)]
extern "C" fn read(file: c_int, bytes: *mut c_void, length: size_t) -> ssize_t {
    if length > 0 && fails("read", || format!("of {length}")) {
        return refuse(libc::EIO) as ssize_t;
    }
    // SAFETY: the arguments are those of the caller.
    unsafe { libc::syscall(libc::SYS_read, file, bytes, length) as ssize_t }
}

/// The disk is full after half of the bytes, and stays so.
#[unsafe(no_mangle)]
extern "C" fn write(file: c_int, bytes: *const c_void, mut length: size_t) -> ssize_t {
    if file > 2 && watch().full {
        return refuse(libc::ENOSPC) as ssize_t;
    }
    if file > 2 && fails("write", || format!("of {length}")) {
        watch().full = true;
        if length < 2 {
            return refuse(libc::ENOSPC) as ssize_t;
        }
        length /= 2;
    }
    // SAFETY: the arguments are those of the caller, or less.
    unsafe { libc::syscall(libc::SYS_write, file, bytes, length) as ssize_t }
}
