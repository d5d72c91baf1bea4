/// makeMapper() for benchmarks, experiments and tests; and the GPU that a mapper would use, also in
/// a build that has no CUDA backend.
#pragma once

#include <memory>

#include "backend/mapper_probe.h"
#include "backend/profile.h"
#include "backend/rules.h"

namespace dtsdf {

/// A mapper with a view inside, and with other numbers in its rules where an experiment asks for
/// it.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params,
                                               const Rules& rules = Rules());

/// A mapper that begins with the contents of another one.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapContents& contents);
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapParts& parts);

/// Memory of the GPU that is taken at present, by whatever process. 0 without CUDA.
size_t gpuMemoryTaken();

/// How much more that is than it was; 0 where others gave back more meanwhile.
size_t gpuMemoryTakenSince(size_t before);

}  // namespace dtsdf
