//! The driver CUDA, with the same kernels, for GPUs of NVIDIA that OpenCL does not list. NVRTC compiles them while the program runs.

use super::WARPS_SINCE;
use crate::device::{Argument, Commands, DeviceInfo, Done, Driver, Failed, Kernel, Memory, Program};
use cudarc::driver::sys::CUdevice_attribute;
use cudarc::driver::{
    CudaContext, CudaFunction, CudaModule, CudaSlice, CudaStream, DriverError, LaunchConfig, PushKernelArg,
    result,
};
use cudarc::nvrtc::{CompileError, CompileOptions, Ptx, compile_ptx_with_opts};
use std::sync::Arc;

/// The part of OpenCL C that the kernels use.
const PRELUDE: &str = include_str!("cuda.h");

impl From<DriverError> for Failed {
    fn from(error: DriverError) -> Self {
        Self(error.to_string())
    }
}

/// All GPUs of NVIDIA; none without the driver.
pub(super) fn devices() -> Vec<Arc<dyn Driver>> {
    // SAFETY: the library of the driver may be loaded at any time.
    if !unsafe { cudarc::driver::sys::is_culib_present() } {
        return Vec::new();
    }
    let count = CudaContext::device_count().unwrap_or(0);
    (0..count).map(|number| Arc::new(Cuda(number)) as Arc<dyn Driver>).collect()
}

/// Returns true if there is a compiler.
pub(super) fn has_compiler() -> bool {
    // SAFETY: the library of the compiler may be loaded at any time.
    unsafe { cudarc::nvrtc::sys::is_culib_present() }
}

/// Compiles kernels for a compute capability, such as `sm_90`, to the bits of the processor's: nothing contracted or relaxed.
///
/// # Errors
/// The log of the compiler.
pub(super) fn compile(source: &str, options: &str, capability: &str) -> Result<Ptx, String> {
    let more = ["--device-as-default-execution-space".to_owned(), format!("--gpu-architecture={capability}")];
    let options = CompileOptions {
        ftz: Some(false),
        prec_sqrt: Some(true),
        prec_div: Some(true),
        fmad: Some(false),
        options: options.split_whitespace().map(str::to_owned).chain(more).collect(),
        ..CompileOptions::default()
    };
    compile_ptx_with_opts(format!("{PRELUDE}{source}"), options).map_err(|error| match error {
        CompileError::CompileError { log, .. } => log.to_string_lossy().into_owned(),
        error => format!("error: {error}"),
    })
}

/// A GPU, by its number. It gets a context when it is used.
struct Cuda(i32);

impl Driver for Cuda {
    fn info(&self) -> DeviceInfo {
        let unknown = DeviceInfo {
            name: format!("GPU {}", self.0),
            driver: "CUDA".to_owned(),
            memory: 0,
            largest: 0,
            is_processor: false,
            refused: Some("the driver does not describe it".to_owned()),
        };
        let Ok(device) = result::device::get(self.0) else { return unknown };
        let [major, minor] = [
            CUdevice_attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR,
            CUdevice_attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR,
        ]
        // SAFETY: the driver has just named the device.
        .map(|attribute| unsafe { result::device::get_attribute(device, attribute) }.unwrap_or(0));
        // SAFETY: as above.
        let memory = unsafe { result::device::total_mem(device) }.unwrap_or(0) as u64;
        let refused = if !has_compiler() {
            Some("the compiler NVRTC (libnvrtc) is not here".to_owned())
        } else if major < 6 {
            Some("its compute capability is below 6.0".to_owned())
        } else {
            None
        };
        DeviceInfo {
            name: result::device::get_name(device).unwrap_or_default(),
            driver: format!("CUDA, compute capability {major}.{minor}"),
            memory,
            largest: memory,
            refused,
            ..unknown
        }
    }

    fn compile(&self, source: &str, options: &str) -> Result<Arc<dyn Program>, String> {
        let failed = |error: DriverError| format!("error: {error}");
        let context = CudaContext::new(self.0 as usize).map_err(failed)?;
        let (major, minor) = context.compute_capability().map_err(failed)?;
        let options = if major >= WARPS_SINCE { format!("{options} -DWARPS") } else { options.to_owned() };
        let code = compile(source, &options, &format!("sm_{major}{minor}"))?;
        let module = context.load_module(code).map_err(failed)?;
        Ok(Arc::new(Compiled { context, module }))
    }
}

/// Kernels on a GPU.
struct Compiled {
    context: Arc<CudaContext>,
    module: Arc<CudaModule>,
}

