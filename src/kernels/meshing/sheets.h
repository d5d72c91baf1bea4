/// The index stage: determines the marching cubes case of each sheet in a unit from the unit's
/// samples (docs/method.md, Index).
#pragma once

#include "kernels/meshing/crossings.h"
#include "kernels/meshing/leaders.h"
#include "kernels/meshing/vote.h"

namespace dtsdf {

/// Marching cubes case of a sheet: its labels without the components that are impossible in all of
/// its active directions. kUnknown if a component has a weak crossing.
DTSDF_HD int sheetIndex(const MeshTables& tables, unsigned labels, unsigned active,
                        unsigned weak_crossings) {
  uint8_t index = static_cast<uint8_t>(labels);
  for (int i = 0; i < tables.component_count[labels]; ++i) {
    const uint8_t component = tables.component[labels][i];
    const uint64_t crossings = tables.crossings[component];
    if (((crossings | crossings >> kFallingBit) & weak_crossings) != 0) return kUnknown;
    if ((tables.seen_from[component] & active) == 0) index = removeComponent(index, component);
  }
  return index;
}

/// Plain marching cubes for an undirected map. All units around a corner assign the same side to
/// it, so units without a surface can stay empty.
template <class Samples>
DTSDF_HD void undirectedLabels(const Samples& samples, UnitLabels (&result)[Samples::kUnits]) {
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
    const auto index = static_cast<unsigned>(lane(labels, k));
    result[k] = index == 0 ? UnitLabels{0, 0} : labelsOfSheets(index, index);
  }
}

/// Computes the marching cubes case of the sheet that `leader` leads, for each unit; kUnknown if
/// the leader is -1 or the sheet is not meshed. `greatest_weight` is the greatest weight at the
/// unit's corners; at each corner, the weights of the directions that vote must add up to more than
/// `min_weight`.
template <class Samples, class Real, class Bits>
DTSDF_HD void sheetIndices(const MeshTables& tables, const MeshRules& rules, const Samples& samples,
                           const Real& greatest_weight, const Real& min_weight, const Bits& leader,
                           const Bits& active, int (&result)[Samples::kUnits]) {
  for (int& index : result) index = kUnknown;
  const auto has_leader = leader != Bits{-1};
  if (!any(has_leader)) return;
  const Bits voted = voteOnCorners(rules, samples, leader ^ Bits{1}, min_weight);
  const Bits labels = select(has_leader, voted, Bits{kUnknown});
  if (!any(labels != Bits{kUnknown})) return;
  const Bits weak = weakCrossings(rules, samples, labels, greatest_weight);
  const Bits opposite = leader ^ Bits { 1 };
  for (int k = 0; k < Samples::kUnits; ++k) {
    if (lane(labels, k) == kUnknown) continue;
    const unsigned all = static_cast<unsigned>(lane(active, k));
    result[k] =
        sheetIndex(tables, static_cast<unsigned>(lane(labels, k)),
                   all & ~(1u << (lane(opposite, k) & 7)), static_cast<unsigned>(lane(weak, k)));
  }
}

DTSDF_HD bool isSurface(int index) { return index > 0 && index < 255; }

/// Labels of a unit whose sheets have these cases. The two sides of a thin object never cross the
/// same edge with the same facing. Two sheets that do are the same surface found twice, for
/// instance where it bends within the unit, so only the first sheet, with the stronger leader, is
/// kept. A sheet without a surface is dropped if the other sheet has one.
DTSDF_HD UnitLabels joinSheets(const MeshTables& tables, int first, int second) {
  if (!isSurface(first) && (isSurface(second) || first == kUnknown)) first = second;
  if (first == kUnknown) return {0, 0};
  const auto a = static_cast<unsigned>(first), b = static_cast<unsigned>(second);
  const bool are_two = isSurface(second) && (tables.crossings[a] & tables.crossings[b]) == 0;
  return labelsOfSheets(a, are_two ? b : a);
}

/// The index stage, for all units of the samples at once.
template <class Samples>
DTSDF_HD void labelUnits(const MeshTables& tables, const MeshRules& rules, const Samples& samples,
                         bool directional, UnitLabels (&result)[Samples::kUnits]) {
  constexpr int kUnits = Samples::kUnits;
  if (!directional) return undirectedLabels(samples, result);
  const auto greatest = maxWeight(samples);
  const auto least = typename Samples::Real{rules.min_weight_share} * greatest;
  typename Samples::Bits leader[kMaxSheets];
  const auto active = findLeaders(samples, least, leader);
  int first[kUnits], second[kUnits];
  sheetIndices(tables, rules, samples, greatest, least, leader[0], active, first);
  sheetIndices(tables, rules, samples, greatest, least, leader[1], active, second);
  for (int k = 0; k < kUnits; ++k) result[k] = joinSheets(tables, first[k], second[k]);
}

}  // namespace dtsdf
