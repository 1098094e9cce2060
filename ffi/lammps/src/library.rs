//! The C library of LAMMPS, loaded while the program runs, and an instance of it: commands and arrays.

use crate::PACKAGE;
use crate::screen::Screen;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::fs::File;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

/// A failure is a message.
pub(crate) use turbid_process::Outcome;

/// Name of the library.
const NAME: &str = "liblammps.so.0";

/// Argument of `lammps_extract_compute`: numbers by pair.
const LOCAL: c_int = 2;
/// Argument of `lammps_extract_fix`: numbers by atom.
const BY_ATOM: c_int = 1;
/// Argument of both: the number of rows.
const ROWS: c_int = 0;
/// Argument of both: the rows.
const ARRAY: c_int = 2;

type Handle = *mut c_void;

/// Adds to the forces of an instance: pointer of the caller, step, number of atoms, their ids, positions, forces.
pub(crate) type Callback = extern "C" fn(*mut c_void, i64, c_int, *mut c_int, *mut *mut f64, *mut *mut f64);

macro_rules! functions {
    ($($name:ident: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Functions of the library.
        #[derive(Debug)]
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// # Safety
            /// The library is LAMMPS, and stays loaded.
            unsafe fn of(library: &Library) -> Result<Self, libloading::Error> {
                Ok(Self {
                    // SAFETY: these are the types of `library.h`, with `bigint` of 64 bits and `tagint` of 32, which is checked.
                    $($name: *unsafe { library.get(concat!("lammps_", stringify!($name))) }?,)*
                })
            }
        }
    };
}

functions! {
    open_no_mpi: fn(c_int, *mut *mut c_char, *mut Handle) -> Handle;
    open_fortran: fn(c_int, *mut *mut c_char, c_int) -> Handle;
    close: fn(Handle);
    mpi_finalize: fn();
    command: fn(Handle, *const c_char) -> *mut c_char;
    has_error: fn(Handle) -> c_int;
    get_last_error_message: fn(Handle, *mut c_char, c_int) -> c_int;
    extract_setting: fn(Handle, *const c_char) -> c_int;
    extract_global: fn(Handle, *const c_char) -> *mut c_void;
    extract_atom: fn(Handle, *const c_char) -> *mut c_void;
    extract_compute: fn(Handle, *const c_char, c_int, c_int) -> *mut c_void;
    extract_fix: fn(Handle, *const c_char, c_int, c_int, c_int, c_int) -> *mut c_void;
    create_atoms: fn(Handle, c_int, *const c_int, *const c_int, *const f64, *const f64, *const c_int, c_int) -> c_int;
    set_fix_external_callback: fn(Handle, *const c_char, Callback, *mut c_void);
}

/// The library, and the stream that it takes for its screen.
#[derive(Debug)]
struct Lammps {
    functions: Functions,
    /// The variable `stdout` of C as LAMMPS sees it.
    stdout: *mut *mut libc::FILE,
}

// SAFETY: functions do not belong to a thread, and the variable is changed under a lock.
unsafe impl Send for Lammps {}
// SAFETY: as above.
unsafe impl Sync for Lammps {}

/// Held while the variable `stdout` has another value.
static OPENING: Mutex<()> = Mutex::new(());

/// True once an instance has been opened that has started MPI, if nobody else had.
static STARTED: AtomicBool = AtomicBool::new(false);

/// Loads the library.
///
/// # Errors
/// The reason why that cannot be, with a remedy.
pub fn load() -> Result<(), String> {
    library().map(drop)
}

fn library() -> Result<&'static Lammps, String> {
    static LAMMPS: OnceLock<Result<Lammps, String>> = OnceLock::new();
    LAMMPS.get_or_init(open).as_ref().map_err(Clone::clone)
}

fn open() -> Result<Lammps, String> {
    // LIGGGHTS has the names of LAMMPS; each must find its own.
    let flags = RTLD_NOW | RTLD_LOCAL | libc::RTLD_DEEPBIND;
    // SAFETY: LAMMPS and the libraries below it may be loaded at any time.
    let library = unsafe { Library::open(Some(NAME), flags) }
        .map_err(|e| format!("cannot load {NAME} ({e})\n  on Debian: apt-get install {PACKAGE}"))?;
    let misses = |e: libloading::Error| format!("{NAME} is not a LAMMPS of 2021 or later: {e}");
    // SAFETY: the library is LAMMPS, and is never unloaded.
    let functions = unsafe { Functions::of(&library) }.map_err(misses)?;
    // SAFETY: a variable of C of this type.
    let stdout = *unsafe { library.get::<*mut *mut libc::FILE>("stdout") }.map_err(misses)?;
    let _ = library.into_raw();
    Ok(Lammps { functions, stdout })
}

