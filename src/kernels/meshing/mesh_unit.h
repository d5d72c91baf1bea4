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

#include "kernels/core/direction.h"
#include "kernels/core/select.h"
#include "kernels/core/voxel.h"
#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

constexpr int kMaxSheets = 2;

/// Distances and weights at the eight corners of a unit, per direction; weight 0 is unobserved.
///
/// The rules below take this or any other `Samples` with the same members: one whose Real holds the
/// values of several neighbouring units works on all of them at once.
struct UnitSamples {
  using Real = float;    ///< A value per unit.
  using Bits = int32_t;  ///< An integer per unit.
  static constexpr int kUnits = 1;

  Voxel corner[kDirectionCount][kCubeCorners];

  DTSDF_HD float sdf(int direction, int c) const { return corner[direction][c].sdf; }
  DTSDF_HD float weight(int direction, int c) const { return corner[direction][c].weight; }
  /// May be false where the direction has no weight, or does not see both sides of a surface.
  DTSDF_HD bool isObserved(int) const { return true; }
  DTSDF_HD bool maySpeak(int) const { return true; }
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

template <class Samples>
DTSDF_HD typename Samples::Real greatestWeight(const Samples& samples) {
  typename Samples::Real greatest{0.0f};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    for (int c = 0; c < kCubeCorners; ++c) greatest = maximum(greatest, samples.weight(d, c));
  }
  return greatest;
}

/// Rise of a direction's distance along one axis: weighted mean over the unit's edges that it has
/// observed; 0 where there is none.
template <class Samples, class Real>
DTSDF_HD Real riseAlong(const Samples& samples, int direction, int axis, const Real& least_weight) {
  const Real zero{0.0f};
  Real rise = zero, total = zero;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (c >> axis & 1) continue;
    const int upper = c | 1 << axis;
    const Real weight_c = samples.weight(direction, c);
    const Real weight_upper = samples.weight(direction, upper);
    const auto known = (weight_c > least_weight) & (weight_upper > least_weight);
    const Real weight = weight_c + weight_upper;
    const Real step = samples.sdf(direction, upper) - samples.sdf(direction, c);
    rise = rise + select(known, weight * step, zero);
    total = total + select(known, weight, zero);
  }
  return select(total > zero, rise / total, zero);
}

/// How strongly a direction speaks for a surface in the unit; 0 if it does not. It has to see both
/// sides of the surface, and the gradient of its distance has to lie in its range (the gradient check
/// of the paper's intra-directional filter). Only the gradient's direction counts: noise makes it
/// shorter.
template <class Samples, class Real>
DTSDF_HD Real directionConfidence(const Samples& samples, int direction, const Real& least_weight) {
  const Real zero{0.0f};
  Real weight = zero;
  auto in_front = zero > zero, behind = in_front;
  for (int c = 0; c < kCubeCorners; ++c) {
    const Real corner_weight = samples.weight(direction, c), sdf = samples.sdf(direction, c);
    const auto known = corner_weight > least_weight;
    weight = weight + select(known, corner_weight, zero);
    behind = behind | (known & (sdf < zero));
    in_front = in_front | (known & (sdf >= zero));
  }
  const auto sees_both = in_front & behind;
  if (!any(sees_both)) return zero;
  const Real rise[3] = {riseAlong(samples, direction, 0, least_weight),
                        riseAlong(samples, direction, 1, least_weight),
                        riseAlong(samples, direction, 2, least_weight)};
  const Real length = squareRoot(rise[0] * rise[0] + rise[1] * rise[1] + rise[2] * rise[2]);
  const Real along = rise[directionAxis(direction)] * Real{directionSign(direction)};
  const Real cosine = along / length;
  return select(sees_both & (length > zero) & (cosine > Real{kDirectionThreshold}),
                weight * cosine, zero);
}

/// The vote on one corner: weighted mean of the distances of several directions. Each counts by its
/// squared weight and by how near its surface is, since the nearest surface decides the sign.
template <class Real>
struct CornerVote {
  Real sum{0.0f}, votes{0.0f}, weight{0.0f};
};

