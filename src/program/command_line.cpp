#include "program/command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>

#include "io/text_file.h"

namespace dtsdf {
namespace {

bool isOption(const std::string& text) { return text.rfind("--", 0) == 0; }

/// Breaks a text into indented lines for a terminal.
std::string wrap(const std::string& text, size_t indent) {
  constexpr size_t kColumns = 80;
  const std::string margin(indent, ' ');
  std::istringstream words(text);
  std::string wrapped, line = margin;
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kColumns) {
      wrapped += line + "\n";
      line = margin;
    }
    line += (line == margin ? "" : " ") + word;
  }
  return wrapped + line + "\n";
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  }
  return text;
}

std::string shortest(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

std::string describe(Range range) {
  const std::string max = shortest(range.max);
  if (range.min == kAboveZero) return " above 0" + (range.max < kUnbounded ? " up to " + max : "");
  if (range.max < kUnbounded) return " from " + shortest(range.min) + " to " + max;
  return range.min > -kUnbounded ? " from " + shortest(range.min) + " on" : "";
}

/// The help in paragraphs: options may have long names of values and long explanations.
class HelpFormat : public CLI::Formatter {
 public:
  HelpFormat(std::string usage, std::string about)
      : usage_(std::move(usage)), about_(std::move(about)) {
    label("Positionals", "Arguments");
  }

  std::string make_usage(const CLI::App* app, std::string) const override {
    return "usage: " + app->get_name() + " " + usage_ + "\n\n" + wrap(about_, 0);
  }

  std::string make_option(const CLI::Option* option, bool is_argument) const override {
    const std::string value = option->get_type_name();
    return "  " + option->get_name(is_argument, !is_argument) + (value.empty() ? "" : " " + value) +
           "\n" + wrap(option->get_description(), 6);
  }

 private:
  const std::string usage_, about_;
};

}  // namespace

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

struct CommandLine::State {
  explicit State(const std::string& program) : app("", program) {}

  CLI::Option* configure(CLI::Option* option, const OptionText& text) const {
    option->type_name(text.value)->group(headline)->required(!isOption(text.name));
    return option;
  }

  /// What CLI11 leaves open or says in words of its own.
  void check() const {
    for (const std::string& name : singles) {
      if (app.count(name) > 1) throw UsageError(name + " is given twice");
    }
    const std::vector<std::string> unknown = app.remaining();
    if (unknown.empty()) return;
    if (unknown[0].rfind('-', 0) == 0) throw UsageError("unknown option " + unknown[0]);
    throw UsageError("'" + unknown[0] + "' belongs to no option");
  }

  /// Values that are missing, or that a flag got. Versions differ in what they make of these.
  void checkValues(const std::vector<std::string>& arguments) const {
    for (size_t i = 0; i < arguments.size(); ++i) {
      const size_t equals = arguments[i].find('=');
      const std::string name = arguments[i].substr(0, equals);
      const CLI::Option* option = isOption(name) ? app.get_option_no_throw(name) : nullptr;
      if (option == nullptr) continue;
      const bool has_value = equals == std::string::npos
                                 ? i + 1 < arguments.size() && !isOption(arguments[i + 1])
                                 : equals + 1 < arguments[i].size();
      const std::string value = option->get_type_name();
      if (value.empty() && equals != std::string::npos) throw UsageError(name + " takes no value");
      if (!value.empty() && !has_value) throw UsageError(name + " needs a value (" + value + ")");
    }
  }

  void checkChoices() const {
    for (const std::vector<std::string>& names : choices) {
      size_t given = 0;
      for (const std::string& name : names) given += app.count(name) > 0;
      if (given != 1) throw UsageError("give one of " + joined(names));
    }
  }

  CLI::App app;
  std::string headline = "Options";
  std::vector<std::string> singles;               ///< Options that may be given once.
  std::vector<std::vector<std::string>> choices;  ///< Of each, one has to be given.
};

CommandLine::CommandLine(const std::string& program, const std::string& usage,
                         const std::string& about, const std::string& end)
    : state_(std::make_unique<State>(program)) {
  state_->app.set_help_flag();
  state_->app.formatter(std::make_shared<HelpFormat>(usage, about));
  state_->app.footer("\n" + end);
  // Unknown ones are reported by check(), before anything that is missing.
  state_->app.allow_extras();
}

