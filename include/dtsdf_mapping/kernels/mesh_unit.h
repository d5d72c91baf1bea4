/// Directional marching cubes: what happens to one mesh unit, and to one edge.
///
/// The stages are those of the paper's Sec. V. For each direction the unit's marching cubes index is
/// formed and its impossible components removed (intra-directional filter); directions vote on what
/// remains (inter-directional filter); the survivors are combined into at most two indices, one per
/// facing sheet; and disagreements with the neighbouring units are settled (regularisation).
/// Vertices belong to (edge, facing) and depend on the edge's two samples alone, so all units
/// around an edge share them.
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

DTSDF_HD bool isObserved(const Voxel (&corner)[kCubeCorners]) {
  for (int c = 0; c < kCubeCorners; ++c) {
    if (!(corner[c].weight > 0.0f)) return false;
  }
  return true;
}

DTSDF_HD uint8_t marchingCubesIndex(const Voxel (&corner)[kCubeCorners]) {
  unsigned index = 0;
  for (int c = 0; c < kCubeCorners; ++c) index |= (corner[c].sdf < 0.0f ? 1u : 0u) << c;
  return static_cast<uint8_t>(index);
}

/// Gradient of the trilinear interpolation at the unit's centre, per voxel.
DTSDF_HD Vec3f unitGradient(const Voxel (&corner)[kCubeCorners]) {
  Vec3f g{0.0f, 0.0f, 0.0f};
  for (int c = 0; c < kCubeCorners; ++c) {
    const float s = corner[c].sdf;
    g.x += (c & 1) ? s : -s;
    g.y += (c & 2) ? s : -s;
    g.z += (c & 4) ? s : -s;
  }
  return 0.25f * g;
}

DTSDF_HD float meanWeight(const Voxel (&corner)[kCubeCorners]) {
  float sum = 0.0f;
  for (int c = 0; c < kCubeCorners; ++c) sum += corner[c].weight;
  return 0.125f * sum;
}

/// What one direction says about a unit.
struct DirectionalIndex {
  bool observed;
  uint8_t index;      ///< After the intra-directional filter; 0 if nothing is left.
  float confidence;   ///< Weight times compliance of the gradient with the direction; >= 0.
};

/// Marching cubes index of one direction without the components that cannot belong to it.
DTSDF_HD DirectionalIndex filterDirection(const MeshTables& tables,
                                          const Voxel (&corner)[kCubeCorners], int direction,
                                          bool directional) {
  DirectionalIndex result{isObserved(corner), 0, 0.0f};
  if (!result.observed) return result;
  const uint8_t index = marchingCubesIndex(corner);
  const Vec3f gradient = unitGradient(corner);
  const float length = norm(gradient);
  const float cosine = length > 0.0f ? directionCosine(gradient, direction) / length : 0.0f;
  result.confidence = meanWeight(corner) * (directional ? fmaxf(cosine, 0.0f) : 1.0f);
  result.index = index == 255 ? 0 : index;
  if (!directional) return result;
  for (int i = 0; i < tables.component_count[index]; ++i) {
    const uint8_t component = tables.component[index][i];
    const Verdict verdict = judgeComponent(component, direction);
    if (verdict == Verdict::kReject ||
        (verdict == Verdict::kAskGradient && cosine < kDirectionThreshold)) {
      result.index = removeComponent(result.index, component);
    }
  }
  if (result.index == 255) result.index = 0;
  return result;
}

/// Inter-directional vote on the surface that `candidate` sees in a unit: the directions that may
/// see the same surface (all but the opposite one) speak for it with a compatible index of their
/// own, and against it with an empty or a contradicting one.
DTSDF_HD bool survivesVote(const DirectionalIndex (&directions)[kDirectionCount], int candidate) {
  float balance = 0.0f;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (d == (candidate ^ 1) || !directions[d].observed) continue;
    const bool agrees = directions[d].index != 0 &&
                        areCompatible(directions[d].index, directions[candidate].index);
    balance += agrees ? directions[d].confidence : -directions[d].confidence;
  }
  return balance >= 0.0f;
}

