//! A driver for tests: the kernels as C++, by the system's compiler. So they are held to the bits of the processor's where there is no
//! driver at all.

use super::{Argument, Commands, DeviceInfo, Done, Driver, Failed, Kernel, Memory, Program};
use std::ffi::{CString, c_char, c_void};
use std::fmt::Write;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// The part of OpenCL C that the kernels use.
const PRELUDE: &str = include_str!("host_tests.h");

/// A kernel: takes pointers to its arguments, the number of work-groups, and that of the items of each.
pub(super) type Entry = unsafe extern "C" fn(*const *const c_void, usize, usize);

/// The system's C++ compiler; none if there is none.
pub(super) struct Host {
    compiler: String,
}

impl Host {
    pub(super) fn new() -> Option<Self> {
        let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".to_owned());
        Command::new(&compiler).arg("--version").output().is_ok().then_some(Self { compiler })
    }
}

impl Driver for Host {
    fn info(&self) -> DeviceInfo {
        DeviceInfo {
            name: "the processor".to_owned(),
            driver: self.compiler.clone(),
            memory: 1 << 30,
            largest: 1 << 30,
            is_processor: true,
            refused: None,
        }
    }

    fn compile(&self, source: &str, options: &str) -> Result<Arc<dyn Program>, String> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        // A folder of its own, which nobody else has made.
        let folder = std::env::temp_dir().join(format!("turbid-kernels-{}-{number}", std::process::id()));
        std::fs::create_dir(&folder).map_err(|error| error.to_string())?;
        let (written, built) = (folder.join("kernels.cpp"), folder.join("kernels.so"));
        let mut text = format!("{PRELUDE}{source}");
        for kernel in source.split("__kernel ").skip(1) {
            let (before, after) = kernel.split_once("void ").expect("a kernel returns nothing");
            let name = after.split('(').next().expect("a name");
            writeln!(
                text,
                "extern \"C\" void enter_{name}(void** arguments, size_t groups, size_t items) {{ \
                 items::launch({name}, arguments, groups, items, {}); }}",
                before.contains("WORK_GROUP")
            )
            .expect("memory takes any text");
        }
        std::fs::write(&written, text).map_err(|error| error.to_string())?;
        let output = Command::new(&self.compiler)
            .args(["-std=c++17", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-w"])
            .args(options.split_whitespace())
            .arg("-o")
            .args([&built, &written])
            .output()
            .map_err(|error| error.to_string())?;
        let library = CString::new(built.as_os_str().as_encoded_bytes()).expect("a path");
        // SAFETY: the library has no code that runs as it is loaded.
        let handle = unsafe { libc::dlopen(library.as_ptr(), libc::RTLD_NOW) };
        let _ = std::fs::remove_dir_all(folder);
        if !output.status.success() || handle.is_null() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        Ok(Arc::new(Library(handle as usize)))
    }
}

/// Compiled kernels, which stay loaded.
struct Library(usize);

impl Program for Library {
    fn kernel(&self, name: &str) -> Done<Kernel> {
        let name = CString::new(format!("enter_{name}")).expect("a name");
        // SAFETY: the library stays loaded.
        let entry = unsafe { libc::dlsym(self.0 as *mut c_void, name.as_ptr().cast::<c_char>()) };
        if entry.is_null() {
            return Err(Failed(format!("no {}", name.to_string_lossy())));
        }
        // SAFETY: all functions of these names are written above.
        Ok(Box::new(unsafe { std::mem::transmute::<*mut c_void, Entry>(entry) }))
    }

    fn commands(self: Arc<Self>) -> Done<Box<dyn Commands>> {
        Ok(Box::new(AtOnce))
    }
}

/// Does what is asked at once.
struct AtOnce;

fn words(memory: &Memory) -> &[AtomicU64] {
    memory.downcast_ref::<Vec<AtomicU64>>().expect("an array of this driver")
}

fn bytes(memory: &Memory) -> *mut u8 {
    words(memory).as_ptr().cast::<u8>().cast_mut()
}

impl Commands for AtOnce {
    fn allocate(&self, bytes: usize) -> Done<Memory> {
        // Nothing may rely on zeros.
        let words = (0..bytes.div_ceil(8)).map(|_| AtomicU64::new(0x7ff4_dead_beef_7ff4));
        Ok(Box::new(words.collect::<Vec<_>>()))
    }

    unsafe fn clear(&self, memory: &mut Memory, count: usize) -> Done {
        assert!(count <= 8 * words(memory).len());
        // SAFETY: the array is as long.
        unsafe { bytes(memory).write_bytes(0, count) };
        Ok(())
    }

    unsafe fn write(&self, memory: &mut Memory, from: &[u8]) -> Done {
        assert!(from.len() <= 8 * words(memory).len());
        // SAFETY: the array is as long.
        unsafe { bytes(memory).copy_from_nonoverlapping(from.as_ptr(), from.len()) };
        Ok(())
    }

    unsafe fn read(&self, memory: &Memory, to: &mut [u8]) -> Done {
        assert!(to.len() <= 8 * words(memory).len());
        // SAFETY: the array is as long.
        unsafe { bytes(memory).copy_to_nonoverlapping(to.as_mut_ptr(), to.len()) };
        Ok(())
    }

    unsafe fn launch(&self, kernel: &Kernel, arguments: &[Argument], groups: u32, group: u32) -> Done {
        let entry: &Entry = kernel.downcast_ref().expect("a kernel of this driver");
        let arrays: Vec<*mut u8> = arguments
            .iter()
            .map(|argument| match argument {
                Argument::Array(array) => bytes(&array.memory),
                _ => std::ptr::null_mut(),
            })
            .collect();
        let pointers: Vec<*const c_void> = arguments
            .iter()
            .zip(&arrays)
            .map(|(argument, array)| match argument {
                Argument::Array(_) => std::ptr::from_ref(array).cast(),
                Argument::Int(n) => std::ptr::from_ref(n).cast(),
                Argument::Long(n) => std::ptr::from_ref(n).cast(),
                Argument::Ints(n) => std::ptr::from_ref(n).cast(),
                Argument::Longs(n) => std::ptr::from_ref(n).cast(),
                Argument::Doubles(n) => std::ptr::from_ref(n).cast(),
            })
            .collect();
        // SAFETY: promised by the caller.
        unsafe { entry(pointers.as_ptr(), groups as usize, group as usize) };
        Ok(())
    }

    fn finish(&self) -> Done {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::device::Device;
    use crate::error::Error;

    #[test]
    fn refused_kernels_are_an_error_with_all_that_the_compiler_said_and_its_first_error_in_the_message() {
        let Some(device) = Device::compiled_as_cpp() else { return };
        let refused = device.compile("void first() { int x = \"no\"; }\nvoid second() { return 1; }", "");
        let Err(error) = refused else { panic!("compiled") };
        let Error::Kernels { log, .. } = &error else { panic!("{error}") };
        assert!(log.contains("first") && log.contains("second"), "{log}");
        let message = error.to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.starts_with("the compiler of the processor refused the kernels: "), "{message}");
        assert!(message.contains("error") && !message.contains(".log"), "{message}");
    }
}
