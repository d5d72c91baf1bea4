#include "tools/map_settings.h"

#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/io/yaml_params.h"
#include "io/map_chunks.h"
#include "program/progress_bar.h"

namespace dtsdf {

RunSettings settingsFor(const MapContents& contents, const std::vector<std::string>& given) {
  RunSettings settings;
  MapperParams& params = settings.params.mapper;
  ParamWriter known;
  visitParams(params, known);
  visitRules(settings.rules, known);
  ParamTree tree;
  for (const auto& [key, value] : contents.settings) {
    if (known.tree.count(key) > 0) tree[key] = value;
  }
  for (const std::string& setting : given) setParam(setting, tree);
  ParamReader reader(std::move(tree));
  visitParams(params, reader);
  visitRules(settings.rules, reader);
  checkParams(params, reader);
  reader.finish();
  // The map will not grow, so its size is the limit, unless map/page_folder is set.
  if (params.map.page_folder.empty()) params.map.max_memory_mb = minMemoryMb(contents, params);
  checkFits(contents, params, kLeaveSettingOut);
  return settings;
}

void checkMeshPath(const std::string& path) {
  if (!meshFormatOf(path).empty()) return;
  throw UsageError("'" + path + "' does not end in " + kMeshExtensions);
}

namespace {

/// The real limit, the diagonal of the mesh, is not known yet.
constexpr double kLargestError_m = 1e6;

}  // namespace

void addSimplifyOption(CommandLine& line, double& error_m) {
  line.addNumber({"--simplify-error", "METRES",
                  "simplify the mesh to within this distance, and print the largest distance "
                  "measured; 0 saves all triangles"},
                 error_m, {0.0, kLargestError_m});
}

SavedMesh saveSimplified(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                         double error_m) {
  if (error_m == 0.0) return savePagedMesh(meshes, colour, path);
  ProgressBar progress("% simplified", 100);
  try {
    SavedMesh saved = savePagedMesh(meshes, colour, path, std::nullopt, error_m, [&](double share) {
      progress.show(static_cast<size_t>(100.0 * share));
    });
    std::printf("simplified from %zu to %zu triangles, at most %.6f m from the original mesh\n",
                saved.joined_triangles, saved.triangles, saved.error_m);
    return saved;
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--simplify-error: ") + error.what());
  }
}

}  // namespace dtsdf
