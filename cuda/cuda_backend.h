/// The entry point of the GPU backend, and the only header in cuda/ that code outside it includes,
/// except for tests.
#pragma once

#include <string>

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// The reason why this process cannot map on the current CUDA device; empty if it can.
std::string findCudaProblem();

/// Returns a function that makes backends, on any thread, for the device that is current now.
/// @pre findCudaProblem() is empty. @throws BackendError if CUDA fails, here or in the function.
BackendMaker cudaBackends(const MapperParams& params, const Rules& rules);

/// Bytes of the current device's memory in use, by all processes together.
size_t cudaMemoryTaken();

}  // namespace dtsdf
