/// The blocks around one of the map, and the vertices that are made of their voxels.
#pragma once

#include <array>

#include "cpu/voxel_store.h"
#include "kernels/meshing/make_vertex.h"
#include "map/block_table.h"

namespace dtsdf {

/// The slots of a block and of those around it, by aroundOffset(); -1 where there is none.
using SlotsAround = std::array<int32_t, kBlocksAround>;

SlotsAround slotsAround(const BlockTable& table, const BlockKey& key);

/// Their voxel arrays; `least_evidence` is what a voxel needs to be known.
ArraysAround arraysAround(const CpuMap& map, const SlotsAround& slots, int32_t least_evidence);

/// The voxels at both ends of an edge, each read once.
class EdgeVoxels {
 public:
  /// @param directions Those that are read, a bit each; of the undirected map the only one is.
  EdgeVoxels(const ArraysAround& arrays, int edge, bool directional, uint32_t directions);

  /// The directions that cross the edge. @pre All that may were read.
  uint32_t crossing() const {
    return crossingDirections(samples_, edgeAxis(edge_), edgeFacing(edge_));
  }

  /// @pre The directions that cross it were read, or, if none does, all that have a say.
  BlockVertex vertex(const MeshSettings& rules, uint32_t crossing) const {
    const auto anchors = [this](int end, int direction) { return anchor_[end][direction]; };
    return makeVertex(rules, samples_, crossing, anchors, edge_, directional_);
  }

 private:
  const int edge_;
  const bool directional_;
  EdgeSamples samples_;
  uint16_t anchor_[2][kDirectionCount];
};

}  // namespace dtsdf
