/// Creates mappers for benchmarks, experiments and tests, and reports how much GPU memory is in
/// use. Also available in builds without CUDA.
#pragma once

#include <memory>

#include "backend/mapper_probe.h"
#include "backend/profile.h"
#include "backend/rules.h"

namespace dtsdf {

/// Creates a mapper that gives access to its internals. Experiments may change `rules`.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params,
                                               const Rules& rules = Rules());

/// Creates a mapper that resumes from the contents of another one.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapContents& contents);
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapParts& parts);

/// GPU memory currently in use by all processes, in bytes; 0 without CUDA.
size_t gpuMemoryTaken();

/// Increase of gpuMemoryTaken() since `before`; 0 if it fell.
size_t gpuMemoryTakenSince(size_t before);

}  // namespace dtsdf
