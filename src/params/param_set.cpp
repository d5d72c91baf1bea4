#include "dtsdf_mapping/params/param_set.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "params/printable.h"
#include "params/setting_unit.h"
#include "params/text.h"

namespace dtsdf {
namespace {

constexpr int kDigits = 7;

/// Suggests alternatives to an unknown key, as in "; known: map/voxel_size_m": all keys whose last
/// part begins with the last part of the unknown key or, if there are none, all keys in the unknown
/// key's section.
std::string suggestionsFor(const std::string& key, const std::set<std::string>& known) {
  const auto nameIn = [](const std::string& of) { return of.rfind('/') + 1; };
  const std::string section = key.substr(0, nameIn(key)), name = key.substr(nameIn(key));
  std::vector<std::string> namesakes, in_section;
  for (const std::string& other : known) {
    if (other.compare(nameIn(other), name.size(), name) == 0) namesakes.push_back(other);
    if (!section.empty() && other.substr(0, nameIn(other)) == section) in_section.push_back(other);
  }
  const std::string others = joined(namesakes.empty() ? in_section : namesakes);
  return others.empty() ? "" : "; known: " + others;
}

}  // namespace

std::string toString(const ParamValue& value) {
  if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
  if (const int* i = std::get_if<int>(&value)) return std::to_string(*i);
  if (const double* d = std::get_if<double>(&value)) return shortestText(*d, kDigits);
  if (const auto* names = std::get_if<std::vector<std::string>>(&value))
    return "[" + joined(*names) + "]";
  return "'" + std::get<std::string>(value) + "'";
}

ParamError::ParamError(std::vector<std::string> violations)
    : std::runtime_error("invalid settings:\n  " + joined(violations, "\n  ")),
      violations_(std::move(violations)) {}

ParamReader::ParamReader(ParamTree tree) : tree_(std::move(tree)) {}

const ParamValue* ParamReader::find(const std::string& key) {
  known_.insert(key);
  const auto it = tree_.find(key);
  return it == tree_.end() ? nullptr : &it->second;
}

void ParamReader::addViolation(const std::string& key, const std::string& rule) {
  const auto it = tree_.find(key);
  const std::string value = it == tree_.end() ? "" : " = " + printable(toString(it->second));
  violations_.push_back(printable(key) + value + ": " + rule);
}

bool ParamReader::readString(const std::string& key, std::string& text) {
  const ParamValue* value = find(key);
  if (value == nullptr) return false;
  const std::string* string = std::get_if<std::string>(value);
  if (string == nullptr) {
    addViolation(key, "must be a string");
    return false;
  }
  text = *string;
  return true;
}

size_t ParamReader::readChoice(const std::string& key, const std::vector<std::string>& words) {
  const ParamValue* value = find(key);
  if (value == nullptr) return words.size();
  const bool* flag = std::get_if<bool>(value);
  const std::string* text = std::get_if<std::string>(value);
  // YAML reads "on" and "off" as true and false.
  const std::string word = flag != nullptr   ? (*flag ? "always" : "never")
                           : text != nullptr ? *text
                                             : "";
  const auto choice = std::find_if(words.begin(), words.end(), [&](const std::string& known) {
    return inLowerCase(known) == inLowerCase(word);
  });
  if (choice == words.end()) addViolation(key, "must be one of: " + joined(words));
  return static_cast<size_t>(choice - words.begin());
}

bool ParamReader::readNumber(const std::string& key, double& number, bool whole, Range range) {
  const ParamValue* value = find(key);
  if (value == nullptr) return false;
  if (const int* i = std::get_if<int>(value)) {
    number = *i;
  } else if (const double* d = std::get_if<double>(value); d != nullptr && !whole) {
    number = *d;
  } else {
    addViolation(key, whole ? "must be a whole number" : "must be a number");
    return false;
  }
  // A float converted to double may exceed a bound by its rounding error.
  const double slack = 1e-6 * std::abs(number);
  if (!std::isfinite(number) || number < range.min - slack || number > range.max + slack) {
    const std::string unit = unitOf(key);
    addViolation(key, "must be from " + shortestText(range.min, kDigits) + " to " +
                          shortestText(range.max, kDigits) + (unit.empty() ? "" : " " + unit));
    return false;
  }
  return true;
}

void ParamReader::operator()(const std::string& key, bool& member) {
  const ParamValue* value = find(key);
  if (value == nullptr) return;
  if (const bool* flag = std::get_if<bool>(value)) {
    member = *flag;
    return;
  }
  const std::string* text = std::get_if<std::string>(value);
  const std::string word = text != nullptr ? inLowerCase(*text) : "";
  // The booleans of YAML 1.1, some of which parsers return as strings.
  const auto isOneOf = [&](const std::vector<std::string>& words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  const bool is_true = isOneOf({"true", "yes", "on", "y"});
  if (!is_true && !isOneOf({"false", "no", "off", "n"})) {
    addViolation(key, "must be true or false");
    return;
  }
  member = is_true;
}

void ParamReader::operator()(const std::string& key, int& member, Range range) {
  double number = 0.0;
  if (readNumber(key, number, true, range)) member = static_cast<int>(number);
}

void ParamReader::operator()(const std::string& key, float& member, Range range) {
  double number = 0.0;
  if (readNumber(key, number, false, range)) member = static_cast<float>(number);
}

void ParamReader::operator()(const std::string& key, double& member, Range range) {
  readNumber(key, member, false, range);
}

void ParamReader::operator()(const std::string& key, std::string& member) {
  readString(key, member);
}

void ParamReader::operator()(const std::string& key, std::vector<std::string>& member) {
  const ParamValue* value = find(key);
  if (value == nullptr) return;
  if (const auto* names = std::get_if<std::vector<std::string>>(value)) {
    member = *names;
    return;
  }
  const auto* text = std::get_if<std::string>(value);  // from the command line of a ROS tool
  if (text == nullptr || text->size() < 2 || text->front() != '[' || text->back() != ']') {
    addViolation(key, "must be a list of names, such as [front, rear]");
    return;
  }
  std::string words = text->substr(1, text->size() - 2);
  std::replace(words.begin(), words.end(), ',', ' ');
  std::istringstream in(words);
  member.assign(std::istream_iterator<std::string>(in), std::istream_iterator<std::string>());
}

void ParamReader::finish() {
  for (const auto& [key, value] : tree_) {
    if (known_.count(key) > 0) continue;
    addViolation(key, "no such setting" + suggestionsFor(key, known_));
  }
  if (!violations_.empty()) throw ParamError(violations_);
}

namespace {

std::string inWords(Range range) {
  return toString(ParamValue(range.min)) + " to " + toString(ParamValue(range.max));
}

}  // namespace

void ParamWriter::operator()(const std::string& key, int& member, Range range) {
  put(key, member, inWords(range));
}

void ParamWriter::operator()(const std::string& key, double& member, Range range) {
  put(key, member, inWords(range));
}

void ParamWriter::operator()(const std::string& key, float& member, Range range) {
  // The shortest decimal that reads back as the same float: 0.02, not 0.0199999996.
  double number = member;
  for (int digits = 6; digits <= 9; ++digits) {
    if (parseNumber(shortestText(member, digits), number) && static_cast<float>(number) == member) {
      break;
    }
  }
  put(key, number, inWords(range));
}

}  // namespace dtsdf
