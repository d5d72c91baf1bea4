/// Marks functions that compile for the CPU and, under nvcc, for the GPU.
///
/// The rules in kernels/ are written once and run on both backends. To give the same bits on both,
/// they use only operations that IEEE 754 rounds exactly (+ - * / and square root, floor,
/// comparisons, conversions), and the build disables the contraction of a * b + c.
#pragma once

#ifdef __CUDACC__
#define DTSDF_HD __host__ __device__ __forceinline__
#else
#define DTSDF_HD inline
#endif
