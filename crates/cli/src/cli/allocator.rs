//! The allocator of the program: where memory runs out in the middle of something, the process ends with words and exit code 2.
//!
//! The large arrays of a run are results ([`memory`]). For all else a failed allocation would mean SIGABRT. Ending
//! the process at once ends all its ranks, and a launcher of MPI then ends those of the others.

use std::alloc::{GlobalAlloc, Layout};
use std::io::Write;
use turbid::memory;

/// An allocator that does not fail where nobody can deal with it.
pub struct Guarded<A>(pub A);

// SAFETY: every call is passed to the inner allocator, and the result is its own.
unsafe impl<A: GlobalAlloc> GlobalAlloc for Guarded<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: by the contract of this method.
        checked(unsafe { self.0.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: by the contract of this method.
        checked(unsafe { self.0.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, start: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: by the contract of this method.
        checked(unsafe { self.0.realloc(start, layout, size) }, size)
    }

    unsafe fn dealloc(&self, start: *mut u8, layout: Layout) {
        // SAFETY: by the contract of this method.
        unsafe { self.0.dealloc(start, layout) }
    }
}

#[inline]
fn checked(start: *mut u8, bytes: usize) -> *mut u8 {
    if start.is_null() && !memory::is_tried() {
        give_up(bytes);
    }
    start
}

/// Ends the process; nothing here allocates.
#[cold]
fn give_up(bytes: usize) -> ! {
    let mut text = [0; 256];
    let mut rest = &mut text[..];
    // What has no room is left out.
    let _ = writeln!(
        rest,
        "error: out of memory: {bytes} bytes more are not to be had; take a smaller case, or raise the limit on the memory of the \
         process (ulimit -v, the control group, the request of the job)"
    );
    let unused = rest.len();
    // SAFETY: the text is there, and the process may end at any time.
    unsafe {
        libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len() - unused);
        libc::_exit(2)
    }
}
