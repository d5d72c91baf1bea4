/// Values of options: numbers as users write them.
#pragma once

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// The command line is wrong; the program ends with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bounds of a Range: the least of all numbers above 0, and none.
constexpr double kAboveZero = std::numeric_limits<double>::min();
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// The text as a number; a whole one up to 1e15. @throws UsageError that names the range.
double readNumber(const std::string& text, Range range);
double readWhole(const std::string& text, Range range);

/// Numbers between commas. @throws UsageError
std::vector<double> readNumbers(const std::string& text);

/// With six digits at most, and no zeros at the end.
std::string shortestText(double number);

}  // namespace dtsdf
