/// Strict reading of settings: a ParamTree of keys and values is read into structs, or rejected
/// as a whole.
///
/// Each settings struct has a visitParams() overload that lists its keys and the rules for their
/// values. Reading, writing and the tests of config/ all use it. The command-line programs fill the
/// tree from YAML files and key=value arguments, the node from the ROS parameter server.
#pragma once

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace dtsdf {

/// Value of a setting, as read from a file.
using ParamValue = std::variant<bool, int, double, std::string, std::vector<std::string>>;

/// Maps full keys, such as "map/voxel_size_m", to values.
using ParamTree = std::map<std::string, ParamValue>;

/// Formats a value as in a settings file, for messages.
std::string toString(const ParamValue& value);

/// Thrown with every violation found: the full key, its value and the rule it breaks.
class ParamError : public std::runtime_error {
 public:
  /// Creates an error from one line per violation; what() joins the lines.
  explicit ParamError(std::vector<std::string> violations);
  /// One line per violation, with key, value and rule.
  const std::vector<std::string>& violations() const { return violations_; }

 private:
  std::vector<std::string> violations_;
};

/// Closed interval of allowed numbers.
struct Range {
  double min;  ///< Smallest allowed value.
  double max;  ///< Largest allowed value.
};

/// Names of the values of an enum, as spelt in the YAML files.
template <class Enum>
using EnumNames = std::vector<std::pair<std::string, Enum>>;

/// Visitor that sets members from a tree. Members whose key is missing keep their default; an
/// unknown key, a wrong type or a broken rule is a violation. A whole number is accepted for a
/// floating-point member, and words such as "yes" and "off", as in YAML, for a Boolean.
class ParamReader {
 public:
  /// Creates a reader for a tree.
  explicit ParamReader(ParamTree tree);

  /// @name Reading a member
  /// @{

  /// Sets the member to the value of the key, or records a violation.
  void operator()(const std::string& key, bool& member);
  void operator()(const std::string& key, int& member, Range range);
  void operator()(const std::string& key, float& member, Range range);
  void operator()(const std::string& key, double& member, Range range);
  void operator()(const std::string& key, std::string& member);
  void operator()(const std::string& key, std::vector<std::string>& member);

  template <class Enum>
  void operator()(const std::string& key, Enum& member, const EnumNames<Enum>& names) {
    std::vector<std::string> words;
    for (const auto& [name, value] : names) words.push_back(name);
    const size_t choice = readChoice(key, words);
    if (choice < names.size()) member = names[choice].second;
  }
  /// @}

  /// Adds a violation of a rule that involves several settings, under the key of one of these
  /// settings.
  void addViolation(const std::string& key, const std::string& rule);

  /// Ends reading. @throws ParamError with all violations, including unknown keys, if any.
  void finish();

 private:
  bool readString(const std::string& key, std::string& text);
  /// Index in `words` of the value of the key; words.size() if it is not one of them.
  size_t readChoice(const std::string& key, const std::vector<std::string>& words);
  bool readNumber(const std::string& key, double& number, bool whole, Range range);
  const ParamValue* find(const std::string& key);

  ParamTree tree_;
  std::set<std::string> known_;
  std::vector<std::string> violations_;
};

/// Visitor that writes every member into a tree, and describes its allowed values.
class ParamWriter {
 public:
  /// @name Writing a member
  /// @{

  /// Sets the key to the value of the member.
  void operator()(const std::string& key, bool& member) { put(key, member, "true or false"); }
  void operator()(const std::string& key, int& member, Range range);
  void operator()(const std::string& key, float& member, Range range);
  void operator()(const std::string& key, double& member, Range range);
  void operator()(const std::string& key, std::string& member) { put(key, member, "a string"); }
  void operator()(const std::string& key, std::vector<std::string>& member) {
    put(key, member, "a list of names");
  }

  template <class Enum>
  void operator()(const std::string& key, Enum& member, const EnumNames<Enum>& names) {
    std::string words;
    for (const auto& [name, value] : names) words += (words.empty() ? "" : ", ") + name;
    for (const auto& [name, value] : names) {
      if (value == member) put(key, name, words);
    }
  }
  /// @}

  ParamTree tree;                              ///< Values by key.
  std::map<std::string, std::string> choices;  ///< Allowed values by key, such as "0.1 to 100".

 private:
  void put(const std::string& key, ParamValue value, const std::string& choice) {
    tree[key] = std::move(value);
    choices[key] = choice;
  }
};

/// Writes a settings struct into a tree.
template <class Params>
ParamTree toTree(Params params) {
  ParamWriter writer;
  visitParams(params, writer);
  return std::move(writer.tree);
}

}  // namespace dtsdf
