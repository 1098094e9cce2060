//! The driver OpenCL.

use super::WARPS_SINCE;
use crate::device::{Argument, Commands, DeviceInfo, Done, Driver, Failed, Kernel, Memory, Program};
use opencl3::command_queue::CommandQueue;
use opencl3::context::Context;
use opencl3::device::{
    CL_DEVICE_TYPE_ALL, CL_DEVICE_TYPE_CPU, CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT, Device as Id,
    get_all_devices,
};
use opencl3::error_codes::ClError;
use opencl3::memory::{Buffer, CL_MEM_READ_WRITE, ClMem};
use opencl3::types::CL_TRUE;
use std::sync::Arc;

impl From<ClError> for Failed {
    fn from(error: ClError) -> Self {
        Self(error.to_string())
    }
}

/// All devices of all drivers.
pub(super) fn devices() -> Vec<Arc<dyn Driver>> {
    // An error if there is no driver, or if it lists no device.
    let ids = get_all_devices(CL_DEVICE_TYPE_ALL).unwrap_or_default();
    ids.into_iter().map(|id| Arc::new(OpenCl(Id::new(id))) as Arc<dyn Driver>).collect()
}

/// A device.
struct OpenCl(Id);

impl Driver for OpenCl {
    fn info(&self) -> DeviceInfo {
        let Self(id) = self;
        let text = |text: std::result::Result<String, ClError>| text.unwrap_or_default().trim().to_owned();
        let extensions = text(id.extensions());
        let missing = |what: &str| Some(format!("it {what}"));
        let refused = if !extensions.contains("cl_khr_fp64") {
            missing("has no double precision")
        } else if !extensions.contains("cl_khr_int64_base_atomics") {
            missing("cannot add up 64-bit integers in memory (cl_khr_int64_base_atomics)")
        } else if id.single_fp_config().unwrap_or(0) & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT == 0 {
            missing("does not round divisions as IEEE 754 says")
        } else if id.max_work_group_size().unwrap_or(0) < 256 || id.local_mem_size().unwrap_or(0) < 32_768 {
            missing("has work-groups of fewer than 256 items, or less than 32 kB of memory for each")
        } else if !id.compiler_available().unwrap_or(false) || !id.available().unwrap_or(false) {
            missing("is not available")
        } else {
            None
        };
        DeviceInfo {
            name: text(id.name()),
            driver: format!("{}, {}", text(id.version()), text(id.driver_version())),
            memory: id.global_mem_size().unwrap_or(0),
            largest: id.max_mem_alloc_size().unwrap_or(0),
            is_processor: id.dev_type().is_ok_and(|kind| kind & CL_DEVICE_TYPE_CPU != 0),
            refused,
        }
    }

    fn compile(&self, source: &str, options: &str) -> Result<Arc<dyn Program>, String> {
        // The same bits as the processor's: divisions as IEEE 754 says, nothing relaxed.
        let mut options = format!("-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt {options}");
        // Only NVIDIA's driver answers.
        if self.0.compute_capability_major_nv().is_ok_and(|major| major as i32 >= WARPS_SINCE) {
            options += " -DWARPS";
        }
        let context = Context::from_device(&self.0).map_err(|error| format!("error: no context: {error}"))?;
        let program = opencl3::program::Program::create_and_build_from_source(&context, source, &options)?;
        Ok(Arc::new(Compiled { context, program, device: Id::new(self.0.id()) }))
    }
}

/// Kernels in the context of a device.
struct Compiled {
    context: Context,
    program: opencl3::program::Program,
    device: Id,
}

impl Program for Compiled {
    fn kernel(&self, name: &str) -> Done<Kernel> {
        Ok(Box::new(opencl3::kernel::Kernel::create(&self.program, name)?))
    }

    fn commands(self: Arc<Self>) -> Done<Box<dyn Commands>> {
        // SAFETY: context and device are valid; no host memory is involved.
        let queue = unsafe { CommandQueue::create_with_properties(&self.context, self.device.id(), 0, 0) }?;
        Ok(Box::new(InOrder { queue, compiled: self }))
    }
}

/// Most bytes that are filled or transferred at once: a driver of NVIDIA (580.159) never ends with 2 GiB.
const AT_ONCE: usize = 1 << 28;

/// A queue.
struct InOrder {
    queue: CommandQueue,
    compiled: Arc<Compiled>,
}

/// The array of this driver.
fn buffer(memory: &Memory) -> &Buffer<u8> {
    memory.downcast_ref().expect("an array of this driver")
}

