#include "program/command_line.h"

#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <sstream>

#include "io/text_file.h"
#include "params/text.h"

namespace dtsdf {
namespace po = boost::program_options;
namespace {

std::string describe(Range range) {
  const std::string max = shortestText(range.max);
  if (range.min == kAboveZero) return " above 0" + (range.max < kUnbounded ? ", up to " + max : "");
  if (range.max < kUnbounded) return " from " + shortestText(range.min) + " to " + max;
  return range.min > -kUnbounded ? " of " + shortestText(range.min) + " or more" : "";
}

bool isOption(const std::string& text) { return text.rfind("--", 0) == 0; }
bool isFlag(const ProgramOption& option) { return option.read == nullptr; }
/// Name of the option for Boost, without dashes.
std::string keyOf(const ProgramOption& option) {
  return isOption(option.name) ? option.name.substr(2) : option.name;
}

/// Wraps text into indented lines for a terminal.
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

void readValue(const ProgramOption& option, const std::string& value) {
  if (value.empty()) throw UsageError(option.name + " needs a value (" + option.value + ")");
  try {
    option.read(value);
  } catch (const std::invalid_argument& error) {
    throw UsageError(option.name + ": " + error.what());
  }
}

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
  std::istringstream parts(text + ",");  // so that an empty last part is not overlooked
  for (std::string part; std::getline(parts, part, ',');) {
    numbers.push_back(readNumber(part, {-kUnbounded, kUnbounded}));
  }
  return numbers;
}

ProgramOption& CommandLine::get(const std::string& name) {
  const auto found = std::find_if(options_.begin(), options_.end(),
                                  [&](const ProgramOption& option) { return option.name == name; });
  if (found == options_.end()) throw std::logic_error("unknown option " + name);
  return *found;
}

/// Assigns the arguments to the options. @throws po::error, UsageError
void CommandLine::distribute(const std::vector<std::string>& arguments) {
  // Options have no short names, and cannot be abbreviated.
  const int style = po::command_line_style::allow_long |
                    po::command_line_style::long_allow_adjacent |
                    po::command_line_style::long_allow_next;
  po::options_description all;
  po::positional_options_description places;
  all.add_options()("help", po::bool_switch())("...", po::value<std::vector<std::string>>());
  for (const ProgramOption& option : options_) {
    const po::value_semantic* value = po::value<std::string>();
    if (option.is_list) value = po::value<std::vector<std::string>>()->multitoken();
    if (isFlag(option)) value = po::bool_switch();
    all.add_options()(keyOf(option).c_str(), value);
    if (!isOption(option.name)) places.add(keyOf(option).c_str(), option.is_list ? -1 : 1);
  }
  if (places.max_total_count() != std::numeric_limits<unsigned>::max()) places.add("...", -1);
  const po::parsed_options parsed =
      po::command_line_parser(arguments).options(all).positional(places).style(style).run();
  for (const po::option& given : parsed.options) {
    const std::vector<std::string>& tokens = given.original_tokens;
    if (given.string_key == "..." || (given.position_key >= 0 && tokens[0].rfind('-', 0) == 0)) {
      throw UsageError("'" + tokens[0] + "' is not expected here");
    }
    if (tokens.size() > 1 && isOption(tokens[1])) throw UsageError(tokens[0] + " needs a value");
  }
  po::variables_map values;
  po::store(parsed, values);
  for (ProgramOption& option : options_) {
    option.values.clear();
    const po::variable_value& value = values[keyOf(option)];
    if (value.empty() || value.defaulted()) continue;
    if (isFlag(option)) option.values = {""};
    if (!isFlag(option) && !option.is_list) option.values = {value.as<std::string>()};
    if (option.is_list) option.values = value.as<std::vector<std::string>>();
  }
}

/// Flags come first, so that --list-settings works even if other values are wrong.
void CommandLine::readValues() const {
  for (const ProgramOption& option : options_) {
    if (isFlag(option) && !option.values.empty()) option.set();
  }
  for (const ProgramOption& option : options_) {
    if (isFlag(option)) continue;
    for (const std::string& value : option.values) readValue(option, value);
  }
}

void CommandLine::checkRules() {
  for (const std::vector<std::string>& names : choices_) {
    size_t given = 0;
    for (const std::string& name : names) given += get(name).values.empty() ? 0 : 1;
    if (given != 1) throw UsageError("give exactly one of " + joined(names, ", ", " and "));
  }
  for (const ProgramOption& option : options_) {
    if (option.is_required && option.values.empty()) {
      throw UsageError(option.name + " is required");
    }
    if (!option.needs.empty() && !option.values.empty() && get(option.needs).values.empty()) {
      throw UsageError(option.name + " requires " + option.needs);
    }
  }
}

CommandLine::CommandLine(const std::string& program, const std::string& usage,
                         const std::string& about)
    : program_(program), usage_(usage), about_(about) {}

void CommandLine::beginGroup(const std::string& headline) { headline_ = headline; }

void CommandLine::add(ProgramOption option, const std::function<void(const std::string&)>& read) {
  option.read = read;
  option.group = isOption(option.name) ? headline_ : "Arguments";
  option.is_required = !isOption(option.name);
  options_.push_back(std::move(option));
}

void CommandLine::addList(ProgramOption option,
                          const std::function<void(const std::string&)>& read) {
  option.is_list = true;
  add(std::move(option), read);
}

void CommandLine::addText(ProgramOption option, std::string& target) {
  option.default_value = target;
  add(std::move(option), [&target](const std::string& value) { target = value; });
}

void CommandLine::addFlag(const std::string& name, const std::string& help, bool& target) {
  ProgramOption option{name, "", help};
  option.set = [&target] { target = true; };
  add(std::move(option), nullptr);
}

void CommandLine::addTextRequest(const std::string& name, const std::string& help,
                                 const std::function<std::string()>& text) {
  ProgramOption option{name, "", help};
  option.set = [text] { throw TextRequest(text()); };
  add(std::move(option), nullptr);
}

void CommandLine::require(const std::string& name) { get(name).is_required = true; }

void CommandLine::requireOneOf(const std::vector<std::string>& names) {
  for (const std::string& name : names) get(name).is_required = false;
  choices_.push_back(names);
}

void CommandLine::onlyWith(const std::string& name, const std::string& other) {
  get(name).needs = other;
}

void CommandLine::parse(const std::vector<std::string>& arguments) {
  if (std::find(arguments.begin(), arguments.end(), "-h") != arguments.end() ||
      std::find(arguments.begin(), arguments.end(), "--help") != arguments.end()) {
    throw TextRequest(help());
  }
  try {
    distribute(arguments);
  } catch (const po::error& error) {
    throw UsageError(error.what());
  }
  readValues();
  checkRules();
}

bool CommandLine::given(const std::string& name) { return !get(name).values.empty(); }

std::string CommandLine::help() const {
  std::string text = "usage: " + program_ + " " + usage_ + "\n\n" + wrap(about_, 0), group;
  for (const bool is_option : {false, true}) {
    for (const ProgramOption& option : options_) {
      if (isOption(option.name) != is_option) continue;
      if (std::exchange(group, option.group) != option.group) text += "\n" + group + ":\n";
      text += "  " + option.name + (option.value.empty() ? "" : " " + option.value) + "\n";
      // A required option has no default.
      const bool has_default = !option.is_required && !option.default_value.empty();
      text += wrap(option.help + (has_default ? " (default " + option.default_value + ")" : ""), 6);
    }
  }
  return text + "  -h,--help\n" + wrap("print this help", 6) + "\n" + kExitCodes + "\n";
}

}  // namespace dtsdf
