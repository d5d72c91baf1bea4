/// The door to the GPU backend: the only header of cuda/ that the rest of the package includes.
#pragma once

#include <memory>
#include <string>

#include "backend/mapper_probe.h"
#include "backend/rules.h"

namespace dtsdf {

/// Empty if this process can map on the current CUDA device, else the reason why not.
std::string findCudaProblem();

/// @pre findCudaProblem() is empty.
/// @throws std::runtime_error if CUDA fails.
std::unique_ptr<ProbedMapper> makeCudaMapper(const MapperParams& params, const Rules& rules);

}  // namespace dtsdf
