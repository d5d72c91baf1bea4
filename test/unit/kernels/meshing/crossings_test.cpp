#include "kernels/meshing/crossings.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace crossings_test {

constexpr float kGreatest = 100.0f;
/// The edge from corner 0 to corner 4, along z, and its bit.
constexpr int kLower = 0, kUpper = 4;
constexpr int kWeak = 1 << 16;
/// Corner 0 is behind, so that the edges from it along x, y and z are crossed.
constexpr int kLabels = 1;

MeshRules rulesWith(float least_crossing_share, float voted_crossing_share) {
  MeshRules rules;
  rules.least_crossing_share = least_crossing_share;
  rules.voted_crossing_share = voted_crossing_share;
  return rules;
}

/// Whether the crossing of that edge is weak.
bool isWeak(const MeshRules& rules, const UnitSamples& samples) {
  return (weakCrossings(rules, samples, kLabels, kGreatest) & kWeak) != 0;
}

void setEdge(UnitSamples& samples, int direction, const Sample& lower, const Sample& upper) {
  samples.corner[direction][kLower] = lower;
  samples.corner[direction][kUpper] = upper;
}

/// 2 % of 100 is 2: weights of 1 and 4 have just that mean, and 1 and 4.1 more.
TEST(Crossings, NeedAShareOfTheGreatestWeightAtBothEnds) {
  const MeshRules rules = rulesWith(0.02f, 0.0f);
  UnitSamples samples = {};
  setEdge(samples, 0, {-0.3f, 1.0f}, {0.7f, 4.0f});
  EXPECT_TRUE(isWeak(rules, samples));
  setEdge(samples, 0, {-0.3f, 1.0f}, {0.7f, 4.1f});
  EXPECT_FALSE(isWeak(rules, samples));
  setEdge(samples, 0, {-0.3f, 0.0f}, {0.7f, 100.0f});
  EXPECT_TRUE(isWeak(rules, samples));
}

TEST(Crossings, OnlyDirectionsThatCrossThereCount) {
  const MeshRules rules = rulesWith(0.02f, 0.0f);
  UnitSamples samples = {};
  setEdge(samples, 0, {-0.3f, 50.0f}, {-0.7f, 50.0f});  // stays behind
  setEdge(samples, 2, {0.3f, 50.0f}, {-0.7f, 50.0f});   // crosses the other way
  EXPECT_TRUE(isWeak(rules, samples));
  setEdge(samples, 1, {-0.0001f, 3.0f}, {0.0f, 3.0f});  // 0 is in front
  EXPECT_FALSE(isWeak(rules, samples));
}

/// The lower end is behind, so the sheet faces up: Z- (5) has no say, neither by a crossing nor by
/// its weight; Z+ (4) does.
TEST(Crossings, WhoFacesAgainstTheSheetHasNoSay) {
  const MeshRules rules = rulesWith(0.02f, 0.5f);
  UnitSamples samples = {};
  setEdge(samples, 5, {-0.3f, 90.0f}, {0.7f, 90.0f});
  EXPECT_TRUE(isWeak(rules, samples));
  UnitSamples upright = {};
  setEdge(upright, 4, {-0.3f, 90.0f}, {0.7f, 90.0f});
  EXPECT_FALSE(isWeak(rules, upright));
}

/// One direction is behind below, another one in front above: the weights of all, 8 + 2 below and
/// 9 + 1 above, count for a quarter, 2.5.
TEST(Crossings, AVoteCountsForAShareOfTheWeights) {
  UnitSamples samples = {};
  setEdge(samples, 0, {-0.3f, 8.0f}, {-0.2f, 1.0f});
  setEdge(samples, 2, {0.4f, 2.0f}, {0.7f, 9.0f});
  EXPECT_FALSE(isWeak(rulesWith(0.024f, 0.25f), samples));
  EXPECT_TRUE(isWeak(rulesWith(0.026f, 0.25f), samples));
  EXPECT_TRUE(isWeak(rulesWith(0.024f, 0.2f), samples));
}

/// Nothing is known at all: all three edges from corner 0 are weak, and none that is not crossed.
TEST(Crossings, AreTheEdgesBetweenLabels) {
  const UnitSamples nothing = {};
  EXPECT_EQ(weakCrossings(MeshRules(), nothing, 1, kGreatest), 1 | 1 << 8 | 1 << 16);
  EXPECT_EQ(weakCrossings(MeshRules(), nothing, 0x80, kGreatest), 1 << 6 | 1 << 13 | 1 << 19);
  EXPECT_EQ(weakCrossings(MeshRules(), nothing, 0, kGreatest), 0);
  EXPECT_EQ(weakCrossings(MeshRules(), nothing, 255, kGreatest), 0);
}

TEST(Crossings, OfAComponent) {
  for (const unsigned edge : {1u, 1u << 8, 1u << 16}) EXPECT_TRUE(crossesAny(0x01, edge));
  for (const unsigned edge : {1u << 2, 1u << 9, 1u << 17}) EXPECT_FALSE(crossesAny(0x01, edge));
  EXPECT_TRUE(crossesAny(0x80, 1u << 19));  // behind at the upper end
  EXPECT_FALSE(crossesAny(0x81, 0));
}

}  // namespace crossings_test
}  // namespace dtsdf
