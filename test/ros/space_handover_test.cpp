#include "ros/output/space_handover.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

SpaceCube cubeAt(int32_t x, uint64_t surface) {
  SpaceCube cube{{8 * x, 0, 0}, {}, {}};
  cube.surface[0] = surface;
  return cube;
}

class SpaceHandoverTest : public testing::Test {
 protected:
  void tell(const SpaceChanges& changes) { handover_.tell(changes, 0.1, ros::Time(1.0)); }

  int deliveries_ = 0;
  SpaceHandover handover_{[this] { ++deliveries_; }};
};

TEST_F(SpaceHandoverTest, WantsNothingAtFirst) {
  EXPECT_FALSE(handover_.wish().any());
  tell({true, {cubeAt(0, 1)}});
  handover_.tell(SpaceSlice());
  EXPECT_FALSE(handover_.take().changes);
  EXPECT_FALSE(handover_.take().slice);
  EXPECT_EQ(deliveries_, 0);
}

TEST_F(SpaceHandoverTest, BeginsWithEverything) {
  handover_.want(true, false);
  EXPECT_TRUE(handover_.wish().all_cells);
  tell({false, {cubeAt(0, 1)}});
  EXPECT_FALSE(handover_.take().changes) << "of an earlier wish";
  tell({true, {cubeAt(0, 1)}});
  EXPECT_FALSE(handover_.wish().all_cells);
  EXPECT_TRUE(handover_.take().changes->begins_anew);
  handover_.want(true, true);
  EXPECT_FALSE(handover_.wish().all_cells) << "it has the cells";
  EXPECT_TRUE(handover_.wish().first_slice);
  handover_.want(false, true);
  handover_.want(true, true);
  EXPECT_TRUE(handover_.wish().all_cells);
}

TEST_F(SpaceHandoverTest, ChangesOfACubeBecomeOne) {
  handover_.want(true, false);
  tell({true, {cubeAt(0, 1), cubeAt(1, 1)}});
  tell({false, {cubeAt(0, 3), cubeAt(-1, 4)}});
  const SpaceDelivery delivery = handover_.take();
  ASSERT_TRUE(delivery.changes);
  EXPECT_TRUE(delivery.changes->begins_anew);
  EXPECT_EQ(delivery.cell_size_m, 0.1);
  ASSERT_EQ(delivery.changes->cubes.size(), 3u);
  uint64_t all = 0;
  for (const SpaceCube& cube : delivery.changes->cubes) all += cube.surface[0];
  EXPECT_EQ(all, 3u + 1u + 4u);
  EXPECT_FALSE(handover_.take().changes);
  tell({false, {}});
  EXPECT_FALSE(handover_.take().changes->begins_anew);
}

TEST_F(SpaceHandoverTest, WhatIsAnewTakesThePlaceOfWhatWas) {
  handover_.want(true, false);
  tell({true, {cubeAt(0, 1)}});
  tell({true, {cubeAt(5, 2)}});
  const SpaceDelivery delivery = handover_.take();
  ASSERT_EQ(delivery.changes->cubes.size(), 1u);
  EXPECT_EQ(delivery.changes->cubes[0].first.x, 40);
}

TEST_F(SpaceHandoverTest, WhatNobodyWantsAnyMoreIsThrownAway) {
  handover_.want(true, true);
  tell({true, {cubeAt(0, 1)}});
  handover_.tell(SpaceSlice());
  handover_.want(false, false);
  const SpaceDelivery delivery = handover_.take();
  EXPECT_FALSE(delivery.changes);
  EXPECT_FALSE(delivery.slice);
}

TEST_F(SpaceHandoverTest, AMapThatIsClearedIsForgottenAtOnce) {
  handover_.want(true, true);
  handover_.clear();
  EXPECT_FALSE(handover_.take().changes) << "nothing was told so far";
  EXPECT_FALSE(handover_.take().slice);
  EXPECT_TRUE(handover_.wish().lacks());
  tell({true, {cubeAt(0, 1)}});
  handover_.take();
  tell({false, {cubeAt(1, 1)}});
  handover_.tell(SpaceSlice{{SliceCell()}, 0.1, ros::Time(1.0)});
  handover_.clear();
  const SpaceDelivery delivery = handover_.take();
  ASSERT_TRUE(delivery.changes);
  EXPECT_TRUE(delivery.changes->begins_anew);
  EXPECT_TRUE(delivery.changes->cubes.empty());
  EXPECT_EQ(delivery.cell_size_m, 0.1) << "that of what has to be forgotten";
  EXPECT_TRUE(delivery.stamp.isZero());
  ASSERT_TRUE(delivery.slice);
  EXPECT_TRUE(delivery.slice->cells.empty());
}

}  // namespace
}  // namespace dtsdf