/// Only where `takes_part` and where the weight is not 0.
template <class Real, class Mask>
DTSDF_HD void castVote(CornerVote<Real>& vote, const Real& sdf, const Real& weight,
                       const Mask& takes_part) {
  const Real zero{0.0f};
  const auto counts = takes_part & (weight > zero);
  if (!any(counts)) return;
  const Real strength = weight / (Real{kNearness} + magnitude(sdf));
  const Real squared = strength * strength;
  vote.sum = vote.sum + select(counts, squared * sdf, zero);
  vote.votes = vote.votes + select(counts, squared, zero);
  vote.weight = vote.weight + select(counts, weight, zero);
}

/// In voxels; 0 where nobody voted.
template <class Real>
DTSDF_HD Real votedSdf(const CornerVote<Real>& vote) {
  const Real zero{0.0f};
  return select(vote.votes > zero, vote.sum / vote.votes, zero);
}

/// Marching cubes labels of a sheet, by the vote of all directions but one; 0 where some corner has
/// too little weight.
template <class Samples, class Real, class Bits>
DTSDF_HD Bits voteOnCorners(const Samples& samples, const Bits& excluded_direction,
                            const Real& least_weight) {
  const Bits none{0};
  Bits labels = none;
  auto known = none == none;
  for (int c = 0; c < kCubeCorners; ++c) {
    CornerVote<Real> vote;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!samples.isObserved(d)) continue;
      castVote(vote, samples.sdf(d, c), samples.weight(d, c), excluded_direction != Bits{d});
    }
    known = known & (vote.weight > least_weight);
    if (!any(known)) return none;
    labels = labels | select(votedSdf(vote) < Real{0.0f}, Bits{1 << c}, none);
  }
  return select(known, labels, none);
}

/// Which directions speak (bit d), and which lead the unit's sheets; -1 for no sheet.
template <class Bits>
struct Leaders {
  Bits speaking{0};
  Bits direction[kMaxSheets] = {Bits{-1}, Bits{-1}};
};

/// The strongest direction leads, of equal ones the first; the second sheet is for its opposite.
template <class Bits, class Real>
DTSDF_HD Leaders<Bits> chooseLeaders(const Real (&confidence)[kDirectionCount]) {
  const Real zero{0.0f};
  const Bits none{0};
  Leaders<Bits> leaders;
  Real greatest = zero;
  for (int d = 0; d < kDirectionCount; ++d) {
    const auto leads = confidence[d] > greatest;
    leaders.speaking = leaders.speaking | select(confidence[d] > zero, Bits{1 << d}, none);
    leaders.direction[0] = select(leads, Bits{d}, leaders.direction[0]);
    greatest = select(leads, confidence[d], greatest);
  }
  for (int d = 0; d < kDirectionCount; ++d) {
    const auto opposes = (confidence[d] > zero) & (leaders.direction[0] == Bits{d ^ 1});
    leaders.direction[1] = select(opposes, Bits{d}, leaders.direction[1]);
  }
  return leaders;
}

/// Whether some speaking direction of a sheet can see a component; where no parallel edge is
/// crossed, the direction's own gradient has already spoken.
DTSDF_HD bool isVisible(uint8_t component, unsigned speaking) {
  for (unsigned d = 0, rest = speaking; rest != 0; ++d, rest >>= 1) {
    if ((rest & 1) && judgeComponent(component, static_cast<int>(d)) != Verdict::kReject) {
      return true;
    }
  }
  return false;
}

/// Marching cubes index of a sheet: its labels without the components that none of the sheet's
/// speaking directions can see.
DTSDF_HD uint8_t sheetIndex(const MeshTables& tables, unsigned labels, unsigned speaking) {
  uint8_t index = static_cast<uint8_t>(labels);
  for (int i = 0; i < tables.component_count[labels]; ++i) {
    const uint8_t component = tables.component[labels][i];
    if (!isVisible(component, speaking)) index = removeComponent(index, component);
  }
  return index == 255 ? 0 : index;
}

