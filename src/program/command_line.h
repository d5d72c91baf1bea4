/// Parses the programs' command lines with Boost.Program_options, and checks numbers, ranges and
/// dependencies between options.
#pragma once

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"
#include "params/text.h"

namespace dtsdf {

/// The command line is wrong; the program ends with exit code 2.
class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Special bounds of a Range: the smallest number above 0, and no bound.
constexpr double kAboveZero = std::numeric_limits<double>::min();
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Reads a number, or a whole number up to 1e15. @throws UsageError that names the range.
double readNumber(const std::string& text, Range range);
double readWhole(const std::string& text, Range range);

/// Reads numbers separated by commas. @throws UsageError
std::vector<double> readNumbers(const std::string& text);

/// Last line of a program's help.
constexpr char kExitCodes[] = "Exit code: 0 success, 1 error, 2 invalid command line or setting.";

/// Thrown by options such as --help, to print a text and end the program.
class TextRequest : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An option, a positional argument (a name without dashes), or a flag, which takes no value.
/// Callers of CommandLine may set the first four members.
struct ProgramOption {
  std::string name;
  std::string value;  ///< Placeholder for the value in the help.
  std::string help;
  std::string default_value = {};  ///< Shown unless the option is required; may be empty.

  std::string group = {};
  bool is_list = false, is_required = false;
  std::function<void(const std::string&)> read = nullptr;  ///< Reads each value; null for a flag.
  std::function<void()> set = nullptr;                     ///< Called for a flag.
  std::string needs = {};                ///< Option that this one requires, if any.
  std::vector<std::string> values = {};  ///< Values given; for a flag, one empty string.
};

/// The options of one program. An option may be bound to a variable, whose initial value is the
/// default. Only lists may be given more than once.
class CommandLine {
 public:
  /// `usage` follows the program's name in the help, `about` says what the program does.
  CommandLine(const std::string& program, const std::string& usage, const std::string& about);

  /// Sets the headline under which the help lists the options added next.
  void beginGroup(const std::string& headline);

  /// Adds an option whose value is passed to `read`. A std::invalid_argument from `read` becomes a
  /// UsageError with the option's name.
  void add(ProgramOption option, const std::function<void(const std::string&)>& read);
  void addText(ProgramOption option, std::string& target);
  /// Adds a whole number, a double, or a std::optional<double>, which has no default.
  template <class Number>
  void addNumber(ProgramOption option, Number& target, Range range);

  /// Adds an option that takes one or more values and may be repeated; `read` is called for each.
  void addList(ProgramOption option, const std::function<void(const std::string&)>& read);

  void addFlag(const std::string& name, const std::string& help, bool& target);

  /// Adds a flag that prints a text and ends the program, even if required options are missing.
  void addTextRequest(const std::string& name, const std::string& help,
                      const std::function<std::string()>& text);

  /// Rules for options already added. Positional arguments are required unless passed to
  /// requireOneOf().
  void require(const std::string& name);
  void requireOneOf(const std::vector<std::string>& names);
  void onlyWith(const std::string& name, const std::string& other);

  /// Reads the arguments after the program's name into the variables.
  /// @throws UsageError that names the option, TextRequest for --help.
  void parse(const std::vector<std::string>& arguments);

  bool given(const std::string& name);

  std::string help() const;

 private:
  ProgramOption& get(const std::string& name);
  void distribute(const std::vector<std::string>& arguments);
  void readValues() const;
  void checkRules();

  const std::string program_, usage_, about_;
  std::string headline_ = "Options";
  std::vector<ProgramOption> options_;             ///< In the order in which they were added.
  std::vector<std::vector<std::string>> choices_;  ///< One option of each must be given.
};

template <class Number>
void CommandLine::addNumber(ProgramOption option, Number& target, Range range) {
  constexpr bool kIsWhole = std::is_integral_v<Number>;
  if constexpr (std::is_arithmetic_v<Number>) {
    option.default_value = shortestText(static_cast<double>(target), kIsWhole ? 15 : 6);
  }
  add(std::move(option), [&target, range](const std::string& value) {
    target = static_cast<Number>((kIsWhole ? readWhole : readNumber)(value, range));
  });
}

}  // namespace dtsdf
