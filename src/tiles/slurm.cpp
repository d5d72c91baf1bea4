#include "tiles/slurm.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "map/block_table.h"
#include "tiles/tile_queue.h"

namespace dtsdf {
namespace {

/// One word for a shell, whatever it holds.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

/// A folder as sbatch reads it, in which % begins a number of the job. With a backslash anywhere it
/// would replace none, and all tasks would write one log.
std::string forSbatch(const std::string& folder) {
  if (folder.find_first_of("\\\n") != folder.npos) {
    throw std::runtime_error("Slurm cannot write its logs to '" + folder +
                             "', whose name has a "
                             "backslash or a line break; give the folder another name");
  }
  std::string text;
  for (const char c : folder) {
    if (c == '"') text += '\\';
    text += c == '%' ? "%%" : std::string(1, c);
  }
  return text;
}

/// Of the largest tile: its map, its mesh, which is half as much at most, also of what lies on
/// disk, and what a frame takes.
size_t memoryMb(const Plan& plan) {
  constexpr size_t kBesides_mb = 500;
  size_t most = 0;
  for (const Tile& tile : plan.tiles) {
    const TileEstimate& needs = tile.estimate;
    const size_t mesh_bytes = needs.voxel_arrays * BlockTable::kArrayBytes / 2;
    most = std::max(most, needs.map_bytes + needs.free_bytes + mesh_bytes);
  }
  return (most >> 20) + kBesides_mb;
}

std::string numbersLongestFirst(const Plan& plan) {
  TileQueue queue(plan, std::vector<bool>(plan.tiles.size(), false));
  std::string numbers;
  while (const std::optional<size_t> tile = queue.next()) {
    numbers += (numbers.empty() ? "" : " ") + std::to_string(*tile);
  }
  return numbers;
}

}  // namespace

std::string slurmScript(const SlurmRequest& request, const Plan& plan) {
  const std::string folder = std::filesystem::absolute(request.folder).lexically_normal().string();
  const size_t indices = std::min(plan.tiles.size(), kMostArrayIndices);
  const std::string threads = std::to_string(request.threads);
  const std::string backend = request.backend ? " --backend " + quoted(*request.backend) : "";
  const bool on_gpu = request.backend == "cuda";
  return "#!/bin/bash\n"
         "#SBATCH --job-name=tiles\n"
         "#SBATCH --array=0-" +
         std::to_string(indices - 1) +
         "\n"
         "#SBATCH --cpus-per-task=" +
         threads +
         "\n"
         "#SBATCH --mem=" +
         std::to_string(memoryMb(plan)) + "M\n" + (on_gpu ? "#SBATCH --gres=gpu:1\n" : "") +
         "#SBATCH --output=\"" + forSbatch(folder) +
         "/tiles/slurm-%A_%a.log\"\n"
         "# Finished tiles are skipped: submit it again to resume.\n"
         "tiles=(" +
         numbersLongestFirst(plan) +
         ")\n"
         "failed=0\n"
         "for ((i = SLURM_ARRAY_TASK_ID; i < ${#tiles[@]}; i += " +
         std::to_string(indices) +
         ")); do\n"
         "  " +
         quoted(request.program) + " fuse " + quoted(folder) + " \"${tiles[i]}\" --threads " +
         threads + backend +
         " || failed=1\n"
         "done\n"
         "exit $failed\n";
}

}  // namespace dtsdf
