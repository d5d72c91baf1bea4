/// tiles: a map that is larger than one machine, made in tiles by as many processes as there are.
#include "program/run_program.h"
#include "tiles/commands.h"

namespace dtsdf {
namespace {

void run(const std::vector<std::string>& arguments) {
  runCommand(
      "tiles",
      "Makes a map in tiles, with any number of processes and machines; map and mesh have the "
      "same\nbytes as those of reconstruct.",
      {{"plan", "cuts the map of recordings into tiles", planCommand},
       {"run", "makes all tiles and joins them, under mpirun", runTilesCommand},
       {"status", "lists done, failed, running and waiting tiles", statusCommand},
       {"fuse", "makes one tile", fuseCommand},
       {"merge", "joins the tiles into one mesh and one map", mergeCommand},
       {"slurm", "prints a Slurm array job that makes all tiles", slurmCommand}},
      arguments);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) { return dtsdf::runProgram("tiles", argc, argv, dtsdf::run); }
