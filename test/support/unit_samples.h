/// The samples at the corners of one marching cubes cell (mesh unit), with the interface that
/// labelUnits() expects.
#pragma once

#include "kernels/meshing/sheets.h"

namespace dtsdf {

struct UnitSamples {
  using Real = float;
  using Bits = int32_t;
  static constexpr int kUnits = 1;

  Sample corner[kDirectionCount][kCubeCorners];

  float sdf(int direction, int c) const { return corner[direction][c].sdf; }
  float weight(int direction, int c) const { return corner[direction][c].weight; }
  bool isObserved(int) const { return true; }
  bool mayBeActive(int) const { return true; }
};

inline UnitLabels labelUnit(const MeshTables& tables, const MeshRules& rules,
                            const UnitSamples& samples, bool directional) {
  UnitLabels result[1];
  labelUnits(tables, rules, samples, directional, result);
  return result[0];
}

}  // namespace dtsdf