CommandLine::~CommandLine() = default;

void CommandLine::beginGroup(const std::string& headline) { state_->headline = headline; }

static void readValue(const OptionText& text, const std::string& value,
                      const std::function<void(const std::string&)>& read) {
  if (value.empty()) throw UsageError(text.name + " needs a value (" + text.value + ")");
  try {
    read(value);
  } catch (const UsageError& error) {
    throw UsageError(text.name + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw UsageError(text.name + ": " + error.what());
  }
}

void CommandLine::add(const OptionText& text,
                      const std::function<void(const std::string&)>& read) {
  const std::function<void(const std::string&)> readNamed = [text, read](const std::string& value) {
    readValue(text, value, read);
  };
  state_->configure(state_->app.add_option_function<std::string>(text.name, readNamed, text.help),
                    text);
  state_->singles.push_back(text.name);
}

void CommandLine::addList(const OptionText& text,
                          const std::function<void(const std::string&)>& read) {
  using Values = std::vector<std::string>;
  const std::function<void(const Values&)> readEach = [text, read](const Values& values) {
    for (const std::string& value : values) readValue(text, value, read);
  };
  state_->configure(state_->app.add_option_function<Values>(text.name, readEach, text.help), text);
}

void CommandLine::addText(const OptionText& text, std::string& target) {
  OptionText with_default = text;
  if (!target.empty()) with_default.help += " (default " + target + ")";
  add(with_default, [&target](const std::string& value) { target = value; });
}

void CommandLine::addNumber(const OptionText& text, double& target, Range range) {
  OptionText with_default = text;
  with_default.help += " (default " + shortest(target) + ")";
  add(with_default,
      [&target, range](const std::string& value) { target = readNumber(value, range); });
}

void CommandLine::addNumber(const OptionText& text, std::optional<double>& target, Range range) {
  add(text, [&target, range](const std::string& value) { target = readNumber(value, range); });
}

void CommandLine::addFlag(const std::string& name, const std::string& help, bool& target) {
  CLI::Option* const option = state_->app.add_flag(name, target, help);
  state_->configure(option, {name, "", help})->disable_flag_override();
  state_->singles.push_back(name);
}

void CommandLine::addTextRequest(const std::string& name, const std::string& help,
                                 const std::function<std::string()>& text) {
  const std::function<void()> request = [text] { throw TextRequest(text()); };
  CLI::Option* const option = state_->app.add_flag_callback(name, request, help);
  state_->configure(option, {name, "", help})->disable_flag_override();
}

void CommandLine::require(const std::string& name) { state_->app.get_option(name)->required(); }

void CommandLine::requireOneOf(const std::vector<std::string>& names) {
  for (const std::string& name : names) state_->app.get_option(name)->required(false);
  state_->choices.push_back(names);
}

void CommandLine::onlyWith(const std::string& name, const std::string& other) {
  state_->app.get_option(name)->needs(state_->app.get_option(other));
}

void CommandLine::parse(const std::vector<std::string>& arguments) {
  CLI::App& app = state_->app;
  CLI::Option* const help_flag = app.set_help_flag("-h,--help", "show this and end");
  help_flag->disable_flag_override()->group(state_->headline);
  state_->checkValues(arguments);
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    state_->check();
    state_->checkChoices();
  } catch (const CLI::CallForHelp&) {
    throw TextRequest(help());
  } catch (const CLI::RequiredError& error) {
    state_->check();
    state_->checkChoices();
    throw UsageError(error.what());
  } catch (const CLI::ParseError& error) {
    state_->check();
    throw UsageError(error.what());
  }
}

bool CommandLine::given(const std::string& name) const { return state_->app.count(name) > 0; }

std::string CommandLine::help() const {
  std::string text = state_->app.help();
  // Some versions leave two empty lines between groups.
  for (size_t at; (at = text.find("\n\n\n")) != std::string::npos;) text.erase(at, 1);
  return text;
}

}  // namespace dtsdf
