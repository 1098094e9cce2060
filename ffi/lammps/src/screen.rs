//! The screen of a LAMMPS: a stream of C whose text goes to the log while LAMMPS is set up, and to the standard error once it says what has
//! ended it. LAMMPS writes to it last of all before it ends the process.

use crate::library::Outcome;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::fs::File;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Start of the line in which LAMMPS says what has ended it.
const LAST_WORDS: &[u8] = b"ERROR";

/// Destination of what LAMMPS prints.
#[derive(Debug, Default)]
pub(crate) struct Screen {
    /// That of the set-up.
    log: Mutex<Option<File>>,
    failed: AtomicBool,
}

/// `cookie_io_functions_t` of C.
#[repr(C)]
struct Functions {
    read: Option<extern "C" fn(*mut c_void, *mut c_char, usize) -> isize>,
    write: extern "C" fn(*mut c_void, *const c_char, usize) -> isize,
    seek: Option<extern "C" fn(*mut c_void, *mut i64, c_int) -> c_int>,
    close: extern "C" fn(*mut c_void) -> c_int,
}

unsafe extern "C" {
    fn fopencookie(cookie: *mut c_void, mode: *const c_char, functions: Functions) -> *mut libc::FILE;
}

extern "C" fn write(cookie: *mut c_void, text: *const c_char, size: usize) -> isize {
    // SAFETY: the stream has one of the counts of the screen until it is closed.
    let screen = unsafe { &*cookie.cast::<Screen>() };
    // SAFETY: the stream has that many bytes to write.
    screen.print(unsafe { std::slice::from_raw_parts(text.cast(), size) });
    // What cannot be written is not waited for.
    size as isize
}

extern "C" fn close(cookie: *mut c_void) -> c_int {
    // SAFETY: takes back the count that the stream was given; it is not used again.
    drop(unsafe { Arc::from_raw(cookie.cast_const().cast::<Screen>()) });
    0
}

impl Screen {
    pub(crate) fn set_log(&self, log: Option<File>) {
        if let Ok(mut place) = self.log.lock() {
            *place = log;
        }
    }

    fn print(&self, text: &[u8]) {
        let at = text.windows(LAST_WORDS.len()).position(|word| word == LAST_WORDS);
        let (before, last) = match at {
            _ if self.failed.load(Ordering::Relaxed) => (&[][..], text),
            Some(at) => text.split_at(at),
            None => (text, &[][..]),
        };
        if let Ok(Some(log)) = self.log.lock().as_deref_mut() {
            let _ = log.write_all(before);
        }
        if !last.is_empty() {
            let words =
                if self.failed.swap(true, Ordering::Relaxed) { "" } else { "error: LAMMPS has failed: " };
            let _ = std::io::stderr().write_all(&[words.as_bytes(), last].concat());
        }
    }

    /// A stream to this screen, line by line; whoever has it closes it.
    pub(crate) fn stream(self: &Arc<Self>) -> Outcome<*mut libc::FILE> {
        const LINES: c_int = 1;
        let cookie = Arc::into_raw(Arc::clone(self)).cast_mut().cast();
        let mode: &CStr = c"w";
        let functions = Functions { read: None, write, seek: None, close };
        // SAFETY: the functions take the screen, of which the stream has a count of its own.
        let stream = unsafe { fopencookie(cookie, mode.as_ptr(), functions) };
        if stream.is_null() {
            close(cookie);
            return Err("no stream for what LAMMPS prints".to_owned());
        }
        // SAFETY: the stream is open and has not been used; C makes the buffer. `_IOLBF` is 1.
        unsafe { libc::setvbuf(stream, std::ptr::null_mut(), LINES, 0) };
        Ok(stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Seek};

    #[test]
    fn the_log_has_what_is_printed_in_the_set_up_but_not_the_last_words() {
        let mut file = turbid_process::exchange_file().unwrap();
        let screen = Arc::new(Screen::default());
        screen.set_log(Some(file.try_clone().unwrap()));
        let stream = screen.stream().unwrap();
        for text in [c"64 atoms\n", c"ERROR: of a test\n", c"Last command: run\n"] {
            // SAFETY: the stream is open, the text a C string.
            unsafe { libc::fputs(text.as_ptr(), stream) };
        }
        // SAFETY: nobody else has the stream.
        unsafe { libc::fclose(stream) };
        assert_eq!(Arc::strong_count(&screen), 1);
        let mut text = String::new();
        file.rewind().unwrap();
        file.read_to_string(&mut text).unwrap();
        assert_eq!(text, "64 atoms\n");
    }
}
