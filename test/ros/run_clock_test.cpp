#include "ros/output/status_history.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

class RunClockTest : public testing::Test {
 protected:
  double update(double wall_s, double ros_s, bool paused = false) {
    clock_.update({SteadyTime() + toSteadyDuration(1000.0 + wall_s), ros::Time(ros_s), paused});
    return clock_.ran_s();
  }

  RunClock clock_;
};

TEST_F(RunClockTest, RunsAsLongAsTimeDoes) {
  EXPECT_EQ(update(0.0, 50.0), 0.0);
  EXPECT_NEAR(update(2.0, 51.0), 2.0, 1e-9) << "wall time, though simulated time is slow";
  EXPECT_NEAR(update(2.9, 51.0), 2.9, 1e-9) << "between two steps of simulated time";
  EXPECT_FALSE(clock_.timeStands());
}

TEST_F(RunClockTest, BeginsAnewAfterAPause) {
  update(0.0, 1.0);
  EXPECT_EQ(update(10.0, 2.0, true), 0.0);
  EXPECT_NEAR(update(11.0, 3.0), 1.0, 1e-9);
}

TEST_F(RunClockTest, BeginsAnewAfterAStandOfSimulatedTime) {
  update(0.0, 1.0);
  update(10.0, 2.0);
  EXPECT_NEAR(update(10.5, 2.0), 10.5, 1e-9);
  EXPECT_EQ(update(11.0, 2.0), 0.0);
  EXPECT_TRUE(clock_.timeStands());
  EXPECT_EQ(update(99.0, 2.0), 0.0);
  EXPECT_NEAR(update(100.0, 2.1), 1.0, 1e-9);
  EXPECT_FALSE(clock_.timeStands());
}

}  // namespace
}  // namespace dtsdf
