/// The backend on the CPU, with all cores.
#pragma once

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// How many threads a mapper on the CPU has.
int cpuThreads(const MapperParams& params);

/// Backends with as many threads.
BackendMaker cpuBackends(const MapperParams& params, const Rules& rules);

}  // namespace dtsdf
