/// The stage "index" for one block on the CPU: labels its mesh units with marching-cubes cases, and
/// places vertices on their edges.
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

/// A set of edges of a block's corner grid. forEach() visits them in ascending order.
class EdgeSet {
 public:
  void clear() {
    for (uint64_t& word : bits_) word = 0;
  }

  void add(int edge) { bits_[edge / kWordBits] |= uint64_t{1} << edge % kWordBits; }

  /// Adds the edges on which the corners of a unit's triangles lie.
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

/// Processes one block at a time. Each thread needs its own instance, as it contains buffers.
class BlockIndexer {
 public:
  /// Labels a block's units, before regularisation.
  /// @param arrays The voxel arrays of the block and its neighbours.
  /// @param labels Receives one per unit; empty if all units are empty.
  /// @param vertices Receives a vertex for each edge that a unit's surface crosses, sorted by edge.
  void index(const MeshSettings& rules, const ArraysAround& arrays, bool directional,
             std::vector<UnitLabels>& labels, std::vector<BlockVertex>& vertices);

 private:
  /// Number of corners, with padding for loops that read neighbours past the last corner.
  static constexpr int kPaddedCorners = kGridCorners + kCornerGridSide * kCornerGridSide;

  void findArrays(const ArraysAround& arrays);
  void collectSamples(int32_t min_evidence);
  void markSides();
  void findCandidates();
  void labelRows(const MeshSettings& rules, bool directional, UnitLabels* labels);
  bool rowHasCandidates(int row) const;
  bool hasCandidates() const;
  uint32_t directionsOn(int edge) const;

  /// The voxel arrays, by direction, of the corner blocks, which contain the corners of the units.
  const Voxel* const* corner_arrays_[kCornerBlocks] = {};
  uint32_t present_ = 0;  ///< Bit d: some corner block has an array of direction d.
  /// For each corner block, bit d: some of its samples of direction d may be nonzero.
  uint32_t maybe_nonzero_[kCornerBlocks] = {};
  float sdf_[kDirectionCount][kGridCorners] = {};
  float weight_[kDirectionCount][kGridCorners] = {};
  uint32_t sides_[kPaddedCorners] = {};       ///< For each corner, see sidesOfCorner().
  uint32_t unit_sides_[kPaddedCorners] = {};  ///< Sides of the unit that starts at a corner.
  uint8_t candidate_[kGridCorners];           ///< Whether the unit at a corner can hold a surface.
  EdgeSet edges_;
};

}  // namespace dtsdf
