//! Devices that compute the fluid besides the processor, by OpenCL, whose driver is loaded while the program runs.
//!
//! A device is what OpenCL lists: GPUs and other accelerators first, then processors that have a driver (PoCL). It must compute in double
//! precision, add up 64-bit integers in memory, and divide as IEEE 754 says: then all results have the bits of the processor's kernels.

use crate::error::{Error, Result};
use crate::memory;
use opencl3::command_queue::CommandQueue;
use opencl3::context::Context;
use opencl3::device::{
    CL_DEVICE_TYPE_ALL, CL_DEVICE_TYPE_CPU, CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT, Device as Id,
    get_all_devices,
};
use opencl3::error_codes::ClError;
use opencl3::kernel::Kernel;
use opencl3::memory::{Buffer, CL_MEM_READ_WRITE, ClMem};
use opencl3::program::Program;
use opencl3::types::{CL_TRUE, cl_device_id};
use std::cell::RefCell;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DeviceInfo {
    /// Its name.
    pub name: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Memory (bytes), and the largest array that it gives.
    pub memory: u64,
    /// Largest array (bytes).
    pub largest: u64,
    /// A processor, not a GPU.
    pub is_processor: bool,
    /// Why it cannot be used, if so.
    pub refused: Option<String>,
}

/// What a kernel took while kernels were timed.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct KernelCost {
    /// Its name.
    pub name: String,
    /// How often it ran.
    pub launches: u64,
    /// Time (s), waiting for the device included.
    pub seconds: f64,
    /// Bytes that it reads and writes by count, each once.
    pub bytes: u64,
}

/// All devices, those that are no processors first; none without a driver.
pub fn devices() -> Vec<DeviceInfo> {
    ids().iter().map(|&id| info(id)).collect()
}

/// Asked once, as drivers may fail if two threads ask for the first time at once.
fn ids() -> Vec<cl_device_id> {
    static IDS: OnceLock<Vec<usize>> = OnceLock::new();
    let ids = IDS.get_or_init(|| {
        // An error if there is no driver, or if it lists no device.
        let mut ids = get_all_devices(CL_DEVICE_TYPE_ALL).unwrap_or_default();
        ids.sort_by_key(|&id| is_processor(Id::new(id)));
        ids.into_iter().map(|id| id as usize).collect()
    });
    ids.iter().map(|&id| id as cl_device_id).collect()
}

fn is_processor(id: Id) -> bool {
    id.dev_type().is_ok_and(|kind| kind & CL_DEVICE_TYPE_CPU != 0)
}

fn info(id: cl_device_id) -> DeviceInfo {
    let id = Id::new(id);
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
        is_processor: is_processor(id),
        refused,
    }
}

/// A device that can be used.
#[derive(Clone, Debug)]
pub struct Device {
    id: Id,
    info: Arc<DeviceInfo>,
}

impl Device {
    /// The device with a number in the list of [`devices`].
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such device, or if it cannot be used.
    pub fn open(number: usize) -> Result<Self> {
        let ids = ids();
        let Some(&id) = ids.get(number) else {
            let found = match ids.len() {
                0 => "there is no OpenCL driver (libOpenCL) that lists one".to_owned(),
                1 => "there is one device, gpu:0".to_owned(),
                n => format!("there are devices up to gpu:{}", n - 1),
            };
            return Err(Error::Input(format!(
                "cannot compute on device gpu:{number}: {found}; install the driver of the graphics card, or pocl-opencl-icd for \
                 the processor, or take --device cpu; `turbid doctor` lists the devices"
            )));
        };
        let info = info(id);
        if let Some(why) = &info.refused {
            return Err(Error::Input(format!("cannot compute on device gpu:{number}, {}: {why}", info.name)));
        }
        Ok(Self { id: Id::new(id), info: Arc::new(info) })
    }

