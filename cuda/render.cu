#include "render.h"

#include <algorithm>

#include "backend/frame_check.h"
#include "device_map.cuh"
#include "kernels/meshing/gap.h"
#include "launch.h"
#include "runtime/device.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kThreadBlocksPerProcessor = 8;
constexpr MeshSize kFirstMeshes = {1 << 17, 1 << 18};

/// Number of threads that draw a triangle: one per pixel of a patch.
constexpr int kPatchWidth = 4, kPatchHeight = 2, kLanes = kPatchWidth * kPatchHeight;
static_assert(4 * kLanes == 32, "a warp draws large triangles, in patches twice as wide and high");
constexpr int kMaxPatches = 8;  ///< Triangles with more patches are large.

/// One thread per slot. Selects the blocks that may be visible in a view, and all blocks whose
/// marching cubes cases (labels) are needed to mesh these.
__global__ void __launch_bounds__(kThreads)
    selectInViewKernel(MapView map, RenderJob job, MeshView drawn, MeshView labelled) {
  const size_t slot = globalThread();
  if (slot >= map.slot_count || map.slots[slot].key == kNoKey) return;
  const BlockKey block_L = unpackKey(map.slots[slot].key) - blockOfVoxel(job.frame.origin_voxel);
  const auto select = [&](const MeshView& mesh, float reach) {
    if (!mayReachView(job.frame, block_L, reach)) return;
    mesh.slots[atomicAdd(&mesh.totals->reached, 1u)] = static_cast<int32_t>(slot);
  };
  select(drawn, kDrawnReach);
  select(labelled, kLabelledReach);
}

/// A block's mesh, and buffers for drawing it.
struct DrawnBlock {
  const BlockVertex* vertices;
  const BlockTriangle* triangles;
  const VertexColour* colours;
  Vec3i* shares;
  ProjectedVertex* seen;
};

/// Projects a block's vertices, and computes their normals from the block's triangles. All threads
/// of the thread block must call it.
__device__ void projectVertices(const RenderJob& job, const MeshRecord& record,
                                const DrawnBlock& block) {
  const Vec3f first = toFloat(firstVoxelOfBlock(unpackKey(record.key)) - job.frame.origin_voxel);
  for (uint32_t i = threadIdx.x; i < record.vertices; i += blockDim.x) {
    block.shares[i] = {0, 0, 0};
    block.seen[i] = projectVertex(job.frame, first + block.vertices[i].position);
  }
  __syncthreads();
  for (uint32_t i = threadIdx.x; i < record.triangles; i += blockDim.x) {
    const uint16_t* corner = block.triangles[i].vertex;
    const Vec3i share =
        normalShare(block.vertices[corner[0]].position, block.vertices[corner[1]].position,
                    block.vertices[corner[2]].position);
    for (int k = 0; k < 3; ++k) {
      atomicAdd(&block.shares[corner[k]].x, share.x);
      atomicAdd(&block.shares[corner[k]].y, share.y);
      atomicAdd(&block.shares[corner[k]].z, share.z);
    }
  }
  __syncthreads();
  for (uint32_t i = threadIdx.x; i < record.vertices; i += blockDim.x) {
    const Vec3i sum{readShared(&block.shares[i].x), readShared(&block.shares[i].y),
                    readShared(&block.shares[i].z)};
    block.seen[i].normal_C = normalOfShares(job.frame, sum);
  }
  __syncthreads();
}

__device__ void drawKey(ViewKey& pixel, ViewKey key) {
  if (key < readShared(&pixel)) {
    atomicMin(reinterpret_cast<unsigned long long*>(&pixel), static_cast<unsigned long long>(key));
  }
}

struct SeenTriangle {
  const uint16_t* corner;
  ProjectedVertex a, b, c;
  DrawnTriangle drawn;

  __device__ bool isLarge() const {
    return drawn.is_drawn &&
           (drawn.u1 - drawn.u0 + 1) * (drawn.v1 - drawn.v0 + 1) > kMaxPatches * kLanes;
  }
};

__device__ SeenTriangle seeTriangle(const RenderJob& job, const DrawnBlock& block,
                                    const uint16_t* corner) {
  SeenTriangle triangle{
      corner, block.seen[corner[0]], block.seen[corner[1]], block.seen[corner[2]], {}};
  triangle.drawn = drawTriangle(job.frame, triangle.a, triangle.b, triangle.c);
  return triangle;
}

/// Fills a triangle with kWidth x kHeight threads, one for each pixel of a patch.
template <int kWidth, int kHeight>
__device__ void fillTriangle(const RenderJob& job, const DrawnBlock& block,
                             const SeenTriangle& triangle) {
  const auto& [corner, a, b, c, drawn] = triangle;
  if (!drawn.is_drawn) return;
  const int lane = static_cast<int>(threadIdx.x) % (kWidth * kHeight);
  for (int32_t v = drawn.v0 + lane / kWidth; v <= drawn.v1; v += kHeight) {
    for (int32_t u = drawn.u0 + lane % kWidth; u <= drawn.u1; u += kWidth) {
      const CornerWeights weights = weightsAt(drawn, u - drawn.u0, v - drawn.v0);
      if (!covers(drawn, weights)) continue;
      const TrianglePlace place = placeOn(a, b, c, weights);
      const auto pixel = static_cast<size_t>(pixelIndex(job.frame, {u, v}));
      if (!mayBeBefore(place.depth, readShared(&job.surfaces[pixel]))) continue;
      drawKey(job.surfaces[pixel], viewKey(place.depth, normalAt(a, b, c, place)));
      if (job.painted == 0) continue;
      drawKey(job.colours[pixel],
              viewKey(place.depth, colourAt(block.colours[corner[0]], block.colours[corner[1]],
                                            block.colours[corner[2]], place)));
    }
  }
}