/// Joins the surviving indices into at most two sheets, most confident first. Compatible ones are
/// joined by a bitwise AND: a corner is behind where all of the sheet's directions say so.
DTSDF_HD UnitIndices combineDirections(DirectionalIndex (&directions)[kDirectionCount]) {
  UnitIndices result{{0, 0}};
  int sheets = 0;
  for (int round = 0; round < kDirectionCount; ++round) {
    int best = -1;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (directions[d].index != 0 &&
          (best < 0 || directions[d].confidence > directions[best].confidence)) {
        best = d;
      }
    }
    if (best < 0) break;
    const uint8_t index = directions[best].index;
    directions[best].index = 0;
    bool joined = false;
    for (int s = 0; s < sheets && !joined; ++s) {
      const uint8_t both = result.sheet[s] & index;
      if (!areCompatible(result.sheet[s], index)) continue;
      // An AND of nothing would delete a surface that both directions see: keep the better one.
      if (both != 0) result.sheet[s] = both;
      joined = true;
    }
    if (!joined && sheets < kMaxSheets) result.sheet[sheets++] = index;
  }
  return result;
}

/// All stages up to the combination, for one unit.
DTSDF_HD UnitIndices indexUnit(const MeshTables& tables, const UnitSamples& samples,
                               bool directional) {
  DirectionalIndex directions[kDirectionCount];
  for (int d = 0; d < kDirectionCount; ++d) {
    directions[d] = filterDirection(tables, samples.corner[d], d, directional);
    if (!directional) return {{directions[0].index, 0}};
  }
  bool survives[kDirectionCount];
  for (int d = 0; d < kDirectionCount; ++d) {
    survives[d] = directions[d].index != 0 && survivesVote(directions, d);
  }
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!survives[d]) directions[d].index = 0;
  }
  return combineDirections(directions);
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

/// Regularisation (paper, Sec. V-F): a corner takes the side that most of the units around it give
/// it, among the face neighbours whose surface continues this one. Reads the indices as they were
/// before regularisation, so the result does not depend on any order.
DTSDF_HD UnitIndices regulariseUnit(const UnitIndices& own, const UnitIndices (&neighbours)[6]) {
  UnitIndices result = own;
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = own.sheet[s];
    if (index == 0) continue;
    int votes[kCubeCorners];
    for (int c = 0; c < kCubeCorners; ++c) votes[c] = (index >> c & 1) ? 1 : -1;
    for (int face = 0; face < 6; ++face) {
      const unsigned shared = faceCorners(face);
      int best = -1, best_difference = 3;  // a face that differs in three corners is another surface
      for (int t = 0; t < kMaxSheets; ++t) {
        if (neighbours[face].sheet[t] == 0) continue;
        const unsigned label = mirrorFace(neighbours[face].sheet[t], face >> 1);
        int difference = 0;
        for (unsigned bits = (label ^ index) & shared; bits != 0; bits &= bits - 1) ++difference;
        if (difference < best_difference) {
          best_difference = difference;
          best = static_cast<int>(label);
        }
      }
      if (best < 0) continue;
      for (int c = 0; c < kCubeCorners; ++c) {
        if (shared >> c & 1) votes[c] += (best >> c & 1) ? 1 : -1;
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
/// zero crossings of the directions with the given facing (paper, Sec. V-D). Facing 0 is behind at
/// the lower end.
DTSDF_HD float edgeOffset(const EdgeSamples& edge, int axis, int facing) {
  float sum = 0.0f, sum_weight = 0.0f;      // crossings with the right facing
  float lower = 0.0f, upper = 0.0f, all = 0.0f;  // weighted distances, to fall back on
  for (int d = 0; d < kDirectionCount; ++d) {
    const Voxel& a = edge.lower[d];
    const Voxel& b = edge.upper[d];
    if (!(a.weight > 0.0f && b.weight > 0.0f)) continue;
    if (directionAxis(d) == axis && (d & 1) != facing) continue;
    const float weight = a.weight + b.weight;
    lower += weight * a.sdf;
    upper += weight * b.sdf;
    all += weight;
    const bool crosses = facing == 0 ? a.sdf < 0.0f && !(b.sdf < 0.0f)
                                     : !(a.sdf < 0.0f) && b.sdf < 0.0f;
    if (!crosses) continue;
    sum += weight * (a.sdf / (a.sdf - b.sdf));
    sum_weight += weight;
  }
  float offset = 0.5f;
  if (sum_weight > 0.0f) {
    offset = sum / sum_weight;
  } else if (all > 0.0f && (lower < 0.0f) != (upper < 0.0f)) {
    offset = lower / (lower - upper);
  }
  return fminf(fmaxf(offset, kVertexMargin), 1.0f - kVertexMargin);
}

}  // namespace dtsdf
