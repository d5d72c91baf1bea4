/// The entry point of the GPU backend: the only header of cuda/ that the rest of the package
/// includes.
#pragma once

#include <string>

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Why this process cannot map on the current CUDA device; empty if it can.
std::string findCudaProblem();

/// A maker of backends on the calling thread's current device, whichever thread it is used on.
/// @pre findCudaProblem() is empty. @throws BackendError if CUDA fails; so does the maker.
BackendMaker cudaBackends(const MapperParams& params, const Rules& rules);

/// Bytes of the current device's memory that are in use, by all processes.
size_t cudaMemoryTaken();

}  // namespace dtsdf
