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

// Operations, counted in the rules in kernels/ for the usual case.
constexpr double kFitOperations = 60;     // of a pixel's row or column: a window of 5, 12 each
constexpr double kMergeOperations = 10;   // of a pixel: least and most of depth and slope, twice
constexpr double kSurfelOperations = 60;  // back-projection, normalisation, rotation, weights
constexpr double kTouchOperations = 80;   // the line, and the one or two blocks that it meets
constexpr double kSamplesOfSurfel = 3.5 * 4 * 1.7;  // planes in reach, corners, directions
constexpr double kSampleOperations = 25;    // crossing, weights, distance, rounding, two sums
constexpr double kFoldOperations = 8;       // of a voxel
constexpr double kClearOperations = 70;     // of a voxel: foot, projection, comparison with nine
constexpr double kLinkOperations = 40;      // of a pixel: two steps, and what lies around them
constexpr double kFreeOperations = 40;      // of a pixel: its plane, how far its ray is free
constexpr double kIndexOperations = 100;    // of a mesh unit; far more where a surface is
constexpr double kVertexOperations = 250;   // its own edge, and the weights of four beside it
constexpr double kPaintOperations = 200;    // of a voxel: foot, visibility around it, colour, mean
constexpr double kCellOperations = 100;     // bounds of eight corners, up to 16 texels
constexpr double kTriangleOperations = 40;  // which cells three corners are in
constexpr double kPyramidBytes = 3 + (1 + 4.0 / 3) * sizeof(ColourPixel);

constexpr double kNoiseOperations = 10;  // of a sample of a line
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
    case Stage::kCopy: return {2 * raw, 0};
    case Stage::kUpload: return {raw, 0, true};
    case Stage::kSense:  // images of the fits are written and read once, free depth written
      return {std::min(raw, kNoiseBytes) + raw + pixels * (2 * kPixelFits + sizeof(float)),
              kNoiseKinds * kNoisePoints * kNoiseLength * kNoiseOperations +
                  pixels * (kLinkOperations + kFitOperations + kFreeOperations)};
    case Stage::kMakeSurfels:  // the images are read in full, for what is around a surfel
      return {2 * pixels * (kPixelFits + kTileBytes / kTilePixels) + surfel_bytes,
              pixels * kMergeOperations + surfels * (kFitOperations + kSurfelOperations)};
    case Stage::kFindBlocks:  // entry of the frame's table, of the map's table, slot, result
      return {surfel_bytes + static_cast<double>(work.touched_blocks) * (12 + 12 + 32 + 40),
              surfels * kTouchOperations};
    case Stage::kAdmit: return {static_cast<double>(work.new_arrays) * kArrayBytes, 0};
    case Stage::kCast:
      return {surfel_bytes + arrays * kSumsBytes, surfels * kSamplesOfSurfel * kSampleOperations};
    case Stage::kFold:
      return {arrays * (2 * kSumsBytes + 2 * kArrayBytes),
              arrays * kVoxelsPerBlock * kFoldOperations};
    case Stage::kClear:
      // The voxels of the frame's arrays, and the depth that each is compared with. What is looked
      // at in turn is not counted, so this is the least that there is to do.
      return {arrays * (kArrayBytes + kVoxelsPerBlock * sizeof(float)),
              arrays * kVoxelsPerBlock * kClearOperations};
    case Stage::kSeeFree:  // free depths and their pyramid, and a bit of each cell
      return {pixels * (1 + 2.0 / 3) * sizeof(float) + cubes * sizeof(CellMask),
              pixels + cubes * kCellsPerCube * kCellOperations};
    case Stage::kPaint:  // the image, at all its sizes; of what is painted, voxels and colours
      return {
          static_cast<double>(work.colour_pixels) * kPyramidBytes +
              static_cast<double>(work.painted_voxels) * (sizeof(Voxel) + 2 * sizeof(VoxelColour)),
          static_cast<double>(work.painted_voxels) * kPaintOperations};
    case Stage::kIndex:  // which blocks to index, and them
      return {static_cast<double>(work.touched_blocks) * kUnitReach * 24 +
                  indexed * (arrays_per_block * kGridCorners * sizeof(Voxel) + kLabelsBytes),
              indexed * kVoxelsPerBlock * kIndexOperations};
    case Stage::kMake:  // the labels, a layer around, ends of each vertex' edges, the mesh
      return {meshed * kLabelsBytes * (1 + 6.0 / kBlockSide) +
                  static_cast<double>(work.vertices) * arrays_per_block * 2 * kVertexEdges *
                      sizeof(Voxel) +
                  meshBytes(work),
              static_cast<double>(work.vertices) * kVertexOperations};
    case Stage::kFetch: return {meshBytes(work), 0, true};
    case Stage::kHandOut: return {2 * meshBytes(work), 0};
    case Stage::kFindCells:
      return {meshBytes(work), static_cast<double>(work.triangles) * kTriangleOperations};
  }
  return {};
}

double occupancyOnTuring(int threads, int registers, size_t shared_bytes) {
  constexpr int kMaxThreads = 1024, kMaxRegisters = 65536, kWarp = 32;
  constexpr int kRegisterUnit = 256;  // registers are given out to warps in these steps
  constexpr size_t kMaxShared = 65536, kSharedUnit = 256;
  const int warps = (threads + kWarp - 1) / kWarp;
  const int warp_registers =
      (registers * kWarp + kRegisterUnit - 1) / kRegisterUnit * kRegisterUnit;
  int blocks = std::min(kMaxThreads / threads, kMaxRegisters / std::max(1, warp_registers * warps));
  const size_t shared = (shared_bytes + kSharedUnit - 1) / kSharedUnit * kSharedUnit;
  if (shared > 0) blocks = std::min(blocks, static_cast<int>(kMaxShared / shared));
  return static_cast<double>(blocks * threads) / kMaxThreads;
}

}  // namespace dtsdf
