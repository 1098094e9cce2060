//! The one LIGGGHTS of this process: commands, arrays, and its end.

use liggghts_sys as ffi;
use std::ffi::{CStr, CString};
use std::ptr;
use std::sync::Mutex;

/// A failure is the message of LIGGGHTS.
pub(crate) use turbid_process::Outcome;

/// The one instance of this process, while nobody uses it.
static SLOT: Mutex<Slot> = Mutex::new(Slot::Empty);

enum Slot {
    /// Not started.
    Empty,
    /// Ready, cleared, and the communicator that it belongs to.
    Ready(Handle, Option<i32>),
    /// In use, or left behind by an error.
    Taken,
}

#[derive(Clone, Copy, Debug)]
struct Handle(*mut ffi::lgg_instance);

// SAFETY: an instance is not bound to the thread that made it; whoever has this value is its only user.
unsafe impl Send for Handle {}

/// Ends the LIGGGHTS of this process, and MPI if LIGGGHTS has started it; for the end of the program. A job whose process ends
/// without it counts as failed.
pub fn end() {
    let Ok(mut slot) = SLOT.lock() else {
        return;
    };
    match std::mem::replace(&mut *slot, Slot::Taken) {
        Slot::Empty => return,
        // SAFETY: nobody else has the instance, and it is not used after this.
        Slot::Ready(handle, _) => unsafe { ffi::lgg_close(handle.0) },
        Slot::Taken => {}
    }
    // SAFETY: nothing calls MPI after this.
    unsafe { ffi::lgg_finalize() };
}

/// An instance of LIGGGHTS; returns to the slot, cleared, when dropped, unless an error has broken it.
#[derive(Debug)]
pub(crate) struct Instance(Handle, Option<i32>);

/// Arrays of the atoms, in LIGGGHTS's order.
pub(super) struct Arrays<'a> {
    /// From 1.
    pub(super) id: &'a mut [i32],
    /// Material, from 1.
    pub(super) kind: &'a mut [i32],
    pub(super) position: &'a mut [[f64; 3]],
    pub(super) velocity: &'a mut [[f64; 3]],
    pub(super) angular_velocity: &'a mut [[f64; 3]],
    pub(super) force: &'a mut [[f64; 3]],
    pub(super) torque: &'a mut [[f64; 3]],
    pub(super) radius: &'a mut [f64],
    pub(super) mass: &'a mut [f64],
    pub(super) density: &'a mut [f64],
}

impl Drop for Instance {
    fn drop(&mut self) {
        let cleared = self.command("log none").and_then(|()| self.command("clear"));
        if let (Ok(()), Ok(mut slot)) = (cleared, SLOT.lock()) {
            *slot = Slot::Ready(self.0, self.1);
        }
    }
}

impl Instance {
    /// The one of this process, which belongs to the communicator of several processes (a handle of Fortran's) of the first call, or to
    /// none.
    pub(super) fn take(communicator: Option<i32>) -> Outcome<Self> {
        let mut slot = SLOT.lock().map_err(|e| e.to_string())?;
        match std::mem::replace(&mut *slot, Slot::Taken) {
            Slot::Ready(handle, own) if own == communicator => Ok(Self(handle, own)),
            Slot::Ready(handle, own) => {
                *slot = Slot::Ready(handle, own);
                Err("this process has one LIGGGHTS, and it belongs to another communicator; process = \"worker\" has no such limit"
                    .to_owned())
            }
            Slot::Empty => {
                let mut instance = ptr::null_mut();
                let of = communicator.as_ref().map_or(ptr::null(), ptr::from_ref);
                // SAFETY: the path is a C string, the communicator null or a handle, and `instance` is where the pointer goes.
                check(unsafe { ffi::lgg_open(c"/dev/null".as_ptr(), of, &raw mut instance) })?;
                Ok(Self(Handle(instance), communicator))
            }
            Slot::Taken => {
                Err("this process has one LIGGGHTS, and it is in use, or an error has broken it; \
                     process = \"worker\" has no such limit"
                    .to_owned())
            }
        }
    }

