#include "tools/map_space.h"

#include <cstdio>

#include "dtsdf_mapping/io/map_file.h"
#include "mapper/probed_mapper.h"
#include "params/ending.h"
#include "tools/map_settings.h"

namespace dtsdf {

std::unique_ptr<Mapper> loadWithSpace(const SpaceOutputOptions& options) {
  const MapContents contents = loadMap(options.map_path, options.limit.bytes());
  std::vector<std::string> all = options.settings;
  all.emplace_back("space/enabled=true");
  const MapSettings settings = settingsFor(contents, all);
  if (contents.free_cubes.empty()) {
    std::fprintf(stderr,
                 "map_tool: warning: the map has no free space; only surface cells are in %s. Map "
                 "with --set space/enabled=true\n",
                 options.what.c_str());
  }
  std::unique_ptr<Mapper> mapper = makeProbedMapper(settings.params, settings.rules, contents);
  mapper->updateMesh();
  return mapper;
}

void parseSpaceOutput(CommandLine& line, const std::vector<std::string>& arguments,
                      const std::string& what, const std::string& ending,
                      SpaceOutputOptions& options) {
  options.what = what;
  line.addText({"FILE", "", "a map file"}, options.map_path);
  line.addText({"OUT", "", what + ": " + ending}, options.out_path);
  line.addList({"--set", "KEY=VALUE ...",
                "settings that override those of the file: space/..., backend, threads"},
               [&](const std::string& value) { options.settings.push_back(value); });
  addLoadLimit(line, options.limit);
  line.parse(arguments);
  const std::string& path = options.out_path;
  if (!endsWith(path, ending)) {
    throw UsageError("'" + path + "' does not end in " + ending);
  }
}

}  // namespace dtsdf
