/// A mesh unit as a ray meets it: which side of a surface its corners are on, and how far from it,
/// for surfaces that face the camera.
///
/// Directions lead and vote as for the mesh's sheets (meshing/sheets.h), except that only those
/// lead whose surface faces the camera: of the two sides of a thin plate a ray meets the one in
/// front. Distances are voted as sides are.
#pragma once

#include "kernels/meshing/sheets.h"

namespace dtsdf {

enum class UnitState : int32_t {
  kUnknown,  ///< Nothing is known of some corner, or too little of the surface.
  kFront,    ///< All of it is in front of the surfaces that face the camera.
  kSurface,  ///< `sdf` are the distances at its corners.
};

struct RayUnit {
  UnitState state;
  uint32_t directions;  ///< Those whose surface in the unit faces the camera, a bit each.
  float sdf[kCubeCorners];
};

DTSDF_HD RayUnit unitWithoutSurface(UnitState state) {
  return {state, 0, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}};
}

/// What there is of a unit before anything is said of its surfaces.
struct UnitKnowledge {
  float greatest_weight;
  bool has_corners_behind;  ///< Of any direction.
  bool is_known;            ///< All corners have a weight.
};

template <class Samples>
DTSDF_HD UnitKnowledge lookAtUnit(const Samples& samples) {
  float greatest[kCubeCorners] = {};
  int32_t behind = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    for (int c = 0; c < kCubeCorners; ++c) {
      const float weight = samples.weight(d, c);
      greatest[c] = maximum(greatest[c], weight);
      behind |= static_cast<int32_t>(weight > 0.0f && samples.sdf(d, c) < 0.0f);
    }
  }
  UnitKnowledge unit{0.0f, behind != 0, true};
  for (int c = 0; c < kCubeCorners; ++c) {
    if (!(greatest[c] > 0.0f)) unit.is_known = false;
    unit.greatest_weight = maximum(unit.greatest_weight, greatest[c]);
  }
  return unit;
}

/// The undirected map's only array says it all.
template <class Samples>
DTSDF_HD RayUnit makeUndirectedRayUnit(const Samples& samples) {
  RayUnit unit = unitWithoutSurface(UnitState::kSurface);
  unit.directions = 1;
  for (int c = 0; c < kCubeCorners; ++c) unit.sdf[c] = samples.sdf(0, c);
  return unit;
}

/// The directions that speak for a surface, and the one of them that leads.
struct FacingDirections {
  uint32_t speaking, facing;  ///< A bit each; those whose surface faces the camera.
  int leader;                 ///< The strongest of these; -1: none.
};

/// `away`: from the camera to the unit.
template <class Samples>
DTSDF_HD FacingDirections findFacing(const Samples& samples, float least_weight,
                                     const Vec3f& away) {
  FacingDirections found{0, 0, -1};
  float greatest = 0.0f;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.maySpeak(d)) continue;
    Rise<float> rise{{0.0f, 0.0f, 0.0f}, 0.0f};
    const float confidence = directionConfidence(samples, d, least_weight, rise);
    if (!(confidence > 0.0f)) continue;
    found.speaking |= 1u << d;
    if (!(dot({rise.along[0], rise.along[1], rise.along[2]}, away) < 0.0f)) continue;
    found.facing |= 1u << d;
    if (confidence > greatest) {
      greatest = confidence;
      found.leader = d;
    }
  }
  return found;
}

/// The votes on all corners, side by side: loops over them become vector instructions on a CPU.
struct UnitVotes {
  float sum[kCubeCorners] = {}, votes[kCubeCorners] = {}, weight[kCubeCorners] = {};

  DTSDF_HD CornerVote<float> at(int c) const { return {sum[c], votes[c], weight[c]}; }
  DTSDF_HD void set(int c, const CornerVote<float>& vote) {
    sum[c] = vote.sum;
    votes[c] = vote.votes;
    weight[c] = vote.weight;
  }
};

/// Votes on the distance of each corner, of all directions but those in `excluded`.
/// @return whether all corners are known.
template <class Samples>
DTSDF_HD bool voteOnDistances(const Samples& samples, uint32_t excluded,
                              const VoteLimits<float>& limits, float (&sdf)[kCubeCorners]) {
  UnitVotes votes;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d) || (excluded >> d & 1) != 0) continue;
    for (int c = 0; c < kCubeCorners; ++c) {
      CornerVote<float> vote = votes.at(c);
      const float weight = samples.weight(d, c);
      addVote(vote, samples.sdf(d, c), weight, weight > 0.0f, limits.nearness);
      votes.set(c, vote);
    }
  }
  int32_t known = 0;
  for (int c = 0; c < kCubeCorners; ++c) {
    known += static_cast<int32_t>(votes.weight[c] > limits.least_weight);
    sdf[c] = votedSdf(votes.at(c));
  }
  return known == kCubeCorners;
}

