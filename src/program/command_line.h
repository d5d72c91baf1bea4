/// Command lines of the programs, by Boost.Program_options; numbers, ranges and rules between
/// options are checked here.
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

/// Bounds of a Range: the least of all numbers above 0, and none.
constexpr double kAboveZero = std::numeric_limits<double>::min();
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// The text as a number; a whole one up to 1e15. @throws UsageError that names the range.
double readNumber(const std::string& text, Range range);
double readWhole(const std::string& text, Range range);

/// Numbers between commas. @throws UsageError
std::vector<double> readNumbers(const std::string& text);

/// Last line of a program's help.
constexpr char kExitCodes[] = "Exit code: 0 done, 1 an error, 2 a wrong command line or setting.";

/// A text was asked for in place of the program's work, as by --help.
class TextRequest : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An option, an argument without dashes, which is known from others by its place, or a flag, which
/// takes no value. Whoever adds one gives the first members.
struct ProgramOption {
  std::string name;
  std::string value;  ///< What stands for its value in the help.
  std::string help;
  std::string default_value = {};  ///< Shown where the option is not required; empty: none.

  std::string group = {};
  bool is_list = false, is_required = false;
  std::function<void(const std::string&)> read = nullptr;  ///< For each value; null for a flag.
  std::function<void()> set = nullptr;                     ///< For a flag.
  std::string needs = {};                                  ///< Another option, or empty.
  std::vector<std::string> values = {};  ///< Values given; for a flag, an empty one.
};

/// The options of one program. Each is bound to a variable, whose value at that time is its
/// default; none may be given twice, but for lists.
class CommandLine {
 public:
  /// `usage` follows the program's name in the help, `about` says what the program does.
  CommandLine(const std::string& program, const std::string& usage, const std::string& about);

  /// The headline in the help of the options to come.
  void beginGroup(const std::string& headline);

  /// An option whose value is given to `read`; what that throws as std::invalid_argument becomes a
  /// UsageError with the option's name.
  void add(ProgramOption option, const std::function<void(const std::string&)>& read);
  void addText(ProgramOption option, std::string& target);
  /// Of a whole number, a double, or std::optional<double>, which has no default.
  template <class Number>
  void addNumber(ProgramOption option, Number& target, Range range);

  /// Takes one value or more, and may be repeated; `read` is called for each.
  void addList(ProgramOption option, const std::function<void(const std::string&)>& read);

  void addFlag(const std::string& name, const std::string& help, bool& target);

  /// A flag that shows a text and ends the program, whatever else is missing.
  void addTextRequest(const std::string& name, const std::string& help,
                      const std::function<std::string()>& text);

  /// Rules for options that were added. Arguments are required, but as one of a choice.
  void require(const std::string& name);
  void requireOneOf(const std::vector<std::string>& names);
  void onlyWith(const std::string& name, const std::string& other);

  /// Reads the arguments behind the program's name into the variables.
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
  std::vector<ProgramOption> options_;             ///< In the order of the help.
  std::vector<std::vector<std::string>> choices_;  ///< One of each has to be given.
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
