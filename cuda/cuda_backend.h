/// The door to the GPU backend: the only header of cuda/ that the rest of the package includes.
#pragma once

#include <string>

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Empty if this process can map on the current CUDA device, else the reason why not.
std::string findCudaProblem();

/// Backends on the device that is the calling thread's now, whoever makes them.
/// @pre findCudaProblem() is empty. @throws BackendError if CUDA fails, as making one does.
BackendMaker cudaBackends(const MapperParams& params, const Rules& rules);

/// Bytes of the current device that are taken, by whatever process.
size_t cudaMemoryTaken();

}  // namespace dtsdf
