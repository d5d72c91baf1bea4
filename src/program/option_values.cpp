#include "program/option_values.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/text_file.h"

namespace dtsdf {
namespace {

std::string describe(Range range) {
  const std::string max = shortestText(range.max);
  if (range.min == kAboveZero) return " above 0" + (range.max < kUnbounded ? " up to " + max : "");
  if (range.max < kUnbounded) return " from " + shortestText(range.min) + " to " + max;
  return range.min > -kUnbounded ? " from " + shortestText(range.min) + " on" : "";
}

}  // namespace

std::string shortestText(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

double readNumber(const std::string& text, Range range) {
  double number = 0.0;
  if (!parseNumber(text, number) || !std::isfinite(number) || number < range.min ||
      number > range.max) {
    throw UsageError("'" + text + "' is not a number" + describe(range));
  }
  return number;
}

double readWhole(const std::string& text, Range range) {
  constexpr double kExact = 1e15;
  long long number = 0;
  if (!parseNumber(text, number) || std::abs(static_cast<double>(number)) > kExact ||
      static_cast<double>(number) < range.min || static_cast<double>(number) > range.max) {
    throw UsageError("'" + text + "' is not a whole number" + describe(range));
  }
  return static_cast<double>(number);
}

std::vector<double> readNumbers(const std::string& text) {
  std::vector<double> numbers;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    numbers.push_back(readNumber(text.substr(begin, end - begin), {-kUnbounded, kUnbounded}));
    begin = end + 1;
  }
  return numbers;
}

}  // namespace dtsdf
