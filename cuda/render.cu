#include "render.h"

#include <cstring>

#include "device_map.cuh"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Few threads a block: rays next to each other wait for memory together.
constexpr int kRayThreads = 64;

/// Of a block of threads that looks at a block of the map.
constexpr int kLookThreads = 128;

/// A corner of a unit: the arrays of its block, and its place in them.
struct UnitCorner {
  int32_t slot;  ///< -1: none.
  int32_t voxel;
};

/// Samples of a unit that are read when they are asked for: rays side by side read the same ones.
struct ReadSamples {
  using Real = float;
  using Bits = int32_t;
  const MapView& map;
  int32_t least_evidence;
  UnitCorner corner[kCubeCorners];
  uint32_t observed;

  __device__ __forceinline__ Sample at(int direction, int c) const {
    const int32_t array =
        corner[c].slot < 0 ? kNoArray : map.slots[corner[c].slot].array[direction];
    if (array == kNoArray) return {0.0f, 0.0f};
    return sampleOf(map.voxels.record(array)[corner[c].voxel], least_evidence);
  }
  __device__ __forceinline__ float sdf(int direction, int c) const { return at(direction, c).sdf; }
  __device__ __forceinline__ float weight(int direction, int c) const {
    return at(direction, c).weight;
  }
  __device__ __forceinline__ bool isObserved(int direction) const {
    return (observed >> direction & 1) != 0;
  }
  __device__ __forceinline__ bool maySpeak(int direction) const { return isObserved(direction); }
};

/// The units of the map as castRay() asks for them, made anew each time.
class RayUnits {
 public:
  __device__ RayUnits(const MapView& map, const RenderJob& job)
      : samples_{map, job.least_evidence, {}, 0}, job_(job) {}

  __device__ bool enter(const Vec3i& block_L) {
    const int32_t slot = slotOf(block_L + blockOfVoxel(job_.frame.origin_voxel));
    return slot >= 0 && directionsOfSlot(samples_.map.slots[slot]) != 0;
  }

  __device__ const RayUnit& find(const Vec3i& unit) {
    unit_ = make(unit);
    return unit_;
  }

  /// @pre The unit was the last that find() gave.
  __device__ UnitColours coloursAt(const Vec3i&) const {
    return coloursOf(unit_, [this](int d, int c) { return colouredAt(d, samples_.corner[c]); });
  }

 private:
  __device__ int32_t slotOf(const BlockKey& key) {
    if (!is_known_ || key != key_) {
      slot_ = isRepresentable(key) ? findSlot(samples_.map, packKey(key)) : -1;
      key_ = key;
      is_known_ = true;
    }
    return slot_;
  }

  __device__ UnitCorner cornerAt(const Vec3i& at) {
    constexpr int kMask = kBlockSide - 1;
    return {slotOf(blockOfVoxel(at)), voxelIndex(at.x & kMask, at.y & kMask, at.z & kMask)};
  }

  /// Directions that know a corner, a bit each.
  __device__ uint32_t knownAt(int c) const {
    uint32_t known = 0;
    for (int d = 0; d < kDirectionCount; ++d) {
      known |= (samples_.weight(d, c) > 0.0f ? 1u : 0u) << d;
    }
    return known;
  }

  __device__ RayUnit make(const Vec3i& unit) {
    const Vec3i first = unit + job_.frame.origin_voxel;
    samples_.observed = 0;
    for (int c = 0; c < kCubeCorners; ++c) {
      samples_.corner[c] = cornerAt(first + Vec3i{c & 1, c >> 1 & 1, c >> 2 & 1});
      const uint32_t known = knownAt(c);
      if (known == 0) return unitWithoutSurface(UnitState::kUnknown);
      samples_.observed |= known;
    }
    const Vec3f middle = toFloat(unit) + Vec3f{0.5f, 0.5f, 0.5f};
    return makeRayUnit(*job_.tables, job_.rules, samples_, job_.directional != 0,
                       middle - job_.frame.T_L_C.t);
  }

