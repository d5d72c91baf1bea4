#include "cpu/paint.h"

#include <algorithm>
#include <atomic>

#include "backend/frame_check.h"
#include "cpu/columns.h"
#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"
#include "kernels/colour/hiding.h"
#include "kernels/colour/surface_point.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

// Surface points are found and drawn in loops that compilers vectorise. The results equal those of
// kernels/colour bit for bit.

/// isNearSurface() for a row of voxels.
LaneInts areNearSurface(const PointView& view, const VoxelRow& row) {
  return (row.evidence() > LaneInts(view.min_evidence - 1)) &
         (LaneFloats(view.rules.surface_distance) >= magnitude(row.sdf()));
}

int listNear(const PointView& of_image, const Voxel* voxels, int* near) {
  const PointView view = of_image;  // a copy, as stores may alias the reference
  int count = 0;
  for (int first = 0; first < kVoxelsPerBlock; first += kBlockSide) {
    const LaneInts nearby = areNearSurface(view, VoxelRow(voxels + first));
    if (!any(nearby)) continue;
    int32_t is_near[kBlockSide];
    nearby.store(is_near);
    for (int x = 0; x < kBlockSide; ++x) {
      near[count] = first + x;
      count -= is_near[x];  // all bits are set, or none
    }
  }
  return count;
}

/// Lists the voxels of an array that are near their surface. @return the number of voxels listed.
int listNearSurface(const PointView& view, const Voxel* voxels, int* near) {
  int count = 0;
  withWidestVectors([&] { count = listNear(view, voxels, near); });
  return count;
}

/// A batch of surface points for voxels of one array. They equal those of findSurfacePoint() bit
/// for bit.
class PointBatch {
 public:
  static constexpr int kMax = 64;

  void find(const PointView& of_image, const Vec3f& of_block, const Voxel* voxels,
            const int* listed, int count, int direction) {
    for (int k = 0; k < count; ++k) {
      const int i = listed[k];
      slopes_.set(k, slopeAt(voxels, i));
      feet_.set(k, toFloat(voxelOffset(i)));
      sdf_[k] = sdfOf(voxels[i]);
    }
    withWidestVectors([&] { placeAll(of_image, of_block, direction, count); });
  }

  Vec3f normal(int k) const { return normals_[k]; }
  SurfacePoint point(int k) const { return points_[k]; }

 private:
  void placeAll(const PointView& of_image, const Vec3f& of_block, int direction, int count) {
    const FrameView frame = of_image.frame;  // copies, as stores may alias references
    const Vec3f first_voxel_L = of_block;
    const Facing facing = facingOf(of_image.directional ? direction : kAnyDirection);
    for (int k = 0; k < count; ++k) {
      const Vec3f normal = gradientOf(slopes_[k], facing);
      normals_.set(k, normal);
      points_.set(k, projectFoot(frame, first_voxel_L, feet_[k] - sdf_[k] * normal, normal));
    }
  }

  Columns<Vec3f, kMax> slopes_, feet_, normals_;
  Columns<SurfacePoint, kMax> points_;
  float sdf_[kMax];
};

constexpr int kCells = 8;  ///< Number of cells drawn at a time.

void drawRows(const SurfacePiece* pieces, int count, int32_t width, float* hiding_m) {
  for (int i = 0; i < count; ++i) {
    const SurfacePiece piece = pieces[i];
    for (int32_t v = piece.first_v; v <= piece.last_v; ++v) {
      for (int32_t first = piece.first_u; first <= piece.last_u; first += kCells) {
        float* const cells = hiding_m + static_cast<size_t>(v) * width + first;
        for (int32_t k = 0; k < kCells; ++k) {
          const float nearer_m = minimum(cells[k], depthOfPiece(piece, first + k, v));
          cells[k] = first + k <= piece.last_u ? nearer_m : cells[k];
        }
      }
    }
  }
}

/// Draws each piece as drawSurface() does. May rewrite up to kCells cells past the end.
void drawPieces(const SurfacePiece* pieces, int count, int32_t width, float* hiding_m) {
  withWidestVectors([&] { drawRows(pieces, count, width, hiding_m); });
}

