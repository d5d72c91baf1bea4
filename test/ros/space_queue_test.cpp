#include "ros/steps/space.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

SpaceCube cubeAt(int32_t x, uint64_t surface) {
  SpaceCube cube{{8 * x, 0, 0}, {}, {}};
  cube.surface[0] = surface;
  return cube;
}

class SpaceQueueTest : public testing::Test {
 protected:
  void add(const SpaceChanges& changes) { queue_.add(changes, 0.1, ros::Time(1.0)); }

  SpaceQueue queue_;
};

TEST_F(SpaceQueueTest, ChangesOfACubeBecomeOne) {
  EXPECT_FALSE(queue_.take());
  add({true, {cubeAt(0, 1), cubeAt(1, 1)}});
  add({false, {cubeAt(0, 3), cubeAt(-1, 4)}});
  const auto delivery = queue_.take();
  ASSERT_TRUE(delivery);
  EXPECT_TRUE(delivery->changes.begins_anew);
  EXPECT_EQ(delivery->cell_size_m, 0.1);
  EXPECT_EQ(delivery->stamp, ros::Time(1.0));
  ASSERT_EQ(delivery->changes.cubes.size(), 3u);
  uint64_t all = 0;
  for (const SpaceCube& cube : delivery->changes.cubes) all += cube.surface[0];
  EXPECT_EQ(all, 3u + 1u + 4u);
  EXPECT_FALSE(queue_.take());
  add({false, {}});
  EXPECT_FALSE(queue_.take()->changes.begins_anew);
}

TEST_F(SpaceQueueTest, WhatBeginsAgainTakesThePlaceOfWhatWas) {
  add({true, {cubeAt(0, 1)}});
  add({true, {cubeAt(5, 2)}});
  const auto delivery = queue_.take();
  ASSERT_EQ(delivery->changes.cubes.size(), 1u);
  EXPECT_EQ(delivery->changes.cubes[0].first.x, 40);
}

TEST_F(SpaceQueueTest, AMapThatIsClearedIsForgottenAtOnce) {
  queue_.clear();
  EXPECT_FALSE(queue_.take()) << "nothing was known so far";
  add({true, {cubeAt(0, 1)}});
  queue_.take();
  add({false, {cubeAt(1, 1)}});
  queue_.clear();
  const auto delivery = queue_.take();
  ASSERT_TRUE(delivery);
  EXPECT_TRUE(delivery->changes.begins_anew);
  EXPECT_TRUE(delivery->changes.cubes.empty());
  EXPECT_EQ(delivery->cell_size_m, 0.1) << "that of what has to be forgotten";
  EXPECT_TRUE(delivery->stamp.isZero());
}

using std::chrono::milliseconds;

TEST(StaticLayerPace, UpdatesKeepAwayFromTheirGrid) {
  const SteadyTime start{milliseconds(1000)};
  StaticLayerPace pace;
  EXPECT_FALSE(pace.isDue(start)) << "no grid was published yet";
  pace.startOver(start);
  EXPECT_FALSE(pace.isDue(start + milliseconds(199)));
  EXPECT_TRUE(pace.isDue(start + milliseconds(200)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(200))) << "all of the grid";
  EXPECT_FALSE(pace.isDue(start + milliseconds(300))) << "it lacks nothing";
  pace.noteChange();
  EXPECT_TRUE(pace.isDue(start + milliseconds(300)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(1999)));
  pace.noteChange();
  EXPECT_FALSE(pace.takeUpdate(start + milliseconds(2000))) << "what has changed will do";
  pace.startOver(start + milliseconds(3000));
  EXPECT_FALSE(pace.isDue(start + milliseconds(3100)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(3200)));
}

}  // namespace
}  // namespace dtsdf
