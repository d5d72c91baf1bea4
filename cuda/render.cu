#include "render.h"

#include <cstring>

#include "device_map.cuh"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/stage_clock.h"
#include "unit_samples.cuh"

namespace dtsdf {
namespace gpu {
namespace {

/// Few threads a block: rays next to each other wait for memory together.
constexpr int kRayThreads = 64;

/// Of a block of threads that looks at a block of the map.
constexpr int kLookThreads = 128;
constexpr int kWarp = 32;

/// The units of the map as castRay() asks for them.
class RayUnits {
 public:
  __device__ RayUnits(const MapView& map, const RenderJob& job) : map_(map), job_(job) {}

  __device__ bool enter(const Vec3i& block_L) {
    slot_ = slotOf(block_L + blockOfVoxel(job_.scene.frame.origin_voxel));
    return slot_ >= 0 && directionsOfSlot(map_.slots[slot_]) != 0;
  }

  __device__ const RayUnit& find(const Vec3i& unit) {
    const UnitPlaces& places = job_.units.places[slot_];
    const int z = unit.z & (kBlockSide - 1), bit = bitOf(unit);
    const uint64_t made = places.made.layer[z];
    if ((made >> bit & 1) != 0) {
      const int before = places.before[z] + __popcll(made & ((uint64_t{1} << bit) - 1));
      unit_ = job_.units.units[places.first + before];
    } else {
      unit_ = unitWithoutSurface(has(places.known, unit) ? UnitState::kFront : UnitState::kUnknown);
    }
    return unit_;
  }

  /// @pre The unit was the last that find() gave.
  __device__ UnitColours coloursAt(const Vec3i& unit) {
    UnitCorner corner[kCubeCorners];
    for (int c = 0; c < kCubeCorners; ++c) {
      corner[c] =
          cornerAt(unit + job_.scene.frame.origin_voxel + Vec3i{c & 1, c >> 1 & 1, c >> 2 & 1});
    }
    return coloursOf(unit_, [&](int d, int c) { return colouredAt(d, corner[c]); });
  }

 private:
  __device__ int32_t slotOf(const BlockKey& key) {
    if (!is_known_ || key != key_) {
      known_slot_ = isRepresentable(key) ? findSlot(map_, packKey(key)) : -1;
      key_ = key;
      is_known_ = true;
    }
    return known_slot_;
  }

  __device__ UnitCorner cornerAt(const Vec3i& at) {
    constexpr int kMask = kBlockSide - 1;
    return {slotOf(blockOfVoxel(at)), voxelIndex(at.x & kMask, at.y & kMask, at.z & kMask)};
  }

  __device__ ColouredSample colouredAt(int direction, const UnitCorner& corner) const {
    const int32_t array = corner.slot < 0 ? kNoArray : map_.slots[corner.slot].array[direction];
    if (array == kNoArray) return {{0.0f, 0.0f}, {0, 0, 0, 0}};
    const Sample sample =
        sampleOf(map_.voxels.record(array)[corner.voxel], job_.scene.least_evidence);
    const VoxelColour* colour = colourOf(map_, array, corner.voxel);
    return {sample, colour == nullptr ? VoxelColour{0, 0, 0, 0} : *colour};
  }

