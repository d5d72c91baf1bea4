/// The CPU backend, on all cores.
#pragma once

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Number of threads of a mapper on the CPU.
int cpuThreads(const MapperParams& params);

/// Makes CPU backends with this many threads.
BackendMaker cpuBackends(const MapperParams& params, const Rules& rules);

}  // namespace dtsdf
