/// The CPU backend.
#pragma once

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Number of threads that a mapper uses on the CPU: the setting `threads` or, if that is 0, the
/// number of cores available to this process.
int cpuThreads(const MapperParams& params);

/// Returns a function that creates a CPU backend for a block table.
BackendMaker cpuBackends(const MapperParams& params, const Rules& rules);

}  // namespace dtsdf
