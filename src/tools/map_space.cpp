#include "tools/map_space.h"

#include "dtsdf_mapping/io/map_file.h"
#include "mapper/probed_mapper.h"
#include "tools/map_settings.h"

namespace dtsdf {

std::unique_ptr<Mapper> loadWithSpace(const std::string& map_path,
                                      const std::vector<std::string>& given) {
  const MapContents contents = loadMap(map_path);
  std::vector<std::string> all = given;
  all.emplace_back("space/enabled=true");
  const MapSettings settings = settingsFor(contents, all);
  std::unique_ptr<Mapper> mapper = makeProbedMapper(settings.params, settings.rules, contents);
  mapper->updateMesh();
  return mapper;
}

}  // namespace dtsdf
