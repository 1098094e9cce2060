//! Memory for the populations: huge pages where the system gives them.

use crate::error::Result;
use crate::memory;
use bytemuck::Pod;
use std::alloc::{Layout, alloc, dealloc};
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

/// Size of a huge page (bytes); 38 concurrent streams exhaust the address cache with small ones.
const HUGE_PAGE: usize = 2 << 20;

/// A zeroed array on huge pages, first touched by the thread that makes it.
pub(crate) struct Buffer<T> {
    start: NonNull<T>,
    len: usize,
}

// SAFETY: the buffer owns its memory and numbers can be sent between threads.
unsafe impl<T: Send> Send for Buffer<T> {}

impl<T: Pod> Buffer<T> {
    /// `len` zeros; `what` they are for stands in the message, with an article.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) if there is no room for them.
    pub(crate) fn zeroed(len: usize, what: &str) -> Result<Self> {
        let bytes = len as f64 * size_of::<T>() as f64;
        let refused = || memory::refused(bytes, what);
        let layout = layout::<T>(len).ok_or_else(refused)?;
        // SAFETY: the layout has a size that is not zero.
        let start = memory::trying(|| NonNull::new(unsafe { alloc(layout) })).ok_or_else(refused)?;
        // SAFETY: the range was just allocated; the advice does not change its contents. Before the first touch, or
        // small pages would already be there. A refusal only costs speed.
        #[cfg(all(target_os = "linux", not(miri)))]
        unsafe {
            libc::madvise(start.as_ptr().cast(), layout.size(), libc::MADV_HUGEPAGE);
        }
        // SAFETY: the range was just allocated with this size.
        unsafe { start.as_ptr().write_bytes(0, layout.size()) };
        Ok(Self { start: start.cast(), len })
    }

    /// The start of the memory, from which every slice of it derives.
    pub(crate) fn root(&self) -> *mut T {
        self.start.as_ptr()
    }
}

/// Layout of an allocation of `len` numbers; `None` if it exceeds the address space.
fn layout<T>(len: usize) -> Option<Layout> {
    let bytes = (len.max(1).checked_mul(size_of::<T>())?).checked_next_multiple_of(4096)?;
    // Small boxes (tests, many ranks) need no huge page.
    let align = if bytes >= HUGE_PAGE { HUGE_PAGE } else { 4096 };
    Layout::from_size_align(bytes, align).ok()
}

impl<T> Deref for Buffer<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        // SAFETY: `len` numbers were allocated and zeroed, and zero is a valid number (`Pod`).
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as for `deref`, and the borrow is unique.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

impl<T> Drop for Buffer<T> {
    fn drop(&mut self) {
        if let Some(layout) = layout::<T>(self.len) {
            // SAFETY: allocated by `zeroed` with this very layout.
            unsafe { dealloc(self.start.as_ptr().cast(), layout) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_populations_than_an_address_space_holds_are_an_error_with_their_amount() {
        for len in [1 << 57, (1 << 60) - 1, 1 << 61, usize::MAX] {
            let text = Buffer::<f64>::zeroed(len, "the populations").err().unwrap().to_string();
            assert!(text.contains(" GB for the populations; take"), "{text}");
        }
    }
}