template <class Visit>
void visitArrays(const BlockEntry& entry, const VoxelStore& voxels, const Visit& visit) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] != kNoArray) visit(d, voxels.array(entry.array[d]));
  }
}

/// The stored colour of an array's voxel, or null.
VoxelColour* findColour(CpuMap& map, int32_t array, int voxel) {
  const int32_t number = map.table.colourOf(array, brickOf(voxel));
  return number == kNoArray ? nullptr : map.colours.array(number) + placeInBrick(voxel);
}

VoxelColour colourOf(const ColourSample& sample) {
  return {sample.red, sample.green, sample.blue, 0};
}

void copyRow(const uint8_t* row, int width, const PixelLayout& layout, ColourPixel* to) {
  for (int u = 0; u < width; ++u) to[u] = takePixel(row + u * layout.bytes, layout);
}

/// Copies rows of an image and removes their padding.
void copyPixels(const ColourFrame& frame, int first_row, int end_row, ColourPixel* pixels) {
  const PixelLayout layout = layoutOf(frame.encoding);
  for (int v = first_row; v < end_row; ++v) {
    const auto* row = static_cast<const uint8_t*>(frame.data) + v * frame.row_bytes;
    ColourPixel* to = pixels + static_cast<size_t>(v) * frame.width;
    switch (frame.encoding) {  // faster with a constant layout for the usual encodings
      case ColourEncoding::kRgb8: copyRow(row, frame.width, {3, 0, 1, 2}, to); break;
      case ColourEncoding::kBgr8: copyRow(row, frame.width, {3, 2, 1, 0}, to); break;
      default: copyRow(row, frame.width, layout, to);
    }
  }
}

/// Computes halvedPixel() for a row. The loop for pixels at the border only runs if the finer level
/// is one pixel wide.
void halveRow(const ColourImage& image, int level, int32_t v, ColourPixel* __restrict__ row) {
  const ColourLevel& finer = image.level[level - 1];
  const int32_t inside = finer.width / 2;
  const ColourPixel* const upper = &pixelAt(image, finer, 0, 2 * v);
  const ColourPixel* const lower = &pixelAt(image, finer, 0, 2 * v + 1);
  withWidestVectors([&] {
    for (int32_t u = 0; u < inside; ++u) {
      row[u] = meanOf(upper[2 * u], upper[2 * u + 1], lower[2 * u], lower[2 * u + 1]);
    }
  });
  for (int32_t u = inside; u < image.level[level].width; ++u) {
    row[u] = halvedPixel(image, level, u, v);
  }
}

void addToSums(ExposureSums& sums, const ExposureSums& parts) {
  visitSums(sums, parts, [](int64_t& sum, int64_t part) { sum += part; });
}

}  // namespace

void forgetColours(const BlockEntry& entry, uint32_t directions, CpuMap& map) {
  visitArrays(entry, map.voxels, [&](int direction, const Voxel* array) {
    if (!(directions >> direction & 1)) return;
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      const int32_t number = map.table.colourOf(entry.array[direction], brick);
      if (number == kNoArray) continue;
      VoxelColour* const colours = map.colours.array(number);
      for (int place = 0; place < kVoxelsPerBrick; ++place) {
        const bool is_kept = !isEmpty(array[voxelInBrick(brick, place)]);
        colours[place] = is_kept ? colours[place] : VoxelColour{0, 0, 0, 0};
      }
    }
  });
}

Vec3f Painter::firstVoxelOf(const BlockEntry& entry) const {
  const BlockKey origin = blockOfVoxel(sensing_.view.frame.origin_voxel);
  return toFloat(firstVoxelOfBlock(entry.key - origin));
}

void Painter::takeImage(const ColourFrame& frame) {
  const ColourImage layout = layOut(nullptr, frame.width, frame.height);
  pixels_.resize(static_cast<size_t>(pixelCount(layout)));
  sensing_.image = layOut(pixels_.data(), frame.width, frame.height);
  constexpr int kRows = 16;
  const size_t bands = static_cast<size_t>((frame.height + kRows - 1) / kRows);
  parallelFor(bands, threads_, [&](size_t i) {
    const int first = static_cast<int>(i) * kRows;
    copyPixels(frame, first, std::min(first + kRows, frame.height), pixels_.data());
  });
  for (int level = 1; level < kColourLevels; ++level) {
    const ColourLevel& to = sensing_.image.level[level];
    parallelFor<kRows>(to.height, threads_, [&](size_t v) {
      halveRow(sensing_.image, level, static_cast<int32_t>(v),
               pixels_.data() + to.first + static_cast<int64_t>(v) * to.width);
    });
  }
}

