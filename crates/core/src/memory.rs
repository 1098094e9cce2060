//! Fallible allocation of large arrays: if one does not fit in memory, the run ends with a message on every rank
//! instead of an abort on one.
//!

use crate::error::{Error, Result};
use bytemuck::Zeroable;
use std::cell::Cell;
use std::io;
use std::sync::mpsc::{self, Sender};

/// Memory of a run per particle (bytes), about: its state, loads and cells with copies of neighbours, and those that
/// are written.
pub const PER_PARTICLE: f64 = 2000.0;

thread_local! {
    /// True while this thread makes an allocation that may fail.
    static TRYING: Cell<bool> = const { Cell::new(false) };
}

/// Runs code whose allocations may fail and which handles the failure.
pub fn trying<R>(work: impl FnOnce() -> R) -> R {
    let before = TRYING.replace(true);
    let result = work();
    TRYING.set(before);
    result
}

/// Returns true if the caller of an allocation on this thread handles its failure.
pub fn is_tried() -> bool {
    TRYING.get()
}

/// An empty list with room for `len` items; `what` it is for stands in the message, with an article.
///
/// # Errors
/// [`Error::Memory`] if there is not enough memory.
pub fn with_capacity<T>(len: usize, what: &str) -> Result<Vec<T>> {
    let mut list = Vec::new();
    match trying(|| list.try_reserve_exact(len)) {
        Ok(()) => Ok(list),
        Err(_) => Err(refused(len as f64 * size_of::<T>() as f64, what)),
    }
}

/// A list of `len` zeros.
///
/// # Errors
/// As [`with_capacity`].
pub fn zeroed<T: Zeroable + Clone>(len: usize, what: &str) -> Result<Vec<T>> {
    let mut list = with_capacity(len, what)?;
    list.resize(len, T::zeroed());
    Ok(list)
}

/// Starts a thread by `spawn` if there is room for what it makes at its start, beside its stack of 2 MiB: without, the standard library panics in
/// it, or the C library ends the process. Waits until the thread drops what `spawn` is given, first of all, so that nothing takes its room.
///
/// # Errors
/// That memory is out, or that of `spawn`.
pub fn start_thread<T>(spawn: impl FnOnce(Sender<()>) -> io::Result<T>) -> io::Result<T> {
    const ROOM: usize = 3 << 20;
    // The GNU C library reserves this much for a thread, if it can, before the standard library makes what it needs.
    const ARENA: usize = 64 << 20;
    let reserved = |bytes| {
        let mut room = Vec::<u8>::new();
        trying(|| room.try_reserve_exact(bytes)).map(|()| room)
    };
    reserved(ROOM).map_err(|_| io::ErrorKind::OutOfMemory)?;
    // Where little would be left, it must not.
    let is_tight = reserved(ARENA).is_ok() && reserved(ARENA + ROOM).is_err();
    let held = if is_tight { reserved(ARENA / 2 + ROOM).ok() } else { None };
    let (starting, started) = mpsc::channel();
    let thread = spawn(starting)?;
    let _ = started.recv();
    drop(held);
    Ok(thread)
}

/// The error for an allocation of this many bytes that failed.
pub fn refused(bytes: f64, what: &str) -> Error {
    Error::Memory { amount: in_bytes(bytes), what: what.to_string() }
}

/// Bytes in words.
pub fn in_bytes(bytes: f64) -> String {
    if bytes >= 1e9 {
        format!("{:.1} GB", bytes / 1e9)
    } else if bytes >= 1e6 {
        format!("{:.0} MB", (bytes / 1e6).ceil())
    } else {
        format!("{:.0} kB", (bytes / 1e3).ceil())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_that_no_machine_can_hold_is_an_error_with_amount_purpose_and_remedy() {
        for error in [
            with_capacity::<u64>(1 << 59, "the populations").unwrap_err(),
            zeroed::<u64>(usize::MAX, "the populations").unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(
                text.starts_with("cannot allocate ") && text.contains(" GB for the populations; "),
                "{text}"
            );
            assert_eq!(error.exit_code(), 2);
        }
        assert!(!is_tried());
        assert_eq!(zeroed::<f32>(3, "a test").unwrap(), [0.0; 3]);
    }

    #[test]
    fn amounts_read_well_over_many_orders() {
        assert_eq!(in_bytes(0.3e6), "300 kB");
        assert_eq!(in_bytes(2.5e9), "2.5 GB");
    }
}