  __device__ ColouredSample colouredAt(int direction, const UnitCorner& corner) const {
    const MapView& map = samples_.map;
    const int32_t array = corner.slot < 0 ? kNoArray : map.slots[corner.slot].array[direction];
    if (array == kNoArray) return {{0.0f, 0.0f}, {0, 0, 0, 0}};
    const Sample sample = sampleOf(map.voxels.record(array)[corner.voxel], job_.least_evidence);
    const VoxelColour* colour = colourOf(map, array, corner.voxel);
    return {sample, colour == nullptr ? VoxelColour{0, 0, 0, 0} : *colour};
  }

  ReadSamples samples_;
  const RenderJob& job_;
  RayUnit unit_;
  BlockKey key_{0, 0, 0};
  int32_t slot_ = -1;
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

/// One block of threads per block of the map.
__global__ void __launch_bounds__(kLookThreads) findRangesKernel(MapView map, RenderJob job) {
  const SlotEntry& entry = map.slots[blockIdx.x];
  if (entry.key == kNoKey) return;
  const BlockKey block_L = unpackKey(entry.key) - blockOfVoxel(job.frame.origin_voxel);
  if (!mayReachView(job.frame, block_L)) return;
  const Vec3f first = toFloat(firstVoxelOfBlock(block_L));
  for (int i = static_cast<int>(threadIdx.x); i < kVoxelsPerBlock; i += kLookThreads) {
    bool is_near = false;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      is_near = is_near || isNearRay(map.voxels.record(entry.array[d])[i], job.least_evidence);
    }
    if (!is_near) continue;
    const TileCover cover = coverTiles(job.frame, first + toFloat(voxelOffset(i)));
    for (int32_t v = cover.v0; v <= cover.v1; ++v) {
      for (int32_t u = cover.u0; u <= cover.u1; ++u) {
        widen(job.ranges[static_cast<size_t>(v) * job.tile_columns + u], cover.range);
      }
    }
  }
}

__device__ RenderedPixel castPixelOf(const MapView& map, const RenderJob& job,
                                     const Pixel& pixel) {
  const TileRange& range =
      job.ranges[static_cast<size_t>(pixel.v / kRangeTileSide) * job.tile_columns +
                 pixel.u / kRangeTileSide];
  RayUnits units(map, job);
  return castPixel(job.frame, pixel, range, job.painted != 0, units);
}

/// One thread per ray of the first lattice.
__global__ void __launch_bounds__(kRayThreads) castLatticeKernel(MapView map, RenderJob job) {
  const int32_t columns = (job.frame.width + kFirstStride - 1) / kFirstStride;
  const auto i = static_cast<int32_t>(globalThread());
  const Pixel pixel{i % columns * kFirstStride, i / columns * kFirstStride};
  if (pixel.v >= job.frame.height) return;
  job.pixels[pixelIndex(job.frame, pixel)] = castPixelOf(map, job, pixel);
}

/// Fills a pixel from the rays of its square, if they meet a plane.
__device__ bool fillPixel(const RenderJob& job, const Pixel& pixel, int32_t stride) {
  const Pixel square = squareOf(pixel, stride);
  if (!hasRays(job.frame, square, stride)) return false;
  const RaySquare rays = raysOf(square, stride, [&](const Pixel& at) {
    return job.pixels[pixelIndex(job.frame, at)];
  });
  if (!meetsPlane(job.frame, square, stride, rays)) return false;
  job.pixels[pixelIndex(job.frame, pixel)] = pixelBetween(rays, square, stride, pixel);
  return true;
}

__device__ Pixel pixelOfThread(const FrameView& frame) {
  const auto i = static_cast<int32_t>(globalThread());
  return {i % frame.width, i / frame.width};
}

/// One thread per pixel: fills squares of the first stride, else casts rays of the second lattice.
__global__ void __launch_bounds__(kRayThreads) fillFirstKernel(MapView map, RenderJob job) {
  const Pixel pixel = pixelOfThread(job.frame);
  if (pixel.v >= job.frame.height || isOnLattice(pixel, kFirstStride)) return;
  if (fillPixel(job, pixel, kFirstStride) || !isOnLattice(pixel, kSecondStride)) return;
  job.pixels[pixelIndex(job.frame, pixel)] = castPixelOf(map, job, pixel);
}

