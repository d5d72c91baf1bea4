/// Copies of settings that survive a lack of memory.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// A copy of a tree. Not by the copy constructor of std::variant, which in libstdc++ 12 ends the
/// process where it finds no memory for a text: it destroys what it has not made yet.
inline ParamTree copyOf(const ParamTree& tree) {
  ParamTree copy;
  for (const auto& [key, value] : tree) {
    ParamValue& copied = copy[key];
    std::visit([&](const auto& content) { copied = content; }, value);
  }
  return copy;
}

}  // namespace dtsdf
