// map_tool bt: saves the known cells as an OctoMap tree.
#ifdef DTSDF_WITH_OCTOMAP
#include "planning/oc_tree.h"
#endif

#include <cstdio>
#include <sstream>
#include <stdexcept>

#include "io/atomic_file.h"
#include "params/text.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

#ifdef DTSDF_WITH_OCTOMAP

void save(const Space& space, const std::string& path) {
  octomap::OcTree tree(space.cellSize_m());
  size_t occupied = 0, free = 0;
  for (const SpaceCell& known : space.cells()) {
    addToTree(known, tree);
    ++(known.state == CellState::kSurface ? occupied : free);
  }
  tree.updateInnerOccupancy();
  std::ostringstream bytes;
  bytes.imbue(std::locale::classic());
  if (!tree.writeBinary(bytes)) throw std::runtime_error("OctoMap cannot write the tree");
  writeFileAtomically(path, bytes.str());
  std::printf("%zu cells of %g m with a surface, %zu free: %s\n", occupied, space.cellSize_m(),
              free, path.c_str());
}

#else

void save(const Space&, const std::string&) {
  throw std::runtime_error(
      "this map_tool was built without OctoMap; install liboctomap-dev and build it again");
}

#endif

}  // namespace

void saveOcTree(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  CommandLine line("map_tool bt", "FILE OUT.bt [options]",
                   "Saves the free-space grid of a map as an OctoMap tree: cells with a surface "
                   "are occupied, cells observed to be empty are free, and all others unknown.");
  addPaths(line, "the tree: .bt", options);
  addSettings(line, "space/..., backend, threads", options);
  line.parse(arguments);
  if (!endsWith(options.out_path, ".bt")) {
    throw UsageError("'" + options.out_path + "' does not end in .bt");
  }
  prepareOutputFile(options.out_path);
  const auto mapper = loadMapOf(options, "space/enabled=true").second;
  if (mapper->stats().free_bytes == 0) {
    std::fprintf(
        stderr,
        "map_tool: warning: the map contains no free cells, so the tree contains only surface "
        "cells. Build the map with --set space/enabled=true\n");
  }
  mapper->updateMesh();
  save(*mapper->space(), options.out_path);
}

}  // namespace dtsdf
