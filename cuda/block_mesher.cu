#include "block_mesher.h"

#include <algorithm>
#include <cub/block/block_scan.cuh>

#include "device_map.cuh"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/device.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kUnitsPerThread = kVoxelsPerBlock / kThreads;
constexpr int kEdgeWords = (kLatticeEdges + 31) / 32;
static_assert(kEdgeWords <= kThreads, "one thread per word of edge bits");

using Scan = cub::BlockScan<uint32_t, kThreads>;

/// The voxel arrays that the corners of a block's units lie in; null where there is none.
struct LatticeArrays {
  const Voxel* array[kLatticeBlocks][kDirectionCount];

  __device__ Voxel sample(int lattice_index, int direction) const {
    const LatticeSource source = latticeSource(lattice_index);
    const Voxel* voxels = array[source.block][direction];
    return voxels == nullptr ? Voxel{0.0f, 0.0f} : voxels[source.voxel];
  }
};

__device__ BlockKey keyOfSlot(const MapView& map, int32_t slot) {
  return unpackKey(map.slots[slot].key);
}

/// Done by one thread for each n. @return the directions that the n-th block has.
__device__ uint32_t findLatticeArrays(const MapView& map, const BlockKey& key, int n,
                                      LatticeArrays& arrays) {
  const int32_t slot = findSlot(map, packKey(key + latticeBlockOffset(n)));
  uint32_t present = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[d];
    arrays.array[n][d] = array == kNoArray ? nullptr : map.voxels.record(array);
    present |= (array == kNoArray ? 0u : 1u) << d;
  }
  return present;
}

/// Enters a block into the extraction, unless it is there. @return whether it is new.
__device__ bool takeUp(const MapView& map, const MeshView& mesh, int32_t slot) {
  return atomicExch(&map.mesh_stamp[slot], mesh.stamp) != mesh.stamp;
}

/// One thread per dirty block and reach, in strides: their number is known on the device only.
__global__ void reachBlocksKernel(MapView map, MeshView mesh) {
  const size_t count = static_cast<size_t>(*map.dirty_count) * kUnitReach;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const int32_t dirty = map.dirty_slots[i / kUnitReach];
    const int n = static_cast<int>(i % kUnitReach);
    if (n == 0) map.dirty[dirty] = 0;
    const int32_t slot = findSlot(map, packKey(keyOfSlot(map, dirty) + unitReachOffset(n)));
    if (slot < 0 || !takeUp(map, mesh, slot)) continue;
    mesh.slots[atomicAdd(&mesh.counters->reached, 1u)] = slot;
  }
}

/// The samples at a block's lattice, in shared memory, direction by direction.
struct SharedLattice {
  Voxel* samples;
  uint32_t present;

  __device__ void collect(const LatticeArrays& arrays) {
    for (int i = threadIdx.x; i < kLatticeCorners; i += blockDim.x) {
      Voxel sample[kDirectionCount];
#pragma unroll  // reads all before it waits for any
      for (int d = 0; d < kDirectionCount; ++d) {
        if (present >> d & 1) sample[d] = arrays.sample(i, d);
      }
#pragma unroll
      for (int d = 0; d < kDirectionCount; ++d) {
        if (present >> d & 1) samples[d * kLatticeCorners + i] = sample[d];
      }
    }
  }

  __device__ UnitSamples unit(const Vec3i& unit) const {
    UnitSamples result = {};
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(present >> d & 1)) continue;
      for (int c = 0; c < kCubeCorners; ++c) {
        result.corner[d][c] = samples[d * kLatticeCorners +
                                      latticeIndex(unit.x + (c & 1), unit.y + (c >> 1 & 1),
                                                   unit.z + (c >> 2 & 1))];
      }
    }
    return result;
  }
};

/// Indexes this thread's units of a block. @return whether any index changed.
__device__ int updateIndices(const MeshView& mesh, const SharedLattice& lattice,
                             UnitIndices* stored) {
  int changed = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    const UnitSamples samples = lattice.unit(voxelOffset(i));
    const UnitIndices indices = indexUnit(*mesh.tables, samples, mesh.directional != 0);
    changed |= indices.sheet[0] != stored[i].sheet[0] || indices.sheet[1] != stored[i].sheet[1];
    stored[i] = indices;
  }
  return changed;
}

