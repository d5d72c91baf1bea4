/// Marks functions that compile for the CPU and, under nvcc, for the GPU.
///
/// The rules in kernels/ run on both backends and must give bitwise equal results. So they use only
/// operations whose results IEEE 754 defines exactly (+ - * / and square root, floor, comparisons,
/// conversions), and the build disables the contraction of a * b + c.
#pragma once

#ifdef __CUDACC__
#define DTSDF_HD __host__ __device__ __forceinline__
#else
#define DTSDF_HD inline
#endif
