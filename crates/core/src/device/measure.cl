// What a device reaches: its memory, and its rate in double precision.

#pragma OPENCL EXTENSION cl_khr_fp64 : enable

// Reads and writes every number once.
__kernel void stream(__global double* data, const ulong count) {
    size_t k = get_global_id(0);
    if (k < count) data[k] = data[k] * 1.0001 + 1.0;
}

// Eight chains of `rounds` fused products and sums each in double precision.
__kernel void chains(__global double* data, const int rounds) {
    double x[8];
    for (int k = 0; k < 8; k++) x[k] = 1e-3 * k + 1e-6 * (double)get_global_id(0);
    for (int n = 0; n < rounds; n++) {
        for (int k = 0; k < 8; k++) x[k] = fma(x[k], 0.999, 0.5);
    }
    double sum = 0.0;
    for (int k = 0; k < 8; k++) sum += x[k];
    data[get_global_id(0)] = sum;
}
