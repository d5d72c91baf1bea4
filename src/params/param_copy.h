/// Copies settings without a crash if memory runs out.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Copies a tree without the copy constructor of std::variant. In libstdc++ 12 that constructor
/// terminates the process if memory for a string runs out: it destroys an object that was never
/// constructed.
inline ParamTree copyOf(const ParamTree& tree) {
  ParamTree copy;
  for (const auto& [key, value] : tree) {
    ParamValue& copied = copy[key];
    std::visit([&](const auto& content) { copied = content; }, value);
  }
  return copy;
}

}  // namespace dtsdf
