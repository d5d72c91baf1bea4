/// Derives the unit of a setting from the end of its key.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "params/text.h"

namespace dtsdf {

/// Unit of the key's value; empty if it has none.
inline std::string unitOf(const std::string& key) {
  static const std::vector<std::pair<std::string, std::string>> kUnits = {
      {"_m_s", "m/s"},       {"_deg_s", "deg/s"},   {"_hz", "Hz"},   {"_mb", "MiB"}, {"_px", "px"},
      {"_voxels", "voxels"}, {"_blocks", "blocks"}, {"_rad", "rad"}, {"_m", "m"},    {"_s", "s"}};
  const auto unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& ending_and_unit) {
    return hasEnding(key, ending_and_unit.first);
  });
  return unit == kUnits.end() ? "" : unit->second;
}

}  // namespace dtsdf
