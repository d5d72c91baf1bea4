/// tiles: a map that is larger than one machine, made in tiles by as many processes as there are.
#include <cstdio>
#include <filesystem>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "program/run_program.h"
#include "tiles/child_process.h"
#include "tiles/fuse_tile.h"
#include "tiles/make_plan.h"
#include "tiles/plan_picture.h"
#include "tiles/run_tiles.h"
#include "tiles/slurm.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

struct PlanOptions {
  PlanRequest request;
  std::string folder;
};

void addPlanOptions(CommandLine& line, PlanOptions& options) {
  line.addList({"RECORDINGS", "",
                "recordings that reconstruct reads, with poses in one map frame, "
                "fused in this order"},
               [&](const std::string& path) { options.request.recordings.push_back(path); });
  line.addText({"--out", "DIR", "folder for the plan and everything made from it"}, options.folder);
  line.require("--out");
  line.addNumber({"--tile-m", "METRES", "edge of a tile, rounded to whole blocks of 8 voxels"},
                 options.request.tile_m, {0.01, 1e6});
  line.beginGroup("Input");
  addFormatOption(line, options.request.reading);
  addReadingOptions(line, options.request.reading);
  addFrameOptions(line, options.request.reading);
  line.beginGroup("Settings");
  addMapperOptions(line, options.request.reading);
}

void addFolder(CommandLine& line, std::string& folder) {
  line.addText({"DIR", "", "folder of the plan"}, folder);
}

void addFuseOptions(CommandLine& line, FuseOptions& options) {
  addBackendOption(line, "where to compute", options.backend);
  addThreadsOption(line, "CPU threads of each tile (0: all cores)", options.threads);
}

void addMergeOptions(CommandLine& line, MergeRequest& request) {
  line.add({"--mesh", "OUT.ply", "mesh of the whole map"}, [&](const std::string& value) {
    if (meshFormatOf(value) != MeshFormat::kPly) {
      throw UsageError("'" + value +
                       "' does not end in .ply; map_tool mesh writes other formats "
                       "of maps that fit into memory");
    }
    request.mesh_path = value;
  });
  addSaveMapOption(line, "map file of the whole map", request.map_path);
}

void planCommand(const std::vector<std::string>& arguments) {
  PlanOptions options;
  CommandLine line("tiles plan", "RECORDINGS... --out DIR [options]",
                   "Cuts the map of recordings into tiles and finds the frames that each needs.");
  addPlanOptions(line, options);
  line.parse(arguments);
  const std::string picture = (fs::path(options.folder) / "plan.svg").string();
  prepareOutputFile(picture);
  const RunSettings settings = readSettings(options.request.reading);
  const Plan plan = makePlan(options.request, settings);
  const double voxel_size_m = static_cast<double>(settings.params.mapper.map.voxel_size_m);
  const std::string table = planTable(plan, voxel_size_m);
  writeFileAtomically((fs::path(options.folder) / "plan.txt").string(), table);
  writeFileAtomically(picture, planPicture(plan, voxel_size_m));
  savePlan(plan, options.folder);
  std::printf("%splanned in %.1f s: %s, %s\n", table.c_str(), plan.seconds,
              planPath(options.folder).c_str(), picture.c_str());
}

void fuseCommand(const std::vector<std::string>& arguments) {
  FuseRequest request;
  std::string tile;
  int parent = 0;
  CommandLine line("tiles fuse", "DIR TILE [options]",
                   "Makes one tile, unless it is already done.");
  addFolder(line, request.folder);
  line.addText({"TILE", "", "number of the tile in the plan"}, tile);
  addFuseOptions(line, request.options);
  line.addFlag("--again", "make it again even if it is done", request.again);
  line.add({"--end-with", "PID", "end when the process with this id ends"},
           [&](const std::string& value) {
             parent = static_cast<int>(readWhole(value, {1, 1e9}));
           });
  line.parse(arguments);
  if (parent > 0) endWithProcess(parent);
  const LoadedPlan plan = loadPlan(request.folder);
  request.tile = readTileNumber(tile, plan.plan);
  fuseTile(request, plan);
}

void mergeCommand(const std::vector<std::string>& arguments) {
  MergeRequest request;
  CommandLine line("tiles merge", "DIR [--mesh OUT.ply] [--save-map OUT.dtsdf]",
                   "Joins the tiles of a plan into one mesh and one map. All tiles must be done.");
  addFolder(line, request.folder);
  addMergeOptions(line, request);
  line.parse(arguments);
  if (request.mesh_path.empty() && request.map_path.empty()) {
    throw UsageError("give --mesh, --save-map or both");
  }
  printMerged(request, mergeTiles(request, loadPlan(request.folder)));
}

void statusCommand(const std::vector<std::string>& arguments) {
  std::string folder;
  CommandLine line("tiles status", "DIR",
                   "Lists the tiles that are done, failed, running and "
                   "waiting.");
  addFolder(line, folder);
  line.parse(arguments);
  const LoadedPlan loaded = loadPlan(folder);
  static constexpr const char* kWords[] = {"waiting", "running", "failed", "done"};
  size_t count[4] = {};
  for (size_t i = 0; i < loaded.plan.tiles.size(); ++i) {
    const TileState state = stateOf(folder, i, loaded.id);
    const auto stage = static_cast<size_t>(state.stage);
    ++count[stage];
    std::printf("%5zu  %s%s%s\n", i, kWords[stage], state.why.empty() ? "" : ": ",
                state.why.c_str());
  }
  std::printf("%zu tiles: %zu done, %zu running, %zu failed, %zu waiting\n",
              loaded.plan.tiles.size(), count[3], count[1], count[2], count[0]);
}

void slurmCommand(const std::vector<std::string>& arguments) {
  SlurmRequest request;
  CommandLine line("tiles slurm", "DIR [options]",
                   "Prints a Slurm array job that makes all tiles. Then run tiles merge.");
  addFolder(line, request.folder);
  line.addWhole({"--threads", "N", "CPU threads of each tile"}, request.threads, {1, 1024});
  addBackendOption(line, "where to compute", request.backend);
  line.parse(arguments);
  request.program = fs::read_symlink("/proc/self/exe").string();
  const LoadedPlan loaded = loadPlan(request.folder);
  const std::string script = slurmScript(request, loaded.plan);
  prepareTiles(request.folder);  // before any task runs: Slurm makes no folder for its logs
  std::fputs(script.c_str(), stdout);
}

void runTilesCommand(const std::vector<std::string>& arguments) {
  RunRequest request;
  CommandLine line("tiles run", "DIR [options]",
                   "Makes all tiles that are not done, with as many processes as mpirun starts, "
                   "and joins them. To resume after an interruption, run the same command again.");
  addFolder(line, request.merge.folder);
  addFuseOptions(line, request.options);
  addMergeOptions(line, request.merge);
  line.parse(arguments);
  runTiles(request);
}

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
