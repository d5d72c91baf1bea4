// map_tool mesh: the mesh of a map file.
#include <cstdio>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "mapper/probed_mapper.h"
#include "program/command_line.h"
#include "program/run_program.h"
#include "tools/map_settings.h"
#include "tools/map_tool.h"
#include "tools/simplification.h"

namespace dtsdf {
namespace {

struct MeshOptions {
  std::string map_path, mesh_path;
  std::vector<std::string> settings;  ///< Each key=value.
  MapLoadLimit limit;
  double simplify_error_m = 0.0;
};

MeshOptions parseMeshOptions(const std::vector<std::string>& arguments) {
  MeshOptions options;
  CommandLine line("map_tool mesh", "FILE OUT.ply [options]",
                   "Saves the mesh of a map file, with the settings it was saved with.",
                   kExitCodes);
  line.addText({"FILE", "", "a map file"}, options.map_path);
  line.addText({"OUT", "", "mesh to write: .ply or .glb (normals, colours), .obj or .stl"},
               options.mesh_path);
  line.addList({"--set", "KEY=VALUE ...",
                "settings that override those of the file: mesh/..., backend, threads"},
               [&](const std::string& value) { options.settings.push_back(value); });
  addSimplifyOption(line, options.simplify_error_m);
  addLoadLimit(line, options.limit);
  line.parse(arguments);
  if (!meshFormatOf(options.mesh_path)) {
    throw UsageError("'" + options.mesh_path + "' does not end in " + kMeshExtensions);
  }
  return options;
}

}  // namespace

void meshMap(const std::vector<std::string>& arguments) {
  const MeshOptions options = parseMeshOptions(arguments);
  prepareOutputFile(options.mesh_path);
  MapContents contents = loadMap(options.map_path, options.limit.bytes());
  std::vector<std::string> given = options.settings;
  given.emplace_back("space/enabled=false");  // the mesh does not depend on it
  const MapSettings settings = settingsFor(contents, given);
  const auto mapper = makeProbedMapper(settings.params, settings.rules, contents);
  contents = MapContents();
  MeshStore store(settings.params.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  Mesh mesh = store.assemble();
  simplify(mesh, options.simplify_error_m);
  saveMesh(mesh, settings.params.mesh.colour, options.mesh_path);
  std::printf("%zu vertices, %zu triangles: %s\n", mesh.vertices_m.size(), mesh.triangles.size(),
              options.mesh_path.c_str());
  const std::string loss = lossInFormat(mesh, options.mesh_path);
  if (!loss.empty()) std::printf("%s\n", loss.c_str());
}

}  // namespace dtsdf