/// One block of threads per reached block, in strides.
__global__ void __launch_bounds__(kThreads) indexBlocksKernel(MapView map, MeshView mesh) {
  extern __shared__ Voxel samples[];
  __shared__ LatticeArrays arrays;
  __shared__ uint32_t present;
  if (blockIdx.x == 0 && threadIdx.x == 0) *map.dirty_count = 0;  // taken up by now
  const uint32_t reached = mesh.counters->reached;
  for (uint32_t b = blockIdx.x; b < reached; b += gridDim.x) {
    const int32_t slot = mesh.slots[b];
    const BlockKey key = keyOfSlot(map, slot);
    if (threadIdx.x == 0) present = 0;
    __syncthreads();
    if (threadIdx.x < kLatticeBlocks) {
      atomicOr(&present, findLatticeArrays(map, key, threadIdx.x, arrays));
    }
    __syncthreads();
    SharedLattice lattice{samples, present};
    lattice.collect(arrays);
    __syncthreads();
    const int changed =
        __syncthreads_or(updateIndices(mesh, lattice, map.unit_indices.record(slot)));
    if (!changed || threadIdx.x >= kRegularisationReach) continue;
    const int32_t adjoining = findSlot(map, packKey(key + regularisationOffset(threadIdx.x)));
    if (adjoining < 0 || !takeUp(map, mesh, adjoining)) continue;
    mesh.slots[reached + atomicAdd(&mesh.counters->adjoining, 1u)] = adjoining;
  }
}

/// Indices of the units in a block and across its faces; null where there is no block.
struct IndexNeighbourhood {
  const UnitIndices* block[kRegularisationReach];

  __device__ UnitIndices operator()(const Vec3i& unit) const {
    const UnitSource source = unitSource(unit);
    const UnitIndices* indices = block[source.block];
    return indices == nullptr ? UnitIndices{{0, 0}} : indices[source.unit];
  }
};

/// Which of a block's lattice edges carry a vertex: the vertices in order of their edges.
struct EdgeSet {
  uint32_t bits[kEdgeWords];
  uint32_t rank[kEdgeWords];  ///< Vertices before each word.

  __device__ void add(int edge) { atomicOr(&bits[edge / 32], 1u << (edge % 32)); }
  __device__ uint32_t vertexOf(int edge) const {
    return rank[edge / 32] + __popc(bits[edge / 32] & ((1u << (edge % 32)) - 1u));
  }
};

/// Calls visit(lattice edge) for the corners of a unit's triangles, in canonical order.
template <class Visit>
__device__ void visitTriangleEdges(const MeshTables& tables, const UnitIndices& settled,
                                   const Vec3i& unit, const Visit& visit) {
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = settled.sheet[s];
    for (int k = 0; k < 3 * tables.triangle_count[index]; ++k) {
      visit(unitEdge(unit, tables.triangle_edge[index][k], index));
    }
  }
}

__device__ BlockVertex makeVertex(const LatticeArrays& arrays, int edge, bool directional) {
  const int lower = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const int only = directionOnEdge(0, axis, facing, directional);  // of an undirected map
  EdgeSamples samples = {};
#pragma unroll  // so that the samples are in registers, and read all at once
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!directional && d != only) continue;
    samples.lower[d] = arrays.sample(lower, directional ? d : 0);
    samples.upper[d] = arrays.sample(lower + latticeStride(axis), directional ? d : 0);
  }
  return {vertexPosition(edge, edgeOffset(samples, axis, facing)), static_cast<uint32_t>(edge)};
}

struct MeshBlockShared {
  LatticeArrays arrays;
  IndexNeighbourhood indices;
  EdgeSet edges;
  uint16_t vertex_edge[kLatticeEdges];  ///< Edge of each vertex.
  MeshRecord record;
  typename Scan::TempStorage scan;
};

