#include "benchmark/stage_costs.h"

#include <algorithm>

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/colour/colour_image.h"
#include "kernels/core/voxel.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/unit_samples.h"
#include "kernels/space/cells.h"
#include "kernels/surfels/noise.h"
#include "kernels/surfels/surfel.h"
#include "map/block_table.h"

namespace dtsdf {
namespace {

constexpr double kPyramidBytes = 3 + (1 + 4.0 / 3) * sizeof(ColourPixel);

// Of lines far apart, memory is read in sectors of 32 bytes: one of a short line, three of a wide
// one along the row, and as many as it has samples of one down the column.
constexpr double kNoiseBytes = 32.0 * (1 + 3 + kNoiseLength) * kNoisePoints;

constexpr double kArrayBytes = BlockTable::kArrayBytes;
constexpr double kSumsBytes = kVoxelsPerBlock * sizeof(VoxelSums);
constexpr double kLabelsBytes = kVoxelsPerBlock * sizeof(UnitLabels);
constexpr double kTileBytes = 1;
constexpr double kTilePixels = kTileSide * kTileSide;
// Inverse depth, value and slope of the row, links.
constexpr double kPixelFits = 3 * sizeof(float) + sizeof(PixelLinks);
constexpr double kVertexEdges = 5;
constexpr double kTriangleBytes = 3 * sizeof(uint16_t);

double meshBytes(const WorkCounts& work) {
  return static_cast<double>(work.vertices) * sizeof(BlockVertex) +
         static_cast<double>(work.triangles) * kTriangleBytes;
}

}  // namespace

StageCost costOf(Stage stage, const WorkCounts& work, double arrays_per_block) {
  const double pixels = static_cast<double>(work.pixels);
  const double surfels = static_cast<double>(work.surfels);
  const double raw = static_cast<double>(work.raw_bytes);
  const double arrays = static_cast<double>(work.touched_arrays);
  const double indexed = static_cast<double>(work.indexed_blocks);
  const double meshed = static_cast<double>(work.meshed_blocks);
  const double cubes = static_cast<double>(work.seen_cubes);
  const double surfel_bytes = surfels * sizeof(Surfel);
  switch (stage) {
    case Stage::kCopy: return {2 * raw};
    case Stage::kUpload: return {raw, true};
    case Stage::kAlign: return {raw};  // the voxels around its points are few
    case Stage::kSense:  // images of the fits are written and read once, free depth written
      return {std::min(raw, kNoiseBytes) + raw + pixels * (2 * kPixelFits + sizeof(float))};
    case Stage::kMakeSurfels:  // the images are read in full, for what is around a surfel
      return {2 * pixels * (kPixelFits + kTileBytes / kTilePixels) + surfel_bytes};
    case Stage::kFindBlocks:  // entry of the frame's table, of the map's table, slot, result
      return {surfel_bytes + static_cast<double>(work.touched_blocks) * (12 + 12 + 32 + 40)};
    case Stage::kAdmit: return {static_cast<double>(work.new_arrays) * kArrayBytes};
    case Stage::kCast: return {surfel_bytes + arrays * kSumsBytes};
    case Stage::kFold: return {arrays * (2 * kSumsBytes + 2 * kArrayBytes)};
    case Stage::kClear:
      // The voxels of the frame's arrays, and the depth that each is compared with. What is looked
      // at in turn is not counted, so this is the least that there is to do.
      return {arrays * (kArrayBytes + kVoxelsPerBlock * sizeof(float))};
    case Stage::kSeeFree:  // free depths and their pyramid, and a bit of each cell
      return {pixels * (1 + 2.0 / 3) * sizeof(float) + cubes * sizeof(CellMask)};
    case Stage::kPaint:  // the image, at all its sizes; of what is painted, voxels and colours
      return {static_cast<double>(work.colour_pixels) * kPyramidBytes +
              static_cast<double>(work.painted_voxels) * (sizeof(Voxel) + 2 * sizeof(VoxelColour))};
    case Stage::kRender: return {};  // by what is in view, which is not counted
    case Stage::kIndex:              // which blocks to index, and them
      return {static_cast<double>(work.touched_blocks) * kUnitReach * 24 +
              indexed * (arrays_per_block * kGridCorners * sizeof(Voxel) + kLabelsBytes)};
    case Stage::kMake:  // the labels, a layer around, ends of each vertex' edges, the mesh
      return {meshed * kLabelsBytes * (1 + 6.0 / kBlockSide) +
              static_cast<double>(work.vertices) * arrays_per_block * 2 * kVertexEdges *
                  sizeof(Voxel) +
              meshBytes(work)};
    case Stage::kFetch: return {meshBytes(work), true};
    case Stage::kHandOut: return {2 * meshBytes(work)};
    case Stage::kFindCells: return {meshBytes(work)};
  }
  return {};
}

}  // namespace dtsdf