DTSDF_HD int labelsOf(const float (&sdf)[kCubeCorners]) {
  int labels = 0;
  for (int c = 0; c < kCubeCorners; ++c) labels |= sdf[c] < 0.0f ? 1 << c : 0;
  return labels;
}

/// The unit's distances to the sheet that the leader leads: what of it is no surface of the mesh is
/// none here, so its corners are in front.
template <class Samples>
DTSDF_HD RayUnit makeSheet(const MeshTables& tables, const MeshRules& rules, const Samples& samples,
                           const VoteLimits<float>& limits, const FacingDirections& found) {
  RayUnit unit = unitWithoutSurface(UnitState::kSurface);
  unit.directions = found.facing;
  const uint32_t opposite = 1u << (found.leader ^ 1);
  if (!voteOnDistances(samples, opposite, limits, unit.sdf)) {
    return unitWithoutSurface(UnitState::kUnknown);
  }
  const int labels = labelsOf(unit.sdf);
  const int32_t weak = weakCrossings(rules, samples, labels, limits.greatest_weight);
  const int index = sheetIndex(tables, static_cast<unsigned>(labels), found.speaking & ~opposite,
                               static_cast<unsigned>(weak));
  if (index == kNotKnown || index == 255) return unitWithoutSurface(UnitState::kUnknown);
  if (index == 0) return unitWithoutSurface(UnitState::kFront);
  for (int c = 0; c < kCubeCorners; ++c) {
    const float distance = fabsf(unit.sdf[c]);
    unit.sdf[c] = (index >> c & 1) != 0 ? -distance : distance;
  }
  return unit;
}

/// The unit of a camera that looks along `away`, from the camera to the unit's middle.
template <class Samples>
DTSDF_HD RayUnit makeRayUnit(const MeshTables& tables, const MeshRules& rules,
                             const Samples& samples, bool directional, const Vec3f& away) {
  const UnitKnowledge known = lookAtUnit(samples);
  if (!known.is_known) return unitWithoutSurface(UnitState::kUnknown);
  if (!known.has_corners_behind) return unitWithoutSurface(UnitState::kFront);
  if (!directional) return makeUndirectedRayUnit(samples);
  const VoteLimits<float> limits{known.greatest_weight,
                                 rules.least_weight_share * known.greatest_weight,
                                 rules.nearness_voxels};
  const FacingDirections found = findFacing(samples, limits.least_weight, away);
  if (found.leader >= 0) return makeSheet(tables, rules, samples, limits, found);
  // Beside a surface: what speaks for one that faces away says nothing of those that face here.
  float sdf[kCubeCorners];
  const bool is_front = voteOnDistances(samples, found.speaking, limits, sdf) && labelsOf(sdf) == 0;
  return unitWithoutSurface(is_front ? UnitState::kFront : UnitState::kUnknown);
}

/// Distance at a place in the unit, in [0, 1]^3, between those of its corners.
DTSDF_HD float distanceIn(const RayUnit& unit, const Vec3f& at) {
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float* sdf = unit.sdf;
  const float low = mix(mix(sdf[0], sdf[1], at.x), mix(sdf[2], sdf[3], at.x), at.y);
  const float high = mix(mix(sdf[4], sdf[5], at.x), mix(sdf[6], sdf[7], at.x), at.y);
  return mix(low, high, at.z);
}

/// How the distance changes there.
DTSDF_HD Vec3f gradientIn(const RayUnit& unit, const Vec3f& at) {
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float* sdf = unit.sdf;
  const float x00 = mix(sdf[0], sdf[1], at.x), x10 = mix(sdf[2], sdf[3], at.x);
  const float x01 = mix(sdf[4], sdf[5], at.x), x11 = mix(sdf[6], sdf[7], at.x);
  return {mix(mix(sdf[1] - sdf[0], sdf[3] - sdf[2], at.y),
              mix(sdf[5] - sdf[4], sdf[7] - sdf[6], at.y), at.z),
          mix(x10 - x00, x11 - x01, at.z), mix(x01, x11, at.y) - mix(x00, x10, at.y)};
}

}  // namespace dtsdf
