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

/// How many characters have to be put in, taken out, changed or swapped with the next.
size_t editsBetween(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> edits(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        edits[i][j] = i + j;
        continue;
      }
      const size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      edits[i][j] =
          std::min({edits[i - 1][j] + 1, edits[i][j - 1] + 1, edits[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        edits[i][j] = std::min(edits[i][j], edits[i - 2][j - 2] + 1);
      }
    }
  }
  return edits[a.size()][b.size()];
}

std::string lastOf(const std::string& key) { return key.substr(key.rfind('/') + 1); }

/// As where a unit was left out, or a section.
bool oneContainsTheOther(const std::string& a, const std::string& b) {
  constexpr size_t kShortest = 3;  // many words contain fewer letters
  if (std::min(a.size(), b.size()) < kShortest) return false;
  return a.find(b) != std::string::npos || b.find(a) != std::string::npos;
}

/// "; did you mean map/voxel_size_m?" where a known key is near: by the whole key, or by its last
/// part alone, as where the section was left out.
std::string suggestionFor(const std::string& key, const std::set<std::string>& known) {
  constexpr size_t kLongestKey = 100;
  if (key.size() > kLongestKey) return "";
  const size_t other_section = key.find('/') == std::string::npos ? 0 : 1;
  std::string nearest, related;
  size_t least = lastOf(key).size() / 4 + 2, least_related = kLongestKey;
  for (const std::string& candidate : known) {
    const size_t edits = std::min(editsBetween(key, candidate),
                                  editsBetween(lastOf(key), lastOf(candidate)) + other_section);
    if (edits < least) {
      least = edits;
      nearest = candidate;
    }
    if (edits < least_related && oneContainsTheOther(lastOf(key), lastOf(candidate))) {
      least_related = edits;
      related = candidate;
    }
  }
  if (nearest.empty()) nearest = related;
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
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
  // YAML has "on" and "off" for true and false.
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
  // The float that is stored, not the double that was written, may lie a rounding outside.
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
  // All that YAML 1.1 knows; readers of YAML leave some of these as strings.
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
  const auto* text = std::get_if<std::string>(value);  // from a command line of ROS
  if (text == nullptr || text->size() < 2 || text->front() != '[' || text->back() != ']') {
    addViolation(key, "must be a list of names, as in [front, rear]");
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
    addViolation(key, "no such setting" + suggestionFor(key, known_));
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
