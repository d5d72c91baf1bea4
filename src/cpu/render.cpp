#include "cpu/render.h"

#include <algorithm>

#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

struct NoScratch {};

/// Rows of pixels that a thread takes at a time.
constexpr int32_t kBandRows = 8 * kRangeTileSide;

Vec3f firstVoxelOf(const FrameView& frame, const BlockEntry& entry) {
  return toFloat(firstVoxelOfBlock(entry.key) - frame.origin_voxel);
}

/// Calls visit(pixel) for those of a square that are in the image.
template <class Visit>
void forEachPixel(const FrameView& frame, const Pixel& square, int32_t side, const Visit& visit) {
  for (int32_t v = square.v; v < std::min(square.v + side, frame.height); ++v) {
    for (int32_t u = square.u; u < std::min(square.u + side, frame.width); ++u) {
      visit(Pixel{u, v});
    }
  }
}

void widen(TileRange& range, const TileRange& other) {
  range.near = minimum(range.near, other.near);
  range.far = maximum(range.far, other.far);
}

void cover(const FrameView& frame, const Vec3f& voxel, TileImage& tiles) {
  const TileCover cover = coverTiles(frame, voxel);
  for (int32_t v = cover.v0; v <= cover.v1; ++v) {
    for (int32_t u = cover.u0; u <= cover.u1; ++u) {
      widen(tiles.ranges[static_cast<size_t>(v) * tiles.columns + u], cover.range);
    }
  }
}

}  // namespace

void Renderer::findBlocksInView(const FrameView& frame) {
  const BlockKey origin = blockOfVoxel(frame.origin_voxel);
  slots_.clear();
  number_of_slot_.assign(map_.table.slotCount(), kNotInView);
  for (size_t slot = 0; slot < map_.table.slotCount(); ++slot) {
    const BlockEntry& entry = map_.table.block(static_cast<int32_t>(slot));
    if (!entry.in_use || !mayReachView(frame, entry.key - origin)) continue;
    number_of_slot_[slot] = static_cast<int32_t>(slots_.size());
    slots_.push_back(static_cast<int32_t>(slot));
  }
}

/// Notes what rays ask of a block's voxels, and the tiles that its surfaces may be seen in.
void Renderer::lookAtBlock(const RayScene& scene, size_t number, TileImage& tiles) {
  const BlockEntry& entry = map_.table.block(slots_[number]);
  const VoxelBits bits = voxelBitsOf(entry, map_.voxels, scene.least_evidence);
  bits_[number] = bits;
  const Vec3f first = firstVoxelOf(scene.frame, entry);
  for (int z = 0; z < kBlockSide; ++z) {
    for (uint64_t left = bits.near.layer[z]; left != 0; left &= left - 1) {
      const int in_layer = __builtin_ctzll(left);
      const int voxel = in_layer + kBlockSide * kBlockSide * z;
      cover(scene.frame, first + toFloat(voxelOffset(voxel)), tiles);
    }
  }
}

/// Each thread has an image of its own; the widest range of all of them stays.
void Renderer::findRanges(const RayScene& scene) {
  const FrameView& frame = scene.frame;
  const int32_t columns = rangeTilesFor(frame.width), rows = rangeTilesFor(frame.height);
  tiles_.resize(static_cast<size_t>(threads_));
  bits_.resize(slots_.size());
  parallelFor<NoScratch>(tiles_.size(), threads_, [&](size_t part, NoScratch&) {
    TileImage& tiles = tiles_[part];
    tiles.columns = columns;
    tiles.ranges.assign(static_cast<size_t>(columns) * rows, noTileRange());
    for (size_t i = part; i < slots_.size(); i += tiles_.size()) lookAtBlock(scene, i, tiles);
  });
  std::vector<TileRange>& all = tiles_[0].ranges;
  for (size_t part = 1; part < tiles_.size(); ++part) {
    for (size_t i = 0; i < all.size(); ++i) widen(all[i], tiles_[part].ranges[i]);
  }
}

const TileRange& Renderer::rangeAt(const Pixel& pixel) const {
  const TileImage& tiles = tiles_[0];
  return tiles.ranges[static_cast<size_t>(pixel.v / kRangeTileSide) * tiles.columns +
                      pixel.u / kRangeTileSide];
}

RenderedPixel& Renderer::pixelAt(const FrameView& frame, const Pixel& pixel) {
  return pixels_[static_cast<size_t>(pixelIndex(frame, pixel))];
}

void Renderer::cast(const RayScene& scene, const Pixel& pixel, RayUnits& units) {
  pixelAt(scene.frame, pixel) = castPixel(scene.frame, pixel, rangeAt(pixel), scene.painted, units);
}

/// Casts the rays of the first lattice in a row of squares.
void Renderer::castLattice(const RayScene& scene, int32_t v, RayUnits& units) {
  for (int32_t u = 0; u < scene.frame.width; u += kFirstStride) cast(scene, {u, v}, units);
}

/// Fills what lies in a square between its rays, if they meet a plane.
bool Renderer::fillSquare(const FrameView& frame, const Pixel& square, int32_t stride) {
  if (!hasRays(frame, square, stride)) return false;
  const RaySquare rays =
      raysOf(square, stride, [&](const Pixel& pixel) { return pixelAt(frame, pixel); });
  if (!meetsPlane(frame, square, stride, rays)) return false;
  for (int32_t v = square.v; v < square.v + stride; ++v) {
    for (int32_t u = square.u; u < square.u + stride; ++u) {
      if (u == square.u && v == square.v) continue;
      pixelAt(frame, {u, v}) = pixelBetween(rays, square, stride, {u, v});
    }
  }
  return true;
}

