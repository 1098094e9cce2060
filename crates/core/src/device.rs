//! Devices that compute the fluid besides the processor, by OpenCL or CUDA, whose drivers are loaded while the program runs.
//!
//! A device is what OpenCL lists: GPUs and other accelerators first, then processors that have a driver (PoCL). If it lists no GPU of NVIDIA,
//! those that CUDA lists come first. A device must compute in double precision, add up 64-bit integers in memory, and divide as IEEE 754 says:
//! then all results have the bits of the processor's kernels.

// Only drivers read the arguments of kernels.
#![cfg_attr(not(feature = "gpu"), allow(dead_code))]

#[cfg(feature = "gpu")]
mod drivers;
#[cfg(test)]
mod host_tests;

use crate::error::{Error, Result};
use crate::memory;
use std::any::Any;
use std::cell::RefCell;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// This program has drivers; without the feature `gpu` it has none, and lists no device.
pub const HAS_DRIVERS: bool = cfg!(feature = "gpu");

/// Name, driver and memory of a device.
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
    /// The reason why it cannot be used, if so.
    pub refused: Option<String>,
}

/// Time and bytes of a kernel while kernels were timed.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct KernelCost {
    /// Its name.
    pub name: String,
    /// Number of launches.
    pub launches: u64,
    /// Time (s), waiting for the device included.
    pub seconds: f64,
    /// Bytes that it reads and writes by count, each once.
    pub bytes: u64,
}

/// All devices, those that are no processors first; none without a driver.
pub fn devices() -> Vec<DeviceInfo> {
    drivers().iter().map(|(_, info)| info.clone()).collect()
}

/// Asked once, as drivers may fail if two threads ask for the first time at once.
fn drivers() -> &'static [(Arc<dyn Driver>, DeviceInfo)] {
    static DRIVERS: OnceLock<Vec<(Arc<dyn Driver>, DeviceInfo)>> = OnceLock::new();
    DRIVERS.get_or_init(|| {
        #[cfg(feature = "gpu")]
        let mut all = drivers::all();
        #[cfg(not(feature = "gpu"))]
        let mut all = Vec::<(Arc<dyn Driver>, DeviceInfo)>::new();
        all.sort_by_key(|(_, info)| info.is_processor);
        all
    })
}

/// A device, as its driver has it.
trait Driver: Send + Sync {
    /// Its description.
    fn info(&self) -> DeviceInfo;

    /// Compiles kernels with options of the preprocessor; the log if it does not.
    fn compile(&self, source: &str, options: &str) -> std::result::Result<Arc<dyn Program>, String>;
}

/// Compiled kernels.
trait Program: Send + Sync {
    /// A kernel, whose arguments belong to the caller alone.
    fn kernel(&self, name: &str) -> Done<Kernel>;

    /// Work that is done in the order in which it is given.
    fn commands(self: Arc<Self>) -> std::result::Result<Box<dyn Commands>, Failed>;
}

/// Work on a device, done in the order in which it is given.
///
/// # Safety
/// Of its functions: arrays and kernels are those of this driver and device, arrays have at least the bytes given, and with its arguments a kernel stays
/// within its arrays.
trait Commands {
    fn allocate(&self, bytes: usize) -> Done<Memory>;
    unsafe fn clear(&self, memory: &mut Memory, bytes: usize) -> Done;
    unsafe fn write(&self, memory: &mut Memory, bytes: &[u8]) -> Done;
    unsafe fn read(&self, memory: &Memory, bytes: &mut [u8]) -> Done;
    unsafe fn launch(&self, kernel: &Kernel, arguments: &[Argument], groups: u32, group: u32) -> Done;
    fn finish(&self) -> Done;
}

/// An array of a driver.
type Memory = Box<dyn Any + Send + Sync>;

/// A kernel of a driver.
type Kernel = Box<dyn Any>;

/// A device that can be used.
#[derive(Clone)]
pub struct Device {
    number: usize,
    driver: Arc<dyn Driver>,
    info: Arc<DeviceInfo>,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.info.fmt(f)
    }
}

