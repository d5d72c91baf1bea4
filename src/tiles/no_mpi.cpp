// runTiles() of a build without MPI.
#include <stdexcept>

#include "tiles/run_tiles.h"

namespace dtsdf {

void runTiles(const RunRequest&) {
  throw std::runtime_error(
      "this build has no `tiles run`, because MPI was not found (libopenmpi-dev, openmpi-bin); "
      "tiles fuse makes one tile, tiles slurm prints a job for all");
}

}  // namespace dtsdf
