// Tests how frames that support or contradict a surface change the evidence.
#include "kernels/fusion/evidence.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace evidence_test {

const FusionRules kRules;  // +3 for support, -2 for a contradiction, limited to -24..24
constexpr bool kCovered = true, kUncovered = false;

TEST(Evidence, CountsSupportingFramesAndSaturates) {
  int32_t evidence = 0;
  for (int frame = 1; frame <= 8; ++frame) {
    evidence = supportedEvidence(evidence, kRules);
    EXPECT_EQ(evidence, 3 * frame);
  }
  EXPECT_EQ(supportedEvidence(24, kRules), 24);
  EXPECT_EQ(supportedEvidence(22, kRules), 24);
}

TEST(Evidence, AContradictionLowersOnlyEvidence) {
  const Voxel after = contradictedVoxel(makeVoxel(-0.75f, 12345, 9), 1, kUncovered, kRules);
  EXPECT_EQ(evidenceOf(after), 7);
  EXPECT_EQ(weightUnits(after), 12345u);
  EXPECT_EQ(sdfOf(after), -0.75f);
  FusionRules costly;
  costly.contradiction_cost = 4;
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 9), 1, kUncovered, costly)), 5);
}

/// A voxel that loses its evidence also loses its distance and weight, so that they do not affect
/// later measurements.
TEST(Evidence, AVoxelWithoutEvidenceBecomesEmpty) {
  for (const int32_t evidence : {0, 1, 2}) {
    const Voxel voxel =
        contradictedVoxel(makeVoxel(-0.75f, 12345, evidence), 1, kUncovered, kRules);
    EXPECT_TRUE(isEmpty(voxel)) << evidence;
    EXPECT_EQ(sdfOf(voxel), 0.0f);
  }
  EXPECT_FALSE(isEmpty(contradictedVoxel(makeVoxel(-0.75f, 12345, 3), 1, kUncovered, kRules)));
}

/// A frame that covers the voxel, but sees through its anchor (a measured point), also takes back
/// the evidence of one supporting frame.
TEST(Evidence, ContradictionsOfCoveredVoxelsCostMore) {
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 24), 1, kCovered, kRules)), 19);
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 3), 1, kCovered, kRules)), -2);
}

/// Negative evidence marks free space and is kept after the distance has been removed.
TEST(Evidence, FreeSpaceEvidenceSaturates) {
  Voxel voxel = contradictedVoxel(makeVoxel(-0.75f, 12345, 1), 1, kUncovered, kRules);
  EXPECT_TRUE(isEmpty(voxel));
  EXPECT_EQ(evidenceOf(voxel), -1);
  for (int frame = 0; frame < 11; ++frame) voxel = contradictedVoxel(voxel, 1, kUncovered, kRules);
  EXPECT_EQ(evidenceOf(voxel), -23);
  for (int frame = 0; frame < 100; ++frame) {
    voxel = contradictedVoxel(voxel, 4, kUncovered, kRules);
  }
  EXPECT_EQ(evidenceOf(voxel), -24);
}

/// The required evidence is what remains after one, two or three supporting frames and one
/// contradiction: 1, 4 or 7.
TEST(MinEvidence, AllowsOneContradiction) {
  constexpr uint64_t kMany = uint64_t{1} << 40;
  EXPECT_EQ(minEvidence(1, kMany, kRules), 1);
  EXPECT_EQ(minEvidence(2, kMany, kRules), 4);
  EXPECT_EQ(minEvidence(3, kMany, kRules), 7);
  EXPECT_EQ(minEvidence(10, kMany, kRules), 24);  // the maximum evidence
}

}  // namespace evidence_test
}  // namespace dtsdf
