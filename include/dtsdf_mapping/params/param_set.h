/// Strict reading of settings: a flat tree of keys is read into structs, or refused as a whole.
///
/// Each settings struct has one visitParams() overload that names its keys and rules once; reading,
/// writing and the tests of config/ all go through it. The command-line programs fill the tree from
/// YAML files, the node from the ROS parameter server.
#pragma once

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace dtsdf {

/// A setting as it stands in a file.
using ParamValue = std::variant<bool, int, double, std::string, std::vector<std::string>>;

/// Full key, as in "map/voxel_size_m", to value.
using ParamTree = std::map<std::string, ParamValue>;

/// The value as a file would have it, for messages.
std::string toString(const ParamValue& value);

/// Thrown with every violation found: full key, its value and the rule it breaks.
class ParamError : public std::runtime_error {
 public:
  /// One line each; what() joins them.
  explicit ParamError(std::vector<std::string> violations);
  /// One line each, with key, value and rule.
  const std::vector<std::string>& violations() const { return violations_; }

 private:
  std::vector<std::string> violations_;
};

/// Closed interval of allowed numbers.
struct Range {
  double min;  ///< Least allowed.
  double max;  ///< Greatest allowed.
};

/// Names of an enum's values, in the spelling of the YAML files.
template <class Enum>
using EnumNames = std::vector<std::pair<std::string, Enum>>;

/// Visitor that sets members from a tree. A missing key keeps the default; an unknown key, a wrong
/// type or a broken rule is a violation. A whole number may stand for a floating-point one, and a
/// text for a truth value: the words of YAML.
class ParamReader {
 public:
  /// Reads from this tree.
  explicit ParamReader(ParamTree tree);

  /// @name Reading one member
  /// @{

  /// Sets the member to the key's value, or notes what is wrong with it.
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

  /// Adds a violation that concerns a key, for rules between several settings.
  void addViolation(const std::string& key, const std::string& rule);

  /// @throws ParamError if anything was wrong, unknown keys included.
  void finish();

 private:
  bool readString(const std::string& key, std::string& text);
  /// The number of the word that the key has; that of all words if it has none of them.
  size_t readChoice(const std::string& key, const std::vector<std::string>& words);
  bool readNumber(const std::string& key, double& number, bool whole, Range range);
  const ParamValue* find(const std::string& key);

  ParamTree tree_;
  std::set<std::string> known_;
  std::vector<std::string> violations_;
};

/// Visitor that writes every member into a tree: the struct's values by key; and what each may be.
class ParamWriter {
 public:
  /// @name Writing one member
  /// @{

  /// Sets the key to the member's value.
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

  ParamTree tree;                              ///< What was written.
  std::map<std::string, std::string> choices;  ///< In words, as in "0.1 to 100".

 private:
  void put(const std::string& key, ParamValue value, const std::string& choice) {
    tree[key] = std::move(value);
    choices[key] = choice;
  }
};

/// A settings struct's values by key.
template <class Params>
ParamTree toTree(Params params) {
  ParamWriter writer;
  visitParams(params, writer);
  return std::move(writer.tree);
}

}  // namespace dtsdf