__device__ void gatherBlock(const MapView& map, const BlockKey& key, MeshBlockShared& shared) {
  const int t = threadIdx.x;
  if (t < kLatticeBlocks) findLatticeArrays(map, key, t, shared.arrays);
  const int n = t - 32;  // by another warp
  if (n >= 0 && n < kRegularisationReach) {
    const int32_t slot = findSlot(map, packKey(key + regularisationOffset(n)));
    shared.indices.block[n] = slot < 0 ? nullptr : map.unit_indices.record(slot);
  }
  if (t < kEdgeWords) shared.edges.bits[t] = 0;
  __syncthreads();
}

/// Settles this thread's units and enters their edges. @return their number of triangles.
__device__ uint32_t settleUnits(const MeshView& mesh, MeshBlockShared& shared,
                                UnitIndices (&settled)[kUnitsPerThread]) {
  uint32_t triangles = 0;
  for (int k = 0; k < kUnitsPerThread; ++k) {
    const Vec3i unit = voxelOffset(threadIdx.x * kUnitsPerThread + k);
    settled[k] = settleUnit(shared.indices, unit);
    for (int s = 0; s < kMaxSheets; ++s) {
      triangles += mesh.tables->triangle_count[settled[k].sheet[s]];
    }
    visitTriangleEdges(*mesh.tables, settled[k], unit,
                       [&](int edge) { shared.edges.add(edge); });
  }
  return triangles;
}

/// Numbers the vertices on the edges of one word of bits.
__device__ void listEdges(int word, uint32_t rank, MeshBlockShared& shared) {
  shared.edges.rank[word] = rank;
  for (uint32_t bits = shared.edges.bits[word]; bits != 0; bits &= bits - 1) {
    shared.vertex_edge[rank++] = static_cast<uint16_t>(32 * word + __ffs(bits) - 1);
  }
}

/// Counts a block's vertices and triangles, and takes room for them; the order of the blocks in
/// that room is free. @return this thread's first triangle in the block.
__device__ uint32_t takeRoom(const MeshView& mesh, uint32_t own_triangles,
                             MeshBlockShared& shared) {
  constexpr uint32_t kLow = 0xffff;
  static_assert(kLatticeEdges <= kLow && kVoxelsPerBlock * kMaxSheets * kMaxTriangles <= kLow,
                "one scan counts both, in half a word each");
  __syncthreads();  // of the edges' bits
  const int t = threadIdx.x;
  const uint32_t in_word = t < kEdgeWords ? __popc(shared.edges.bits[t]) : 0;
  uint32_t before, total;
  Scan(shared.scan).ExclusiveSum(in_word << 16 | own_triangles, before, total);
  if (t == kThreads - 1) {  // of a warp without words
    const uint32_t vertices = total >> 16, triangles = total & kLow;
    MeshRecord& record = shared.record;
    record.vertices = vertices;
    record.triangles = triangles;
    record.first_vertex = vertices == 0 ? 0 : atomicAdd(&mesh.size->vertices, vertices);
    record.first_triangle = triangles == 0 ? 0 : atomicAdd(&mesh.size->triangles, triangles);
  }
  if (t < kEdgeWords) listEdges(t, before >> 16, shared);
  __syncthreads();
  return before & kLow;
}

__device__ void writeMesh(const MeshView& mesh, const UnitIndices (&settled)[kUnitsPerThread],
                          uint32_t first_triangle, const MeshBlockShared& shared) {
  const MeshRecord& record = shared.record;
  for (uint32_t i = threadIdx.x; i < record.vertices; i += blockDim.x) {
    mesh.vertices[record.first_vertex + i] =
        makeVertex(shared.arrays, shared.vertex_edge[i], mesh.directional != 0);
  }
  uint16_t* corner = mesh.triangles[record.first_triangle + first_triangle].vertex;
  for (int k = 0; k < kUnitsPerThread; ++k) {
    const Vec3i unit = voxelOffset(threadIdx.x * kUnitsPerThread + k);
    visitTriangleEdges(*mesh.tables, settled[k], unit, [&](int edge) {
      *corner++ = static_cast<uint16_t>(shared.edges.vertexOf(edge));
    });
  }
}

