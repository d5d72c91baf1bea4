// Evidence: what frames that support or contradict a surface make of it.
#include "kernels/fusion/evidence.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace evidence_test {

const FusionRules kRules;  // 3 for support, 2 against it, 24 at most, for and against
constexpr bool kCovered = true, kUncovered = false;

TEST(Evidence, IsAFrameCounterThatSaturates) {
  int32_t evidence = 0;
  for (int frame = 1; frame <= 8; ++frame) {
    evidence = supportedEvidence(evidence, kRules);
    EXPECT_EQ(evidence, 3 * frame);
  }
  EXPECT_EQ(supportedEvidence(24, kRules), 24);
  EXPECT_EQ(supportedEvidence(22, kRules), 24);
}

TEST(Evidence, GainAndLimitAreRules) {
  FusionRules rules;
  rules.support_gain = 5;
  rules.most_evidence = 127;
  EXPECT_EQ(supportedEvidence(7, rules), 12);
  EXPECT_EQ(supportedEvidence(124, rules), 127);
}

TEST(Evidence, AContradictionCostsEvidenceOnly) {
  const Voxel after = contradictedVoxel(makeVoxel(-0.75f, 12345, 9), 1, kUncovered, kRules);
  EXPECT_EQ(evidenceOf(after), 7);
  EXPECT_EQ(weightUnits(after), 12345u);
  EXPECT_EQ(sdfOf(after), -0.75f);
  FusionRules dear;
  dear.contradiction_cost = 4;
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 9), 1, kUncovered, dear)), 5);
}

/// A look that counts for eight frames costs as much as eight looks.
TEST(Evidence, ALookInTurnCountsForAllItsFrames) {
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 24), 8, kUncovered, kRules)), 8);
}

/// Nothing is left of a voxel without evidence: neither distance nor weight mixes with what comes.
TEST(Evidence, WithoutItTheVoxelIsEmpty) {
  for (const int32_t evidence : {0, 1, 2}) {
    const Voxel voxel =
        contradictedVoxel(makeVoxel(-0.75f, 12345, evidence), 1, kUncovered, kRules);
    EXPECT_TRUE(isEmpty(voxel)) << evidence;
    EXPECT_EQ(sdfOf(voxel), 0.0f);
  }
  EXPECT_FALSE(isEmpty(contradictedVoxel(makeVoxel(-0.75f, 12345, 3), 1, kUncovered, kRules)));
}

/// A frame that covers the voxel, but looks through its anchor, costs a support more.
TEST(Evidence, ACoveredContradictionCostsASupportMore) {
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 24), 1, kCovered, kRules)), 19);
  EXPECT_EQ(evidenceOf(contradictedVoxel(makeVoxel(0.5f, 1, 3), 1, kCovered, kRules)), -2);
}

/// Below zero it is evidence of free space, which stays where the distance goes.
TEST(Evidence, OfFreeSpaceIsCountedAndSaturates) {
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

/// However long a place was free: nine frames of support, and there is a surface again.
TEST(Evidence, WhatAppearsIsThereAfterTenFrames) {
  int32_t evidence = -24;
  int frames = 0;
  for (; evidence < leastEvidence(2, 1000, kRules); ++frames) {
    evidence = supportedEvidence(evidence, kRules);
  }
  EXPECT_EQ(frames, 10);
}

/// However long it was seen: the most evidence is gone after twelve frames.
TEST(Evidence, WhatIsTakenAwayIsGoneAfterTwelveFrames) {
  Voxel voxel = makeVoxel(0.25f, 64 << 16, 0);
  for (int frame = 0; frame < 1000; ++frame) {
    voxel =
        makeVoxel(sdfOf(voxel), weightUnits(voxel), supportedEvidence(evidenceOf(voxel), kRules));
  }
  int frames = 0;
  for (; !isEmpty(voxel); ++frames) voxel = contradictedVoxel(voxel, 1, kUncovered, kRules);
  EXPECT_EQ(frames, 12);
}

/// With twenty supports, which aligned poses remember: after 30.
TEST(Evidence, ALongerMemoryIsGoneAfterThirtyFrames) {
  FusionRules rules;
  rules.most_evidence = 60;
  Voxel voxel = makeVoxel(0.25f, 64 << 16, 60);
  int frames = 0;
  for (; !isEmpty(voxel); ++frames) voxel = contradictedVoxel(voxel, 1, kUncovered, rules);
  EXPECT_EQ(frames, 30);
}

/// Seen through in one frame of two it stays, in two frames of three it goes.
TEST(Evidence, WhatIsSeenThroughMoreOftenThanNotGoes) {
  const auto lastsFor = [](int through_of_three) {
    Voxel voxel = makeVoxel(0.0f, 1, 24);
    int frame = 0;
    for (; frame < 300 && !isEmpty(voxel); ++frame) {
      voxel = frame % 3 < through_of_three
                  ? contradictedVoxel(voxel, 1, kUncovered, kRules)
                  : makeVoxel(0.0f, 1, supportedEvidence(evidenceOf(voxel), kRules));
    }
    return frame;
  };
  EXPECT_EQ(lastsFor(1), 300);
  EXPECT_LT(lastsFor(2), 100);
  int32_t evidence = 24;
  for (int frame = 0; frame < 300; ++frame) {
    const Voxel voxel = makeVoxel(0.0f, 1, evidence);
    evidence = frame % 2 ? supportedEvidence(evidence, kRules)
                         : evidenceOf(contradictedVoxel(voxel, 1, kUncovered, kRules));
  }
  EXPECT_GT(evidence, 12);
}

/// One frame gives 3; two give 6, or 4 if one more saw through it; three give 9, or 7.
TEST(LeastEvidence, IsThatOfSoManyFramesButForAContradiction) {
  constexpr uint64_t kMany = uint64_t{1} << 40;
  EXPECT_EQ(leastEvidence(1, kMany, kRules), 1);
  EXPECT_EQ(leastEvidence(2, kMany, kRules), 4);
  EXPECT_EQ(leastEvidence(3, kMany, kRules), 7);
  EXPECT_EQ(leastEvidence(10, kMany, kRules), 24);  // what no voxel could have is not asked for
}

TEST(LeastEvidence, AsksForNoMoreFramesThanWereFused) {
  for (const int32_t min_support : {1, 2, 3}) {
    EXPECT_EQ(leastEvidence(min_support, 0, kRules), 1);
    EXPECT_EQ(leastEvidence(min_support, 1, kRules), 1);
  }
  EXPECT_EQ(leastEvidence(1, 2, kRules), 1);
  EXPECT_EQ(leastEvidence(2, 2, kRules), 4);
  EXPECT_EQ(leastEvidence(3, 2, kRules), 4);
  EXPECT_EQ(leastEvidence(3, 3, kRules), 7);
}

}  // namespace evidence_test
}  // namespace dtsdf