    /// What it says of itself.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Measures the bandwidth of the memory (bytes per second, read and write counted) and the rate in double precision (operations per
    /// second, a fused product and sum being two): the best of five.
    ///
    /// # Errors
    /// [`Error::Input`] if the device does not do it.
    pub fn measure(&self) -> Result<[f64; 2]> {
        const CHAINS: usize = 1 << 18;
        const ROUNDS: i32 = 256;
        let kernels = self.compile(include_str!("device/measure.cl"), "")?;
        let queue = self.queue(&kernels)?;
        let numbers = (self.info.largest / 16).min(1 << 25) as usize / 256 * 256;
        let array = queue.zeroed(numbers * 8, "a measurement")?;
        let (stream, chains) = (kernels.kernel("stream"), kernels.kernel("chains"));
        let mut best = [0.0_f64; 2];
        for _ in 0..6 {
            let of = [Argument::Array(&array), Argument::Long(numbers as u64)];
            let rates = [
                // SAFETY: the arguments of the kernel; the array has so many numbers.
                timed(&queue, || unsafe { queue.launch(&stream, &of, [numbers, 1], Some(256), 0) })
                    .map(|time| 16.0 * numbers as f64 / time),
                // SAFETY: the arguments of the kernel; the array has a number for each item.
                timed(&queue, || unsafe {
                    let of = [Argument::Array(&array), Argument::Int(ROUNDS)];
                    queue.launch(&chains, &of, [CHAINS.min(numbers), 1], Some(256), 0)
                })
                .map(|time| 16.0 * f64::from(ROUNDS) * CHAINS.min(numbers) as f64 / time),
            ];
            for (best, rate) in best.iter_mut().zip(rates) {
                *best =
                    best.max(rate.map_err(|failed| Error::Input(format!("{}: {failed}", self.info.name)))?);
            }
        }
        Ok(best)
    }

    /// Compiles kernels with options of the preprocessor, once for each device, source and options.
    ///
    /// # Errors
    /// [`Error::Input`] with the first line of the log of the compiler.
    pub(crate) fn compile(&self, source: &str, options: &str) -> Result<Arc<Kernels>> {
        static COMPILED: Mutex<Vec<(usize, String, Arc<Kernels>)>> = Mutex::new(Vec::new());
        let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
        let (key, with) = (self.id.id() as usize, format!("{options}\n{source}"));
        if let Some((.., kernels)) = compiled.iter().find(|(id, of, _)| *id == key && *of == with) {
            return Ok(kernels.clone());
        }
        // The same bits as the processor's: divisions as IEEE 754 says, nothing relaxed.
        let options_of_all = format!("-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt {options}");
        let context =
            Context::from_device(&self.id).map_err(|error| self.failed("make a context on", &error))?;
        let program =
            Program::create_and_build_from_source(&context, source, &options_of_all).map_err(|log| {
                let path = std::env::temp_dir().join(format!("turbid-kernels-{}.log", std::process::id()));
                let kept = std::fs::write(&path, &log)
                    .map_or_else(|_| String::new(), |()| format!("; log: {}", path.display()));
                let first = log.lines().find(|line| line.contains("error")).unwrap_or("no message");
                Error::Input(format!("the compiler of {} refused the kernels: {first}{kept}", self.info.name))
            })?;
        let kernels = Arc::new(Kernels { context, program });
        compiled.push((key, with, kernels.clone()));
        Ok(kernels)
    }

    /// A queue of work on the device.
    ///
    /// # Errors
    /// [`Error::Input`] if the driver gives none.
    pub(crate) fn queue(&self, kernels: &Arc<Kernels>) -> Result<Queue> {
        // SAFETY: context and device are valid; no host memory is involved.
        let queue = unsafe { CommandQueue::create_with_properties(&kernels.context, self.id.id(), 0, 0) };
        let queue = queue.map_err(|error| self.failed("make a queue on", &error))?;
        Ok(Queue {
            commands: queue,
            kernels: kernels.clone(),
            device: self.clone(),
            costs: RefCell::new(None),
        })
    }

    fn failed(&self, what: &str, error: &ClError) -> Error {
        Error::Input(format!("cannot {what} {}: {error}", self.info.name))
    }
}

