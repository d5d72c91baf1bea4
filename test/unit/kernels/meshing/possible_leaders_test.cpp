#include "kernels/meshing/possible_leaders.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace possible_leaders_test {

constexpr uint32_t kAll = 0x3F;

/// The sides of a unit whose corners are all seen by some directions alike.
uint32_t sidesOfUnit(uint32_t in_front, uint32_t behind) {
  return sidesOfCorner(in_front) | sidesOfCorner(behind << kBehindBit);
}

TEST(PossibleLeaders, ASampleIsInFrontOrBehindIfItHasAWeight) {
  EXPECT_EQ(sidesOfSample(3, 0.5f, 1.0f), 1u << 3);
  EXPECT_EQ(sidesOfSample(3, 0.06f, 1.0f), 1u << 3);
  constexpr uint32_t kBehind = 1u << (kBehindBit + 3) | 1u << (kNegativeBit + 3);
  EXPECT_EQ(sidesOfSample(3, -0.5f, 1.0f), kBehind);
  EXPECT_EQ(sidesOfSample(3, -0.5f, 0.0f), 0u);
  EXPECT_EQ(sidesOfSample(3, -0.5f, -1.0f), 0u);
  EXPECT_EQ(sidesOfSample(3, -0.06f, 1.0f), kBehind);
}

TEST(PossibleLeaders, ACornerThatTheSurfaceTouchesIsOnBothSides) {
  for (const float sdf : {-0.04f, 0.0f, 0.04f}) {
    const uint32_t negative = sdf < 0.0f ? 1u << (kNegativeBit + 3) : 0u;
    EXPECT_EQ(sidesOfSample(3, sdf, 1.0f), 1u << 3 | 1u << (kBehindBit + 3) | negative);
    EXPECT_EQ(sidesOfSample(3, sdf, 0.0f), 0u);
  }
}

/// X+ alone (bit 0) bars X- (bit 1), and so on in pairs; two directions bar none; nobody bars all.
TEST(PossibleLeaders, ALoneObserverBarsItsOpposite) {
  const uint32_t barred[kDirectionCount] = {1u << 1, 1u << 0, 1u << 3, 1u << 2, 1u << 5, 1u << 4};
  EXPECT_EQ(barredLeaders(0), kAll);
  for (int a = 0; a < kDirectionCount; ++a) {
    EXPECT_EQ(barredLeaders(1u << a), barred[a]);
    for (int b = 0; b < a; ++b) EXPECT_EQ(barredLeaders(1u << a | 1u << b), 0u);
  }
}

TEST(PossibleLeaders, WhoSeesBothSidesCanLead) {
  EXPECT_EQ(possibleLeaders(sidesOfUnit(1, 1)), 1u);
  EXPECT_EQ(possibleLeaders(sidesOfUnit(1, 2)), 0u);  // X+ in front, X- behind: none sees both
  EXPECT_EQ(possibleLeaders(sidesOfUnit(5, 4)), 4u);  // X+ and Y+ in front, Y+ behind
  EXPECT_EQ(possibleLeaders(sidesOfUnit(3, 3)), 3u);
}

/// X+ sees both sides, but on one corner only X- could vote, which does not where X+ leads.
TEST(PossibleLeaders, ACornerThatOnlyTheOppositeSawBarsALeader) {
  EXPECT_EQ(possibleLeaders(sidesOfUnit(1, 1) | sidesOfCorner(2)), 0u);
  EXPECT_EQ(possibleLeaders(sidesOfUnit(1, 1) | sidesOfCorner(2 | 4)), 1u);  // Y+ votes there
}

TEST(PossibleLeaders, ACornerThatNobodySawBarsAll) {
  EXPECT_EQ(possibleLeaders(sidesOfUnit(1, 1) | sidesOfCorner(0)), 0u);
}

}  // namespace possible_leaders_test
}  // namespace dtsdf
