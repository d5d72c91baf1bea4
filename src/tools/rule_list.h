/// What numbers the rules have: the text of --list-rules.
#pragma once

#include <string>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Visitor that writes one line for each number: key, value and range.
class RuleLister {
 public:
  template <class Number>
  void operator()(const std::string& key, Number& member, Range range) {
    ParamWriter writer;
    writer(key, member, range);
    addLine(key, writer.tree.at(key), " in [" + toString(ParamValue(range.min)) + ", " +
                                          toString(ParamValue(range.max)) + "]");
  }

  std::string text;

 private:
  void addLine(const std::string& key, const ParamValue& value, const std::string& range) {
    text += key + " = " + toString(value) + range + "\n";
  }
};

/// Every number with its default.
std::string listRules();

}  // namespace dtsdf