void Painter::findBlocksInView(const std::vector<int32_t>& candidates, const BlockTable& table) {
  const FrameView& frame = sensing_.view.frame;
  const BlockKey origin = blockOfVoxel(frame.origin_voxel);
  const float radius = pointRadius(settings_.rules);
  blocks_in_view_ = 0;
  for (const int32_t slot : candidates) {
    const BlockEntry& entry = table.block(slot);
    if (!entry.in_use || !mayBeInView(frame, entry.key - origin, radius)) continue;
    if (blocks_in_view_ == blocks_.size()) blocks_.emplace_back();
    blocks_[blocks_in_view_++].slot = slot;
  }
}

/// Draws the surfaces of a block that can hide other surfaces, and stores the points that may be
/// visible.
inline void Painter::findPoints(CpuMap& map, BlockView& block, float* hiding_m) const {
  const PointView& view = sensing_.view;
  const BlockEntry& entry = map.table.block(block.slot);
  const Vec3f first_voxel_L = firstVoxelOf(entry);
  const bool takes_colour = map.table.takesColour(entry.key);
  block.points.clear();
  const int32_t width = cellsFor(view.frame.width);
  PointBatch batch;
  SurfacePiece pieces[PointBatch::kMax];
  visitArrays(entry, map.voxels, [&](int direction, const Voxel* array) {
    int near[kVoxelsPerBlock];
    const int near_count = listNearSurface(view, array, near);
    for (int first = 0; first < near_count; first += PointBatch::kMax) {
      const int count = std::min(near_count - first, PointBatch::kMax);
      batch.find(view, first_voxel_L, array, near + first, count, direction);
      int piece_count = 0;
      for (int k = 0; k < count; ++k) {
        const SurfacePoint point = batch.point(k);
        if (!hasPoint(view, batch.normal(k), direction) || !isInImage(view, point)) continue;
        const int i = near[first + k];
        if (hides(view, array, i, direction)) pieces[piece_count++] = pieceOf(view, point);
        if (!takes_colour || !(point.cosine > 0.0f)) continue;
        block.points.push_back({static_cast<uint16_t>(direction * kVoxelsPerBlock + i), point});
      }
      drawPieces(pieces, piece_count, width, hiding_m);
    }
  });
}

/// Each thread draws into its own depth image. At the end, the first receives the minimum of all.
void Painter::findPoints(CpuMap& map) {
  const int32_t width = cellsFor(sensing_.view.frame.width);
  const int32_t height = cellsFor(sensing_.view.frame.height);
  hiding_m_.resize(threads_);
  std::atomic<size_t> next{0};
  parallelFor(hiding_m_.size(), threads_, [&](size_t part) {
    hiding_m_[part].assign(static_cast<size_t>(width) * height + kCells, kNoSurface_m);
    for (size_t i = next++; i < blocks_in_view_; i = next++) {
      const size_t ahead = i + hiding_m_.size();  // most likely this thread's next block
      if (ahead < blocks_in_view_) prefetchBlock(map.table.block(blocks_[ahead].slot), map);
      withWidestVectors([&] { findPoints(map, blocks_[i], hiding_m_[part].data()); });
    }
  });
  std::vector<float>& nearest_m = hiding_m_[0];
  for (size_t part = 1; part < hiding_m_.size(); ++part) {
    for (size_t i = 0; i < nearest_m.size(); ++i) {
      nearest_m[i] = minimum(nearest_m[i], hiding_m_[part][i]);
    }
  }
  sensing_.hiding_m = nearest_m.data();
}

