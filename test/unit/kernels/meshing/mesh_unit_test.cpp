// One mesh unit at a time, from samples of known surfaces.
#include "kernels/meshing/mesh_unit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/meshing/mesh_block.h"
#include "unit/kernels/meshing/cube_geometry.h"

namespace dtsdf {
namespace {

/// Free on the side that n points to; n^T x = offset, the unit being [0, 1]^3.
struct UnitPlane {
  Eigen::Vector3d n;
  double offset;

  float at(int corner) const { return static_cast<float>(n.dot(cornerPoint(corner)) - offset); }
};

/// What fusion leaves of a plane: its distance in every direction that its normal belongs to.
void addPlane(UnitSamples& samples, const UnitPlane& plane, float weight = 1.0f) {
  const Vec3f n{static_cast<float>(plane.n.x()), static_cast<float>(plane.n.y()),
                static_cast<float>(plane.n.z())};
  const DirectionSet set = directionsOf(n, true);
  for (int k = 0; k < set.count; ++k) {
    for (int c = 0; c < kCubeCorners; ++c) {
      samples.corner[set.direction[k]][c] = {plane.at(c), weight * set.weight[k]};
    }
  }
}

int labelsOf(const UnitPlane& plane) {
  int index = 0;
  for (int c = 0; c < kCubeCorners; ++c) index |= (plane.at(c) < 0.0f ? 1 : 0) << c;
  return index;
}

UnitPlane randomPlane(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  const Eigen::Vector3d n =
      Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  return {n, n.dot(Eigen::Vector3d::Constant(0.5)) + uniform(random)};
}

TEST(MeshUnit, APlaneGivesItsLabels) {
  std::mt19937 random(18);
  for (int trial = 0; trial < 5000; ++trial) {
    const UnitPlane plane = randomPlane(random);
    UnitSamples samples = {};
    addPlane(samples, plane);
    const int labels = labelsOf(plane);
    const UnitIndices indices = indexUnit(kMeshTables, samples, true);
    EXPECT_EQ(indices.sheet[0], labels == 255 ? 0 : labels) << "trial " << trial;
    EXPECT_EQ(indices.sheet[1], 0) << "trial " << trial;
  }
}

TEST(MeshUnit, TheUndirectedMapMeshesLabels) {
  std::mt19937 random(19);
  for (int index = 0; index < 256; ++index) {
    UnitSamples samples = {};
    for (int c = 0; c < kCubeCorners; ++c) {
      samples.corner[0][c] = {isBehind(index, c) ? -0.5f : 0.5f, 0.01f};
    }
    EXPECT_EQ(indexUnit(kMeshTables, samples, false).sheet[0], index == 255 ? 0 : index);
    if (index == 0 || index == 255) continue;
    samples.corner[0][random() % 8].weight = 0.0f;
    EXPECT_EQ(indexUnit(kMeshTables, samples, false).sheet[0], 0);
  }
}

/// Both sides of a wall thinner than the unit, each by the direction that sees it.
TEST(MeshUnit, AThinWallHasTwoSheets) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
    for (const double thickness : {0.05, 0.3, 0.8}) {
      const UnitPlane front{n, 0.5 + 0.5 * thickness}, back{-n, -(0.5 - 0.5 * thickness)};
      UnitSamples samples = {};
      addPlane(samples, front);
      addPlane(samples, back);
      const UnitIndices indices = indexUnit(kMeshTables, samples, true);
      const std::set<int> sheets{indices.sheet[0], indices.sheet[1]};
      EXPECT_EQ(sheets, (std::set<int>{labelsOf(front), labelsOf(back)}))
          << "axis " << axis << ", thickness " << thickness;
    }
  }
}

TEST(MeshUnit, UnobservedCornersHaveNoSurface) {
  const UnitPlane plane{Eigen::Vector3d::UnitZ(), 0.4};
  for (int c = 0; c < kCubeCorners; ++c) {
    UnitSamples samples = {};
    addPlane(samples, plane);
    samples.corner[4][c].weight = 0.0f;
    EXPECT_EQ(indexUnit(kMeshTables, samples, true).sheet[0], 0);
  }
  EXPECT_EQ(indexUnit(kMeshTables, UnitSamples{}, true).sheet[0], 0);
  EXPECT_EQ(indexUnit(kMeshTables, UnitSamples{}, false).sheet[0], 0);
}

