/// What is taken for a random error.
#pragma once

namespace dtsdf {

/// Random errors are within so many standard deviations: 997 of 1000 of a normal distribution. What
/// is farther has another cause.
constexpr double kMostDeviations = 3.0;

}  // namespace dtsdf