impl Program for Compiled {
    fn kernel(&self, name: &str) -> Done<Kernel> {
        Ok(Box::new(self.module.load_function(name)?))
    }

    fn commands(self: Arc<Self>) -> Done<Box<dyn Commands>> {
        // SAFETY: each array is used in the stream in which it was made, and in no other.
        unsafe { self.context.disable_event_tracking() };
        Ok(Box::new(InOrder(self.context.new_stream()?)))
    }
}

/// A stream.
struct InOrder(Arc<CudaStream>);

/// The array of this driver.
fn slice(memory: &Memory) -> &CudaSlice<u8> {
    memory.downcast_ref().expect("an array of this driver")
}

fn slice_mut(memory: &mut Memory) -> &mut CudaSlice<u8> {
    memory.downcast_mut().expect("an array of this driver")
}

impl Commands for InOrder {
    fn allocate(&self, bytes: usize) -> Done<Memory> {
        // SAFETY: what is in it is no more than bytes.
        Ok(Box::new(unsafe { self.0.alloc::<u8>(bytes) }?))
    }

    unsafe fn clear(&self, memory: &mut Memory, bytes: usize) -> Done {
        Ok(self.0.memset_zeros(&mut slice_mut(memory).slice_mut(..bytes))?)
    }

    unsafe fn write(&self, memory: &mut Memory, bytes: &[u8]) -> Done {
        self.0.memcpy_htod(bytes, &mut slice_mut(memory).slice_mut(..bytes.len()))?;
        self.finish()
    }

    unsafe fn read(&self, memory: &Memory, bytes: &mut [u8]) -> Done {
        let count = bytes.len();
        self.0.memcpy_dtoh(&slice(memory).slice(..count), bytes)?;
        self.finish()
    }

    unsafe fn launch(&self, kernel: &Kernel, arguments: &[Argument], groups: u32, group: u32) -> Done {
        let function: &CudaFunction = kernel.downcast_ref().expect("a kernel of this driver");
        let mut launch = self.0.launch_builder(function);
        for argument in arguments {
            match argument {
                Argument::Array(array) => launch.arg(slice(&array.memory)),
                Argument::Int(n) => launch.arg(n),
                Argument::Long(n) => launch.arg(n),
                Argument::Ints(n) => launch.arg(n),
                Argument::Longs(n) => launch.arg(n),
                Argument::Doubles(n) => launch.arg(n),
            };
        }
        let (grid_dim, block_dim) = ((groups, 1, 1), (group, 1, 1));
        // SAFETY: promised by the caller.
        unsafe { launch.launch(LaunchConfig { grid_dim, block_dim, shared_mem_bytes: 0 }) }?;
        Ok(())
    }

    fn finish(&self) -> Done {
        Ok(self.0.synchronize()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::{Homogenised, Saturated, SolidOperator};
    use crate::fluid::device::{KERNELS, options};
    use crate::fluid::kernel::{Recursive, TwoTimes};
    use crate::fluid::{F16, Population};

    /// Options for all methods.
    fn all<S: Population>() -> Vec<String> {
        let saturated = SolidOperator::ALL.map(|of| options::<S, _, TwoTimes>(Saturated::new(of)));
        let others = [
            options::<S, _, Recursive>(Saturated::new(SolidOperator::Sc3)),
            options::<S, _, TwoTimes>(Homogenised { ramp: 1.0 }),
        ];
        [&saturated[..], &others].concat()
    }

    /// Without NVRTC nothing is compiled, unless `TURBID_NEEDS_NVRTC` is set.
    #[test]
    fn the_code_for_gpus_of_nvidia_has_no_fused_product_and_sum_that_the_kernels_do_not_have() {
        let needs = std::env::var_os("TURBID_NEEDS_NVRTC").is_some();
        assert!(has_compiler() || !needs, "no NVRTC");
        if !has_compiler() {
            return;
        }
        let fused = |source: &str, options: &str| {
            let code = compile(source, options, "sm_80").unwrap().to_src();
            assert!(code.contains(".entry sweep"));
            code.matches("fma.rn").count() + code.matches("mad.rn.f").count()
        };
        let plain = format!("#define fma(a, b, c) ((a) * (b) + (c))\n{KERNELS}");
        for options in [all::<f32>(), all::<f64>(), all::<F16>()].concat() {
            for options in [format!("{options} -DWARPS"), options] {
                assert_eq!(fused(&plain, &options), 0, "{options}");
            }
        }
        // The count finds those that they have.
        assert!(fused(KERNELS, &all::<f32>()[0]) > 0);
    }
}
