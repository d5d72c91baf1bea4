/// The index stage of a block on the CPU: its samples, and its units' indices.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/edge_set.h"
#include "cpu/nearby_arrays.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/anchoring.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The samples at a corner, or at a place beyond the corner grid, by direction.
template <class Samples, class Corner>
struct EdgeEnd {
  const Samples& samples;
  Corner corner;
  int only_direction;  ///< That the undirected map's array counts as; -1 in the directional map.

  Sample operator[](int d) const {
    if (only_direction < 0) return samples.sample(corner, d);
    return d == only_direction ? samples.sample(corner, 0) : Sample{0.0f, 0.0f};
  }
};

/// An edge as the rules want it: most ask for the few directions that cross it.
template <class Samples>
struct EdgeOfGrid {
  EdgeEnd<Samples, int> lower, upper;
  EdgeEnd<Samples, Vec3i> below, above;

  EdgeOfGrid(const Samples& samples, int corner, int axis, int only_direction)
      : lower{samples, corner, only_direction},
        upper{samples, corner + cornerStride(axis), only_direction},
        below{samples, cornerAt(corner) - unitStep(axis), only_direction},
        above{samples, cornerAt(corner) + unitStep(axis) + unitStep(axis), only_direction} {}
};

/// The vertex of an edge; in the directional map held to what was measured.
template <class Samples>
BlockVertex makeVertex(const MeshSettings& rules, const Samples& samples, int edge,
                       bool directional) {
  const int corner = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const int only_direction = directional ? -1 : facedDirection(axis, facing);
  const EdgeOfGrid<Samples> on_edge(samples, corner, axis, only_direction);
  const uint32_t crossing =
      directional ? crossingDirections(samples.sides(corner),
                                       samples.sides(corner + cornerStride(axis)), axis, facing)
                  : crossingDirections(on_edge, axis, facing);
  const float offset = edgeOffset(rules, on_edge, crossing, axis, facing);
  const Vec3f position = vertexPosition(edge, offset);
  if (!directional) return {position, static_cast<uint32_t>(edge)};
  const VoxelsAt ends[2] = {samples.voxelsAt(cornerAt(corner)),
                            samples.voxelsAt(cornerAt(corner) + unitStep(axis))};
  const auto anchors = [&](int end, int direction) { return ends[end].anchor(direction); };
  if (kPullByL) {
    const uint32_t telling = crossing != 0 ? crossing : speakingOnEdge(axis, facing);
    float sum = 0, sum_w = 0;
    visitDirections(telling, [&](int d) {
      const Sample a = on_edge.lower[d], b = on_edge.upper[d];
      const float one[2] = {a.weight * (1 - offset), b.weight * offset};
      for (int e = 0; e < 2; ++e) {
        const uint16_t o = ends[e].outline(d);
        if (!(one[e] > 0) || o == 0) continue;
        const float w = crossing != 0 ? a.weight * b.weight * (e ? offset : 1 - offset) : one[e] * one[e];
        sum += w * ((o - 20000) * 1e-4f);
        sum_w += w;
      }
    });
    const float L = sum_w > 0 ? sum / sum_w : 1.0f;
    if (L < -kTolerance) {
      const NearestAnchor nearest = nearestAnchor(on_edge, telling, anchors, axis, offset);
      if (nearest.distance > 0.02f) {
        const float share = -L / nearest.distance;
        return {position + Vec3f{roundShift(share * nearest.offset.x), roundShift(share * nearest.offset.y),
                                 roundShift(share * nearest.offset.z)}, static_cast<uint32_t>(edge)};
      }
      return {position, static_cast<uint32_t>(edge)};
    }
    if (!kPullOld) return {position, static_cast<uint32_t>(edge)};
  }
  return {position + anchoringShift(rules, on_edge, crossing, anchors, axis, facing, offset),
          static_cast<uint32_t>(edge)};
}

/// A block's units before regularisation.
struct IndexedBlock {
  std::vector<UnitLabels> labels;     ///< One per unit; empty where none of them says anything.
  std::vector<BlockVertex> vertices;  ///< On the edges of their sheets, sorted by edge.
};

/// Room for indexing one block after the other; one per thread.
class BlockIndexer {
 public:
  IndexedBlock index(const MeshSettings& rules, const NearbyArrays& arrays, bool directional);

  Sample sample(int corner, int direction) const {
    if (!(present_ >> direction & 1)) return {0.0f, 0.0f};
    return {sdf_[direction][corner], weight_[direction][corner]};
  }

  uint32_t sides(int corner) const { return sides_[corner]; }

  VoxelsAt voxelsAt(const Vec3i& corner) const { return arrays_->voxelsAt(corner); }

  /// Of the corner grid or one more layer around it.
  Sample sample(const Vec3i& corner, int direction) const {
    const auto in_grid = [](int at) { return static_cast<unsigned>(at) < kCornerGridSide; };
    if (in_grid(corner.x) && in_grid(corner.y) && in_grid(corner.z)) {
      return sample(cornerIndex(corner.x, corner.y, corner.z), direction);
    }
    return arrays_->sample(corner, direction);
  }

 private:
  /// With room behind the last corner for the last one's neighbours, so that loops need no cases.
  static constexpr int kRoom = kGridCorners + kCornerGridSide * kCornerGridSide;

  void findArrays();
  void collect();
  void markSides();
  void findCandidates();
  void labelRows(const MeshSettings& rules, bool directional, UnitLabels* labels);
  bool rowHasCandidates(int row) const;
  bool hasCandidates() const;

  const NearbyArrays* arrays_ = nullptr;                   ///< Of the block, while it is indexed.
  const Voxel* const* corner_arrays_[kCornerBlocks] = {};  ///< Of the corner grid, by direction.
  uint32_t present_ = 0;               ///< Bit d: some corner has samples of direction d.
  uint32_t held_[kCornerBlocks] = {};  ///< Bit d: the block's part of the samples is not all 0.
  float sdf_[kDirectionCount][kGridCorners] = {};
  float weight_[kDirectionCount][kGridCorners] = {};
  uint32_t sides_[kRoom] = {};       ///< Per corner, see sidesOfCorner().
  uint32_t unit_sides_[kRoom] = {};  ///< Of all corners of the unit that starts at a corner.
  uint8_t candidate_[kGridCorners];  ///< Whether that unit can hold a surface.
  EdgeSet edges_;
};

}  // namespace dtsdf
