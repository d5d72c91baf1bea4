/// Marks functions that compile for the CPU and, under nvcc, for the GPU as well.
///
/// Everything in kernels/ is written once and runs on both backends. To give the same bits on both,
/// the rules use only operations that IEEE 754 rounds exactly (+ - * / and square root, floor,
/// comparisons, conversions), and the build switches the contraction of a*b+c off on both sides.
#pragma once

#ifdef __CUDACC__
#define DTSDF_HD __host__ __device__ __forceinline__
#else
#define DTSDF_HD inline
#endif
