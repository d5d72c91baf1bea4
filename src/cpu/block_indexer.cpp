#include "cpu/block_indexer.h"

#include <algorithm>
#include <cstring>

#include "cpu/lanes.h"
#include "cpu/voxel_row.h"
#include "cpu/widest_vectors.h"
#include "kernels/meshing/possible_leaders.h"
#include "kernels/meshing/sheets.h"

namespace dtsdf {
namespace {

/// The eight units of a row along x; the first one starts at `first_corner`.
struct UnitsOfRow {
  using Real = LaneFloats;
  using Bits = LaneInts;
  static constexpr int kUnits = kLanes;

  const float (*sdf_at)[kGridCorners];
  const float (*weight_at)[kGridCorners];
  int first_corner;
  uint32_t observed, active;  ///< Bit d: direction d is observed, or may be active, in some unit.

  static int offset(int c) { return cornerIndex(c & 1, c >> 1 & 1, c >> 2 & 1); }
  LaneFloats sdf(int d, int c) const {
    return LaneFloats::load(&sdf_at[d][first_corner + offset(c)]);
  }
  LaneFloats weight(int d, int c) const {
    return LaneFloats::load(&weight_at[d][first_corner + offset(c)]);
  }
  bool isObserved(int d) const { return observed >> d & 1; }
  bool mayBeActive(int d) const { return active >> d & 1; }
};

const Voxel kNothing[kVoxelsPerBlock] = {};

/// Number of rows of units along x in a block.
constexpr int kRows = kBlockSide * kBlockSide;
/// The first corner of a row.
int cornerOfRow(int row) { return cornerIndex(0, row % kBlockSide, row / kBlockSide); }

/// Splits a row of voxels into distances and weights, as sampleOf() does for one voxel.
void copyRow(const Voxel* from, int32_t min_evidence, float* sdf, float* weight) {
  const VoxelRow row(from);
  row.sdf().store(sdf);
  row.knownWeight(min_evidence).store(weight);
}

/// Copies the samples of the n-th corner block that are part of the corner grid.
void copyPart(const Voxel* voxels, int n, int32_t min_evidence, float* sdf, float* weight) {
  const Vec3i at = cornerBlockOffset(n);
  const int rows = at.y ? 1 : kBlockSide, layers = at.z ? 1 : kBlockSide;
  for (int z = 0; z < layers; ++z) {
    for (int y = 0; y < rows; ++y) {
      const int to = cornerIndex(kBlockSide * at.x, kBlockSide * at.y + y, kBlockSide * at.z + z);
      const Voxel* from = voxels + voxelIndex(0, y, z);
      if (at.x) {
        const Sample sample = sampleOf(*from, min_evidence);
        sdf[to] = sample.sdf;
        weight[to] = sample.weight;
      } else {
        copyRow(from, min_evidence, sdf + to, weight + to);
      }
    }
  }
}

}  // namespace

void BlockIndexer::findArrays(const ArraysAround& arrays) {
  present_ = 0;
  for (int n = 0; n < kCornerBlocks; ++n) {
    corner_arrays_[n] = arrays.array[aroundNumber(cornerBlockOffset(n))];
    for (int d = 0; d < kDirectionCount; ++d) {
      present_ |= (corner_arrays_[n][d] != nullptr ? 1u : 0u) << d;
    }
  }
}

inline void BlockIndexer::collectSamples(int32_t min_evidence) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(present_ >> d & 1)) continue;
    for (int n = 0; n < kCornerBlocks; ++n) {
      const Voxel* voxels = corner_arrays_[n][d];
      const uint32_t bit = 1u << d;
      if (voxels == nullptr && !(maybe_nonzero_[n] & bit)) continue;  // most are already zero
      maybe_nonzero_[n] = voxels == nullptr ? maybe_nonzero_[n] & ~bit : maybe_nonzero_[n] | bit;
      copyPart(voxels == nullptr ? kNothing : voxels, n, min_evidence, sdf_[d], weight_[d]);
    }
  }
}