    pub(super) fn command(&self, command: &str) -> Outcome<()> {
        let text = c_string(command)?;
        // SAFETY: the instance is alive, and the text a C string that is only read.
        check(unsafe { ffi::lgg_command(self.0.0, text.as_ptr()) })
            .map_err(|error| format!("{error}\n  at the command: {command}"))
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

    /// Makes atoms with these ids, from 1, at these positions, in the arrays behind those that there are.
    pub(super) fn create(&mut self, ids: &[i32], positions: &[[f64; 3]]) -> Outcome<()> {
        assert_eq!(ids.len(), positions.len());
        let (id, position) = (ids.as_ptr(), positions.as_flattened().as_ptr());
        // SAFETY: the instance is alive; the arrays have that many numbers, three times as many the positions, and are only read.
        check(unsafe { ffi::lgg_create(self.0.0, ids.len() as i64, id, position) })
    }

    /// True if the argument is true in any of its processes. Collective among them.
    pub(super) fn any(&self, so: bool) -> bool {
        // SAFETY: the instance is alive.
        unsafe { ffi::lgg_any(self.0.0, so.into()) != 0 }
    }

    /// Material, from 1, of an atom that this process knows.
    pub(super) fn kind_of(&self, id: i32) -> Option<usize> {
        // SAFETY: the instance is alive.
        let kind = unsafe { ffi::lgg_type_of(self.0.0, id) };
        (kind > 0).then_some(kind as usize)
    }

    /// The arrays of the atoms.
    pub(super) fn arrays(&mut self) -> Outcome<Arrays<'_>> {
        let mut atoms = ffi::lgg_atoms::default();
        // SAFETY: the instance is alive, and the structure is there to be filled.
        check(unsafe { ffi::lgg_get_atoms(self.0.0, &raw mut atoms) })?;
        let n = atoms.local as usize;
        // SAFETY: the arrays have `local` entries, vectors three numbers each, until the next command, which needs `self`.
        unsafe {
            Ok(Arrays {
                id: slice(atoms.id, n),
                kind: slice(atoms.type_, n),
                position: slice(atoms.position.cast(), n),
                velocity: slice(atoms.velocity.cast(), n),
                angular_velocity: slice(atoms.angular_velocity.cast(), n),
                force: slice(atoms.force.cast(), n),
                torque: slice(atoms.torque.cast(), n),
                radius: slice(atoms.radius, n),
                mass: slice(atoms.mass, n),
                density: slice(atoms.density, n),
            })
        }
    }

    /// Vectors that a fix has for each of the `n` atoms.
    pub(super) fn property(&mut self, name: &str, n: usize) -> Outcome<&mut [[f64; 3]]> {
        if n == 0 {
            return Ok(&mut []);
        }
        let (name, mut values) = (c_string(name)?, ptr::null_mut());
        // SAFETY: the instance is alive, the name a C string, and the pointer is there to be set.
        check(unsafe { ffi::lgg_atom_property(self.0.0, name.as_ptr(), &raw mut values) })?;
        // SAFETY: the fix has three numbers for each atom until the next command, which needs `self`.
        Ok(unsafe { slice(values.cast(), n) })
    }

    /// Rows of a local compute.
    pub(super) fn rows(&self, name: &str) -> Outcome<Vec<Vec<f64>>> {
        let name = c_string(name)?;
        let (mut rows, mut columns, mut values) = (0, 0, ptr::null());
        // SAFETY: the instance is alive, the name a C string, and the three pointers are there to be set.
        check(unsafe {
            ffi::lgg_local_compute(self.0.0, name.as_ptr(), &raw mut rows, &raw mut columns, &raw mut values)
        })?;
        if rows == 0 || columns == 0 {
            return Ok(Vec::new());
        }
        // SAFETY: the shim has copied that many rows, and keeps them until it is asked again.
        let values = unsafe { std::slice::from_raw_parts(values, (rows * columns) as usize) };
        Ok(values.chunks_exact(columns as usize).map(<[f64]>::to_vec).collect())
    }
}

fn c_string(text: &str) -> Outcome<CString> {
    CString::new(text).map_err(|_| "a command with a zero byte".to_owned())
}

/// The reason of a failure if a call of the shim has not returned 0.
fn check(returned: i32) -> Outcome<()> {
    if returned == 0 {
        return Ok(());
    }
    // SAFETY: the shim returns a C string that lives until the next failure in this thread.
    Err(unsafe { CStr::from_ptr(ffi::lgg_error()) }.to_string_lossy().trim().to_owned())
}

/// # Safety
/// `base` is null, or points to `n` values that nobody else uses.
unsafe fn slice<'a, T>(base: *mut T, n: usize) -> &'a mut [T] {
    if base.is_null() {
        return &mut [];
    }
    // SAFETY: as the caller has promised.
    unsafe { std::slice::from_raw_parts_mut(base, n) }
}
