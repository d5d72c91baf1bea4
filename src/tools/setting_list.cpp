#include "tools/setting_list.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "params/node_params.h"
#include "params/setting_unit.h"

namespace dtsdf {

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