impl Device {
    /// The device with a number in the list of [`devices`].
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such device, or if it cannot be used.
    pub fn open(number: usize) -> Result<Self> {
        let drivers = drivers();
        let Some((driver, info)) = drivers.get(number) else {
            let found = match drivers.len() {
                0 => "there is no OpenCL driver (libOpenCL) that lists one, nor CUDA".to_owned(),
                1 => "there is one device, gpu:0".to_owned(),
                n => format!("there are devices up to gpu:{}", n - 1),
            };
            return Err(Error::Input(format!(
                "cannot compute on device gpu:{number}: {found}; install the driver of the graphics card, or pocl-opencl-icd for \
                 the processor, or take --device cpu; `turbid doctor` lists the devices"
            )));
        };
        if let Some(why) = &info.refused {
            return Err(Error::Input(format!("cannot compute on device gpu:{number}, {}: {why}", info.name)));
        }
        Ok(Self { number, driver: driver.clone(), info: Arc::new(info.clone()) })
    }

    /// The processor, by the system's C++ compiler; none without one.
    #[cfg(test)]
    pub(crate) fn compiled_as_cpp() -> Option<Self> {
        let driver = Arc::new(host_tests::Host::new()?);
        Some(Self { number: usize::MAX, info: Arc::new(driver.info()), driver })
    }

