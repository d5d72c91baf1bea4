/// Options and arguments of the evaluation programs.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace dtsdf {

/// Splits a command line into positional arguments and options (--name VALUE or --name=VALUE).
class CommandLine {
 public:
  /// `options` take a value, `flags` do not.
  /// @throws std::invalid_argument for an unknown option or a missing value.
  CommandLine(int argc, const char* const* argv, const std::set<std::string>& options,
              const std::set<std::string>& flags);

  const std::vector<std::string>& positional() const { return positional_; }
  bool has(const std::string& name) const { return values_.count(name) > 0; }

  std::string text(const std::string& name, const std::string& fallback) const;

  /// @throws std::invalid_argument if the value is no number or not in [min, max].
  double number(const std::string& name, double fallback, double min, double max) const;

  /// Numbers between commas, as many as there are.
  std::vector<double> numbers(const std::string& name, const std::vector<double>& fallback) const;

 private:
  std::vector<std::string> positional_;
  std::map<std::string, std::string> values_;
};

}  // namespace dtsdf