/// Time that the device takes (s).
fn timed(
    queue: &Queue,
    work: impl FnOnce() -> std::result::Result<(), Failed>,
) -> std::result::Result<f64, Failed> {
    queue.finish()?;
    let start = std::time::Instant::now();
    work()?;
    queue.finish()?;
    Ok(start.elapsed().as_secs_f64())
}

/// Compiled kernels.
pub(crate) struct Kernels {
    context: Context,
    program: Program,
}

impl Kernels {
    /// A kernel, whose arguments belong to the caller alone.
    pub(crate) fn kernel(&self, name: &'static str) -> NamedKernel {
        NamedKernel { kernel: Kernel::create(&self.program, name).expect("a kernel of the source"), name }
    }
}

/// A kernel.
pub(crate) struct NamedKernel {
    kernel: Kernel,
    name: &'static str,
}

/// An array of bytes on a device.
pub(crate) struct Array {
    buffer: Buffer<u8>,
    bytes: usize,
}

/// Why a device did not do what was asked.
#[derive(Clone, Debug)]
pub(crate) struct Failed(pub(crate) String);

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<ClError> for Failed {
    fn from(error: ClError) -> Self {
        Self(error.to_string())
    }
}

/// An argument of a kernel.
pub(crate) enum Argument<'a> {
    Array(&'a Array),
    Int(i32),
    Long(u64),
    Ints([i32; 4]),
}

/// Work on a device, done in the order in which it is given.
pub(crate) struct Queue {
    commands: CommandQueue,
    pub(crate) kernels: Arc<Kernels>,
    device: Device,
    /// By kernel, while they are timed.
    costs: RefCell<Option<Vec<KernelCost>>>,
}

impl Queue {
    /// An array of zeros; `what` it is for stands in the message, with an article.
    ///
    /// # Errors
    /// [`Error::Input`] with what is needed and what there is.
    pub(crate) fn zeroed(&self, bytes: usize, what: &str) -> Result<Array> {
        let size = bytes.max(16);
        let info = self.device.info();
        let refused = || {
            Error::Input(format!(
                "{} has not the memory for {what}: {} are needed, it has {} and gives {} at once; take a smaller box, fewer cells \
                 per diameter, fluid.precision = \"f32\" or more devices",
                info.name,
                memory::in_bytes(bytes as f64),
                memory::in_bytes(info.memory as f64),
                memory::in_bytes(info.largest as f64)
            ))
        };
        if size as u64 > info.largest {
            return Err(refused());
        }
        // SAFETY: no host memory is involved.
        let buffer = unsafe {
            Buffer::<u8>::create(&self.kernels.context, CL_MEM_READ_WRITE, size, std::ptr::null_mut())
        };
        let mut array = Array { buffer: buffer.map_err(|_| refused())?, bytes: size };
        self.clear(&mut array, size).map_err(|_| refused())?;
        self.commands.finish().map_err(|_| refused())?;
        Ok(array)
    }

    /// Makes sure that an array has room for so many bytes; what it held is lost if it grows.
    pub(crate) fn reserve(&self, array: &mut Array, bytes: usize) -> std::result::Result<(), Failed> {
        if array.bytes < bytes {
            let size = bytes + bytes / 4;
            // SAFETY: no host memory is involved.
            array.buffer = unsafe {
                Buffer::<u8>::create(&self.kernels.context, CL_MEM_READ_WRITE, size, std::ptr::null_mut())
            }?;
            array.bytes = size;
        }
        Ok(())
    }

    /// Zeros in the first bytes, a multiple of 8.
    pub(crate) fn clear(&self, array: &mut Array, bytes: usize) -> std::result::Result<(), Failed> {
        // SAFETY: the array has so many bytes.
        unsafe {
            self.commands.enqueue_fill_buffer(&mut array.buffer, &[0_u8], 0, bytes.min(array.bytes), &[])
        }?;
        Ok(())
    }

