// The part of OpenCL C that the kernels use, in CUDA C++; put before them. Functions are those of the device by default.

#define __kernel extern "C" __global__
#define __global
#define __local
#define __constant __constant__
#define SHARED __shared__
#define WORK_GROUP(items) __launch_bounds__(items)
#define ASM asm
#define CLK_LOCAL_MEM_FENCE 0
#define barrier(fence) __syncthreads()
#define as_long __double_as_longlong
#define as_double __longlong_as_double

typedef unsigned char uchar;
typedef unsigned int uint;
typedef unsigned long ulong;

size_t get_global_id(int) { return (size_t)blockIdx.x * blockDim.x + threadIdx.x; }
size_t get_local_id(int) { return threadIdx.x; }
size_t get_group_id(int) { return blockIdx.x; }

long atom_add(long* sum, long x) { return (long)atomicAdd((unsigned long long*)sum, (unsigned long long)x); }

typedef unsigned short half;

float vload_half(size_t i, const half* p) {
    float x;
    asm("cvt.f32.f16 %0, %1;" : "=f"(x) : "h"(p[i]));
    return x;
}

void vstore_half_rte(float x, size_t i, half* p) {
    half nearest;
    asm("cvt.rn.f16.f32 %0, %1;" : "=h"(nearest) : "f"(x));
    p[i] = nearest;
}
