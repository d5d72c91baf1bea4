// map_tool mesh: saves the mesh of a map file.
#include <cstdio>
#include <memory>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
void meshMap(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  double simplify_error_m = 0.0;
  CommandLine line("map_tool mesh", "FILE OUT.ply [options]",
                   "Saves the mesh of a map file, with the settings in the file.");
  addPaths(line, "mesh to write: .ply or .glb (normals, colours), .obj or .stl", options);
  addSettings(line, "mesh/..., backend, threads", options);
  addSimplifyOption(line, simplify_error_m);
  line.parse(arguments);
  checkMeshPath(options.out_path);
  prepareOutputFile(options.out_path);
  // The mesh does not depend on the free-space grid.
  const auto [settings, mapper] = loadMapOf(options, "space/enabled=false");
  PagedMeshes meshes(settings.params.mapper.map);
  meshes.update(*mapper);
  const SavedMesh saved = saveSimplified(meshes, settings.params.mapper.mesh.colour,
                                         options.out_path, simplify_error_m);
  std::printf("%zu vertices, %zu triangles: %s\n", saved.vertices, saved.triangles,
              options.out_path.c_str());
  if (!saved.loss.empty()) std::printf("%s\n", saved.loss.c_str());
}

}  // namespace dtsdf
