// runTiles() of a build without MPI.
#include <stdexcept>

#include "tiles/run_tiles.h"

namespace dtsdf {

void runTiles(const RunRequest&) {
  throw std::runtime_error(
      "this build has no `tiles run`, as MPI was not there (libopenmpi-dev, openmpi-bin); tiles "
      "fuse makes a tile, and tiles slurm prints a job for all");
}

}  // namespace dtsdf
