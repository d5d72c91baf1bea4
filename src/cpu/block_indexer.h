/// The index stage of a block on the CPU: labels of its units, and vertices on their edges.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cpu/voxel_store.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/emit.h"
#include "kernels/meshing/make_vertex.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// A set of edges of a block's corner grid, visited in ascending order.
class EdgeSet {
 public:
  void clear() {
    for (uint64_t& word : bits_) word = 0;
  }

  void add(int edge) { bits_[edge / kWordBits] |= uint64_t{1} << edge % kWordBits; }

  /// Adds the edges that carry the corners of a unit's triangles.
  void addUnit(const UnitIndices& indices, const Vec3i& unit) {
    visitTriangleEdges(kMeshTables, indices, unit, [this](int edge) { add(edge); });
  }

  template <class Visit>
  void forEach(const Visit& visit) const {
    for (int word = 0; word < kWords; ++word) {
      for (uint64_t rest = bits_[word]; rest != 0; rest &= rest - 1) {
        visit(word * kWordBits + __builtin_ctzll(rest));
      }
    }
  }

  size_t count() const {
    size_t edges = 0;
    for (const uint64_t word : bits_) edges += __builtin_popcountll(word);
    return edges;
  }

 private:
  static constexpr int kWordBits = 64;
  static constexpr int kWords = (kGridEdges + kWordBits - 1) / kWordBits;
  uint64_t bits_[kWords] = {};
};

/// Buffers for indexing blocks; one per thread.
class BlockIndexer {
 public:
  /// Indexes a block's units before regularisation.
  /// @param arrays The voxel arrays around the block.
  /// @param labels One per unit; empty if all are.
  /// @param vertices The vertices on the edges of their sheets, sorted by edge.
  void index(const MeshSettings& rules, const ArraysAround& arrays, bool directional,
             std::vector<UnitLabels>& labels, std::vector<BlockVertex>& vertices);

 private:
  /// Extends beyond the last corner by its neighbours, so that loops need no special cases.
  static constexpr int kRoom = kGridCorners + kCornerGridSide * kCornerGridSide;

  void findArrays(const ArraysAround& arrays);
  void collect(int32_t min_evidence);
  void markSides();
  void findCandidates();
  void labelRows(const MeshSettings& rules, bool directional, UnitLabels* labels);
  bool rowHasCandidates(int row) const;
  bool hasCandidates() const;
  uint32_t directionsOn(int edge) const;

  const Voxel* const* corner_arrays_[kCornerBlocks] = {};  ///< Per corner block, by direction.
  uint32_t present_ = 0;  ///< Bit d: some corner has samples of direction d.
  /// Bit d: the block's part of direction d's samples may not be all 0.
  uint32_t held_[kCornerBlocks] = {};
  float sdf_[kDirectionCount][kGridCorners] = {};
  float weight_[kDirectionCount][kGridCorners] = {};
  uint32_t sides_[kRoom] = {};       ///< Per corner, see sidesOfCorner().
  uint32_t unit_sides_[kRoom] = {};  ///< Sides of the unit that starts at a corner.
  uint8_t candidate_[kGridCorners];  ///< Whether that unit can hold a surface.
  EdgeSet edges_;
};

}  // namespace dtsdf