/// Squares of the first stride in a row of them; where they cannot be filled, rays of the second.
void Renderer::fillFirstSquares(const RayScene& scene, int32_t v, RayUnits& units) {
  std::vector<Pixel>& open = open_squares_[static_cast<size_t>(v / kFirstStride)];
  open.clear();
  for (int32_t u = 0; u < scene.frame.width; u += kFirstStride) {
    const Pixel square{u, v};
    if (fillSquare(scene.frame, square, kFirstStride)) continue;
    open.push_back(square);
    forEachPixel(scene.frame, square, kFirstStride, [&](const Pixel& pixel) {
      if (isOnLattice(pixel, kSecondStride) && !isOnLattice(pixel, kFirstStride)) {
        cast(scene, pixel, units);
      }
    });
  }
}

/// The rest of the row: squares of the second stride, or rays.
void Renderer::fillOpenSquares(const RayScene& scene, int32_t v, RayUnits& units) {
  for (const Pixel& open : open_squares_[static_cast<size_t>(v / kFirstStride)]) {
    forEachPixel(scene.frame, open, kFirstStride, [&](const Pixel& square) {
      if (!isOnLattice(square, kSecondStride)) return;
      if (fillSquare(scene.frame, square, kSecondStride)) return;
      forEachPixel(scene.frame, square, kSecondStride, [&](const Pixel& pixel) {
        if (!isOnLattice(pixel, kSecondStride)) cast(scene, pixel, units);
      });
    });
  }
}

/// A row of squares that is finished, as the caller gets it.
void Renderer::handOut(const FrameView& frame, int32_t v, RenderedView& view) const {
  const size_t first = static_cast<size_t>(v) * frame.width;
  const size_t end = static_cast<size_t>(std::min(v + kFirstStride, frame.height)) * frame.width;
  for (size_t i = first; i < end; ++i) {
    view.depth_m[i] = frame.voxel_size_m * pixels_[i].depth;
    view.normals_C[i] = pixels_[i].normal_C;
  }
  if (view.colours.empty()) return;
  for (size_t i = first; i < end; ++i) view.colours[i] = pixels_[i].colour;
}

/// A row is filled once the next one's rays are cast, and finished once the next one is filled. In
/// a band rows follow each other closely, while the units that they meet are in the caches; its
/// last ones wait for the band below.
void Renderer::castRays(const RayScene& scene, RenderedView& view) {
  const FrameView& frame = scene.frame;
  constexpr int32_t kRow = kFirstStride;
  const auto finish = [&](int32_t v, RayUnits& units) {
    fillOpenSquares(scene, v, units);
    handOut(frame, v, view);
  };
  const auto for_bands = [&](const auto& step) {
    const int32_t bands = (frame.height + kBandRows - 1) / kBandRows;
    parallelFor<NoScratch>(static_cast<size_t>(bands), threads_, [&](size_t i, NoScratch&) {
      const int32_t first = static_cast<int32_t>(i) * kBandRows;
      const int32_t rows = (std::min(kBandRows, frame.height - first) + kRow - 1) / kRow;
      RayUnits units(blocks_);
      step(first, first + (rows - 1) * kRow, units);
    });
  };
  for_bands([&](int32_t first, int32_t last, RayUnits& units) {
    for (int32_t v = first; v <= last; v += kRow) {
      castLattice(scene, v, units);
      if (v - kRow >= first) fillFirstSquares(scene, v - kRow, units);
      if (v - 2 * kRow >= first) finish(v - 2 * kRow, units);
    }
  });
  for_bands([&](int32_t first, int32_t last, RayUnits& units) {
    fillFirstSquares(scene, last, units);
    if (last - kRow >= first) finish(last - kRow, units);
  });
  for_bands([&](int32_t, int32_t last, RayUnits& units) { finish(last, units); });
}

void Renderer::render(const FrameView& frame, int32_t least_evidence, bool painted,
                      RenderedView& view) {
  findBlocksInView(frame);
  const RayScene scene{map_,         frame,   rules_, least_evidence,
                       directional_, painted, bits_,  number_of_slot_};
  findRanges(scene);
  const size_t pixels = static_cast<size_t>(frame.width) * frame.height;
  view.width = frame.width;
  view.height = frame.height;
  view.depth_m.resize(pixels);
  view.normals_C.resize(pixels);
  view.colours.resize(painted ? pixels : 0);
  pixels_.resize(pixels);
  open_squares_.resize(static_cast<size_t>(frame.height + kFirstStride - 1) / kFirstStride);
  blocks_.begin(scene, slots_.size());
  castRays(scene, view);
}

size_t Renderer::bytes() const {
  size_t bytes = (slots_.capacity() + number_of_slot_.capacity()) * sizeof(int32_t) +
                 bits_.capacity() * sizeof(VoxelBits) + pixels_.capacity() * sizeof(RenderedPixel);
  for (const std::vector<Pixel>& open : open_squares_) bytes += open.capacity() * sizeof(Pixel);
  bytes += blocks_.bytes();
  for (const TileImage& tiles : tiles_) bytes += tiles.ranges.capacity() * sizeof(TileRange);
  return bytes;
}

}  // namespace dtsdf
