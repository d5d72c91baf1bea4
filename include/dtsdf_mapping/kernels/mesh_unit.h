/// Directional marching cubes: what happens to one mesh unit, and to one edge.
///
/// The stages follow the paper's Sec. V. A direction speaks for a surface in the unit if its own
/// samples cross zero the way it faces. The strongest direction leads a first sheet; if the opposite
/// one speaks as well, it leads a second: the two sides of something thin. For each sheet the
/// directions vote on every corner (all but the one opposite to the leader take part), the labels
/// give a marching cubes index, and components that no direction of the sheet can see are removed.
/// Disagreements with the neighbouring units are settled last (regularisation). Vertices belong to
/// (edge, facing) and depend on the edge's two samples alone, so all units around an edge share them.
///
/// Departure from the paper, measured in docs/results: it votes and intersects whole indices per
/// unit; voting per corner makes neighbouring units agree on the corners they share.
#pragma once

#include "dtsdf_mapping/kernels/direction.h"
#include "dtsdf_mapping/kernels/mesh_tables.h"
#include "dtsdf_mapping/kernels/voxel.h"

namespace dtsdf {

constexpr int kMaxSheets = 2;

/// Distances and weights at the eight corners of a unit, per direction; weight 0 is unobserved.
struct UnitSamples {
  Voxel corner[kDirectionCount][kCubeCorners];
};

/// The indices of a unit, one per sheet; 0 where there is no surface.
struct UnitIndices {
  uint8_t sheet[kMaxSheets];
};

/// A unit is meshed if each corner has at least this share of the greatest weight in the unit. It
/// keeps out corners that only the far fringe of a measurement reached, and counts no frames.
constexpr float kWeightShare = 0.02f;

/// Distances smaller than this, in voxels, count as equally near in the vote.
constexpr float kNearness = 0.2f;

DTSDF_HD float greatestWeight(const UnitSamples& samples) {
  float greatest = 0.0f;
  for (int d = 0; d < kDirectionCount; ++d) {
    for (int c = 0; c < kCubeCorners; ++c) {
      greatest = fmaxf(greatest, samples.corner[d][c].weight);
    }
  }
  return greatest;
}

/// Rise of a direction's distance along one axis: weighted mean over the unit's edges that it has
/// observed; 0 where there is none.
DTSDF_HD float riseAlong(const Voxel (&corner)[kCubeCorners], int axis, float least_weight) {
  float rise = 0.0f, total = 0.0f;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (c >> axis & 1) continue;
    const Voxel& lower = corner[c];
    const Voxel& upper = corner[c | 1 << axis];
    if (!(lower.weight > least_weight && upper.weight > least_weight)) continue;
    rise += (lower.weight + upper.weight) * (upper.sdf - lower.sdf);
    total += lower.weight + upper.weight;
  }
  return total > 0.0f ? rise / total : 0.0f;
}

/// How strongly a direction speaks for a surface in the unit; 0 if it does not. It has to see both
/// sides of the surface, and the gradient of its distance has to lie in its range (the gradient check
/// of the paper's intra-directional filter). Only the gradient's direction counts: noise makes it
/// shorter.
DTSDF_HD float directionConfidence(const Voxel (&corner)[kCubeCorners], int direction,
                                   float least_weight) {
  float weight = 0.0f;
  bool in_front = false, behind = false;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (!(corner[c].weight > least_weight)) continue;
    weight += corner[c].weight;
    (corner[c].sdf < 0.0f ? behind : in_front) = true;
  }
  if (!in_front || !behind) return 0.0f;
  const Vec3f gradient{riseAlong(corner, 0, least_weight), riseAlong(corner, 1, least_weight),
                       riseAlong(corner, 2, least_weight)};
  const float length = norm(gradient);
  if (!(length > 0.0f)) return 0.0f;
  const float cosine = directionCosine(gradient, direction) / length;
  return cosine > kDirectionThreshold ? weight * cosine : 0.0f;
}

/// The vote on one corner: weighted mean of the distances of several directions. Each counts by its
/// squared weight and by how near its surface is, since the nearest surface decides the sign.
struct CornerVote {
  float sum, votes, weight;
};

DTSDF_HD void castVote(CornerVote& vote, const Voxel& voxel) {
  if (!(voxel.weight > 0.0f)) return;
  const float strength = voxel.weight / (kNearness + fabsf(voxel.sdf));
  vote.sum += strength * strength * voxel.sdf;
  vote.votes += strength * strength;
  vote.weight += voxel.weight;
}

