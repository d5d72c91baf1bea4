/// Entry point to the GPU backend. Apart from tests, code outside cuda/ includes only this header.
#pragma once

#include <string>

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Why this process cannot use the current CUDA device; empty if it can.
std::string findCudaProblem();

/// Returns a function that creates backends for the current device, and may be called on any
/// thread.
/// @pre findCudaProblem() is empty. @throws BackendError if CUDA fails, here or in the function.
BackendMaker cudaBackends(const MapperParams& params, const Rules& rules);

/// Memory on the current device used by all processes together, in bytes.
size_t cudaMemoryTaken();

}  // namespace dtsdf
