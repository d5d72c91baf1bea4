#include "tools/setting_list.h"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <vector>

#include "backend/rules.h"
#include "params/node_params.h"
#include "params/setting_unit.h"

namespace dtsdf {
namespace {

/// Visitor that writes one line for each setting: key, default, unit, and what it may be.
class SettingLister {
 public:
  void operator()(const std::string& key, bool& member) { add(key, "true or false", member); }
  void operator()(const std::string& key, std::string& member) { add(key, "a string", member); }
  void operator()(const std::string& key, std::vector<std::string>& member) {
    add(key, "a list of names", member);
  }
  template <class Number>
  void operator()(const std::string& key, Number& member, Range range) {
    add(key, toString(ParamValue(range.min)) + " to " + toString(ParamValue(range.max)), member,
        range);
  }
  template <class Enum>
  void operator()(const std::string& key, Enum& member, const EnumNames<Enum>& names) {
    std::string words;
    for (const auto& [name, value] : names) words += (words.empty() ? "" : ", ") + name;
    add(key, words, member, names);
  }

  std::string text() const {
    std::vector<Line> lines = lines_;
    std::sort(lines.begin(), lines.end(),
              [](const Line& a, const Line& b) { return a.key < b.key; });
    std::ostringstream text;
    for (const Line& line : lines) {
      const std::string unit = unitOf(line.key);
      text << std::left << std::setw(28) << line.key << ' ' << std::setw(20)
           << line.value + (unit.empty() ? "" : " " + unit) << ' ' << line.choices << '\n';
    }
    return text.str();
  }

 private:
  struct Line {
    std::string key, value, choices;
  };

  /// Behind what the setting may be: what ParamWriter takes.
  template <class... Member>
  void add(const std::string& key, const std::string& choices, Member&&... member) {
    ParamWriter writer;
    writer(key, member...);
    lines_.push_back({key, toString(writer.tree.at(key)), choices});
  }

  std::vector<Line> lines_;
};

/// Visitor that writes one line for each number of a rule.
class RuleLister {
 public:
  template <class Number>
  void operator()(const std::string& key, Number& member, Range range) {
    ParamWriter writer;
    writer(key, member, range);
    text += key + " = " + toString(writer.tree.at(key)) + " in [" +
            toString(ParamValue(range.min)) + ", " + toString(ParamValue(range.max)) + "]\n";
  }

  std::string text;
};

}  // namespace

std::string listSettings() {
  MappingParams params;
  SettingLister lister;
  visitParams(params, lister);
  return lister.text();
}

std::string listRules() {
  Rules rules;
  RuleLister lister;
  visitRules(rules, lister);
  return lister.text;
}

}  // namespace dtsdf
