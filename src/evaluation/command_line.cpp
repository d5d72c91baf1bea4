#include "evaluation/command_line.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace dtsdf {

namespace {

double parseNumber(const std::string& name, const std::string& text) {
  size_t used = 0;
  double number = NAN;
  try {
    number = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  if (text.empty() || used != text.size() || !std::isfinite(number)) {
    throw std::invalid_argument("--" + name + ": '" + text + "' is not a number");
  }
  return number;
}

}  // namespace

CommandLine::CommandLine(int argc, const char* const* argv, const std::set<std::string>& options,
                         const std::set<std::string>& flags) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind("--", 0) != 0) {
      positional_.push_back(argument);
      continue;
    }
    const size_t equals = argument.find('=');
    const std::string name = argument.substr(2, equals == std::string::npos ? equals : equals - 2);
    if (flags.count(name) > 0 && equals == std::string::npos) {
      values_[name] = "";
    } else if (options.count(name) == 0) {
      throw std::invalid_argument("unknown option " + argument);
    } else if (equals != std::string::npos) {
      values_[name] = argument.substr(equals + 1);
    } else if (i + 1 < argc) {
      values_[name] = argv[++i];
    } else {
      throw std::invalid_argument(argument + " needs a value");
    }
  }
}

std::string CommandLine::text(const std::string& name, const std::string& fallback) const {
  const auto found = values_.find(name);
  return found == values_.end() ? fallback : found->second;
}

double CommandLine::number(const std::string& name, double fallback, double min, double max) const {
  const auto found = values_.find(name);
  if (found == values_.end()) return fallback;
  const double number = parseNumber(name, found->second);
  if (number < min || number > max) {
    std::ostringstream rule;
    rule << "--" << name << ": " << found->second << " is not between " << min << " and " << max;
    throw std::invalid_argument(rule.str());
  }
  return number;
}

std::vector<double> CommandLine::numbers(const std::string& name,
                                         const std::vector<double>& fallback) const {
  const auto found = values_.find(name);
  if (found == values_.end()) return fallback;
  std::vector<double> numbers;
  std::istringstream list(found->second);
  std::string item;
  while (std::getline(list, item, ',')) numbers.push_back(parseNumber(name, item));
  return numbers;
}

}  // namespace dtsdf