/// One block of threads per block to mesh, in strides. What does not fit is counted, not written.
__global__ void __launch_bounds__(kThreads) makeMeshesKernel(MapView map, MeshView mesh) {
  __shared__ MeshBlockShared shared;
  const uint32_t count = mesh.counters->reached + mesh.counters->adjoining;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const int32_t slot = mesh.slots[b];
    gatherBlock(map, keyOfSlot(map, slot), shared);
    UnitIndices settled[kUnitsPerThread];
    const uint32_t first_triangle = takeRoom(mesh, settleUnits(mesh, shared, settled), shared);
    const MeshRecord& record = shared.record;
    if (threadIdx.x == 0) {
      shared.record.key = map.slots[slot].key;
      shared.record.slot = slot;
      shared.record.unused = 0;
      mesh.records[b] = shared.record;
    }
    if (record.first_vertex + record.vertices <= mesh.capacity.vertices &&
        record.first_triangle + record.triangles <= mesh.capacity.triangles) {
      writeMesh(mesh, settled, first_triangle, shared);
    }
    __syncthreads();
  }
}

constexpr size_t kFirstVertices = 1 << 16, kFirstTriangles = 1 << 17;
constexpr int kThreadBlocksPerProcessor = 8;

}  // namespace

BlockMesher::BlockMesher(bool directional)
    : directional_(directional),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      tables_(1),
      totals_(1),
      pinned_totals_(1),
      vertices_(kFirstVertices),
      triangles_(kFirstTriangles) {
  pinned_totals_[0] = {};
  PinnedBuffer<MeshTables> tables(1);
  tables[0] = kMeshTables;
  tables_.upload(tables.data(), 1, stream_);
  stream_.synchronize();
}

MeshView BlockMesher::view() const {
  MeshView view;
  view.tables = tables_.data();
  view.counters = &totals_.data()->blocks;
  view.size = &totals_.data()->size;
  view.slots = slots_.data();
  view.records = records_.data();
  view.vertices = vertices_.data();
  view.triangles = triangles_.data();
  view.capacity = {static_cast<uint32_t>(vertices_.capacity()),
                   static_cast<uint32_t>(triangles_.capacity())};
  view.stamp = stamp_;
  view.directional = directional_;
  return view;
}

void BlockMesher::begin(const MapView& map, const Event& map_ready, size_t most_dirty) {
  map_ = map;
  stream_.waitFor(map_ready);
  stream_.record(begun_);
  const size_t most_blocks =
      std::min<size_t>(map.slot_count, most_dirty * kUnitReach * kRegularisationReach);
  slots_.reserve(most_blocks, stream_);
  records_.reserve(most_blocks, stream_);
  totals_.zero(stream_);
  ++stamp_;
  holdForProfile(stream_);
  {
    const StageSpan span(stream_, Stage::kIndex);
    reachBlocksKernel<<<thread_blocks_, kThreads, 0, stream_.get()>>>(map_, view());
    DTSDF_CHECK_LAUNCH("reachBlocksKernel");
  }
  indexBlocks();
  enqueueMeshes();
  state_ = State::kBegun;
}

void BlockMesher::indexBlocks() {
  const StageSpan span(stream_, Stage::kIndex);
  const size_t lattice_bytes =
      (directional_ ? kDirectionCount : 1) * kLatticeCorners * sizeof(Voxel);
  indexBlocksKernel<<<thread_blocks_, kThreads, lattice_bytes, stream_.get()>>>(map_, view());
  DTSDF_CHECK_LAUNCH("indexBlocksKernel");
}

void BlockMesher::enqueueMeshes() {
  {
    const StageSpan span(stream_, Stage::kMake);
    makeMeshesKernel<<<thread_blocks_, kThreads, 0, stream_.get()>>>(map_, view());
    DTSDF_CHECK_LAUNCH("makeMeshesKernel");
  }
  totals_.download(pinned_totals_.data(), 1, stream_);
  stream_.record(counted_);
}

void BlockMesher::settle() {
  if (state_ != State::kBegun) return;
  counted_.wait();
  const MeshSize size = pinned_totals_[0].size;
  if (size.vertices > vertices_.capacity() || size.triangles > triangles_.capacity()) {
    vertices_.reserve(size.vertices, stream_);
    triangles_.reserve(size.triangles, stream_);
    DTSDF_CHECK_CUDA(cudaMemsetAsync(&totals_.data()->size, 0, sizeof(MeshSize), stream_.get()));
    enqueueMeshes();
    counted_.wait();
  }
  fetch();
  state_ = State::kSettled;
}