fn buffer_mut(memory: &mut Memory) -> &mut Buffer<u8> {
    memory.downcast_mut().expect("an array of this driver")
}

impl Commands for InOrder {
    fn allocate(&self, bytes: usize) -> Done<Memory> {
        let context = &self.compiled.context;
        // SAFETY: no host memory is involved.
        let buffer = unsafe { Buffer::<u8>::create(context, CL_MEM_READ_WRITE, bytes, std::ptr::null_mut()) };
        Ok(Box::new(buffer?))
    }

    unsafe fn clear(&self, memory: &mut Memory, bytes: usize) -> Done {
        for at in (0..bytes).step_by(AT_ONCE) {
            let part = AT_ONCE.min(bytes - at);
            let (words, buffer) = (part / 8 * 8, buffer_mut(memory));
            // SAFETY: promised by the caller.
            unsafe {
                if words > 0 {
                    self.queue.enqueue_fill_buffer(buffer, &[0_u8; 8], at, words, &[])?;
                }
                if words < part {
                    self.queue.enqueue_fill_buffer(buffer, &[0_u8], at + words, part - words, &[])?;
                }
            }
        }
        Ok(())
    }

    unsafe fn write(&self, memory: &mut Memory, bytes: &[u8]) -> Done {
        for (part, at) in bytes.chunks(AT_ONCE).zip((0..).step_by(AT_ONCE)) {
            // SAFETY: promised by the caller; the call returns when the bytes have been read.
            unsafe { self.queue.enqueue_write_buffer(buffer_mut(memory), CL_TRUE, at, part, &[]) }?;
        }
        Ok(())
    }

    unsafe fn read(&self, memory: &Memory, bytes: &mut [u8]) -> Done {
        for (part, at) in bytes.chunks_mut(AT_ONCE).zip((0..).step_by(AT_ONCE)) {
            // SAFETY: promised by the caller; the call returns when the bytes have been written.
            unsafe { self.queue.enqueue_read_buffer(buffer(memory), CL_TRUE, at, part, &[]) }?;
        }
        Ok(())
    }

    unsafe fn launch(&self, kernel: &Kernel, arguments: &[Argument], groups: u32, group: u32) -> Done {
        let kernel: &opencl3::kernel::Kernel = kernel.downcast_ref().expect("a kernel of this driver");
        for (at, argument) in (0..).zip(arguments) {
            // SAFETY: promised by the caller.
            unsafe {
                match argument {
                    Argument::Array(array) => kernel.set_arg(at, &buffer(&array.memory).get()),
                    Argument::Int(n) => kernel.set_arg(at, n),
                    Argument::Long(n) => kernel.set_arg(at, n),
                    Argument::Ints(n) => kernel.set_arg(at, n),
                    Argument::Longs(n) => kernel.set_arg(at, n),
                    Argument::Doubles(n) => kernel.set_arg(at, n),
                }
            }?;
        }
        let (group, none) = (group as usize, std::ptr::null());
        let items = groups as usize * group;
        // SAFETY: as above; there is one direction.
        unsafe {
            self.queue.enqueue_nd_range_kernel(kernel.get(), 1, none, &raw const items, &raw const group, &[])
        }?;
        Ok(())
    }

    fn finish(&self) -> Done {
        Ok(self.queue.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use super::AT_ONCE;
    use crate::device::{Device, devices};

    #[test]
    fn an_array_of_more_than_is_moved_at_once_is_zeroed_written_and_read_as_a_whole() {
        let Some(number) =
            devices().iter().position(|device| device.driver.contains("OpenCL") && device.refused.is_none())
        else {
            assert!(std::env::var_os("TURBID_NEEDS_DEVICE").is_none(), "no OpenCL device");
            return;
        };
        let device = Device::open(number).unwrap();
        let queue = device.queue(&device.compile(include_str!("../measure.cl"), "").unwrap()).unwrap();
        let mut array = queue.zeroed(AT_ONCE + 13, "a test").unwrap();
        let mut bytes = vec![1_u8; AT_ONCE + 13];
        queue.read(&array, &mut bytes).unwrap();
        assert!(bytes.iter().all(|byte| *byte == 0));
        for (at, byte) in bytes.iter_mut().enumerate() {
            *byte = (at % 251) as u8;
        }
        queue.write(&mut array, &bytes).unwrap();
        let mut found = vec![0_u8; bytes.len()];
        queue.read(&array, &mut found).unwrap();
        assert!(found == bytes);
    }
}