/// Distances that rise against their own direction, as at the back of something seen from the front
/// only, are no surface.
TEST(MeshUnit, ADirectionDoesNotSpeakForASurfaceThatFacesAway) {
  const UnitPlane away{-Eigen::Vector3d::UnitX(), -0.5};
  UnitSamples samples = {};
  for (int c = 0; c < kCubeCorners; ++c) samples.corner[0][c] = {away.at(c), 1.0f};
  EXPECT_EQ(indexUnit(kMeshTables, samples, true).sheet[0], 0);
}

TEST(MeshUnit, ScalingAllWeightsChangesNothing) {
  std::mt19937 random(20);
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f), weight(0.0f, 1.0f);
  for (int trial = 0; trial < 2000; ++trial) {
    UnitSamples samples = {}, scaled = {};
    for (int d = 0; d < kDirectionCount; ++d) {
      for (int c = 0; c < kCubeCorners; ++c) {
        const float slope = (c >> (d / 2) & 1) ? directionSign(d) : -directionSign(d);
        samples.corner[d][c] = {0.5f * slope + uniform(random),
                                random() % 8 ? weight(random) : 0.0f};
        scaled.corner[d][c] = samples.corner[d][c];
        scaled.corner[d][c].weight *= 64.0f;  // a power of two, so that no rounding differs
      }
    }
    const UnitIndices a = indexUnit(kMeshTables, samples, true);
    const UnitIndices b = indexUnit(kMeshTables, scaled, true);
    EXPECT_EQ(a.sheet[0], b.sheet[0]);
    EXPECT_EQ(a.sheet[1], b.sheet[1]);
  }
}

TEST(EdgeOffset, IsExactOnAPlane) {
  std::mt19937 random(21);
  int crossed = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const UnitPlane plane = randomPlane(random);
    UnitSamples samples = {};
    addPlane(samples, plane);
    for (int e = 0; e < kCubeEdges; ++e) {
      const auto [a, b] = cubeEdges()[static_cast<size_t>(e)];
      if ((plane.at(a) < 0.0f) == (plane.at(b) < 0.0f)) continue;
      EdgeSamples edge = {};
      for (int d = 0; d < kDirectionCount; ++d) {
        edge.lower[d] = samples.corner[d][a];
        edge.upper[d] = samples.corner[d][b];
      }
      const double expected = plane.at(a) / (double(plane.at(a)) - plane.at(b));
      const float offset = edgeOffset(edge, e / 4, plane.at(a) < 0.0f ? 0 : 1);
      EXPECT_NEAR(offset, expected, kVertexMargin + 1e-5);
      ++crossed;
    }
  }
  EXPECT_GT(crossed, 10000);
}

/// A wall that an edge passes through: each side by its own facing.
TEST(EdgeOffset, TellsTheTwoSidesOfAWallApart) {
  EdgeSamples edge = {};
  edge.lower[0] = {-0.7f, 2.0f};  // x+ sees the side at 0.7
  edge.upper[0] = {0.3f, 2.0f};
  edge.lower[1] = {0.4f, 5.0f};  // x- sees the side at 0.4
  edge.upper[1] = {-0.6f, 5.0f};
  EXPECT_NEAR(edgeOffset(edge, 0, 0), 0.7f, 1e-6f);
  EXPECT_NEAR(edgeOffset(edge, 0, 1), 0.4f, 1e-6f);
}

TEST(EdgeOffset, KeepsOffTheCorners) {
  EdgeSamples edge = {};
  edge.lower[4] = {-1e-9f, 1.0f};
  edge.upper[4] = {1.0f, 1.0f};
  EXPECT_EQ(edgeOffset(edge, 2, 0), kVertexMargin);
  edge.lower[4] = {-1.0f, 1.0f};
  edge.upper[4] = {0.0f, 1.0f};
  EXPECT_EQ(edgeOffset(edge, 2, 0), 1.0f - kVertexMargin);
  const float lost = edgeOffset(EdgeSamples{}, 2, 0);
  EXPECT_GT(lost, 0.0f);
  EXPECT_LT(lost, 1.0f);
}

TEST(Regularisation, MirroredFacesShowTheSharedCorners) {
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, bit = 1 << axis;
    for (int neighbour = 0; neighbour < 256; ++neighbour) {
      const uint8_t mirrored = mirrorFace(static_cast<uint8_t>(neighbour), axis);
      for (int c = 0; c < 8; ++c) {
        const bool on_face = bool(c & bit) == bool(face & 1);
        EXPECT_EQ(faceCorners(face) >> c & 1, on_face ? 1u : 0u);
        if (!on_face) continue;
        EXPECT_EQ(isBehind(mirrored, c), isBehind(neighbour, c ^ bit));
      }
    }
  }
}