inline void BlockIndexer::markSides() {
  std::fill(sides_, sides_ + kGridCorners, 0u);
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(present_ >> d & 1)) continue;
    const float* sdf = sdf_[d];
    const float* weight = weight_[d];
    for (int i = 0; i < kGridCorners; ++i) sides_[i] |= sidesOfSample(d, sdf[i], weight[i]);
  }
  for (int i = 0; i < kGridCorners; ++i) sides_[i] = sidesOfCorner(sides_[i]);
}

inline void BlockIndexer::findCandidates() {
  uint32_t* unit = unit_sides_;
  for (int i = 0; i < kGridCorners; ++i) unit[i] = sides_[i] | sides_[i + 1];
  for (const int stride : {cornerStride(1), cornerStride(2)}) {
    for (int i = 0; i < kGridCorners; ++i) unit[i] |= unit[i + stride];
  }
  for (int i = 0; i < kGridCorners; ++i) candidate_[i] = possibleLeaders(unit[i]) != 0;
}

/// Labels the rows that contain a candidate, that is, a unit that can contain a surface. Skips
/// directions that are observed only in other units of the row.
inline void BlockIndexer::labelRows(const MeshSettings& rules, bool directional,
                                    UnitLabels* labels) {
  static_assert(kLanes == kBlockSide, "a row must fill the lanes");
  for (int row = 0; row < kRows; ++row) {
    if (!rowHasCandidates(row)) continue;
    const int corner = cornerOfRow(row);
    UnitsOfRow units{sdf_, weight_, corner, 0, 0};
    for (int k = 0; k < kLanes; ++k) {
      if (!candidate_[corner + k]) continue;
      units.observed |= observedDirections(unit_sides_[corner + k]);
      units.active |= possiblyActive(unit_sides_[corner + k]);
    }
    UnitLabels of_row[kLanes];
    labelUnits(kMeshTables, rules, units, directional, of_row);
    for (int k = 0; k < kLanes; ++k) labels[row * kBlockSide + k] = of_row[k];
  }
}

bool BlockIndexer::rowHasCandidates(int row) const {
  uint64_t candidates;
  static_assert(sizeof(candidates) == kBlockSide * sizeof(candidate_[0]), "");
  std::memcpy(&candidates, candidate_ + cornerOfRow(row), sizeof(candidates));
  return candidates != 0;
}

bool BlockIndexer::hasCandidates() const {
  int row = 0;
  while (row < kRows && !rowHasCandidates(row)) ++row;
  return row < kRows;
}

/// The directions that placeVertex() has to read on an edge. On most edges, few directions cross
/// zero.
uint32_t BlockIndexer::directionsOn(int edge) const {
  const int corner = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const uint32_t crossing =
      crossingDirections(sides_[corner], sides_[corner + cornerStride(axis)], axis, facing);
  return crossing != 0 ? crossing : directionsOnEdge(axis, facing);
}

void BlockIndexer::index(const MeshSettings& rules, const ArraysAround& arrays, bool directional,
                         std::vector<UnitLabels>& labels, std::vector<BlockVertex>& vertices) {
  labels = std::vector<UnitLabels>();  // without spare capacity, as they are kept for a long time
  vertices = std::vector<BlockVertex>();
  findArrays(arrays);
  withWidestVectors([&] {
    collectSamples(arrays.min_evidence);
    markSides();
    findCandidates();
  });
  if (!hasCandidates()) return;
  labels.resize(kVoxelsPerBlock, UnitLabels{0, 0});
  withWidestVectors([&] {
    labelRows(rules, directional, labels.data());
    edges_.clear();
    for (int row = 0; row < kRows; ++row) {
      if (!rowHasCandidates(row)) continue;
      for (int i = row * kBlockSide; i < (row + 1) * kBlockSide; ++i) {
        if (!isEmpty(labels[i])) edges_.addUnit(indicesOf(labels[i]), voxelOffset(i));
      }
    }
    vertices.resize(edges_.count());
    auto next = vertices.begin();
    edges_.forEach([&](int edge) {
      *next++ = {placeVertex(rules, arrays, edge, directional, directionsOn(edge)),
                 static_cast<uint32_t>(edge)};
    });
  });
  const auto is_empty = [](const UnitLabels& unit) { return isEmpty(unit); };
  if (std::all_of(labels.begin(), labels.end(), is_empty)) labels.clear();
}

}  // namespace dtsdf
