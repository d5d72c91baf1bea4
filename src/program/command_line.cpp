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
  if (range.min == kAboveZero) return " above 0" + (range.max < kUnbounded ? " up to " + max : "");
  if (range.max < kUnbounded) return " from " + shortestText(range.min) + " to " + max;
  return range.min > -kUnbounded ? " from " + shortestText(range.min) + " on" : "";
}

bool isOption(const std::string& text) { return text.rfind("--", 0) == 0; }
bool isShort(const std::string& text) { return text.size() > 1 && text[0] == '-'; }

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

void readValue(const OptionText& text, const std::string& value,
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

/// An option, an argument without dashes, or a flag, which takes no value.
struct CommandLine::Option {
  OptionText text;
  std::string group;
  bool is_list = false, is_required = false;
  std::function<void(const std::string&)> read;  ///< For each value; null of a flag.
  std::function<void()> set;                     ///< Of a flag.
  std::string needs;                             ///< Another option, or empty.
  std::vector<std::string> values;               ///< Given; of a flag, an empty one.

  bool isArgument() const { return !isOption(text.name); }
  bool isFlag() const { return read == nullptr; }
  /// As Boost has it, without dashes.
  std::string key() const { return isArgument() ? text.name : text.name.substr(2); }

  /// An option that has to be given has no default, whatever its target was.
  std::string help() const {
    if (is_required || text.default_value.empty()) return text.help;
    return text.help + " (default " + text.default_value + ")";
  }
};

CommandLine::Option& CommandLine::addOption(const OptionText& text) {
  options_.push_back({});
  options_.back().text = text;
  options_.back().group = isOption(text.name) ? headline_ : "Arguments";
  options_.back().is_required = !isOption(text.name);
  return options_.back();
}

CommandLine::Option& CommandLine::get(const std::string& name) {
  const auto found = std::find_if(options_.begin(), options_.end(),
                                  [&](const Option& option) { return option.text.name == name; });
  if (found == options_.end()) throw std::logic_error("unknown option " + name);
  return *found;
}

/// Gives each option its values. @throws po::error, UsageError
void CommandLine::distribute(const std::vector<std::string>& arguments) {
  // No short names, no parts of names.
  const int style = po::command_line_style::allow_long |
                    po::command_line_style::long_allow_adjacent |
                    po::command_line_style::long_allow_next;
  po::options_description all;
  po::positional_options_description places;
  all.add_options()("help", po::bool_switch())("...", po::value<std::vector<std::string>>());
  for (const Option& option : options_) {
    const po::value_semantic* value = po::value<std::string>();
    if (option.is_list) value = po::value<std::vector<std::string>>()->multitoken();
    if (option.isFlag()) value = po::bool_switch();
    all.add_options()(option.key().c_str(), value);
    if (option.isArgument()) places.add(option.key().c_str(), option.is_list ? -1 : 1);
  }
  if (places.max_total_count() != std::numeric_limits<unsigned>::max()) places.add("...", -1);
  const po::parsed_options parsed =
      po::command_line_parser(arguments).options(all).positional(places).style(style).run();
  for (const po::option& given : parsed.options) {
    const std::vector<std::string>& tokens = given.original_tokens;
    if (given.position_key >= 0 && isShort(tokens[0])) {
      throw UsageError("unknown option " + tokens[0]);
    }
    if (given.string_key == "...")
      throw UsageError("'" + given.value[0] + "' is not expected here");
    if (tokens.size() > 1 && isOption(tokens[1])) throw UsageError(tokens[0] + " needs a value");
  }
  po::variables_map values;
  po::store(parsed, values);
  for (Option& option : options_) {
    option.values.clear();
    const po::variable_value& value = values[option.key()];
    if (value.empty() || value.defaulted()) continue;
    if (option.isFlag()) option.values = {""};
    if (!option.isFlag() && !option.is_list) option.values = {value.as<std::string>()};
    if (option.is_list) option.values = value.as<std::vector<std::string>>();
  }
}

/// Flags first: one that asks for a text is answered whatever is wrong with the values.
void CommandLine::readValues() const {
  for (const Option& option : options_) {
    if (option.isFlag() && !option.values.empty()) option.set();
  }
  for (const Option& option : options_) {
    if (option.isFlag()) continue;
    for (const std::string& value : option.values) readValue(option.text, value, option.read);
  }
}

void CommandLine::checkRules() {
  for (const std::vector<std::string>& names : choices_) {
    size_t given = 0;
    for (const std::string& name : names) given += get(name).values.empty() ? 0 : 1;
    if (given != 1) throw UsageError("give one of " + joined(names, ", ", " and "));
  }
  for (const Option& option : options_) {
    if (option.is_required && option.values.empty()) {
      throw UsageError(option.text.name + " is required");
    }
    if (!option.needs.empty() && !option.values.empty() && get(option.needs).values.empty()) {
      throw UsageError(option.text.name + " requires " + option.needs);
    }
  }
}

CommandLine::CommandLine(const std::string& program, const std::string& usage,
                         const std::string& about)
    : program_(program), usage_(usage), about_(about) {}

CommandLine::~CommandLine() = default;

void CommandLine::beginGroup(const std::string& headline) { headline_ = headline; }

void CommandLine::add(const OptionText& text, const std::function<void(const std::string&)>& read) {
  addOption(text).read = read;
}

void CommandLine::addList(const OptionText& text,
                          const std::function<void(const std::string&)>& read) {
  Option& option = addOption(text);
  option.read = read;
  option.is_list = true;
}

void CommandLine::addText(const OptionText& text, std::string& target) {
  OptionText with_default = text;
  with_default.default_value = target;
  add(with_default, [&target](const std::string& value) { target = value; });
}

void CommandLine::addNumber(const OptionText& text, double& target, Range range) {
  OptionText with_default = text;
  with_default.default_value = shortestText(target);
  add(with_default,
      [&target, range](const std::string& value) { target = readNumber(value, range); });
}

void CommandLine::addNumber(const OptionText& text, std::optional<double>& target, Range range) {
  add(text, [&target, range](const std::string& value) { target = readNumber(value, range); });
}

void CommandLine::addFlag(const std::string& name, const std::string& help, bool& target) {
  addOption({name, "", help}).set = [&target] { target = true; };
}

void CommandLine::addTextRequest(const std::string& name, const std::string& help,
                                 const std::function<std::string()>& text) {
  addOption({name, "", help}).set = [text] { throw TextRequest(text()); };
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
  std::vector<std::string> groups = {"Arguments"};
  const auto note = [&](const std::string& group) {
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
  };
  for (const Option& option : options_) note(option.group);
  note(headline_);
  std::string text = "usage: " + program_ + " " + usage_ + "\n\n";
  text += wrap(about_, 0);
  for (const std::string& group : groups) {
    std::string entries;
    for (const Option& option : options_) {
      if (option.group != group) continue;
      const std::string& value = option.text.value;
      entries += "  " + option.text.name + (value.empty() ? "" : " " + value) + "\n" +
                 wrap(option.help(), 6);
    }
    if (group == headline_) {
      entries += "  -h,--help\n" + wrap("print this help", 6);
    }
    if (!entries.empty()) text += "\n" + group + ":\n" + entries;
  }
  return text + "\n" + kExitCodes + "\n";
}

}  // namespace dtsdf
