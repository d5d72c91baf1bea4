#include "kernels/meshing/regularisation.h"

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace {

std::tuple<int, int, int> asTuple(const Vec3i& v) { return {v.x, v.y, v.z}; }

Vec3i voxelIn(const Vec3i& block, int index) {
  return firstVoxelOfBlock(block) + voxelOffset(index);
}

TEST(Regularisation, UnitSourceIsTheUnitInTheBlockOrAcrossAFace) {
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    for (int face = -1; face < 6; ++face) {
      const Vec3i unit = face < 0 ? voxelOffset(i) : voxelOffset(i) + faceOffset(face);
      const UnitSource source = unitSource(unit);
      EXPECT_EQ(asTuple(voxelIn(regularisationOffset(source.block), source.unit)), asTuple(unit));
    }
  }
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
  const UnitIndices calm = regulariseSheets({{flat, 0}}, neighbours);
  EXPECT_EQ(calm.sheet[0], flat);
  const uint8_t odd = static_cast<uint8_t>(flat ^ 0x10);
  const UnitIndices regular = regulariseSheets({{odd, 0}}, neighbours);
  EXPECT_EQ(regular.sheet[0], flat);
  EXPECT_EQ(regular.sheet[1], 0);
}

/// A corner that one neighbour denies stays, since the unit's own label counts as well; a second
/// one turns it, unless that one agrees with the unit.
TEST(Regularisation, OwnLabelAndNeighboursCountTheSame) {
  const uint8_t flat = 0x0F, odd = 0x1F;  // behind below; and corner 4, at (0, 0, 1), as well
  UnitIndices neighbours[6] = {};
  neighbours[0].sheet[0] = flat;  // across -x: shares corner 4
  EXPECT_EQ(regulariseSheets({{odd, 0}}, neighbours).sheet[0], odd);
  neighbours[2].sheet[0] = flat;  // across -y: shares it, too
  EXPECT_EQ(regulariseSheets({{odd, 0}}, neighbours).sheet[0], flat);
  neighbours[2].sheet[0] = mirrorFace(odd, 1);
  EXPECT_EQ(regulariseSheets({{odd, 0}}, neighbours).sheet[0], odd);
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
    ASSERT_EQ(regulariseSheets({{index, 0}}, neighbours).sheet[0], expected) << "trial " << trial;
    changed += expected != index;
  }
  EXPECT_GT(changed, 100);
}

TEST(Regularisation, UnitsWithoutNeighboursStay) {
  const UnitIndices none[6] = {};
  for (int index = 0; index < 255; ++index) {
    EXPECT_EQ(regulariseSheets({{static_cast<uint8_t>(index), 0}}, none).sheet[0], index);
  }
}

TEST(Regularisation, ALevelSurfaceStays) {
  const UnitIndices level{{0x0F, 0}};  // behind below, in front above
  const auto at = [&](const Vec3i& unit) { return unit.z == 2 ? level : UnitIndices{{0, 0}}; };
  EXPECT_EQ(regulariseUnit(at, {3, 3, 2}).sheet[0], level.sheet[0]);
  EXPECT_EQ(regulariseUnit(at, {3, 3, 3}).sheet[0], 0);
}

}  // namespace
}  // namespace dtsdf