/// Ends MPI if LAMMPS has started it in this process; for the end of the program.
pub fn end() {
    if let (true, Ok(library)) = (STARTED.swap(false, Ordering::Relaxed), library()) {
        // SAFETY: there is no instance any more, and nothing calls MPI after this.
        unsafe { (library.functions.mpi_finalize)() };
    }
}

/// An instance of LAMMPS.
#[derive(Debug)]
pub(crate) struct Instance {
    library: &'static Lammps,
    handle: Handle,
    screen: Arc<Screen>,
}

// SAFETY: an instance is not bound to the thread that made it; whoever has this value is its only user.
unsafe impl Send for Instance {}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the instance is not used after this. It closes its stream.
        unsafe { (self.library.functions.close)(self.handle) };
    }
}

impl Instance {
    /// In the processes of a communicator (a handle of Fortran's), or in this one alone; what it prints until the end of the set-up goes to
    /// the log.
    pub(crate) fn open(communicator: Option<i32>, log: Option<File>) -> Outcome<Self> {
        let library = library()?;
        let screen = Arc::new(Screen::default());
        screen.set_log(log);
        let mut arguments: Vec<*mut c_char> =
            [c"lammps", c"-log", c"none", c"-nocite"].map(|word| word.as_ptr().cast_mut()).to_vec();
        let count = arguments.len() as c_int;
        arguments.push(ptr::null_mut());
        let lock = OPENING.lock().map_err(|e| e.to_string())?;
        let stream = screen.stream()?;
        // SAFETY: nobody else changes the variable under this lock; Rust's own output does not use it.
        let before = unsafe { library.stdout.replace(stream) };
        let words = arguments.as_mut_ptr();
        let functions = &library.functions;
        let handle = match communicator {
            // SAFETY: the arguments are C strings, which are only read, and the handle is one of MPI's.
            Some(communicator) => unsafe { (functions.open_fortran)(count, words, communicator) },
            // SAFETY: as above.
            None => unsafe { (functions.open_no_mpi)(count, words, ptr::null_mut()) },
        };
        STARTED.fetch_or(communicator.is_none(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { library.stdout.write(before) };
        drop(lock);
        if handle.is_null() {
            return Err("LAMMPS does not start".to_owned());
        }
        let instance = Self { library, handle, screen };
        if instance.setting(c"tagint") != 4 || instance.setting(c"bigint") != 8 {
            return Err("this LAMMPS has ids or steps of other sizes than usual (LAMMPS_SMALLBIG)".to_owned());
        }
        Ok(instance)
    }

    /// Ends the log: only an error is printed from here on.
    pub(crate) fn set_up_ends(&self) {
        self.screen.set_log(None);
    }

    /// An error ends the process, unless LAMMPS was built with exceptions.
    pub(crate) fn command(&self, command: &str) -> Outcome<()> {
        let text = CString::new(command).map_err(|_| "a command with a zero byte")?;
        let functions = &self.library.functions;
        // SAFETY: the instance is alive, and the text a C string that is only read.
        unsafe { (functions.command)(self.handle, text.as_ptr()) };
        // SAFETY: the instance is alive.
        if unsafe { (functions.has_error)(self.handle) } == 0 {
            return Ok(());
        }
        let mut message = [0_u8; 1024];
        let length = message.len() as c_int - 1;
        // SAFETY: there is room for that many bytes.
        unsafe { (functions.get_last_error_message)(self.handle, message.as_mut_ptr().cast(), length) };
        let message = CStr::from_bytes_until_nul(&message).unwrap_or_default().to_string_lossy();
        Err(format!("{}\n  at the command: {command}", message.trim()))
    }

    pub(crate) fn commands<'a>(&self, commands: impl IntoIterator<Item = &'a String>) -> Outcome<()> {
        commands.into_iter().try_for_each(|command| self.command(command))
    }

    fn setting(&self, name: &CStr) -> c_int {
        // SAFETY: the instance is alive, the name a C string.
        unsafe { (self.library.functions.extract_setting)(self.handle, name.as_ptr()) }
    }

    /// Number of the atoms of this process.
    pub(crate) fn count(&self) -> usize {
        self.setting(c"nlocal").max(0) as usize
    }

    /// Makes atoms of these types, from 1, with these ids, from 1, in the middle of the block of this process, behind those that there are.
    pub(crate) fn create(&mut self, ids: &[i32], kinds: &[i32]) -> Outcome<()> {
        assert_eq!(ids.len(), kinds.len());
        let corner = |name: &CStr| -> Outcome<[f64; 3]> {
            // SAFETY: the instance is alive, the name a C string.
            let place = unsafe { (self.library.functions.extract_global)(self.handle, name.as_ptr()) };
            if place.is_null() {
                return Err(format!("LAMMPS has no `{}`", name.to_string_lossy()));
            }
            // SAFETY: three numbers of the instance.
            Ok(unsafe { *place.cast() })
        };
        let (lo, hi) = (corner(c"sublo")?, corner(c"subhi")?);
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (lo[i] + hi[i]));
        let (positions, none) = (vec![middle; ids.len()], ptr::null());
        let (count, id, kind) = (ids.len() as c_int, ids.as_ptr(), kinds.as_ptr());
        let position = positions.as_flattened().as_ptr();
        let create = self.library.functions.create_atoms;
        // SAFETY: the instance is alive; the arrays have that many numbers, three times as many the positions, and are only read.
        unsafe { create(self.handle, count, id, kind, position, ptr::null(), none, 0) };
        if self.count() == ids.len() { Ok(()) } else { Err("LAMMPS does not make all particles".to_owned()) }
    }