/// In voxels; 0 where nobody voted.
DTSDF_HD float votedSdf(const CornerVote& vote) {
  return vote.votes > 0.0f ? vote.sum / vote.votes : 0.0f;
}

DTSDF_HD CornerVote voteOnCorner(const UnitSamples& samples, int corner, int excluded_direction) {
  CornerVote vote{0.0f, 0.0f, 0.0f};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (d != excluded_direction) castVote(vote, samples.corner[d][corner]);
  }
  return vote;
}

/// Whether some speaking direction of a sheet can see a component; where no parallel edge is
/// crossed, the direction's own gradient has already spoken.
DTSDF_HD bool isVisible(uint8_t component, const float (&confidence)[kDirectionCount],
                        int excluded_direction) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (d == excluded_direction || !(confidence[d] > 0.0f)) continue;
    if (judgeComponent(component, d) != Verdict::kReject) return true;
  }
  return false;
}

/// Marching cubes index of the sheet that `leader` leads; 0 where there is none.
DTSDF_HD uint8_t sheetIndex(const MeshTables& tables, const UnitSamples& samples,
                            const float (&confidence)[kDirectionCount], int leader,
                            float least_weight) {
  const int opposite = leader ^ 1;
  unsigned labels = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    const CornerVote vote = voteOnCorner(samples, c, opposite);
    if (!(vote.weight > least_weight)) return 0;
    labels |= (votedSdf(vote) < 0.0f ? 1u : 0u) << c;
  }
  uint8_t index = static_cast<uint8_t>(labels);
  for (int i = 0; i < tables.component_count[labels]; ++i) {
    const uint8_t component = tables.component[labels][i];
    if (!isVisible(component, confidence, opposite)) index = removeComponent(index, component);
  }
  return index == 255 ? 0 : index;
}

/// Plain marching cubes of the undirected map.
DTSDF_HD uint8_t undirectedIndex(const Voxel (&corner)[kCubeCorners]) {
  unsigned index = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (!(corner[c].weight > 0.0f)) return 0;
    index |= (corner[c].sdf < 0.0f ? 1u : 0u) << c;
  }
  return index == 255u ? 0 : static_cast<uint8_t>(index);
}

/// All stages up to the regularisation, for one unit.
DTSDF_HD UnitIndices indexUnit(const MeshTables& tables, const UnitSamples& samples,
                               bool directional) {
  if (!directional) return {{undirectedIndex(samples.corner[0]), 0}};
  const float least_weight = kWeightShare * greatestWeight(samples);
  float confidence[kDirectionCount];
  int leader = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    confidence[d] = directionConfidence(samples.corner[d], d, least_weight);
    if (confidence[d] > confidence[leader]) leader = d;
  }
  UnitIndices result{{0, 0}};
  if (!(confidence[leader] > 0.0f)) return result;
  result.sheet[0] = sheetIndex(tables, samples, confidence, leader, least_weight);
  if (confidence[leader ^ 1] > 0.0f) {
    const uint8_t other = sheetIndex(tables, samples, confidence, leader ^ 1, least_weight);
    if (other != result.sheet[0]) result.sheet[result.sheet[0] == 0 ? 0 : 1] = other;
  }
  return result;
}

/// The unit across face 0 to 5: -x, +x, -y, +y, -z, +z.
DTSDF_HD Vec3i faceOffset(int face) {
  const int32_t step = (face & 1) ? 1 : -1;
  return {face >> 1 == 0 ? step : 0, face >> 1 == 1 ? step : 0, face >> 1 == 2 ? step : 0};
}

/// Labels of the four corners on a face of a unit, as seen from the unit across it: the neighbour's
/// corner c with the axis bit flipped is the own corner on that face.
DTSDF_HD uint8_t mirrorFace(uint8_t index, int axis) {
  const unsigned lower_corners = axis == 0 ? 0x55u : (axis == 1 ? 0x33u : 0x0Fu);
  const int shift = 1 << axis;
  return static_cast<uint8_t>(((index & lower_corners) << shift) |
                              ((index >> shift) & lower_corners));
}

DTSDF_HD unsigned faceCorners(int face) {
  const int axis = face >> 1;
  const unsigned lower_corners = axis == 0 ? 0x55u : (axis == 1 ? 0x33u : 0x0Fu);
  return (face & 1) ? lower_corners << (1 << axis) : lower_corners;
}

