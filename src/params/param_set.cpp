#include "dtsdf_mapping/params/param_set.h"

#include <cmath>
#include <cstdlib>
#include <sstream>

namespace dtsdf {
namespace {

std::string joinLines(const std::vector<std::string>& lines) {
  std::string text = "invalid parameters:";
  for (const std::string& line : lines) text += "\n  " + line;
  return text;
}

std::string formatNumber(double number, int digits = 7) {
  std::ostringstream out;
  out.precision(digits);
  out << number;
  return out.str();
}

std::string joinNames(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return "[" + text + "]";
}

}  // namespace

std::string toString(const ParamValue& value) {
  if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
  if (const int* i = std::get_if<int>(&value)) return std::to_string(*i);
  if (const double* d = std::get_if<double>(&value)) return formatNumber(*d);
  if (const auto* names = std::get_if<std::vector<std::string>>(&value)) return joinNames(*names);
  return "'" + std::get<std::string>(value) + "'";
}

ParamError::ParamError(std::vector<std::string> violations)
    : std::runtime_error(joinLines(violations)), violations_(std::move(violations)) {}

ParamReader::ParamReader(ParamTree tree) : tree_(std::move(tree)) {}

const ParamValue* ParamReader::find(const std::string& key) {
  known_.insert(key);
  const auto it = tree_.find(key);
  return it == tree_.end() ? nullptr : &it->second;
}

void ParamReader::addViolation(const std::string& key, const std::string& rule) {
  const auto it = tree_.find(key);
  violations_.push_back(key + (it == tree_.end() ? "" : " = " + toString(it->second)) + ": " +
                        rule);
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
  // The float that is stored, not the double that was written, may lie a rounding outside.
  const double slack = 1e-6 * std::abs(number);
  if (!std::isfinite(number) || number < range.min - slack || number > range.max + slack) {
    addViolation(key, "must be in [" + formatNumber(range.min) + ", " + formatNumber(range.max) +
                          "]");
    return false;
  }
  return true;
}

void ParamReader::operator()(const std::string& key, bool& member) {
  const ParamValue* value = find(key);
  if (value == nullptr) return;
  const bool* flag = std::get_if<bool>(value);
  if (flag == nullptr) {
    addViolation(key, "must be true or false");
    return;
  }
  member = *flag;
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
  const auto* names = std::get_if<std::vector<std::string>>(value);
  if (names == nullptr) {
    addViolation(key, "must be a list of names, as in [front, rear]");
    return;
  }
  member = *names;
}

void ParamReader::finish() {
  for (const auto& [key, value] : tree_) {
    if (known_.count(key) == 0) addViolation(key, "no such parameter");
  }
  if (!violations_.empty()) throw ParamError(violations_);
}

void ParamWriter::operator()(const std::string& key, float& member, Range) {
  // The shortest decimal that reads back as the same float: 0.02, not 0.0199999996.
  double number = member;
  for (int digits = 6; digits <= 9; ++digits) {
    number = std::strtod(formatNumber(member, digits).c_str(), nullptr);
    if (static_cast<float>(number) == member) break;
  }
  tree[key] = number;
}

}  // namespace dtsdf
