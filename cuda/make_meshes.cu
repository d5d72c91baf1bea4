// The stage "make" on the device: makes the mesh units around each corner agree on its side of the
// surface (regularisation), and computes the vertices and triangles of blocks.
#include <cub/block/block_scan.cuh>

#include "corner_arrays.cuh"
#include "kernels/meshing/emit.h"
#include "kernels/meshing/gap.h"
#include "kernels/meshing/make_vertex.h"
#include "kernels/meshing/refine.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/vertex_normal.h"
#include "launch.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {
namespace {

__device__ const MeshTables kTables = kMeshTables;
__device__ const RefineTables kRefineTablesHere = kRefineTables;

constexpr int kUnitsPerThread = kVoxelsPerBlock / kThreads;
constexpr int kEdgeWords = (kGridEdges + 31) / 32;
static_assert(kEdgeWords <= kThreads, "each word needs a thread");

using Scan = cub::BlockScan<uint32_t, kThreads>;

/// The edges of a block's units that have a vertex. Vertices are numbered in the order of
/// their edges.
struct EdgeSet {
  uint32_t bits[kEdgeWords];
  uint32_t rank[kEdgeWords];  ///< Number of vertices before each word.

  __device__ void add(int edge) { atomicOr(&bits[edge / 32], 1u << (edge % 32)); }
  __device__ uint32_t vertexOf(int edge) const {
    return rank[edge / 32] + __popc(bits[edge / 32] & ((1u << (edge % 32)) - 1u));
  }
};

/// A copy of the labels (marching cubes cases) of the units in and around a block: one more unit on
/// each side along y and z, four more along x.
struct CornerLabels {
  static constexpr int kSide = kBlockSide + 2, kRows = kSide * kSide;
  static constexpr int kMoreAlongX = 4, kFoursPerRow = (kBlockSide + 2 * kMoreAlongX) / 4;
  uint64_t four[kRows][kFoursPerRow];  ///< Labels of four units along x.

