/// The GPU that a mapper would use, also in a build that has no CUDA backend.
#pragma once

#include "backend/gpu_report.h"

namespace dtsdf {

/// @throws std::runtime_error if CUDA cannot be used.
GpuReport reportGpu();

/// Memory of the GPU that is taken at present, by whatever process. 0 without CUDA.
size_t gpuMemoryTaken();

/// How much more that is than it was; 0 where others gave back more meanwhile.
size_t gpuMemoryTakenSince(size_t before);

}  // namespace dtsdf
