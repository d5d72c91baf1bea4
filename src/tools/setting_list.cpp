#include "tools/setting_list.h"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <utility>

#include "params/ending.h"
#include "params/node_params.h"

namespace dtsdf {

std::string unitOf(const std::string& key) {
  static const std::vector<std::pair<std::string, std::string>> kUnits = {
      {"_m_s", "m/s"},        {"_deg_s", "deg/s"},    {"_hz", "Hz"}, {"_mb", "MiB"}, {"_px", "px"},
      {"_voxels", "voxels"}, {"_blocks", "blocks"}, {"_rad", "rad"}, {"_m", "m"},   {"_s", "s"}};
  const auto unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& ending_and_unit) {
    return hasEnding(key, ending_and_unit.first);
  });
  return unit == kUnits.end() ? "" : unit->second;
}

std::string SettingLister::text() const {
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

std::string listSettings() {
  MappingParams params;
  SettingLister lister;
  visitParams(params, lister);
  return lister.text();
}

}  // namespace dtsdf