/// Draws one triangle with each group of kLanes threads. Large triangles are drawn by the whole
/// warp, so that no group is idle. All threads of the warp must call it.
__device__ void drawTriangles(const RenderJob& job, const DrawnBlock& block, uint32_t first,
                              uint32_t count) {
  const uint32_t own = first + threadIdx.x % 32 / kLanes;
  SeenTriangle triangle{};
  if (own < count && !isMarkedGap(block.triangles[own].vertex)) {
    triangle = seeTriangle(job, block, block.triangles[own].vertex);
  }
  const bool is_large = triangle.isLarge();
  if (!is_large) fillTriangle<kPatchWidth, kPatchHeight>(job, block, triangle);
  for (unsigned large = __ballot_sync(~0u, is_large); large != 0;) {
    const int lane = __ffs(static_cast<int>(large)) - 1;  // the first of its kLanes threads
    large &= ~(((1u << kLanes) - 1u) << lane);
    const uint32_t other = first + static_cast<uint32_t>(lane / kLanes);
    fillTriangle<2 * kPatchWidth, 2 * kPatchHeight>(
        job, block, seeTriangle(job, block, block.triangles[other].vertex));
  }
}

/// One thread block per block in view, in a grid-stride loop, with kLanes threads per triangle.
/// Blocks whose meshes did not fit into the buffers are drawn in the next attempt.
__global__ void __launch_bounds__(kThreads) drawBlocksKernel(RenderJob job, MeshView mesh) {
  const uint32_t count = mesh.totals->reached;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const MeshRecord record = mesh.records[b];
    if (record.triangles == 0 || record.first_vertex + record.vertices > mesh.capacity.vertices ||
        record.first_triangle + record.triangles > mesh.capacity.triangles) {
      continue;  // all threads of the block, or none
    }
    const DrawnBlock block{mesh.vertices + record.first_vertex,
                           mesh.triangles + record.first_triangle,
                           mesh.colours == nullptr ? nullptr : mesh.colours + record.first_vertex,
                           job.shares + record.first_vertex, job.seen + record.first_vertex};
    projectVertices(job, record, block);
    for (uint32_t first = threadIdx.x / 32 * (32 / kLanes); first < record.triangles;
         first += blockDim.x / kLanes) {
      drawTriangles(job, block, first, record.triangles);
    }
  }
}

/// One thread per pixel. Converts keys (depth with a normal or colour) to the images of a view.
__global__ void showKeysKernel(RenderJob job, size_t pixels, float* depth_m, Vec3f* normals_C,
                               VertexColour* colours) {
  const size_t i = globalThread();
  if (i >= pixels) return;
  depth_m[i] = job.frame.voxel_size_m * depthOf(job.surfaces[i]);
  normals_C[i] = normalOf(job.surfaces[i]);
  if (job.painted != 0) colours[i] = dtsdf::colourOf(job.colours[i]);
}

size_t pixelsOf(const FrameView& frame) {
  return static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
}

}  // namespace

Renderer::Renderer(const MeshSettings& rules, bool directional, const Stream& stream)
    : rules_(rules),
      directional_(directional),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      stream_(stream) {}

/// Memory is allocated when the first view is rendered, since many maps are never rendered.
void Renderer::reserveMeshes(const MeshSize& size) {
  if (size.vertices > vertices_.capacity()) {
    const size_t room = size.vertices + size.vertices / 2;
    vertex_colours_.reserveExactly(room, stream_);
    shares_.reserveExactly(room, stream_);
    seen_.reserveExactly(room, stream_);
    vertices_.reserveExactly(room, stream_);  // last, as only its capacity is tested
  }
  triangles_.reserve(size.triangles, stream_);
  totals_.reserveExactly(1, stream_);
  labelled_.reserveExactly(1, stream_);
  pinned_totals_.reserve(1);
  no_dirty_.reserveExactly(1, stream_);
  no_dirty_.zero(stream_);
}

MeshView Renderer::meshView(const ViewRequest& request) {
  MeshView mesh = {};
  mesh.totals = totals_.data();
  mesh.host_totals = pinned_totals_.data();
  mesh.slots = slots_.data();
  mesh.records = records_.data();
  mesh.vertices = vertices_.data();
  mesh.triangles = triangles_.data();
  mesh.colours = request.has_colours ? vertex_colours_.data() : nullptr;
  mesh.capacity = {static_cast<uint32_t>(vertices_.capacity()),
                   static_cast<uint32_t>(triangles_.capacity())};
  mesh.min_evidence = request.min_evidence;
  mesh.directional = directional_;
  mesh.rules = rules_;
  return mesh;
}