/// Plain marching cubes of the undirected map.
template <class Samples>
DTSDF_HD void undirectedIndices(const Samples& samples, UnitIndices (&result)[Samples::kUnits]) {
  using Bits = typename Samples::Bits;
  const typename Samples::Real zero{0.0f};
  const Bits none{0};
  Bits labels = none;
  auto known = none == none;
  for (int c = 0; c < kCubeCorners; ++c) {
    known = known & (samples.weight(0, c) > zero);
    labels = labels | select(samples.sdf(0, c) < zero, Bits{1 << c}, none);
  }
  labels = select(known & (labels != Bits{255}), labels, none);
  for (int k = 0; k < Samples::kUnits; ++k) {
    result[k] = {{static_cast<uint8_t>(lane(labels, k)), 0}};
  }
}

/// Indices of the first or second sheets; 0 where there is no leader.
template <class Samples, class Real, class Bits>
DTSDF_HD void sheetIndices(const MeshTables& tables, const Samples& samples, int sheet,
                           const Leaders<Bits>& leaders, const Real& least_weight,
                           uint8_t (&result)[Samples::kUnits]) {
  for (uint8_t& index : result) index = 0;
  const Bits leader = leaders.direction[sheet], none{0};
  const auto has_leader = leader != Bits{-1};
  if (!any(has_leader)) return;
  const Bits opposite = leader ^ Bits{1};
  const Bits labels =
      select(has_leader, voteOnCorners(samples, opposite, least_weight), none);
  if (!any(labels != none)) return;
  for (int k = 0; k < Samples::kUnits; ++k) {
    const unsigned speaking = static_cast<unsigned>(lane(leaders.speaking, k));
    result[k] = sheetIndex(tables, static_cast<unsigned>(lane(labels, k)),
                           speaking & ~(1u << (lane(opposite, k) & 7)));
  }
}

/// All stages up to the regularisation.
template <class Samples>
DTSDF_HD void indexUnits(const MeshTables& tables, const Samples& samples, bool directional,
                         UnitIndices (&result)[Samples::kUnits]) {
  using Real = typename Samples::Real;
  constexpr int kUnits = Samples::kUnits;
  if (!directional) return undirectedIndices(samples, result);
  const Real zero{0.0f};
  const Real least_weight = Real{kWeightShare} * greatestWeight(samples);
  Real confidence[kDirectionCount];
  for (int d = 0; d < kDirectionCount; ++d) {
    confidence[d] = samples.maySpeak(d) ? directionConfidence(samples, d, least_weight) : zero;
  }
  const auto leaders = chooseLeaders<typename Samples::Bits>(confidence);
  uint8_t first[kUnits], second[kUnits];
  sheetIndices(tables, samples, 0, leaders, least_weight, first);
  sheetIndices(tables, samples, 1, leaders, least_weight, second);
  for (int k = 0; k < kUnits; ++k) {
    if (second[k] == first[k]) second[k] = 0;
    result[k] = first[k] != 0 ? UnitIndices{{first[k], second[k]}} : UnitIndices{{second[k], 0}};
  }
}

/// The same for a single unit.
DTSDF_HD UnitIndices indexUnit(const MeshTables& tables, const UnitSamples& samples,
                               bool directional) {
  UnitIndices result[1];
  indexUnits(tables, samples, directional, result);
  return result[0];
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

/// Whether a neighbour can disagree with `index` about a corner of the face between them.
DTSDF_HD bool mayDisagree(uint8_t index, const UnitIndices& neighbour, int face) {
  const unsigned shared = faceCorners(face);
  bool differs = false;
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t labels = mirrorFace(neighbour.sheet[s], face >> 1);
    differs = differs || (neighbour.sheet[s] != 0 && ((labels ^ index) & shared) != 0);
  }
  return differs;
}