void BlockMesher::fetch() {
  const MeshSize size = pinned_totals_[0].size;
  pinned_records_.reserve(recordCount());
  pinned_vertices_.reserve(size.vertices);
  pinned_triangles_.reserve(size.triangles);
  const StageSpan span(stream_, Stage::kFetch);
  records_.download(pinned_records_.data(), recordCount(), stream_);
  vertices_.download(pinned_vertices_.data(), size.vertices, stream_);
  triangles_.download(pinned_triangles_.data(), size.triangles, stream_);
  stream_.record(fetched_);
}

std::vector<MeshRecord> BlockMesher::changedRecords() {
  std::vector<MeshRecord> changed;
  if (has_mesh_.size() < map_.slot_count) has_mesh_.resize(map_.slot_count, 0);
  for (size_t i = 0; i < recordCount(); ++i) {
    const MeshRecord& record = pinned_records_[i];
    uint8_t& has_mesh = has_mesh_[record.slot];
    if (record.triangles > 0 || has_mesh) changed.push_back(record);
    has_mesh = record.triangles > 0;
  }
  std::sort(changed.begin(), changed.end(),
            [](const MeshRecord& a, const MeshRecord& b) { return a.key < b.key; });
  return changed;
}

BlockMesh BlockMesher::copyBlock(const MeshRecord& record) const {
  BlockMesh mesh;
  mesh.key = unpackKey(record.key);
  const BlockVertex* vertex = pinned_vertices_.data() + record.first_vertex;
  mesh.vertices.assign(vertex, vertex + record.vertices);
  const uint16_t* corner = pinned_triangles_[record.first_triangle].vertex;
  mesh.triangles.assign(corner, corner + 3 * static_cast<size_t>(record.triangles));
  return mesh;
}

void BlockMesher::count() const {
  Profile* profile = profileOf(stream_);
  if (profile == nullptr) return;
  profile->work.indexed_blocks += pinned_totals_[0].blocks.reached;
  profile->work.meshed_blocks += recordCount();
  profile->work.vertices += pinned_totals_[0].size.vertices;
  profile->work.triangles += pinned_totals_[0].size.triangles;
}

void BlockMesher::addMemory(std::vector<MemoryPart>& parts) const {
  const MeshSize size = pinned_totals_[0].size;
  parts.push_back({"vertices and triangles", MemoryKind::kMesh,
                   size.vertices * sizeof(BlockVertex) + size.triangles * sizeof(BlockTriangle),
                   vertices_.bytes() + triangles_.bytes()});
  parts.push_back({"mesh lists", MemoryKind::kMesh,
                   recordCount() * (sizeof(int32_t) + sizeof(MeshRecord)),
                   slots_.bytes() + records_.bytes()});
  parts.push_back({"mesh tables", MemoryKind::kScratch, tables_.bytes(), tables_.bytes()});
  const size_t staging = pinned_records_.bytes() + pinned_vertices_.bytes() +
                         pinned_triangles_.bytes();
  parts.push_back({"mesh", MemoryKind::kStaging, staging, staging});
}

std::vector<NamedKernel> mesherKernels(bool directional) {
  const size_t lattice_bytes =
      (directional ? kDirectionCount : 1) * kLatticeCorners * sizeof(Voxel);
  return {DTSDF_NAMED_KERNEL(reachBlocksKernel, 0),
          DTSDF_NAMED_KERNEL(indexBlocksKernel, lattice_bytes),
          DTSDF_NAMED_KERNEL(makeMeshesKernel, 0)};
}

MeshUpdate BlockMesher::finish() {
  MeshUpdate update;
  if (state_ == State::kIdle) return update;
  settle();
  fetched_.wait();
  state_ = State::kIdle;
  count();
  const StageTimer timer(profileOf(stream_), Stage::kHandOut);
  for (const MeshRecord& record : changedRecords()) update.blocks.push_back(copyBlock(record));
  update.duration_ms = fetched_.millisecondsSince(begun_);
  return update;
}

}  // namespace gpu
}  // namespace dtsdf
