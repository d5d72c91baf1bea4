#include "tiles/plan_picture.h"

#include <algorithm>
#include <array>
#include <map>

#include "params/text.h"

namespace dtsdf {
namespace {

double megabytes(size_t bytes) { return static_cast<double>(bytes) / 1e6; }

/// A tile's column, from above: its least and greatest blocks along x and y.
using Column = std::array<int32_t, 4>;

struct ColumnOfTiles {
  std::string numbers;
  double seconds = 0.0;
};

std::map<Column, ColumnOfTiles> columnsOf(const Plan& plan) {
  std::map<Column, ColumnOfTiles> columns;
  for (size_t i = 0; i < plan.tiles.size(); ++i) {
    const BlockExtent& own = plan.tiles[i].own;
    ColumnOfTiles& column = columns[{own.first.x, own.first.y, own.last.x, own.last.y}];
    column.numbers += (column.numbers.empty() ? "" : " ") + std::to_string(i);
    column.seconds += plan.tiles[i].estimate.seconds;
  }
  return columns;
}

}  // namespace

std::string planTable(const Plan& plan, double voxel_size_m) {
  const double block_m = voxel_size_m * kBlockSide;
  std::string table = formatted("%5s  %-36s %8s %8s %9s %9s\n", "tile", "from x, y, z (m), edges",
                                "frames", "blocks", "MB", "seconds");
  TileEstimate all;
  size_t frames = 0, largest = 0;
  for (size_t i = 0; i < plan.tiles.size(); ++i) {
    const Tile& tile = plan.tiles[i];
    const BlockExtent& own = tile.own;
    const std::string place = formatted(
        "%.2f, %.2f, %.2f  %.1f x %.1f x %.1f", own.first.x * block_m, own.first.y * block_m,
        own.first.z * block_m, (own.last.x - own.first.x + 1) * block_m,
        (own.last.y - own.first.y + 1) * block_m, (own.last.z - own.first.z + 1) * block_m);
    table +=
        formatted("%5zu  %-36s %8zu %8zu %9.1f %9.1f\n", i, place.c_str(), tile.frameCount(),
                  tile.estimate.blocks, megabytes(tile.estimate.map_bytes), tile.estimate.seconds);
    frames += tile.frameCount();
    all.seconds += tile.estimate.seconds;
    largest = std::max(largest, tile.estimate.map_bytes);
  }
  size_t fused = 0;
  for (const PlannedRecording& recording : plan.recordings) fused += recording.fused.count();
  return table +
         formatted(
             "\n%zu tiles of %d blocks (%.2f m); %zu frames from %zu recording%s; each touches "
             "%.3g tiles on average\nlargest tile: at most %.1f MB of map in memory\n"
             "in a single process: about %.0f s\n",
             plan.tiles.size(), plan.tile_blocks, plan.tile_blocks * block_m, fused,
             plan.recordings.size(), plan.recordings.size() == 1 ? "" : "s",
             fused > 0 ? static_cast<double>(frames) / static_cast<double>(fused) : 0.0,
             megabytes(largest), all.seconds);
}

std::string planPicture(const Plan& plan, double voxel_size_m) {
  constexpr double kSide_px = 1000.0, kMargin_px = 10.0;
  const std::map<Column, ColumnOfTiles> columns = columnsOf(plan);
  Column bounds = columns.begin()->first;
  double most_s = 1e-9;
  for (const auto& [at, column] : columns) {
    bounds = {std::min(bounds[0], at[0]), std::min(bounds[1], at[1]), std::max(bounds[2], at[2]),
              std::max(bounds[3], at[3])};
    most_s = std::max(most_s, column.seconds);
  }
  const double width = bounds[2] - bounds[0] + 1, height = bounds[3] - bounds[1] + 1;
  const double scale = kSide_px / std::max(width, height);
  std::string svg = formatted(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" "
      "height=\"%.0f\" font-family=\"sans-serif\" font-size=\"12\">\n",
      width * scale + 2 * kMargin_px, height * scale + 4 * kMargin_px);
  for (const auto& [at, column] : columns) {
    const double x = kMargin_px + (at[0] - bounds[0]) * scale;
    const double y = kMargin_px + (bounds[3] - at[3]) * scale;  // y points up
    const double w = (at[2] - at[0] + 1) * scale, h = (at[3] - at[1] + 1) * scale;
    const int grey = 250 - static_cast<int>(170.0 * column.seconds / most_s);
    svg += formatted(
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" stroke=\"black\" "
        "fill=\"rgb(%d,%d,255)\"/>\n",
        x, y, w, h, grey, grey);
    svg += formatted("<text x=\"%.1f\" y=\"%.1f\">", x + 4.0, y + 16.0) + column.numbers +
           formatted("<title>%.0f s</title></text>\n", column.seconds);
  }
  return svg +
         formatted("<text x=\"%.0f\" y=\"%.1f\">%.1f m x %.1f m, x to the right, y up</text>\n",
                   kMargin_px, height * scale + 3 * kMargin_px, width * kBlockSide * voxel_size_m,
                   height * kBlockSide * voxel_size_m) +
         "</svg>\n";
}

}  // namespace dtsdf
