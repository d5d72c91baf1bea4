// One mesh unit at a time, from samples of known surfaces.
#include "kernels/meshing/sheets.h"

#include <gtest/gtest.h>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace sheets_test {

/// The indices of a unit's sheets, before regularisation.
UnitIndices indexUnit(const UnitSamples& samples, bool directional) {
  return indicesOf(labelUnit(kMeshTables, MeshRules(), samples, directional));
}

TEST(Sheets, APlaneGivesItsLabels) {
  std::mt19937 random(18);
  for (int trial = 0; trial < 5000; ++trial) {
    const UnitPlane plane = randomPlane(random);
    UnitSamples samples = {};
    addPlane(samples, plane);
    const int labels = labelsOf(plane);
    const UnitIndices indices = indexUnit(samples, true);
    EXPECT_EQ(indices.sheet[0], labels) << "trial " << trial;
    EXPECT_EQ(indices.sheet[1], 0) << "trial " << trial;
  }
}

TEST(Sheets, TheUndirectedMapMeshesLabels) {
  std::mt19937 random(19);
  for (int index = 0; index < 256; ++index) {
    UnitSamples samples = {};
    for (int c = 0; c < kCubeCorners; ++c) {
      samples.corner[0][c] = {isBehind(index, c) ? -0.5f : 0.5f, 0.01f};
    }
    EXPECT_EQ(indexUnit(samples, false).sheet[0], index == 255 ? 0 : index);
    if (index == 0 || index == 255) continue;
    samples.corner[0][random() % 8].weight = 0.0f;
    EXPECT_EQ(indexUnit(samples, false).sheet[0], 0);
  }
}

/// Both sides of a wall thinner than the unit, each by the direction that sees it.
TEST(Sheets, AThinWallHasTwoSheets) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
    for (const double thickness : {0.05, 0.3, 0.8}) {
      const UnitPlane front{n, 0.5 + 0.5 * thickness}, back{-n, -(0.5 - 0.5 * thickness)};
      UnitSamples samples = {};
      addPlane(samples, front);
      addPlane(samples, back);
      const UnitIndices indices = indexUnit(samples, true);
      const std::set<int> sheets{indices.sheet[0], indices.sheet[1]};
      EXPECT_EQ(sheets, (std::set<int>{labelsOf(front), labelsOf(back)}))
          << "axis " << axis << ", thickness " << thickness;
    }
  }
}

TEST(Sheets, UnobservedCornersHaveNoSurface) {
  const UnitPlane plane{Eigen::Vector3d::UnitZ(), 0.4};
  for (int c = 0; c < kCubeCorners; ++c) {
    UnitSamples samples = {};
    addPlane(samples, plane);
    samples.corner[4][c].weight = 0.0f;
    EXPECT_EQ(indexUnit(samples, true).sheet[0], 0);
  }
  EXPECT_EQ(indexUnit(UnitSamples{}, true).sheet[0], 0);
  EXPECT_EQ(indexUnit(UnitSamples{}, false).sheet[0], 0);
}

/// The greatest weight is 100, and 0.3 % of it is 0.3: a corner of 0.29 is too little, one of 0.31
/// will do.
TEST(Sheets, ACornerNeedsAShareOfTheGreatestWeight) {
  UnitSamples samples = {};
  addPlaneTo(samples, 4, {Eigen::Vector3d::UnitZ(), 0.4}, 100.0f);
  samples.corner[4][0].weight = 0.29f;
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 0);
  samples.corner[4][0].weight = 0.31f;
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 0x0F);
  MeshRules any_weight;
  any_weight.least_weight_share = any_weight.least_crossing_share = 0.0f;
  samples.corner[4][0].weight = 0.001f;
  EXPECT_EQ(indicesOf(labelUnit(kMeshTables, any_weight, samples, true)).sheet[0], 0x0F);
}

/// Behind above is what Z- (bit 5) sees and Z+ (bit 4) cannot; X+ (bit 0) has no edge to object to.
TEST(Sheets, KeepsWhatSomeSpeakingDirectionCanSee) {
  EXPECT_EQ(sheetIndex(kMeshTables, 0xF0, 1u << 4, 0), 0);
  EXPECT_EQ(sheetIndex(kMeshTables, 0xF0, 1u << 5, 0), 0xF0);
  EXPECT_EQ(sheetIndex(kMeshTables, 0xF0, 1u << 4 | 1u << 0, 0), 0xF0);
  EXPECT_EQ(sheetIndex(kMeshTables, 0xF0, 0, 0), 0);
}

/// The crossing of the edge from corner 0 along x is weak: nothing is said of any corner.
TEST(Sheets, AWeakCrossingSilencesTheUnit) {
  EXPECT_EQ(sheetIndex(kMeshTables, 0x81, 3, 1u << 0), kNotKnown);
  EXPECT_EQ(sheetIndex(kMeshTables, 0x81, 3, 1u << 3), 0x81);  // not crossed
}

/// Both ends of the edge at corner 0 have 1.4 % of the greatest weight; with 1.6 % it is known.
TEST(Sheets, ACrossingNeedsAShareOfTheGreatestWeight) {
  UnitSamples samples = {};
  addPlaneTo(samples, 4, {Eigen::Vector3d::UnitZ(), 0.4}, 100.0f);
  samples.corner[4][0].weight = samples.corner[4][4].weight = 1.4f;
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 0);
  samples.corner[4][0].weight = samples.corner[4][4].weight = 1.6f;
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 0x0F);
}

/// Labels of a unit and the indices that they stand for.
void expectSheets(const UnitLabels& labels, int first, int second) {
  EXPECT_FALSE(saysNothing(labels));
  EXPECT_EQ(indicesOf(labels).sheet[0], first);
  EXPECT_EQ(indicesOf(labels).sheet[1], second);
}

/// Behind below (0x0F) and behind above (0xF0) cross the four edges along z in opposite ways. The
/// floor 0x0F and the corner 0x07 both cross the edges at corners 0, 1 and 2 upwards.
TEST(Sheets, SheetsThatShareACrossingAreOneSurface) {
  expectSheets(joinSheets(0x0F, 0xF0), 0x0F, 0xF0);
  expectSheets(joinSheets(0x07, 0x0F), 0x07, 0);
  expectSheets(joinSheets(0x0F, 0x07), 0x0F, 0);
  expectSheets(joinSheets(0x01, 0x80), 0x01, 0x80);  // opposite corners
}

}  // namespace sheets_test
}  // namespace dtsdf
