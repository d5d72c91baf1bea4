/// What a mesh unit is made of, and what becomes of it.
///
/// A mesh unit is a cell of marching cubes: a cube with a voxel's sample on each of its corners.
/// The files of this folder are the stages of directional marching cubes, in the paper's order
/// (Sec. V):
///
///   index   possible_leaders.h   which units can hold a surface at all
///           leaders.h            which directions speak for a surface, and which lead its sheets
///           vote.h               on which side of a sheet each corner is
///           crossings.h          which crossings of edges are known too little
///           sheets.h             marching cubes indices, without what no direction can see
///   make    loose_pieces.h       small pieces beside a larger one, which are left out
///           regularisation.h     corners that the units around them disagree about
///           edge_vertex.h        where the surface crosses an edge
///           anchoring.h          vertices held to where the surface was measured
///           emit.h               triangles, as references to edges
///   refine  vertex_normal.h      normals of vertices, from the fields around them
///           refine.h             four triangles for each, with vertices on the curved surface
///
/// corner_grid.h says where a block's samples lie, mesh_tables.h holds marching cubes, and
/// mesh_rules.h the numbers. Vertices belong to (edge, facing) and depend on the samples of the
/// edge, so all units around it share them.
///
/// Departure from the paper, measured in docs/results: it votes and intersects whole indices per
/// unit; voting per corner makes neighbouring units agree on the corners they share.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/select.h"
#include "kernels/core/voxel.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// The surface in a unit has one sheet, or two: the sides of something thinner than the unit.
constexpr int kMaxSheets = 2;

/// The indices of a unit, one per sheet; no surface where all corners are on one side.
struct UnitIndices {
  uint8_t sheet[kMaxSheets];
};

/// What a unit says of its corners, bit c for corner c: which are behind its first sheet, and which
/// in front of its second; in front of the first where there is one only. Both 0: it says nothing.
///
/// Nothing else looks like that: both 0 would be a first sheet with no corner behind it and a last
/// one with all, and a sheet without surface is never kept beside another.
struct UnitLabels {
  uint8_t behind_first, in_front_of_last;
};

DTSDF_HD UnitLabels labelsOfSheets(unsigned first, unsigned last) {
  return {static_cast<uint8_t>(first), static_cast<uint8_t>(~last)};
}

DTSDF_HD bool isEmpty(const UnitLabels& labels) {
  return (labels.behind_first | labels.in_front_of_last) == 0;
}

/// Corners that all sheets of the unit have on one side, behind and in front.
DTSDF_HD unsigned cornersBehind(const UnitLabels& labels) {
  return labels.behind_first & ~labels.in_front_of_last & 255u;
}
DTSDF_HD unsigned cornersInFront(const UnitLabels& labels) {
  return ~labels.behind_first & labels.in_front_of_last & 255u;
}

/// The labels as indices; two sheets that are the same are one.
DTSDF_HD UnitIndices indicesOf(const UnitLabels& labels) {
  const auto last = static_cast<uint8_t>(~labels.in_front_of_last);
  if (isEmpty(labels) || last == labels.behind_first) return {{labels.behind_first, 0}};
  return {{labels.behind_first, last}};
}

// Samples are distances and weights at the eight corners of a unit, per direction; a sample counts
// as observed if its weight is above 0. The rules take any type with the members of UnitOfGrid
// (cuda/index_blocks.cu); one whose Real holds the values of several neighbouring units works on
// all of them at once (UnitsOfRow, src/cpu/block_indexer.cpp). isObserved() and maySpeak() may be
// false where a direction has no weight, or does not see both sides of a surface.

/// A surface nearer to a corner than this, in voxels, touches it: its direction has seen both of
/// its sides there. On which side the corner is, the vote decides (vote.h), in which another
/// direction of the same weight can turn what is nearer than a quarter of `nearness_voxels`, by its
/// default. (A unit whose only corner behind the surface was turned would have no direction that
/// speaks, and leave a hole.)
constexpr float kTouching = 0.25f * MeshRules().nearness_voxels;

template <class Samples>
DTSDF_HD typename Samples::Real greatestWeight(const Samples& samples) {
  typename Samples::Real greatest{0.0f};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    for (int c = 0; c < kCubeCorners; ++c) greatest = maximum(greatest, samples.weight(d, c));
  }
  return greatest;
}

}  // namespace dtsdf
