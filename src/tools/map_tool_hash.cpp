// map_tool hash: prints hashes that show whether two maps or two meshes are equal.
#include <cstdio>
#include <locale>
#include <sstream>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/ply.h"
#include "io/records.h"
#include "io/text_file.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

/// Hash of the bytes of the .ply file that `map_tool mesh` saves.
uint64_t hashOfPly(const Mesh& mesh, MeshColour colour) {
  const size_t vertices = mesh.vertices_m.size(), triangles = mesh.triangles.size();
  std::ostringstream file;
  file.imbue(std::locale::classic());
  file << plyHeader(vertices, triangles, isFarFromOrigin(mesh));
  for (size_t i = 0; i < vertices; ++i) writePlyVertex(mesh, i, colour, file);
  for (const auto& triangle : mesh.triangles) writePlyTriangle(triangle, file);
  const std::string bytes = file.str();
  return hashOf(bytes.data(), bytes.size());
}

void print(const char* what, uint64_t hash) {
  std::printf("%-5s %016llx\n", what, static_cast<unsigned long long>(hash));
}

}  // namespace

void printHash(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  CommandLine line(
      "map_tool hash", "FILE [options]",
      "Prints hashes (XXH64) of a map and its mesh. The map's hash does not depend on the "
      "backend, the number of threads or the file version; the mesh's hash is that of the .ply "
      "file that map_tool mesh saves. For a mesh file, prints the hash of its bytes.");
  line.addText({"FILE", "", "a map file or a mesh (.ply, .obj, .stl or .glb)"}, options.map_path);
  addSettings(line, "mesh/..., backend, threads", options);
  line.parse(arguments);
  if (!meshFormatOf(options.map_path).empty()) {
    const std::string bytes = readTextFile(options.map_path, "expected a mesh or a map");
    print("mesh", hashOf(bytes.data(), bytes.size()));
    return;
  }
  const auto [settings, mapper] = loadMapOf(options, "space/enabled=false");
  print("map", readMapInfo(options.map_path).content_hash);
  const Mesh mesh = meshOf(*mapper, settings.params.mapper.map.voxel_size_m);
  print("mesh", hashOfPly(mesh, settings.params.mapper.mesh.colour));
}

}  // namespace dtsdf