/// Enqueues all kernels and the download of the images.
void Renderer::draw(const ViewRequest& request, const MapView& map, bool is_labelled) {
  const RenderJob job{request.frame, request.has_colours, shares_.data(),
                      seen_.data(),  surfaces_.data(),    colours_.data()};
  static_assert(kNothingSeen == ~ViewKey{0}, "the fill writes bytes of 0xff");
  surfaces_.fill(0xff, stream_);
  if (request.has_colours) colours_.fill(0xff, stream_);
  pinned_totals_[0] = {};
  if (map.slot_count > 0) drawBlocks(request, job, map, is_labelled);
  const size_t pixels = pixelsOf(request.frame);
  launch("showKeysKernel", showKeysKernel, blocksFor(pixels), kThreads, 0, stream_, job, pixels,
         depth_.data(), normals_.data(), view_colours_.data());
  for (size_t band = 0; band < kBands; ++band) {
    const size_t begin = pixels * band / kBands, end = pixels * (band + 1) / kBands;
    depth_.downloadPart(pinned_depth_.data(), begin, end, stream_);
    normals_.downloadPart(pinned_normals_.data(), begin, end, stream_);
    if (request.has_colours) {
      view_colours_.downloadPart(pinned_colours_.data(), begin, end, stream_);
    }
    stream_.record(drawn_[band]);
  }
}

void Renderer::drawBlocks(const ViewRequest& request, const RenderJob& job, const MapView& map,
                          bool is_labelled) {
  const MeshView mesh = meshView(request);
  MeshView labelled = mesh;
  labelled.slots = labelled_slots_.data();
  labelled.totals = labelled_.data();
  MapView unchanged = map;
  unchanged.dirty.count = no_dirty_.data();
  totals_.zero(stream_);
  labelled_.zero(stream_);
  launch("selectInViewKernel", selectInViewKernel, blocksFor(map.slot_count), kThreads, 0, stream_,
         unchanged, job, mesh, labelled);
  if (!is_labelled) indexBlocks(unchanged, labelled, thread_blocks_, stream_);
  makeMeshes(unchanged, mesh, thread_blocks_, stream_);
  if (request.has_colours) colourVertices(unchanged, mesh, thread_blocks_, stream_);
  launch("drawBlocksKernel", drawBlocksKernel, thread_blocks_, kThreads, 0, stream_, job, mesh);
}

/// Copies the images with several threads, each band as soon as it has been downloaded.
void Renderer::fill(const ViewRequest& request, RenderedView& view) const {
  constexpr size_t kPixelsOfThread = 1 << 16, kMaxThreads = 4;
  const size_t pixels = pixelsOf(request.frame);
  resizeView(request.frame, request.has_colours, view);
  const size_t threads = std::clamp<size_t>(pixels / kPixelsOfThread, 1, kMaxThreads);
  const int device = currentDevice();
  parallelFor(kBands, static_cast<int>(threads), [&](size_t band) {
    useDevice(device);
    drawn_[band].wait();
    const size_t begin = pixels * band / kBands, end = pixels * (band + 1) / kBands;
    const auto copy = [&](const auto& pinned, auto& image) {
      std::copy(pinned.data() + begin, pinned.data() + end, image.data() + begin);
    };
    copy(pinned_depth_, view.depth_m);
    copy(pinned_normals_, view.normals_C);
    if (request.has_colours) copy(pinned_colours_, view.colours);
  });
}

void Renderer::render(const ViewRequest& request, const MapView& map, bool is_labelled,
                      RenderedView& view) {
  const size_t pixels = pixelsOf(request.frame);
  surfaces_.reserveExactly(pixels, stream_);
  depth_.reserveExactly(pixels, stream_);
  normals_.reserveExactly(pixels, stream_);
  pinned_depth_.reserve(pixels);
  pinned_normals_.reserve(pixels);
  if (request.has_colours) {
    colours_.reserveExactly(pixels, stream_);
    view_colours_.reserveExactly(pixels, stream_);
    pinned_colours_.reserve(pixels);
  }
  slots_.reserve(map.slot_count, stream_);
  labelled_slots_.reserve(map.slot_count, stream_);
  records_.reserve(map.slot_count, stream_);
  reserveMeshes(kFirstMeshes);
  draw(request, map, is_labelled);
  fill(request, view);
  const MeshSize size = pinned_totals_[0].size;
  if (size.vertices <= vertices_.capacity() && size.triangles <= triangles_.capacity()) return;
  reserveMeshes(size);
  draw(request, map, true);
  fill(request, view);
}

void Renderer::addMemory(MapperMemory& memory) const {
  addScratch(memory, totals_, labelled_, no_dirty_, slots_, labelled_slots_, records_, vertices_,
             vertex_colours_, shares_, seen_, triangles_, surfaces_, colours_, depth_, normals_,
             view_colours_, pinned_depth_, pinned_normals_, pinned_colours_);
}

}  // namespace gpu
}  // namespace dtsdf
