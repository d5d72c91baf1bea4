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

/// X+ with a weight of 3 touches corner 0, in front of it by 0.0003; Y+, seen at that corner only,
/// has it 0.3 behind with a weight of 0.3. Their votes are (3 / 0.2003)^2 = 224.3 and
/// (0.3 / 0.5)^2 = 0.36, and 224.3 * 0.0003 - 0.36 * 0.3 is below 0: the corner is behind for all
/// units around it, so that this one must have its triangle, though neither saw both sides.
TEST(Sheets, ACornerThatTheVoteTurnedHasItsTriangle) {
  UnitSamples samples = {};
  for (int c = 0; c < kCubeCorners; ++c) {
    const auto x = static_cast<float>(c & 1), yz = static_cast<float>((c >> 1 & 1) + (c >> 2 & 1));
    samples.corner[0][c] = {0.0003f + x + 0.1f * yz, 3.0f};
  }
  samples.corner[2][0] = {-0.3f, 0.3f};
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 1);
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

/// Distances that rise against their own direction, as at the back of something seen from the front
/// only, are no surface.
TEST(Sheets, ADirectionDoesNotSpeakForASurfaceThatFacesAway) {
  const UnitPlane away{-Eigen::Vector3d::UnitX(), -0.5};
  UnitSamples samples = {};
  for (int c = 0; c < kCubeCorners; ++c) samples.corner[0][c] = {away.at(c), 1.0f};
  EXPECT_EQ(indexUnit(samples, true).sheet[0], 0);
}

TEST(Sheets, ScalingAllWeightsChangesNothing) {
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
    const UnitIndices a = indexUnit(samples, true);
    const UnitIndices b = indexUnit(scaled, true);
    EXPECT_EQ(a.sheet[0], b.sheet[0]);
    EXPECT_EQ(a.sheet[1], b.sheet[1]);
  }
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

/// Corner 0 and corner 7, each cut off alone: X+ sees corner 0 only, X- corner 7 only.
TEST(Sheets, RemovesTheUnseenComponentOnly) {
  EXPECT_EQ(sheetIndex(kMeshTables, 0x81, 1u << 0, 0), 0x01);
  EXPECT_EQ(sheetIndex(kMeshTables, 0x81, 1u << 1, 0), 0x80);
  EXPECT_EQ(sheetIndex(kMeshTables, 0x81, 3, 0), 0x81);
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

TEST(Sheets, ALoneSheetIsTheFirst) {
  expectSheets(joinSheets(3, kNotKnown), 3, 0);
  expectSheets(joinSheets(kNotKnown, 5), 5, 0);
  expectSheets(joinSheets(3, 3), 3, 0);
  EXPECT_TRUE(saysNothing(joinSheets(kNotKnown, kNotKnown)));
}

/// A unit without a surface says on which side all of it is, unless its other sheet has one.
TEST(Sheets, ASheetWithoutASurfaceSaysSoAlone) {
  expectSheets(joinSheets(0, kNotKnown), 0, 0);
  EXPECT_EQ(cornersInFront(joinSheets(0, kNotKnown)), 255u);
  EXPECT_EQ(cornersBehind(joinSheets(kNotKnown, 255)), 255u);
  expectSheets(joinSheets(0, 5), 5, 0);
  expectSheets(joinSheets(5, 255), 5, 0);
}

/// Behind below (0x0F) and behind above (0xF0) cross the four edges along z in opposite ways. The
/// floor 0x0F and the corner 0x07 both cross the edges at corners 0, 1 and 2 upwards.
TEST(Sheets, SheetsThatShareACrossingAreOneSurface) {
  expectSheets(joinSheets(0x0F, 0xF0), 0x0F, 0xF0);
  expectSheets(joinSheets(0x07, 0x0F), 0x07, 0);
  expectSheets(joinSheets(0x0F, 0x07), 0x0F, 0);
  expectSheets(joinSheets(0x01, 0x80), 0x01, 0x80);  // opposite corners
}

/// Each pair of sheets is told again from its labels, two bytes.
TEST(Sheets, LabelsHoldTwoSheets) {
  for (int a = 1; a < 255; ++a) {
    for (int b = 1; b < 255; ++b) {
      const UnitLabels labels = labelsOfSheets(static_cast<unsigned>(a), static_cast<unsigned>(b));
      expectSheets(labels, a, a == b ? 0 : b);
      EXPECT_EQ(cornersBehind(labels), static_cast<unsigned>(a & b));
      EXPECT_EQ(cornersInFront(labels), 255u & ~static_cast<unsigned>(a | b));
    }
  }
}

}  // namespace sheets_test
}  // namespace dtsdf