  __device__ UnitLabels operator()(const Vec3i& unit) const {
    const int row = unit.y + 1 + kSide * (unit.z + 1);
    return reinterpret_cast<const UnitLabels*>(four[row])[unit.x + kMoreAlongX];
  }
};

struct MeshBlockShared {
  ArraysAround arrays;
  LabelNeighbourhood labels_around;
  uint8_t behind[kGridCorners];  ///< 1 if most units put the corner behind the surface.
  EdgeSet edges;
  MeshRecord record;
  union {                 // used one after the other, with a barrier in between
    CornerLabels labels;  ///< Used until units are regularised.
    struct {
      typename Scan::TempStorage scan;
      uint16_t vertex_edge[kGridEdges];  ///< Edge of each vertex.
    } listing;
  };
};
static_assert(sizeof(MeshBlockShared) <= 16 * 1024 - 16,
              "four blocks must fit in 64 KiB, with the memory of isLastBlock()");

__device__ void gatherBlock(const MapView& map, const BlockKey& key, int32_t min_evidence,
                            MeshBlockShared& shared) {
  const int t = threadIdx.x;
  if (t == 0) shared.arrays.min_evidence = min_evidence;
  if (t < kBlocksAround) {
    const int32_t slot = findSlot(map, packKey(key + aroundOffset(t)));
    findArrays(map, slot, shared.arrays.array[t]);
    shared.labels_around[t] = slot < 0 ? nullptr : map.unit_labels.record(slot);
  }
  if (t < kEdgeWords) shared.edges.bits[t] = 0;
  __syncthreads();
}

/// Copies the labels in and around a block. All threads of the thread block must call it.
__device__ void copyLabels(MeshBlockShared& shared) {
  static_assert(kBlockSide % 4 == 0 && CornerLabels::kMoreAlongX == 4, "labels move in fours");
  constexpr int kCount = CornerLabels::kRows * CornerLabels::kFoursPerRow;
  for (int i = threadIdx.x; i < kCount; i += kThreads) {
    const int row = i / CornerLabels::kFoursPerRow, n = i % CornerLabels::kFoursPerRow;
    const CornerSource source =
        unitSource({4 * n - CornerLabels::kMoreAlongX, row % CornerLabels::kSide - 1,
                    row / CornerLabels::kSide - 1});
    const UnitLabels* labels = shared.labels_around[source.block];
    shared.labels.four[row][n] =
        labels == nullptr ? 0 : *reinterpret_cast<const uint64_t*>(labels + source.voxel);
  }
  __syncthreads();
}

/// Decides which corners are behind the surface. All threads of the thread block must call it.
__device__ void decideCorners(MeshBlockShared& shared) {
  for (int i = threadIdx.x; i < kGridCorners; i += blockDim.x) {
    shared.behind[i] = isMajorityBehind(cornerBalance(shared.labels, cornerAt(i))) ? 1 : 0;
  }
  __syncthreads();
}

/// Regularises this thread's units, and marks the edges that have a vertex. @return the number of
/// triangles in these units.
__device__ uint32_t regulariseUnits(MeshBlockShared& shared,
                                    UnitIndices (&regular)[kUnitsPerThread]) {
  uint32_t triangles = 0;
  for (int k = 0; k < kUnitsPerThread; ++k) {
    const Vec3i unit = voxelOffset(static_cast<int>(threadIdx.x * kUnitsPerThread + k));
    unsigned behind = 0;
    for (int c = 0; c < kCubeCorners; ++c) {
      const Vec3i at = unit + cornerOffset(c);
      behind |= (shared.behind[cornerIndex(at.x, at.y, at.z)] ? 1u : 0u) << c;
    }
    regular[k] = regularise(shared.labels(unit), behind);
    triangles += countTriangles(kTables, regular[k]);
    visitTriangleEdges(kTables, regular[k], unit, [&](int edge) { shared.edges.add(edge); });
  }
  return triangles;
}

/// Numbers the vertices on the edges in one word of the edge set.
__device__ void listEdges(int word, uint32_t rank, MeshBlockShared& shared) {
  shared.edges.rank[word] = rank;
  for (uint32_t bits = shared.edges.bits[word]; bits != 0; bits &= bits - 1) {
    shared.listing.vertex_edge[rank++] = static_cast<uint16_t>(32 * word + __ffs(bits) - 1);
  }
}

/// Counts the midpoints of refined triangles' sides. All threads of the thread block must call it.
/// @param before Number of midpoints before those of this thread's units.
/// @return the number of midpoints in the block.
__device__ uint32_t countMidpoints(const UnitIndices (&regular)[kUnitsPerThread],
                                   MeshBlockShared& shared, uint32_t& before) {
  uint32_t own = 0, count;
  for (const UnitIndices& indices : regular) own += sidesOfUnit(kRefineTablesHere, indices);
  __syncthreads();  // no thread reads labels any longer
  Scan(shared.listing.scan).ExclusiveSum(own, before, count);
  return count;
}

/// Counts a block's vertices on edges and its triangles. Reserves space for all vertices, and for
/// `refined_triangles` triangles per counted one. The order of blocks in the buffers is arbitrary.
/// @return this thread's first triangle in the block, before refinement.
__device__ uint32_t reserveSpace(const MeshView& mesh, uint32_t own_triangles, uint32_t middles,
                                 uint32_t refined_triangles, MeshBlockShared& shared) {
  constexpr uint32_t kLow = 0xffff;
  static_assert(kGridEdges <= kLow && kVoxelsPerBlock * kMaxSheets * kMaxTriangles <= kLow,
                "each count must fit in half a word");
  __syncthreads();  // edges are set; labels and the last scan are no longer used
  const int t = threadIdx.x;
  const uint32_t in_word = t < kEdgeWords ? __popc(shared.edges.bits[t]) : 0;
  uint32_t before, total;
  Scan(shared.listing.scan).ExclusiveSum(in_word << 16 | own_triangles, before, total);
  if (t == kThreads - 1) {  // this thread's warp has no edges to list
    const uint32_t vertices = (total >> 16) + middles;
    const uint32_t triangles = (total & kLow) * refined_triangles;
    MeshRecord& record = shared.record;
    record.vertices = vertices;
    record.triangles = triangles;
    record.first_vertex = vertices == 0 ? 0 : atomicAdd(&mesh.totals->size.vertices, vertices);
    record.first_triangle = triangles == 0 ? 0 : atomicAdd(&mesh.totals->size.triangles, triangles);
  }
  if (t < kEdgeWords) listEdges(t, before >> 16, shared);
  __syncthreads();
  return before & kLow;
}

/// Writes the first `count` vertices: those on edges.
__device__ void writeVertices(const MeshView& mesh, uint32_t count, const MeshBlockShared& shared) {
  BlockVertex* vertices = mesh.vertices + shared.record.first_vertex;
  for (uint32_t i = threadIdx.x; i < count; i += blockDim.x) {
    const int edge = shared.listing.vertex_edge[i];
    vertices[i] = {
        placeVertex(mesh.rules, shared.arrays, edge, mesh.directional != 0, kAllDirections),
        static_cast<uint32_t>(edge)};
  }
}

/// Whether a triangle spans a gap (see gap.h); if so, counts it. @pre Its vertices are written.
template <class Index>
__device__ bool countGap(const MeshSettings& rules, const BlockVertex* vertices,
                         const Index* corner, uint32_t& gaps) {
  const bool is_gap =
      spansGap(rules, vertices[corner[0]], vertices[corner[1]], vertices[corner[2]]);
  if (is_gap) ++gaps;
  return is_gap;
}

/// Writes the triangles of this thread's units. @return how many of them span gaps.
__device__ uint32_t writeTriangles(const MeshView& mesh,
                                   const UnitIndices (&regular)[kUnitsPerThread],
                                   uint32_t first_triangle, const MeshBlockShared& shared) {
  uint32_t gaps = 0;
  const BlockVertex* vertices = mesh.vertices + shared.record.first_vertex;
  uint16_t* triangle = mesh.triangles[shared.record.first_triangle + first_triangle].vertex;
  int corner = 0;
  for (int k = 0; k < kUnitsPerThread; ++k) {
    const Vec3i unit = voxelOffset(threadIdx.x * kUnitsPerThread + k);
    visitTriangleEdges(kTables, regular[k], unit, [&](int edge) {
      triangle[corner++] = static_cast<uint16_t>(shared.edges.vertexOf(edge));
      if (corner < 3) return;
      if (countGap(mesh.rules, vertices, triangle, gaps))
        triangle[0] = triangle[1] = triangle[2] = kGapVertex;
      triangle += 3;
      corner = 0;
    });
  }
  return gaps;
}

/// Writes the normals of the first `count` vertices. @pre Their positions are written.
__device__ void writeNormals(const MeshView& mesh, uint32_t count, const MeshBlockShared& shared) {
  const BlockVertex* vertices = mesh.vertices + shared.record.first_vertex;
  Vec3f* normals = mesh.normals + shared.record.first_vertex;
  for (uint32_t i = threadIdx.x; i < count; i += blockDim.x) {
    normals[i] = vertexNormal(shared.arrays, static_cast<int>(vertices[i].edge),
                              vertices[i].position, mesh.directional != 0);
  }
}

/// Writes the midpoints and refined triangles of this thread's units.
/// @param first_middle Index of the first midpoint among the block's vertices.
/// @param first_triangle Index of the first triangle in the block.
/// @return how many of the triangles span gaps.
__device__ uint32_t writeRefined(const MeshView& mesh,
                                 const UnitIndices (&regular)[kUnitsPerThread],
                                 uint32_t first_middle, uint32_t first_triangle,
                                 const MeshBlockShared& shared) {
  BlockVertex* vertices = mesh.vertices + shared.record.first_vertex;
  const Vec3f* normals = mesh.normals + shared.record.first_vertex;
  const auto vertexOf = [&](int edge) { return shared.edges.vertexOf(edge); };
  const auto endOn = [&](int edge) {
    const uint32_t vertex = vertexOf(edge);
    return SideEnd{vertices[vertex].position, normals[vertex]};
  };
  uint16_t* corner = mesh.triangles[shared.record.first_triangle + first_triangle].vertex;
  uint32_t middle = first_middle, gaps = 0;
  const auto isGap = [&](const uint32_t* triangle) {
    return countGap(mesh.rules, vertices, triangle, gaps);
  };
  for (int k = 0; k < kUnitsPerThread; ++k) {
    const Vec3i unit = voxelOffset(threadIdx.x * kUnitsPerThread + k);
    visitRefinedTriangles(kTables, kRefineTablesHere, regular[k], unit, middle, vertexOf, isGap,
                          [&](uint32_t vertex) { *corner++ = static_cast<uint16_t>(vertex); });
    visitSides(kRefineTablesHere, regular[k], unit, [&](int a, int b) {
      vertices[middle++] = {midpointOfSide(endOn(a), endOn(b)), midpointNumber(a, b)};
    });
  }
  return kRefinedTriangles * gaps;
}

/// Whether any unit of a block contains a surface. If not, the block has no mesh, like most
/// blocks that merely adjoin a changed block. All threads of the thread block must call it.
__device__ bool hasSurface(const UnitLabels* labels) {
  static_assert(sizeof(uint32_t) == kUnitsPerThread * sizeof(UnitLabels), "must be one word");
  return __syncthreads_or(reinterpret_cast<const uint32_t*>(labels)[threadIdx.x] != 0) != 0;
}

/// Writes the totals to the host. Called by one thread of the last thread block.
__device__ void writeTotals(const MeshView& mesh) {
  MeshTotals& totals = *mesh.host_totals;
  totals.reached = mesh.totals->reached;
  totals.adjoining = mesh.totals->adjoining;
  totals.size = {readShared(&mesh.totals->size.vertices), readShared(&mesh.totals->size.triangles)};
}

/// One thread block per block to mesh, in a grid-stride loop. Meshes that do not fit into the
/// buffers are counted but not written. The last thread block to finish writes the totals to the
/// host. Four thread blocks share a multiprocessor, which limits the registers of each thread.
template <bool kRefined>
__global__ void __launch_bounds__(kThreads, 4) makeMeshesKernel(MapView map, MeshView mesh) {
  waitForPreviousKernel();
  __shared__ MeshBlockShared shared;
  if (blockIdx.x == 0 && threadIdx.x == 0) *map.dirty.count = 0;  // all dirty blocks are selected
  const uint32_t count = mesh.totals->reached + mesh.totals->adjoining;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const int32_t slot = mesh.slots[b];
    if (!hasSurface(map.unit_labels.record(slot))) {
      if (threadIdx.x == 0) mesh.records[b] = {map.slots[slot].key, slot, 0, 0, 0, 0, 0};
      continue;
    }
    gatherBlock(map, keyOfSlot(map, slot), mesh.min_evidence, shared);
    copyLabels(shared);
    if (threadIdx.x == 0) {
      shared.record.key = map.slots[slot].key;
      shared.record.slot = slot;
      shared.record.gaps = 0;
    }
    decideCorners(shared);
    UnitIndices regular[kUnitsPerThread];
    const uint32_t own_triangles = regulariseUnits(shared, regular);
    uint32_t middles = 0, middles_before = 0;
    if (kRefined) middles = countMidpoints(regular, shared, middles_before);
    const uint32_t first_triangle =
        reserveSpace(mesh, own_triangles, middles, kRefined ? kRefinedTriangles : 1, shared);
    const MeshRecord& record = shared.record;
    uint32_t gaps = 0;
    if (record.first_vertex + record.vertices <= mesh.capacity.vertices &&
        record.first_triangle + record.triangles <= mesh.capacity.triangles) {
      const uint32_t on_edges = record.vertices - middles;
      writeVertices(mesh, on_edges, shared);
      __syncthreads();  // waits until all vertices are written
      if (kRefined) {
        writeNormals(mesh, on_edges, shared);
        __syncthreads();
        gaps = writeRefined(mesh, regular, on_edges + middles_before,
                            kRefinedTriangles * first_triangle, shared);
      } else {
        gaps = writeTriangles(mesh, regular, first_triangle, shared);
      }
    }
    if (gaps > 0) atomicAdd(&shared.record.gaps, gaps);
    __syncthreads();
    if (threadIdx.x == 0) mesh.records[b] = shared.record;
  }
  if (isLastBlock(&mesh.totals->finished, gridDim.x) && threadIdx.x == 0) writeTotals(mesh);
}

}  // namespace

void makeMeshes(const MapView& map, const MeshView& mesh, int thread_blocks, const Stream& stream) {
  if (mesh.refined) {
    launchOverlapped("makeMeshesKernel", makeMeshesKernel<true>, thread_blocks, kThreads, 0, stream,
                     map, mesh);
  } else {
    launchOverlapped("makeMeshesKernel", makeMeshesKernel<false>, thread_blocks, kThreads, 0,
                     stream, map, mesh);
  }
}

}  // namespace gpu
}  // namespace dtsdf