/// One thread per pixel: what was left open.
__global__ void __launch_bounds__(kRayThreads) fillRestKernel(MapView map, RenderJob job) {
  const Pixel pixel = pixelOfThread(job.frame);
  if (pixel.v >= job.frame.height || isOnLattice(pixel, kSecondStride)) return;
  const Pixel square = squareOf(pixel, kFirstStride);
  if (hasRays(job.frame, square, kFirstStride)) {
    const RaySquare rays = raysOf(square, kFirstStride, [&](const Pixel& at) {
      return job.pixels[pixelIndex(job.frame, at)];
    });
    if (meetsPlane(job.frame, square, kFirstStride, rays)) return;
  }
  if (fillPixel(job, pixel, kSecondStride)) return;
  job.pixels[pixelIndex(job.frame, pixel)] = castPixelOf(map, job, pixel);
}

__global__ void __launch_bounds__(kThreads)
    splitPixelsKernel(RenderJob job, size_t count, float* depth_m, Vec3f* normals_C,
                      VertexColour* colours) {
  const size_t i = globalThread();
  if (i >= count) return;
  const RenderedPixel pixel = job.pixels[i];
  depth_m[i] = job.frame.voxel_size_m * pixel.depth;
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
    : rules_(rules), directional_(directional), stream_(stream) {
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

void Renderer::cast(const RenderJob& job, const MapView& map) {
  const size_t tiles = tilesOf(job.frame);
  clearRangesKernel<<<blocksFor(tiles), kThreads, 0, stream_.get()>>>(job, tiles);
  DTSDF_CHECK_LAUNCH("clearRangesKernel");
  if (map.slot_count > 0) {
    findRangesKernel<<<map.slot_count, kLookThreads, 0, stream_.get()>>>(map, job);
    DTSDF_CHECK_LAUNCH("findRangesKernel");
  }
  castLatticeKernel<<<rayBlocksFor(latticeRaysOf(job.frame)), kRayThreads, 0, stream_.get()>>>(
      map, job);
  DTSDF_CHECK_LAUNCH("castLatticeKernel");
  const unsigned blocks = rayBlocksFor(pixelsOf(job.frame));
  fillFirstKernel<<<blocks, kRayThreads, 0, stream_.get()>>>(map, job);
  DTSDF_CHECK_LAUNCH("fillFirstKernel");
  fillRestKernel<<<blocks, kRayThreads, 0, stream_.get()>>>(map, job);
  DTSDF_CHECK_LAUNCH("fillRestKernel");
}

void Renderer::handOut(const RenderJob& job, RenderedView& view) {
  const size_t pixels = pixelsOf(job.frame);
  view.width = job.frame.width;
  view.height = job.frame.height;
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
  const RenderJob job{frame,          tables_.data(),
                      rules_,         request.least_evidence,
                      directional_,   request.has_colours,
                      rangeTilesFor(frame.width), ranges_.data(),
                      pixels_.data()};
  cast(job, map);
  handOut(job, view);
}

void Renderer::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t images = ranges_.bytes() + pixels_.bytes() + depth_m_.bytes() +
                        normals_C_.bytes() + colours_.bytes() + tables_.bytes();
  parts.push_back({"rendered view", MemoryKind::kScratch, images, images});
  const size_t staging =
      pinned_depth_m_.bytes() + pinned_normals_C_.bytes() + pinned_colours_.bytes();
  parts.push_back({"rendered view", MemoryKind::kStaging, staging, staging});
}

std::vector<NamedKernel> renderKernels() {
  return {DTSDF_NAMED_KERNEL(clearRangesKernel, 0),
          DTSDF_NAMED_KERNEL(findRangesKernel, 0, kLookThreads),
          DTSDF_NAMED_KERNEL(castLatticeKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(fillFirstKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(fillRestKernel, 0, kRayThreads),
          DTSDF_NAMED_KERNEL(splitPixelsKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
