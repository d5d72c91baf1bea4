/// What a report on the GPU needs: its name, the rates of its memory, its kernels.
#pragma once

#include "backend/gpu_report.h"

namespace dtsdf {

/// @throws std::runtime_error if CUDA fails.
GpuReport reportCudaDevice();

/// Bytes of the current device that are taken, by whatever process.
size_t cudaMemoryTaken();

}  // namespace dtsdf