  const MapView& map_;
  const RenderJob& job_;
  RayUnit unit_;
  int32_t slot_ = -1;  ///< Of the block that was entered last.
  BlockKey key_{0, 0, 0};
  int32_t known_slot_ = -1;
  bool is_known_ = false;
};

__global__ void __launch_bounds__(kThreads) clearRangesKernel(RenderJob job, size_t tiles) {
  const size_t i = globalThread();
  if (i < tiles) job.ranges[i] = noTileRange();
}

/// Depths are above 0: as numbers and as integers they have one order.
__device__ void widen(TileRange& range, const TileRange& other) {
  auto* near = reinterpret_cast<int*>(&range.near);
  auto* far = reinterpret_cast<int*>(&range.far);
  if (other.near < readShared(&range.near)) atomicMin(near, __float_as_int(other.near));
  if (other.far > readShared(&range.far)) atomicMax(far, __float_as_int(other.far));
}

/// Enters what a voxel says of its tiles.
__device__ void coverRanges(const RenderJob& job, const Vec3f& voxel) {
  const TileCover cover = coverTiles(job.scene.frame, voxel);
  for (int32_t v = cover.v0; v <= cover.v1; ++v) {
    for (int32_t u = cover.u0; u <= cover.u1; ++u) {
      widen(job.ranges[static_cast<size_t>(v) * job.tile_columns + u], cover.range);
    }
  }
}

/// Notes what a warp's voxels are: the bits of its lanes, in their order.
__device__ void noteBits(VoxelBits& bits, int voxel, bool known, bool behind) {
  constexpr unsigned kAllLanes = 0xffffffffu;
  const uint32_t of_known = __ballot_sync(kAllLanes, known);
  const uint32_t of_behind = __ballot_sync(kAllLanes, behind);
  if (threadIdx.x % kWarp != 0) return;
  reinterpret_cast<uint32_t*>(bits.known.layer)[voxel / kWarp] = of_known;
  reinterpret_cast<uint32_t*>(bits.behind.layer)[voxel / kWarp] = of_behind;
}

/// One block of threads per block of the map: the bits of its voxels, and the ranges of what is in
/// view.
__global__ void __launch_bounds__(kLookThreads) lookAtBlocksKernel(MapView map, RenderJob job) {
  const SlotEntry& entry = map.slots[blockIdx.x];
  if (entry.key == kNoKey) return;
  const FrameView& frame = job.scene.frame;
  const BlockKey block_L = unpackKey(entry.key) - blockOfVoxel(frame.origin_voxel);
  if (!mayHaveCornersInView(frame, block_L)) return;
  const Vec3f first = toFloat(firstVoxelOfBlock(block_L));
  for (int i = static_cast<int>(threadIdx.x); i < kVoxelsPerBlock; i += kLookThreads) {
    bool known = false, behind = false, near = false;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      const Voxel voxel = map.voxels.record(entry.array[d])[i];
      if (!isKnown(voxel, job.scene.least_evidence)) continue;
      known = true;
      behind = behind || sdfOf(voxel) < 0.0f;
      near = near || isNearSurface(voxel);
    }
    noteBits(job.units.bits[blockIdx.x], i, known, behind);
    if (near) coverRanges(job, first + toFloat(voxelOffset(i)));
  }
}

__device__ RenderedPixel castPixelOf(const MapView& map, const RenderJob& job, const Pixel& pixel) {
  const TileRange& range =
      job.ranges[static_cast<size_t>(pixel.v / kRangeTileSide) * job.tile_columns +
                 pixel.u / kRangeTileSide];
  RayUnits units(map, job);
  return castPixel(job.scene.frame, pixel, range, job.painted != 0, units);
}

/// One thread per ray of the first lattice.
__global__ void __launch_bounds__(kRayThreads) castLatticeKernel(MapView map, RenderJob job) {
  const int32_t columns = (job.scene.frame.width + kFirstStride - 1) / kFirstStride;
  const auto i = static_cast<int32_t>(globalThread());
  const Pixel pixel{i % columns * kFirstStride, i / columns * kFirstStride};
  if (pixel.v >= job.scene.frame.height) return;
  job.pixels[pixelIndex(job.scene.frame, pixel)] = castPixelOf(map, job, pixel);
}

/// Fills a pixel from the rays of its square, if they meet a plane.
__device__ bool fillPixel(const RenderJob& job, const Pixel& pixel, int32_t stride) {
  const Pixel square = squareOf(pixel, stride);
  if (!hasRays(job.scene.frame, square, stride)) return false;
  const RaySquare rays = raysOf(
      square, stride, [&](const Pixel& at) { return job.pixels[pixelIndex(job.scene.frame, at)]; });
  if (!meetsPlane(job.scene.frame, square, stride, rays)) return false;
  job.pixels[pixelIndex(job.scene.frame, pixel)] = pixelBetween(rays, square, stride, pixel);
  return true;
}

__device__ Pixel pixelOfThread(const FrameView& frame) {
  const auto i = static_cast<int32_t>(globalThread());
  return {i % frame.width, i / frame.width};
}

/// One thread per pixel: fills squares of the first stride, else casts rays of the second lattice.
__global__ void __launch_bounds__(kRayThreads) fillFirstKernel(MapView map, RenderJob job) {
  const Pixel pixel = pixelOfThread(job.scene.frame);
  if (pixel.v >= job.scene.frame.height || isOnLattice(pixel, kFirstStride)) return;
  if (fillPixel(job, pixel, kFirstStride) || !isOnLattice(pixel, kSecondStride)) return;
  job.pixels[pixelIndex(job.scene.frame, pixel)] = castPixelOf(map, job, pixel);
}

/// One thread per pixel: what was left open.
__global__ void __launch_bounds__(kRayThreads) fillRestKernel(MapView map, RenderJob job) {
  const Pixel pixel = pixelOfThread(job.scene.frame);
  if (pixel.v >= job.scene.frame.height || isOnLattice(pixel, kSecondStride)) return;
  const Pixel square = squareOf(pixel, kFirstStride);
  if (hasRays(job.scene.frame, square, kFirstStride)) {
    const RaySquare rays = raysOf(square, kFirstStride, [&](const Pixel& at) {
      return job.pixels[pixelIndex(job.scene.frame, at)];
    });
    if (meetsPlane(job.scene.frame, square, kFirstStride, rays)) return;
  }
  if (fillPixel(job, pixel, kSecondStride)) return;
  job.pixels[pixelIndex(job.scene.frame, pixel)] = castPixelOf(map, job, pixel);
}

__global__ void __launch_bounds__(kThreads)
    splitPixelsKernel(RenderJob job, size_t count, float* depth_m, Vec3f* normals_C,
                      VertexColour* colours) {
  const size_t i = globalThread();
  if (i >= count) return;
  const RenderedPixel pixel = job.pixels[i];
  depth_m[i] = job.scene.frame.voxel_size_m * pixel.depth;
  normals_C[i] = pixel.normal_C;
  if (job.painted != 0) colours[i] = pixel.colour;
}

size_t pixelsOf(const FrameView& frame) {
  return static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
}

size_t tilesOf(const FrameView& frame) {
  return static_cast<size_t>(rangeTilesFor(frame.width)) *
         static_cast<size_t>(rangeTilesFor(frame.height));
}

size_t latticeRaysOf(const FrameView& frame) {
  const auto along = [](int32_t pixels) {
    return static_cast<size_t>((pixels + kFirstStride - 1) / kFirstStride);
  };
  return along(frame.width) * along(frame.height);
}

unsigned rayBlocksFor(size_t rays) {
  return static_cast<unsigned>((rays + kRayThreads - 1) / kRayThreads);
}

template <class T>
void copyTo(std::vector<T>& values, const PinnedBuffer<T>& pinned) {
  if (!values.empty()) std::memcpy(values.data(), pinned.data(), values.size() * sizeof(T));
}

}  // namespace

Renderer::Renderer(const MeshRules& rules, bool directional, const Stream& stream)
    : rules_(rules), directional_(directional), stream_(stream), units_(stream) {
  PinnedBuffer<MeshTables> tables(1);
  tables[0] = kMeshTables;
  tables_.reserveExactly(1, stream_);
  tables_.upload(tables.data(), 1, stream_);
  stream_.synchronize();
}

void Renderer::reserve(const FrameView& frame) {
  const size_t pixels = pixelsOf(frame);
  ranges_.reserveExactly(tilesOf(frame), stream_);
  pixels_.reserveExactly(pixels, stream_);
  depth_m_.reserveExactly(pixels, stream_);
  normals_C_.reserveExactly(pixels, stream_);
  colours_.reserveExactly(pixels, stream_);
  pinned_depth_m_.reserve(pixels);
  pinned_normals_C_.reserve(pixels);
  pinned_colours_.reserve(pixels);
}

void Renderer::cast(RenderJob job, const MapView& map) {
  const size_t tiles = tilesOf(job.scene.frame);
  clearRangesKernel<<<blocksFor(tiles), kThreads, 0, stream_.get()>>>(job, tiles);
  DTSDF_CHECK_LAUNCH("clearRangesKernel");
  job.units = units_.begin(map);
  if (map.slot_count > 0) {
    lookAtBlocksKernel<<<map.slot_count, kLookThreads, 0, stream_.get()>>>(map, job);
    DTSDF_CHECK_LAUNCH("lookAtBlocksKernel");
  }
  job.units = units_.make(job.scene, map);
  const unsigned lattice_blocks = rayBlocksFor(latticeRaysOf(job.scene.frame));
  castLatticeKernel<<<lattice_blocks, kRayThreads, 0, stream_.get()>>>(map, job);
  DTSDF_CHECK_LAUNCH("castLatticeKernel");
  const unsigned blocks = rayBlocksFor(pixelsOf(job.scene.frame));
  fillFirstKernel<<<blocks, kRayThreads, 0, stream_.get()>>>(map, job);
  DTSDF_CHECK_LAUNCH("fillFirstKernel");
  fillRestKernel<<<blocks, kRayThreads, 0, stream_.get()>>>(map, job);
  DTSDF_CHECK_LAUNCH("fillRestKernel");
}

void Renderer::handOut(const RenderJob& job, RenderedView& view) {
  const size_t pixels = pixelsOf(job.scene.frame);
  view.width = job.scene.frame.width;
  view.height = job.scene.frame.height;
  view.depth_m.resize(pixels);
  view.normals_C.resize(pixels);
  view.colours.resize(job.painted != 0 ? pixels : 0);
  splitPixelsKernel<<<blocksFor(pixels), kThreads, 0, stream_.get()>>>(
      job, pixels, depth_m_.data(), normals_C_.data(), colours_.data());
  DTSDF_CHECK_LAUNCH("splitPixelsKernel");
  depth_m_.download(pinned_depth_m_.data(), pixels, stream_);
  normals_C_.download(pinned_normals_C_.data(), pixels, stream_);
  colours_.download(pinned_colours_.data(), view.colours.size(), stream_);
  stream_.synchronize();
  copyTo(view.depth_m, pinned_depth_m_);
  copyTo(view.normals_C, pinned_normals_C_);
  copyTo(view.colours, pinned_colours_);
}

void Renderer::render(const ViewRequest& request, const MapView& map, RenderedView& view) {
  const FrameView& frame = request.frame;
  reserve(frame);
  const StageSpan span(stream_, Stage::kRender);
  const RenderJob job{{frame, tables_.data(), rules_, request.least_evidence, directional_},
                      {},
                      request.has_colours,
                      rangeTilesFor(frame.width),
                      ranges_.data(),
                      pixels_.data()};
  cast(job, map);
  handOut(job, view);
}

void Renderer::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t images = ranges_.bytes() + pixels_.bytes() + depth_m_.bytes() + normals_C_.bytes() +
                        colours_.bytes() + tables_.bytes() + units_.bytes();
  parts.push_back({"rendered view", MemoryKind::kScratch, images, images});
  const size_t staging =
      pinned_depth_m_.bytes() + pinned_normals_C_.bytes() + pinned_colours_.bytes();
  parts.push_back({"rendered view", MemoryKind::kStaging, staging, staging});
}

std::vector<NamedKernel> renderKernels() {
  return {DTSDF_NAMED_KERNEL(clearRangesKernel, 0),
          DTSDF_NAMED_KERNEL(lookAtBlocksKernel, 0, kLookThreads),
          DTSDF_NAMED_KERNEL(castLatticeKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(fillFirstKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(fillRestKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(splitPixelsKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
