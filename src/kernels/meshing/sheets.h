/// The index stage: marching cubes indices of a unit's sheets, from its samples.
///
/// The strongest direction that speaks leads a first sheet; if the opposite one speaks as well, it
/// leads a second. All directions but the one opposite to the leader vote on a sheet's corners; of
/// the components of the labels, those are kept that some speaking direction can see, and that
/// cross no edge where too little is known.
#pragma once

#include "kernels/meshing/crossings.h"
#include "kernels/meshing/leaders.h"
#include "kernels/meshing/vote.h"

namespace dtsdf {

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
/// speaking directions can see, and without those that have a weak crossing.
DTSDF_HD uint8_t sheetIndex(const MeshTables& tables, unsigned labels, unsigned speaking,
                            unsigned weak_crossings) {
  uint8_t index = static_cast<uint8_t>(labels);
  for (int i = 0; i < tables.component_count[labels]; ++i) {
    const uint8_t component = tables.component[labels][i];
    const bool is_kept = isVisible(component, speaking) && !crossesAny(component, weak_crossings);
    if (!is_kept) index = removeComponent(index, component);
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

/// Labels of the units' sheets with the given leaders; 0 where there is none (-1).
template <class Samples, class Real, class Bits>
DTSDF_HD Bits sheetLabels(const Samples& samples, const Bits& leader,
                          const VoteLimits<Real>& limits) {
  const Bits none{0};
  const auto has_leader = leader != Bits{-1};
  if (!any(has_leader)) return none;
  return select(has_leader, voteOnCorners(samples, leader ^ Bits{1}, limits), none);
}

/// Indices of the units' sheets with the given leaders, one per unit.
template <class Samples, class Real, class Bits>
DTSDF_HD void sheetIndices(const MeshTables& tables, const MeshRules& rules,
                           const Samples& samples, const VoteLimits<Real>& limits,
                           const Bits& leader, const Bits& speaking,
                           uint8_t (&result)[Samples::kUnits]) {
  for (uint8_t& index : result) index = 0;
  const Bits labels = sheetLabels(samples, leader, limits);
  if (!any(labels != Bits{0})) return;
  const Bits weak = weakCrossings(rules, samples, labels, limits.greatest_weight);
  const Bits opposite = leader ^ Bits{1};
  for (int k = 0; k < Samples::kUnits; ++k) {
    const unsigned all = static_cast<unsigned>(lane(speaking, k));
    result[k] = sheetIndex(tables, static_cast<unsigned>(lane(labels, k)),
                           all & ~(1u << (lane(opposite, k) & 7)),
                           static_cast<unsigned>(lane(weak, k)));
  }
}

/// A second sheet that equals the first is none; the first is the one that is there.
DTSDF_HD UnitIndices orderSheets(uint8_t first, uint8_t second) {
  if (second == first) second = 0;
  return first != 0 ? UnitIndices{{first, second}} : UnitIndices{{second, 0}};
}

/// The index stage, for all units of the samples at once.
template <class Samples>
DTSDF_HD void indexUnits(const MeshTables& tables, const MeshRules& rules, const Samples& samples,
                         bool directional, UnitIndices (&result)[Samples::kUnits]) {
  constexpr int kUnits = Samples::kUnits;
  if (!directional) return undirectedIndices(samples, result);
  const auto limits = makeVoteLimits(rules, samples);
  const auto leaders = findLeaders(samples, limits.least_weight);
  uint8_t first[kUnits], second[kUnits];
  sheetIndices(tables, rules, samples, limits, leaders.direction[0], leaders.speaking, first);
  sheetIndices(tables, rules, samples, limits, leaders.direction[1], leaders.speaking, second);
  for (int k = 0; k < kUnits; ++k) result[k] = orderSheets(first[k], second[k]);
}

/// The same for a single unit.
DTSDF_HD UnitIndices indexUnit(const MeshTables& tables, const MeshRules& rules,
                               const UnitSamples& samples, bool directional) {
  UnitIndices result[1];
  indexUnits(tables, rules, samples, directional, result);
  return result[0];
}

}  // namespace dtsdf
