/// map_tool: prints the contents of map files and converts them to other formats.
#include "tools/map_tool.h"

#include <cstdio>

#include "io/map_chunks.h"
#include "mapper/probed_mapper.h"
#include "params/text.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

void run(const std::vector<std::string>& arguments) {
  runCommand("map_tool",
             "Reads journals, and map files (.dtsdf) written by save_map or reconstruct.",
             {{"info", "prints what is in a map file", printMapInfo},
              {"mesh", "saves the mesh of a map file", meshMap},
              {"bt", "saves free and occupied cells as an OctoMap tree", saveOcTree},
              {"render", "renders depth, normals and colours from given poses", renderMap},
              {"boxes", "divides the mapped space into boxes for reconstruct --only", printBoxes},
              {"join", "joins the maps of boxes", joinBoxes},
              {"diff", "finds the surfaces added and removed between two maps", compareMaps},
              {"hash", "prints hashes of a map and its mesh, or of a mesh file", printHash},
              {"texture", "saves the mesh with textures from a recording's images", textureMap},
              {"export", "exports a journal's images to train NeRFs and splats", exportJournal}},
             arguments);
}

}  // namespace

void addPaths(CommandLine& line, const std::string& out, MapToolOptions& options) {
  line.addText({"FILE", "", "a map file"}, options.map_path);
  line.addText({"OUT", "", out}, options.out_path);
}

void addSettings(CommandLine& line, const std::string& keys, MapToolOptions& options) {
  line.addList({"--set", "KEY=VALUE ...", "settings that override those of the file: " + keys},
               [&](const std::string& value) { options.settings.push_back(value); });
}

std::pair<RunSettings, std::unique_ptr<Mapper>> loadMapOf(const MapToolOptions& options,
                                                          const char* fixed) {
  const auto file = std::make_shared<const MapChunks>(options.map_path);
  std::vector<std::string> given = options.settings;
  given.emplace_back(fixed);
  RunSettings settings = settingsFor(file->head(), given);
  auto mapper = makeProbedMapper(settings.params.mapper, settings.rules, partsOf(file));
  return {std::move(settings), std::move(mapper)};
}

Mesh meshOf(Mapper& mapper, float voxel_size_m) {
  MeshStore meshes(voxel_size_m);
  meshes.apply(mapper.updateMesh());
  return meshes.assemble();
}

}  // namespace dtsdf

int main(int argc, char** argv) { return dtsdf::runProgram("map_tool", argc, argv, dtsdf::run); }
