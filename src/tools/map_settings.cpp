#include "tools/map_settings.h"

#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/yaml_params.h"

namespace dtsdf {

MapSettings settingsFor(const MapContents& contents, const std::vector<std::string>& given) {
  MapSettings settings;
  ParamWriter known;
  visitParams(settings.params, known);
  visitRules(settings.rules, known);
  ParamTree tree;
  for (const auto& [key, value] : contents.settings) {
    if (known.tree.count(key) > 0) tree[key] = value;
  }
  for (const std::string& setting : given) setParam(setting, tree);
  ParamReader reader(std::move(tree));
  visitParams(settings.params, reader);
  visitRules(settings.rules, reader);
  checkParams(settings.params, reader);
  reader.finish();
  settings.params.map.max_memory_mb = leastMemoryMb(contents, settings.params);  // none is added
  checkFits(contents, settings.params, kLeaveSettingOut);
  return settings;
}

void addLoadLimit(CommandLine& line, MapLoadLimit& limit) {
  line.addWhole({"--max-memory-mb", "MIB", "refuse maps that take more memory"},
                limit.max_memory_mb, {1, 1 << 22});
}

}  // namespace dtsdf
