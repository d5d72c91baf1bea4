/// Lets the directions vote on which side of a sheet each corner of a unit lies.
#pragma once

#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The vote on one corner: a weighted mean of the directions' distances. A direction's influence
/// grows with its weight and with the nearness of its surface, as the nearest surface should decide
/// the sign:
///   sdf = sum(v_d sdf_d) / sum(v_d),  v_d = (weight_d / (nearness + |sdf_d|))^2.
template <class Real>
struct CornerVote {
  Real sum{0.0f}, votes{0.0f}, weight{0.0f};
};

/// Adds one direction's vote where `counts` holds.
template <class Real, class Mask>
DTSDF_HD void addVote(CornerVote<Real>& vote, const Real& sdf, const Real& weight,
                      const Mask& counts, const Real& nearness) {
  const Real zero{0.0f};
  const Real strength = weight / (nearness + magnitude(sdf));
  const Real squared = strength * strength;
  vote.sum = vote.sum + select(counts, squared * sdf, zero);
  vote.votes = vote.votes + select(counts, squared, zero);
  vote.weight = vote.weight + select(counts, weight, zero);
}

/// Adds one direction's vote if it `takes_part` and its weight is positive.
template <class Real, class Mask>
DTSDF_HD void castVote(CornerVote<Real>& vote, const Real& sdf, const Real& weight,
                       const Mask& takes_part, const Real& nearness) {
  const auto counts = takes_part & (weight > Real{0.0f});
  if (shouldBranch(counts)) addVote(vote, sdf, weight, counts, nearness);
}

/// The voted distance, in voxels; 0 if there are no votes.
template <class Real>
DTSDF_HD Real votedSdf(const CornerVote<Real>& vote) {
  const Real zero{0.0f};
  return select(vote.votes > zero, vote.sum / vote.votes, zero);
}

constexpr int kUnknown = -1;

/// Marching cubes labels of a sheet (bit c is set if corner c is behind), by the vote of all
/// directions except the excluded one; kUnknown if the sum of the voting directions' weights at
/// some corner does not exceed `min_weight`.
template <class Samples, class Real, class Bits>
DTSDF_HD Bits voteOnCorners(const MeshRules& rules, const Samples& samples,
                            const Bits& excluded_direction, const Real& min_weight) {
  const Real nearness{rules.nearness_voxels};
  const Bits none{0}, not_known{kUnknown};
  Bits labels = none;
  auto known = none == none;
  for (int c = 0; c < kCubeCorners; ++c) {
    CornerVote<Real> vote;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!samples.isObserved(d)) continue;
      castVote(vote, samples.sdf(d, c), samples.weight(d, c), excluded_direction != Bits{d},
               nearness);
    }
    known = known & (vote.weight > min_weight);
    if (!any(known)) return not_known;
    labels = labels | select(vote.sum < Real{0.0f}, Bits{1 << c}, none);  // the sign of votedSdf()
  }
  return select(known, labels, not_known);
}

}  // namespace dtsdf
