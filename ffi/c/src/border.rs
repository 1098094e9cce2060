//! Checks at the border to C: handles, pointers, texts and panics.

use crate::types::Handle;
use crate::{TURBID_ARGUMENT, TURBID_OK, TURBID_PANIC};
use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use turbid::simulation::Session;

/// An error code with its text.
pub(crate) struct Failure {
    code: i32,
    text: String,
}

impl Failure {
    pub(crate) fn argument(text: impl Into<String>) -> Self {
        Self { code: TURBID_ARGUMENT, text: text.into() }
    }
}

impl From<turbid::Error> for Failure {
    fn from(error: turbid::Error) -> Self {
        Self { code: error.exit_code(), text: error.to_string() }
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

pub(crate) fn last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|text| text.as_ptr())
}

/// The text of a panic.
fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("without a text");
    format!("a defect of Turbid: {text}")
}

/// Does the work of a function; an error or a panic becomes a code and the last error.
pub(crate) fn guard(work: impl FnOnce() -> Result<(), Failure>) -> i32 {
    let caught = catch_unwind(AssertUnwindSafe(work));
    let failure = match caught {
        Ok(Ok(())) => return TURBID_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => Failure { code: TURBID_PANIC, text: panic_text(&*panic) },
    };
    let text = CString::new(failure.text.replace('\0', " ")).unwrap_or_default();
    LAST_ERROR.set(text);
    failure.code
}

/// Open simulations, and the number of the last.
static OPEN: Mutex<(Handle, BTreeMap<Handle, Arc<Session>>)> = Mutex::new((0, BTreeMap::new()));

fn open() -> MutexGuard<'static, (Handle, BTreeMap<Handle, Arc<Session>>)> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Stores a simulation under a new handle.
pub(crate) fn store(session: Session) -> Handle {
    let (last, sessions) = &mut *open();
    *last += 1;
    sessions.insert(*last, Arc::new(session));
    *last
}

fn no_handle(handle: Handle) -> Failure {
    Failure::argument(format!("handle: {handle} is none, or closed"))
}

pub(crate) fn find(handle: Handle) -> Result<Arc<Session>, Failure> {
    open().1.get(&handle).cloned().ok_or_else(|| no_handle(handle))
}

/// Takes a simulation away; it ends when no call uses it any more.
pub(crate) fn forget(handle: Handle) -> Result<(), Failure> {
    let session = open().1.remove(&handle);
    session.map(drop).ok_or_else(|| no_handle(handle))
}

/// A text of the caller.
///
/// # Safety
/// `data` is null or ends with a zero.
pub(crate) unsafe fn text(name: &str, data: *const c_char) -> Result<String, Failure> {
    if data.is_null() {
        return Err(Failure::argument(format!("{name}: null, but a text is needed")));
    }
    // SAFETY: not null, and the same contract.
    let text = unsafe { CStr::from_ptr(data) };
    text.to_str().map(str::to_owned).map_err(|_| Failure::argument(format!("{name}: not UTF-8")))
}

/// Refuses arrays that are null, not aligned, or of another length than `needed`.
fn check<T>(name: &str, data: *const T, count: usize, needed: usize) -> Result<(), Failure> {
    let why = if count != needed {
        format!("{name}: {count} where {needed} are needed")
    } else if count > 0 && (data.is_null() || !data.is_aligned()) {
        format!("{name}: null or not aligned, but an array is needed")
    } else {
        return Ok(());
    };
    Err(Failure::argument(why))
}

/// Writes `rows` to an array of the caller with room for `count`; one that is `optional` may be null.
///
/// # Safety
/// `to` is null or has room for `count`.
pub(crate) unsafe fn put<T: Copy>(
    name: &str,
    to: *mut T,
    count: usize,
    rows: &[T],
    optional: bool,
) -> Result<(), Failure> {
    if optional && to.is_null() {
        return Ok(());
    }
    check(name, to, count, rows.len())?;
    if count > 0 {
        // SAFETY: not null, aligned, with room for as many as there are; memory of the caller overlaps none of ours.
        unsafe { to.copy_from_nonoverlapping(rows.as_ptr(), count) };
    }
    Ok(())
}

/// An array of the caller with as many rows as `needed`.
///
/// # Safety
/// `data` is null or points to `count` of them, which nothing changes meanwhile.
pub(crate) unsafe fn rows<'a, T>(
    name: &str,
    data: *const T,
    count: usize,
    needed: usize,
) -> Result<&'a [T], Failure> {
    check(name, data, count, needed)?;
    // SAFETY: not null, aligned, and the same contract.
    Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(data, count) } })
}