void Painter::sample(BlockView& block) const {
  block.samples.clear();
  for (const auto& [voxel, point] : block.points) {
    if (isHidden(sensing_.view, sensing_.hiding_m, point)) continue;
    const ColourSample sample = sampleAt(sensing_, point);
    if (sample.weight > 0.0f) block.samples.emplace_back(voxel, sample);
  }
}

/// Sums the samples for estimating the exposure, and finds the bricks that contain them.
void Painter::sumExposure(CpuMap& map, BlockView& block) const {
  const BlockEntry& entry = map.table.block(block.slot);
  block.sums = {};
  block.bricks = 0;
  for (const auto& [voxel, sample] : block.samples) {
    block.bricks |= brickBit(voxel / kVoxelsPerBlock, voxel % kVoxelsPerBlock);
    const VoxelColour* known =
        findColour(map, entry.array[voxel / kVoxelsPerBlock], voxel % kVoxelsPerBlock);
    if (known == nullptr) continue;
    if (isUsableForExposure(*known, colourOf(sample), sample.weight, settings_.rules)) {
      addToSums(block.sums, *known, colourOf(sample));
    }
  }
}

/// Prefetches the colours of the block that the thread will most likely process next.
void Painter::prefetchNext(CpuMap& map, size_t i) const {
  const size_t next = i + 1;
  if (next >= blocks_in_view_ || blocks_[next].points.empty()) return;
  prefetchColours(map.table.block(blocks_[next].slot), map);
}

SeenColours Painter::findColours(const FrameView& view, int32_t min_evidence,
                                 const std::vector<int32_t>& in_view, CpuMap& map) {
  sensing_.view = {settings_, view, min_evidence};
  findBlocksInView(in_view, map.table);
  findPoints(map);
  parallelFor(blocks_in_view_, threads_, [&](size_t i) {
    prefetchNext(map, i);
    sample(blocks_[i]);
    sumExposure(map, blocks_[i]);
  });
  SeenColours seen = {};
  for (size_t i = 0; i < blocks_in_view_; ++i) {
    addToSums(seen.sums, blocks_[i].sums);
    seen.any |= !blocks_[i].samples.empty();
  }
  return seen;
}

std::vector<ColourRequest> Painter::requests(CpuMap& map) const {
  std::vector<ColourRequest> requests;
  for (size_t i = 0; i < blocks_in_view_; ++i) {
    const BlockView& block = blocks_[i];
    if (block.bricks == 0) continue;
    requests.push_back({packKey(map.table.block(block.slot).key), block.bricks});
  }
  return requests;
}

bool Painter::paintBlock(const Exposure& exposure, CpuMap& map, const BlockView& block) const {
  const BlockEntry& entry = map.table.block(block.slot);
  bool changed = false;
  for (const auto& [voxel, sample] : block.samples) {
    VoxelColour* colour =
        findColour(map, entry.array[voxel / kVoxelsPerBlock], voxel % kVoxelsPerBlock);
    if (colour == nullptr) continue;
    const VoxelColour painted = paintedColour(*colour, sample, exposure, settings_.rules);
    changed = changed || looksDifferent(*colour, painted);
    *colour = painted;
  }
  return changed;
}

std::vector<int32_t> Painter::paint(const Exposure& exposure, CpuMap& map) {
  std::vector<uint8_t> changed(blocks_in_view_, 0);
  parallelFor(blocks_in_view_, threads_, [&](size_t i) {
    prefetchNext(map, i);
    changed[i] = paintBlock(exposure, map, blocks_[i]);
  });
  std::vector<int32_t> slots;
  for (size_t i = 0; i < blocks_in_view_; ++i) {
    if (changed[i]) slots.push_back(blocks_[i].slot);
  }
  return slots;
}

size_t Painter::bytes() const {
  size_t bytes = pixels_.capacity() * sizeof(ColourPixel) + blocks_.capacity() * sizeof(BlockView);
  for (const std::vector<float>& depth_m : hiding_m_) bytes += depth_m.capacity() * sizeof(float);
  for (const BlockView& block : blocks_) {
    bytes += block.points.capacity() * sizeof(block.points[0]) +
             block.samples.capacity() * sizeof(block.samples[0]);
  }
  return bytes;
}

}  // namespace dtsdf