/// Regularisation (paper, Sec. V-F): a corner takes the side that most of the units around it give
/// it, among the face neighbours whose surface continues this one. Reads the indices as they were
/// before regularisation, so the result does not depend on any order.
///
/// Of the unit and up to three neighbours, most are against the unit only if two disagree with it
/// and none agrees.
DTSDF_HD uint8_t regulariseSheet(uint8_t index, const UnitIndices (&neighbours)[6]) {
  int faces = 0;
  for (int face = 0; face < 6; ++face) faces += mayDisagree(index, neighbours[face], face) ? 1 : 0;
  if (faces < 2) return index;
  unsigned agreed = 0, disagreed = 0, disagreed_twice = 0;  // bits of corners
  for (int face = 0; face < 6; ++face) {
    const int labels = labelsAcross(index, neighbours[face], face);
    if (labels < 0) continue;
    const unsigned shared = faceCorners(face), differing = (labels ^ index) & shared;
    agreed |= shared & ~differing;
    disagreed_twice |= disagreed & differing;
    disagreed |= differing;
  }
  const uint8_t settled = static_cast<uint8_t>(index ^ (disagreed_twice & ~agreed));
  return settled == 255 ? 0 : settled;
}

DTSDF_HD UnitIndices regulariseUnit(const UnitIndices& own, const UnitIndices (&neighbours)[6]) {
  UnitIndices result = own;
  for (uint8_t& index : result.sheet) {
    if (index != 0) index = regulariseSheet(index, neighbours);
  }
  return result;
}

/// The two samples of an edge, per direction. The rules below take any other type with the same
/// members, too.
struct EdgeSamples {
  Voxel lower[kDirectionCount], upper[kDirectionCount];
};

/// Vertices keep off the corners by this share of an edge, so that no triangle is degenerate.
constexpr float kVertexMargin = 1.0f / 1024.0f;

/// Whether a direction has a say on an edge: all but the one that faces against it.
DTSDF_HD bool speaksOnEdge(int direction, int axis, int facing) {
  return directionAxis(direction) != axis || (direction & 1) == facing;
}

/// Where no direction on its own crosses an edge, its vertex goes to the end that is nearer to the
/// voted surface.
template <class Edge>
DTSDF_HD float votedOffset(const Edge& edge, int axis, int facing) {
  CornerVote<float> lower, upper;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!speaksOnEdge(d, axis, facing)) continue;
    const Voxel a = edge.lower[d], b = edge.upper[d];
    castVote(lower, a.sdf, a.weight, true);
    castVote(upper, b.sdf, b.weight, true);
  }
  const float from_lower = fabsf(votedSdf(lower)), from_upper = fabsf(votedSdf(upper));
  return from_lower + from_upper > 0.0f ? from_lower / (from_lower + from_upper) : 0.5f;
}

/// Position of the surface on an edge, as a share of it from the lower end: the weighted mean of the
/// zero crossings of the directions with the given facing (paper, Sec. V-D), where a direction counts
/// by the product of its two weights. Facing 0 is behind at the lower end.
template <class Edge>
DTSDF_HD float edgeOffset(const Edge& edge, int axis, int facing) {
  float sum = 0.0f, sum_weight = 0.0f;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!speaksOnEdge(d, axis, facing)) continue;
    const Voxel a = edge.lower[d], b = edge.upper[d];
    const bool crosses = facing == 0 ? a.sdf < 0.0f && !(b.sdf < 0.0f)
                                     : !(a.sdf < 0.0f) && b.sdf < 0.0f;
    if (!crosses || !(a.weight > 0.0f && b.weight > 0.0f)) continue;
    const float weight = a.weight * b.weight;
    sum += weight * (a.sdf / (a.sdf - b.sdf));
    sum_weight += weight;
  }
  const float offset = sum_weight > 0.0f ? sum / sum_weight : votedOffset(edge, axis, facing);
  return minimum(maximum(offset, kVertexMargin), 1.0f - kVertexMargin);
}

}  // namespace dtsdf