    /// Its description.
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
        const GROUP: usize = 256;
        let kernels = self.compile(include_str!("device/measure.cl"), "")?;
        let queue = self.queue(&kernels)?;
        let numbers = (self.info.largest / 16).min(1 << 25) as usize / 256 * 256;
        let array = queue.zeroed(numbers * 8, "a measurement")?;
        let (stream, chains) = (kernels.kernel("stream"), kernels.kernel("chains"));
        let mut best = [0.0_f64; 2];
        for _ in 0..6 {
            let of = [Argument::Array(&array), Argument::Long(numbers as u64)];
            let rates = [
                // SAFETY: the arguments of the kernel; the array has as many numbers.
                timed(&queue, || unsafe { queue.launch(&stream, &of, numbers / GROUP, GROUP, 0) })
                    .map(|time| 16.0 * numbers as f64 / time),
                // SAFETY: the arguments of the kernel; the array has a number for each item.
                timed(&queue, || unsafe {
                    let of = [Argument::Array(&array), Argument::Int(ROUNDS)];
                    queue.launch(&chains, &of, CHAINS.min(numbers) / GROUP, GROUP, 0)
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
    /// [`Error::Kernels`] with the log of the compiler.
    pub(crate) fn compile(&self, source: &str, options: &str) -> Result<Arc<Kernels>> {
        static COMPILED: Mutex<Vec<(usize, String, Arc<Kernels>)>> = Mutex::new(Vec::new());
        let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
        let with = format!("{options}\n{source}");
        if let Some((.., kernels)) =
            compiled.iter().find(|(number, of, _)| *number == self.number && *of == with)
        {
            return Ok(kernels.clone());
        }
        let refused = |log| Error::Kernels { device: self.info.name.clone(), log };
        let program = self.driver.compile(source, options).map_err(refused)?;
        let kernels = Arc::new(Kernels(program));
        compiled.push((self.number, with, kernels.clone()));
        Ok(kernels)
    }

    /// A queue of work on the device.
    ///
    /// # Errors
    /// [`Error::Input`] if the driver gives none.
    pub(crate) fn queue(&self, kernels: &Kernels) -> Result<Queue> {
        let commands =
            kernels.0.clone().commands().map_err(|error| {
                Error::Input(format!("cannot make a queue on {}: {error}", self.info.name))
            })?;
        Ok(Queue { commands, device: self.clone(), costs: RefCell::new(None) })
    }
}

/// Time that the device takes (s).
fn timed(queue: &Queue, work: impl FnOnce() -> Done) -> Done<f64> {
    queue.finish()?;
    let start = std::time::Instant::now();
    work()?;
    queue.finish()?;
    Ok(start.elapsed().as_secs_f64())
}

/// Compiled kernels.
pub(crate) struct Kernels(Arc<dyn Program>);

impl Kernels {
    /// A kernel, whose arguments belong to the caller alone.
    pub(crate) fn kernel(&self, name: &'static str) -> NamedKernel {
        NamedKernel { kernel: self.0.kernel(name).expect("a kernel of the source"), name }
    }
}

/// A kernel.
pub(crate) struct NamedKernel {
    kernel: Kernel,
    name: &'static str,
}

/// An array of bytes on a device.
pub(crate) struct Array {
    memory: Memory,
    bytes: usize,
}

/// The reason why a device has failed.
#[derive(Clone, Debug)]
pub(crate) struct Failed(pub(crate) String);

/// A result of a device.
pub(crate) type Done<T = ()> = std::result::Result<T, Failed>;

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// An argument of a kernel.
pub(crate) enum Argument<'a> {
    Array(&'a Array),
    Int(i32),
    Long(u64),
    Ints([i32; 4]),
    Longs([u64; 19]),
    Doubles([f64; 8]),
}

/// Work on a device, done in the order in which it is given.
pub(crate) struct Queue {
    commands: Box<dyn Commands>,
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
        let memory = self.commands.allocate(size).map_err(|_| refused())?;
        let mut array = Array { memory, bytes: size };
        self.clear(&mut array, size).map_err(|_| refused())?;
        self.finish().map_err(|_| refused())?;
        Ok(array)
    }

    /// Makes sure that an array has room for some bytes; what it held is lost if it grows.
    pub(crate) fn reserve(&self, array: &mut Array, bytes: usize) -> Done {
        if array.bytes < bytes {
            let size = bytes + bytes / 4;
            array.memory = self.commands.allocate(size)?;
            array.bytes = size;
        }
        Ok(())
    }

    /// Zeros in the first bytes, a multiple of 8.
    pub(crate) fn clear(&self, array: &mut Array, bytes: usize) -> Done {
        let bytes = bytes.min(array.bytes);
        // SAFETY: the array is as long.
        unsafe { self.commands.clear(&mut array.memory, bytes) }
    }

    /// Writes numbers to the start of an array, which grows if need be.
    pub(crate) fn write<T: bytemuck::Pod>(&self, array: &mut Array, values: &[T]) -> Done {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.reserve(array, bytes.len())?;
        if !bytes.is_empty() {
            // SAFETY: the array has room.
            unsafe { self.commands.write(&mut array.memory, bytes) }?;
        }
        Ok(())
    }

    /// Reads numbers from the start of an array, when all work given before is done.
    pub(crate) fn read<T: bytemuck::Pod>(&self, array: &Array, values: &mut [T]) -> Done {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(values);
        assert!(bytes.len() <= array.bytes);
        if !bytes.is_empty() {
            // SAFETY: the array is as long.
            unsafe { self.commands.read(&array.memory, bytes) }?;
        }
        Ok(())
    }

    /// Returns what kernels took since they are timed, and times them from now on or no longer; then each is waited for.
    pub(crate) fn time_kernels(&self, from_now_on: bool) -> Vec<KernelCost> {
        self.costs.replace(from_now_on.then(Vec::new)).unwrap_or_default()
    }

    /// Gives a kernel to the device, in `groups` work-groups of `group` items. By count it reads and writes `bytes`.
    ///
    /// # Safety
    /// The arguments are those of the kernel, and with them it stays within its arrays.
    pub(crate) unsafe fn launch(
        &self,
        of: &NamedKernel,
        arguments: &[Argument],
        groups: usize,
        group: usize,
        bytes: usize,
    ) -> Done {
        let groups = u32::try_from(groups).map_err(|_| Failed("too many work-groups".to_owned()))?;
        // SAFETY: promised by the caller.
        let enqueue = || unsafe { self.commands.launch(&of.kernel, arguments, groups, group as u32) };
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
    ) -> Done {
        const GROUP: usize = 64;
        // SAFETY: promised by the caller.
        unsafe { self.launch(kernel, arguments, count.div_ceil(GROUP), GROUP, count * bytes_each) }
    }

    /// Waits for all that was given.
    pub(crate) fn finish(&self) -> Done {
        self.commands.finish()
    }

    /// The device.
    pub(crate) fn device(&self) -> &Device {
        &self.device
    }
}