    /// Has the fix of this name call `callback` with the address of this instance in LAMMPS.
    pub(crate) fn set_callback(&mut self, fix: &CStr, callback: Callback) {
        // SAFETY: the instance has the fix of that name, of the style `external`.
        unsafe {
            (self.library.functions.set_fix_external_callback)(
                self.handle,
                fix.as_ptr(),
                callback,
                self.handle,
            );
        }
    }

    /// Numbers that each atom of this process has one of.
    pub(crate) fn of_atoms<T: Number>(&mut self, name: &CStr) -> Outcome<&mut [T]> {
        let n = self.count();
        if n == 0 {
            return Ok(&mut []);
        }
        // SAFETY: the instance is alive, the name a C string.
        let values: *mut T =
            unsafe { (self.library.functions.extract_atom)(self.handle, name.as_ptr()) }.cast();
        if values.is_null() {
            return Err(format!("LAMMPS has no `{}`", name.to_string_lossy()));
        }
        // SAFETY: each atom has one such number, and the instance is lent as long as they are.
        Ok(unsafe { std::slice::from_raw_parts_mut(values, n) })
    }

    /// Numbers that each atom of this process has `N` of.
    pub(crate) fn rows_of_atoms<const N: usize>(&mut self, name: &CStr) -> Outcome<&mut [[f64; N]]> {
        let n = self.count();
        // SAFETY: the instance is alive and lent to this call; the array has `N` columns.
        unsafe { rows_of_atoms(self.handle, name, n) }
    }

    /// Numbers that a fix has `N` of for each atom.
    pub(crate) fn rows_of_fix<const N: usize>(&self, name: &CStr) -> Outcome<&[[f64; N]]> {
        let extract = self.library.functions.extract_fix;
        // SAFETY: the instance is alive, the name a C string.
        let rows = unsafe { extract(self.handle, name.as_ptr(), BY_ATOM, ARRAY, 0, 0) };
        // SAFETY: the array has `N` columns.
        unsafe { rows_at(rows.cast(), self.count(), name) }.map(|rows| &*rows)
    }

    /// Rows of a local compute, which computes them if it has not.
    pub(crate) fn rows_of_pairs<const N: usize>(&self, name: &CStr) -> Outcome<Vec<[f64; N]>> {
        let ask = |what| {
            // SAFETY: the instance is alive, the name a C string.
            unsafe { (self.library.functions.extract_compute)(self.handle, name.as_ptr(), LOCAL, what) }
        };
        let count: *mut c_int = ask(ROWS).cast();
        if count.is_null() {
            return Err(format!("LAMMPS has no compute `{}`", name.to_string_lossy()));
        }
        // SAFETY: the number of rows of the compute.
        let count = unsafe { *count }.max(0) as usize;
        // SAFETY: the array has that many rows of `N` columns.
        unsafe { rows_at(ask(ARRAY).cast(), count, name) }.map(|rows| rows.to_vec())
    }
}

/// Types of the numbers of atoms.
pub(crate) trait Number {}
impl Number for f64 {}
impl Number for i32 {}

/// # Safety
/// The instance is alive, `n` is the number of its atoms, of which each has `N` such numbers, and nobody else uses them.
pub(crate) unsafe fn rows_of_atoms<'a, const N: usize>(
    handle: Handle,
    name: &CStr,
    n: usize,
) -> Outcome<&'a mut [[f64; N]]> {
    // SAFETY: as the caller has promised; the name is a C string.
    let rows = unsafe { (library()?.functions.extract_atom)(handle, name.as_ptr()) };
    // SAFETY: as the caller has promised.
    unsafe { rows_at(rows.cast(), n, name) }
}

/// # Safety
/// `rows` is null or points to those of LAMMPS: pointers to `n` rows of `N` numbers, one after the other, which nobody else uses.
pub(crate) unsafe fn rows_at<'a, const N: usize>(
    rows: *mut *mut f64,
    n: usize,
    name: &CStr,
) -> Outcome<&'a mut [[f64; N]]> {
    if n == 0 {
        return Ok(&mut []);
    }
    if rows.is_null() {
        return Err(format!("LAMMPS has no `{}`", name.to_string_lossy()));
    }
    // SAFETY: as the caller has promised.
    Ok(unsafe { std::slice::from_raw_parts_mut((*rows).cast(), n) })
}