/// A unit that all its neighbours contradict in one corner takes their side; one that they agree
/// with stays.
TEST(Regularisation, TheMajorityDecidesACorner) {
  const UnitPlane plane{Eigen::Vector3d::UnitZ(), 0.5};
  const uint8_t flat = static_cast<uint8_t>(labelsOf(plane));
  UnitIndices neighbours[6] = {};
  for (int face = 0; face < 4; ++face) neighbours[face].sheet[0] = flat;
  const UnitIndices calm = regulariseUnit({{flat, 0}}, neighbours);
  EXPECT_EQ(calm.sheet[0], flat);
  const UnitIndices settled = regulariseUnit({{static_cast<uint8_t>(flat ^ 0x10), 0}}, neighbours);
  EXPECT_EQ(settled.sheet[0], flat);
  EXPECT_EQ(settled.sheet[1], 0);
}

/// Votes of the unit and of the neighbours that continue its surface, counted one by one.
TEST(Regularisation, CountsTheVotesOfAllNeighbours) {
  std::mt19937 random(21);
  int changed = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const uint8_t index = static_cast<uint8_t>(1 + random() % 254);
    UnitIndices neighbours[6] = {};
    int votes[8];
    for (int c = 0; c < 8; ++c) votes[c] = isBehind(index, c) ? 1 : -1;
    for (int face = 0; face < 6; ++face) {
      // Mostly what continues the unit, with a corner that differs.
      const uint8_t like = static_cast<uint8_t>(mirrorFace(index, face / 2) ^ 1u << random() % 8);
      neighbours[face].sheet[0] = random() % 4 == 0 ? static_cast<uint8_t>(random()) : like;
      neighbours[face].sheet[1] = random() % 4 == 0 ? static_cast<uint8_t>(random()) : 0;
      const int labels = labelsAcross(index, neighbours[face], face);
      for (int c = 0; c < 8; ++c) {
        if (labels >= 0 && (faceCorners(face) >> c & 1)) votes[c] += isBehind(labels, c) ? 1 : -1;
      }
    }
    int expected = 0;
    for (int c = 0; c < 8; ++c) {
      expected |= (votes[c] > 0 || (votes[c] == 0 && isBehind(index, c)) ? 1 : 0) << c;
    }
    if (expected == 255) expected = 0;
    ASSERT_EQ(regulariseUnit({{index, 0}}, neighbours).sheet[0], expected) << "trial " << trial;
    changed += expected != index;
  }
  EXPECT_GT(changed, 100);
}

TEST(Regularisation, UnitsWithoutNeighboursStay) {
  const UnitIndices none[6] = {};
  for (int index = 0; index < 255; ++index) {
    EXPECT_EQ(regulariseUnit({{static_cast<uint8_t>(index), 0}}, none).sheet[0], index);
  }
}

TEST(MeshBlock, LatticeCornersAreSampledWhereTheyLie) {
  for (int i = 0; i < kLatticeCorners; ++i) {
    const Vec3i corner = latticeCorner(i);
    ASSERT_EQ(latticeIndex(corner.x, corner.y, corner.z), i);
    const LatticeSource source = latticeSource(i);
    const Vec3i first = firstVoxelOfBlock(latticeBlockOffset(source.block));
    EXPECT_TRUE(first + voxelOffset(source.voxel) == corner);
  }
}

TEST(MeshBlock, UnitsAcrossAFaceAreFound) {
  for (int face = 0; face < 6; ++face) {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Vec3i unit = voxelOffset(i) + faceOffset(face);
      const UnitSource source = unitSource(unit);
      const Vec3i first = firstVoxelOfBlock(regularisationOffset(source.block));
      EXPECT_TRUE(first + voxelOffset(source.unit) == unit);
    }
  }
}

TEST(MeshBlock, EdgesOfUnitsComeBack) {
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i unit = voxelOffset(i);
    for (int e = 0; e < kCubeEdges; ++e) {
      const auto [a, b] = cubeEdges()[static_cast<size_t>(e)];
      for (const int behind : {a, b}) {
        const int edge = unitEdge(unit, e, static_cast<uint8_t>(1 << behind));
        EXPECT_EQ(edgeFacing(edge), behind == a ? 0 : 1);
        EXPECT_EQ(edgeAxis(edge), e / 4);
        const Vec3f p = vertexPosition(edge, 0.25f);
        const Eigen::Vector3d expected = Eigen::Vector3d(unit.x, unit.y, unit.z) + cornerPoint(a) +
                                         0.25 * Eigen::Vector3d::Unit(e / 4);
        EXPECT_EQ(Eigen::Vector3d(p.x, p.y, p.z), expected);
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