    /// Writes numbers to the start of an array, which grows if need be.
    pub(crate) fn write<T: bytemuck::Pod>(
        &self,
        array: &mut Array,
        values: &[T],
    ) -> std::result::Result<(), Failed> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.reserve(array, bytes.len())?;
        if !bytes.is_empty() {
            // SAFETY: the array has room, and the call returns when the bytes have been read.
            unsafe { self.commands.enqueue_write_buffer(&mut array.buffer, CL_TRUE, 0, bytes, &[]) }?;
        }
        Ok(())
    }

    /// Reads numbers from the start of an array, when all work given before is done.
    pub(crate) fn read<T: bytemuck::Pod>(
        &self,
        array: &Array,
        values: &mut [T],
    ) -> std::result::Result<(), Failed> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(values);
        assert!(bytes.len() <= array.bytes);
        if !bytes.is_empty() {
            // SAFETY: the array has so many bytes, and the call returns when they have been written.
            unsafe { self.commands.enqueue_read_buffer(&array.buffer, CL_TRUE, 0, bytes, &[]) }?;
        }
        Ok(())
    }

    /// Returns what kernels took since they are timed, and times them from now on or no longer; then each is waited for.
    pub(crate) fn time_kernels(&self, from_now_on: bool) -> Vec<KernelCost> {
        self.costs.replace(from_now_on.then(Vec::new)).unwrap_or_default()
    }

    /// Gives a kernel to the device: `items` in both directions, in work-groups of `group` or of any size. By count it reads and writes
    /// `bytes`.
    ///
    /// # Safety
    /// The arguments are those of the kernel, and with them it stays within its arrays.
    pub(crate) unsafe fn launch(
        &self,
        of: &NamedKernel,
        arguments: &[Argument],
        items: [usize; 2],
        group: Option<usize>,
        bytes: usize,
    ) -> std::result::Result<(), Failed> {
        let kernel = &of.kernel;
        for (at, argument) in (0..).zip(arguments) {
            // SAFETY: promised by the caller.
            unsafe {
                match argument {
                    Argument::Array(array) => kernel.set_arg(at, &array.buffer.get()),
                    Argument::Int(n) => kernel.set_arg(at, n),
                    Argument::Long(n) => kernel.set_arg(at, n),
                    Argument::Ints(n) => kernel.set_arg(at, n),
                }
            }?;
        }
        let group = group.map(|n| [n, 1]);
        let group = group.as_ref().map_or(std::ptr::null(), |group| group.as_ptr());
        // SAFETY: as above; sizes have as many numbers as there are directions.
        let enqueue = || unsafe {
            let (kernel, items) = (kernel.get(), items.as_ptr());
            self.commands.enqueue_nd_range_kernel(kernel, 2, std::ptr::null(), items, group, &[])?;
            Ok(())
        };
        let mut costs = self.costs.borrow_mut();
        let Some(costs) = &mut *costs else { return enqueue() };
        let seconds = timed(self, enqueue)?;
        let at = costs.iter().position(|cost| cost.name == of.name).unwrap_or_else(|| {
            costs.push(KernelCost { name: of.name.to_owned(), ..KernelCost::default() });
            costs.len() - 1
        });
        let cost = &mut costs[at];
        (cost.launches, cost.bytes) = (cost.launches + 1, cost.bytes + bytes as u64);
        cost.seconds += seconds;
        Ok(())
    }

    /// Gives a kernel to the device that works on a list of `count` items, which it is told; it reads and writes `bytes_each`.
    ///
    /// # Safety
    /// As for [`launch`](Self::launch).
    pub(crate) unsafe fn launch_over(
        &self,
        kernel: &NamedKernel,
        arguments: &[Argument],
        count: usize,
        bytes_each: usize,
    ) -> std::result::Result<(), Failed> {
        const GROUP: usize = 64;
        let (items, bytes) = ([count.next_multiple_of(GROUP), 1], count * bytes_each);
        // SAFETY: promised by the caller.
        unsafe { self.launch(kernel, arguments, items, Some(GROUP), bytes) }
    }

    /// Waits for all that was given.
    pub(crate) fn finish(&self) -> std::result::Result<(), Failed> {
        Ok(self.commands.finish()?)
    }

    /// The device.
    pub(crate) fn device(&self) -> &Device {
        &self.device
    }
}
