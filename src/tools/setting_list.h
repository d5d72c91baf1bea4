/// What settings there are: the text of --list-settings.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

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

  /// The lines, by key.
  std::string text() const;

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

/// Every setting of the mapper and the node, with its default.
std::string listSettings();

}  // namespace dtsdf
