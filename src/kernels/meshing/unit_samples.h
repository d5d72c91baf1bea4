/// Samples, labels and marching cubes cases of a mesh unit.
///
/// A mesh unit is a marching cubes cell: a cube with a voxel's sample at each of its corners. It
/// contains at most two surfaces, called sheets, each found by the direction that leads it. The
/// files in this folder are the stages of directional marching cubes (paper, Sec. V):
///
///   index   possible_leaders.h   which units can hold a surface at all
///           leaders.h            which directions are active, and which of these lead its sheets
///           vote.h               on which side of a sheet each corner lies
///           crossings.h          which crossings have too little weight
///           sheets.h             marching cubes cases, without impossible components
///   make    regularisation.h     corners about which the surrounding units disagree
///           edge_vertex.h        where the surface crosses an edge
///           anchoring.h          vertices pulled towards measured points
///           gap.h                triangles across gaps, which are left out
///           emit.h               triangles, as references to edges
///   refine  vertex_normal.h      normals of vertices, from the gradients of distances
///           refine.h             splits each triangle into four on the curved surface
///
/// corner_grid.h locates a block's samples, mesh_tables.h contains the marching cubes tables, and
/// mesh_rules.h the parameters. A vertex belongs to an edge and a facing and depends only on
/// samples along the edge, so all units around the edge share it.
///
/// In the paper, however, the directions vote for whole marching cubes cases, which are then
/// intersected. With a separate vote at each corner, neighbouring units mostly agree about the
/// corners they share.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/select.h"
#include "kernels/core/voxel.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// Maximum number of sheets in a unit; two sheets are the two sides of a thin object.
constexpr int kMaxSheets = 2;

/// The marching cubes cases of a unit, one per sheet. Case 0 or 255 (all corners on one side) means
/// no surface.
struct UnitIndices {
  uint8_t sheet[kMaxSheets];
};

/// The unit's corners (bit c for corner c) that are behind its first sheet, and those that are in
/// front of its last sheet, which may also be the first. If both masks are 0, the unit is empty.
///
/// No other unit is stored as two zeros: they would mean two sheets, with cases 0 and 255, and two
/// sheets are stored only if both contain a surface (joinSheets()).
struct UnitLabels {
  uint8_t behind_first, in_front_of_last;
};

DTSDF_HD UnitLabels labelsOfSheets(unsigned first, unsigned last) {
  return {static_cast<uint8_t>(first), static_cast<uint8_t>(~last)};
}

DTSDF_HD bool isEmpty(const UnitLabels& labels) {
  return (labels.behind_first | labels.in_front_of_last) == 0;
}

/// Corners that are behind, or in front of, all sheets of the unit.
DTSDF_HD unsigned cornersBehind(const UnitLabels& labels) {
  return labels.behind_first & ~labels.in_front_of_last & 255u;
}
DTSDF_HD unsigned cornersInFront(const UnitLabels& labels) {
  return ~labels.behind_first & labels.in_front_of_last & 255u;
}

/// Converts labels to marching cubes cases; two equal sheets become one.
DTSDF_HD UnitIndices indicesOf(const UnitLabels& labels) {
  const auto last = static_cast<uint8_t>(~labels.in_front_of_last);
  if (isEmpty(labels) || last == labels.behind_first) return {{labels.behind_first, 0}};
  return {{labels.behind_first, last}};
}

// Samples are distances and weights at the eight corners of a unit, per direction; a sample is
// observed if its weight is positive. The rules take any type with the members of UnitOfGrid
// (cuda/index_blocks.cu). If Real holds the values of several neighbouring units, the rules work on
// all of these units at once (UnitsOfRow, src/cpu/block_indexer.cpp). isObserved() may return false
// for a direction without weight, and mayBeActive() for a direction without samples on both sides
// of a surface.

/// A surface nearer to a corner than this, in voxels, touches it: the corner counts as being on
/// both of its sides, as the vote may reverse the sign of such small distances (vote.h). Without
/// this rule, a unit with a single corner behind the surface might have no active direction if the
/// vote reverses that corner's sign, and leave a hole.
constexpr float kTouching = 0.25f * MeshRules().nearness_voxels;

template <class Samples>
DTSDF_HD typename Samples::Real maxWeight(const Samples& samples) {
  typename Samples::Real greatest{0.0f};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    for (int c = 0; c < kCubeCorners; ++c) greatest = maximum(greatest, samples.weight(d, c));
  }
  return greatest;
}

}  // namespace dtsdf
