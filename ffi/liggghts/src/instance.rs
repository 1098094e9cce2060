//! The one LIGGGHTS of this process: commands, arrays, and its end.

use liggghts_sys as ffi;
use std::ffi::{CStr, CString};
use std::ptr;
use std::sync::Mutex;

/// The reason of a failure is in LIGGGHTS's words.
pub(crate) type Outcome<T> = std::result::Result<T, String>;

/// The one instance of this process, while nobody uses it.
static SHELF: Mutex<Shelf> = Mutex::new(Shelf::Empty);

enum Shelf {
    /// Not started.
    Empty,
    /// Ready, cleared.
    Ready(Instance),
    /// In use, or left behind by an error.
    Taken,
}

/// Ends the LIGGGHTS of this process, and MPI if LIGGGHTS has started it; for the end of the program. A job whose process ends
/// without it counts as failed.
pub fn end() {
    let Ok(mut shelf) = SHELF.lock() else {
        return;
    };
    match std::mem::replace(&mut *shelf, Shelf::Taken) {
        Shelf::Empty => return,
        // SAFETY: nobody else has the instance, and it is not used after this.
        Shelf::Ready(instance) => unsafe { ffi::lgg_close(instance.0) },
        Shelf::Taken => {}
    }
    // SAFETY: nothing calls MPI after this.
    unsafe { ffi::lgg_finalize() };
}

/// An instance of LIGGGHTS.
#[derive(Debug)]
pub(crate) struct Instance(*mut ffi::lgg_instance);

// SAFETY: an instance has no ties to the thread that made it; whoever has this value is its only user.
unsafe impl Send for Instance {}

impl Instance {
    /// The one of this process.
    pub(super) fn take() -> Outcome<Self> {
        let mut shelf = SHELF.lock().map_err(|e| e.to_string())?;
        match std::mem::replace(&mut *shelf, Shelf::Taken) {
            Shelf::Ready(instance) => Ok(instance),
            Shelf::Empty => Self::start(),
            Shelf::Taken => {
                Err("this process has one LIGGGHTS, and it is in use, or an error has broken it; \
                                 process = \"worker\" has no such limit"
                    .to_owned())
            }
        }
    }

    fn start() -> Outcome<Self> {
        let mut instance = ptr::null_mut();
        // SAFETY: the path is a C string, and `instance` is where the pointer goes.
        let failed = unsafe { ffi::lgg_open(c"/dev/null".as_ptr(), &raw mut instance) };
        if failed == 0 { Ok(Self(instance)) } else { Err(error()) }
    }

    /// Back onto the shelf, empty; an instance that cannot be cleared stays where it is.
    pub(super) fn put_back(self) {
        let cleared = self.command("log none").and_then(|()| self.command("clear"));
        if let (Ok(()), Ok(mut shelf)) = (cleared, SHELF.lock()) {
            *shelf = Shelf::Ready(self);
        }
    }

    pub(super) fn command(&self, command: &str) -> Outcome<()> {
        let text = CString::new(command).map_err(|_| "a command with a zero byte".to_owned())?;
        // SAFETY: the instance is alive, and the text a C string that is only read.
        if unsafe { ffi::lgg_command(self.0, text.as_ptr()) } == 0 {
            Ok(())
        } else {
            Err(format!("{}\n  at the command: {command}", error()))
        }
    }

    /// Commands of the set-up, with everything in the log before the next.
    pub(super) fn commands<'a>(&self, commands: impl IntoIterator<Item = &'a String>) -> Outcome<()> {
        commands.into_iter().try_for_each(|command| {
            self.command(command)?;
            // SAFETY: may be called at any time.
            unsafe { ffi::lgg_flush() };
            Ok(())
        })
    }

    /// The arrays of the atoms. Valid until the next command.
    pub(super) fn atoms(&self) -> Outcome<ffi::lgg_atoms> {
        let mut atoms = ffi::lgg_atoms::default();
        // SAFETY: the instance is alive, and the structure is there to be filled.
        let failed = unsafe { ffi::lgg_get_atoms(self.0, &raw mut atoms) };
        if failed == 0 { Ok(atoms) } else { Err(error()) }
    }

    /// Vectors of all atoms that a fix holds. Valid until the next command.
    pub(super) fn property(&self, name: &str) -> Outcome<*mut f64> {
        let name = CString::new(name).map_err(|e| e.to_string())?;
        let mut values = ptr::null_mut();
        // SAFETY: the instance is alive, the name a C string, and the pointer is there to be set.
        let failed = unsafe { ffi::lgg_atom_property(self.0, name.as_ptr(), &raw mut values) };
        if failed == 0 { Ok(values) } else { Err(error()) }
    }

    /// Rows of a local compute.
    pub(super) fn rows(&self, name: &str) -> Outcome<Vec<Vec<f64>>> {
        let name = CString::new(name).map_err(|e| e.to_string())?;
        let (mut rows, mut columns, mut values) = (0, 0, ptr::null());
        // SAFETY: the instance is alive, the name a C string, and the three places are there to be set.
        let failed = unsafe {
            ffi::lgg_local_compute(self.0, name.as_ptr(), &raw mut rows, &raw mut columns, &raw mut values)
        };
        if failed != 0 {
            return Err(error());
        }
        if rows == 0 || columns == 0 {
            return Ok(Vec::new());
        }
        // SAFETY: the shim has copied that many rows, and keeps them until it is asked again.
        let values = unsafe { std::slice::from_raw_parts(values, (rows * columns) as usize) };
        Ok(values.chunks_exact(columns as usize).map(<[f64]>::to_vec).collect())
    }
}

/// The reason of the last failure, in LIGGGHTS's words.
fn error() -> String {
    // SAFETY: the shim returns a C string that lives until the next failure in this thread.
    unsafe { CStr::from_ptr(ffi::lgg_error()) }.to_string_lossy().trim().to_owned()
}

/// Three numbers of atom `k`.
///
/// # Safety
/// `base` points to at least `3 (k + 1)` numbers that nobody else uses.
pub(crate) unsafe fn vector<'a>(base: *mut f64, k: usize) -> &'a mut [f64; 3] {
    // SAFETY: as the caller has promised.
    unsafe { &mut *base.add(3 * k).cast() }
}