/// Whether two labellings of a face are traces of one surface: some edge of the face is crossed by
/// both in the same way, and none in opposite ways.
DTSDF_HD bool continueAcross(uint8_t a, uint8_t b, int face) {
  const unsigned shared = faceCorners(face);
  unsigned same = 0, opposite = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == face >> 1) continue;
    const ParallelCrossings in_a = parallelCrossings(a, axis), in_b = parallelCrossings(b, axis);
    same |= (in_a.rising & in_b.rising) | (in_a.falling & in_b.falling);
    opposite |= (in_a.rising & in_b.falling) | (in_a.falling & in_b.rising);
  }
  return (same & shared) != 0 && (opposite & shared) == 0;
}

/// The labels that a neighbour gives the corners on a face, from whichever of its sheets continues
/// the surface of `index`; -1 if none does.
DTSDF_HD int labelsAcross(uint8_t index, const UnitIndices& neighbour, int face) {
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t labels = mirrorFace(neighbour.sheet[s], face >> 1);
    if (neighbour.sheet[s] != 0 && continueAcross(index, labels, face)) return labels;
  }
  return -1;
}

/// Regularisation (paper, Sec. V-F): a corner takes the side that most of the units around it give
/// it, among the face neighbours whose surface continues this one. Reads the indices as they were
/// before regularisation, so the result does not depend on any order.
DTSDF_HD UnitIndices regulariseUnit(const UnitIndices& own, const UnitIndices (&neighbours)[6]) {
  UnitIndices result = own;
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = own.sheet[s];
    if (index == 0) continue;
    int votes[kCubeCorners];  // of the unit itself and of up to three neighbours
    for (int c = 0; c < kCubeCorners; ++c) votes[c] = (index >> c & 1) ? 1 : -1;
    for (int face = 0; face < 6; ++face) {
      const int labels = labelsAcross(index, neighbours[face], face);
      if (labels < 0) continue;
      for (int c = 0; c < kCubeCorners; ++c) {
        if (faceCorners(face) >> c & 1) votes[c] += (labels >> c & 1) ? 1 : -1;
      }
    }
    unsigned settled = 0;
    for (int c = 0; c < kCubeCorners; ++c) {
      const bool behind = votes[c] > 0 || (votes[c] == 0 && (index >> c & 1));
      settled |= (behind ? 1u : 0u) << c;
    }
    result.sheet[s] = settled == 255u ? 0 : static_cast<uint8_t>(settled);
  }
  return result;
}

/// The two samples of an edge, per direction.
struct EdgeSamples {
  Voxel lower[kDirectionCount], upper[kDirectionCount];
};

/// Vertices keep off the corners by this share of an edge, so that no triangle is degenerate.
constexpr float kVertexMargin = 1.0f / 1024.0f;

/// Position of the surface on an edge, as a share of it from the lower end: the weighted mean of the
/// zero crossings of the directions with the given facing (paper, Sec. V-D), where a direction counts
/// by the product of its two weights. Facing 0 is behind at the lower end.
DTSDF_HD float edgeOffset(const EdgeSamples& edge, int axis, int facing) {
  float sum = 0.0f, sum_weight = 0.0f;
  CornerVote lower{0.0f, 0.0f, 0.0f}, upper{0.0f, 0.0f, 0.0f};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directionAxis(d) == axis && (d & 1) != facing) continue;
    const Voxel& a = edge.lower[d];
    const Voxel& b = edge.upper[d];
    castVote(lower, a);
    castVote(upper, b);
    const bool crosses = facing == 0 ? a.sdf < 0.0f && !(b.sdf < 0.0f)
                                     : !(a.sdf < 0.0f) && b.sdf < 0.0f;
    const float weight = a.weight * b.weight;
    if (!crosses || !(weight > 0.0f)) continue;
    sum += weight * (a.sdf / (a.sdf - b.sdf));
    sum_weight += weight;
  }
  // Where no direction on its own crosses, the vertex goes to the end that is nearer to the surface.
  const float from_lower = fabsf(votedSdf(lower)), from_upper = fabsf(votedSdf(upper));
  float offset = 0.5f;
  if (sum_weight > 0.0f) {
    offset = sum / sum_weight;
  } else if (from_lower + from_upper > 0.0f) {
    offset = from_lower / (from_lower + from_upper);
  }
  return fminf(fmaxf(offset, kVertexMargin), 1.0f - kVertexMargin);
}

}  // namespace dtsdf
