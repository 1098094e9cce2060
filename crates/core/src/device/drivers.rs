//! The drivers that this program has with the feature `gpu`.

mod cuda;
mod opencl;

use super::{DeviceInfo, Driver};
use std::sync::Arc;

/// First compute capability of NVIDIA's GPUs whose warps add up by an instruction, `WARPS` in the kernels.
const WARPS_SINCE: i32 = 8;

/// All devices; those of CUDA only if OpenCL lists no GPU of NVIDIA.
pub(super) fn all() -> Vec<(Arc<dyn Driver>, DeviceInfo)> {
    let described = |driver: Arc<dyn Driver>| {
        let info = driver.info();
        (driver, info)
    };
    let by_opencl: Vec<_> = opencl::devices().into_iter().map(described).collect();
    let of_nvidia = |info: &DeviceInfo| info.name.contains("NVIDIA") || info.driver.contains("CUDA");
    if by_opencl.iter().any(|(_, info)| info.refused.is_none() && of_nvidia(info)) {
        return by_opencl;
    }
    cuda::devices().into_iter().map(described).chain(by_opencl).collect()
}
