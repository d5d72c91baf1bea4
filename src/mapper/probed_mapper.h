/// makeMapper() for benchmarks, experiments and tests.
#pragma once

#include <memory>

#include "backend/mapper_probe.h"
#include "backend/rules.h"

namespace dtsdf {

/// A mapper with a view inside, and with other numbers in its rules where an experiment asks for
/// it.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params,
                                               const Rules& rules = Rules());

/// The same, from the contents of another one.
/// @throws std::runtime_error like makeMapper().
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapContents& contents);
std::unique_ptr<ProbedMapper> makeProbedMapper(const MapperParams& params, const Rules& rules,
                                               const MapParts& parts);

}  // namespace dtsdf
