#include "ros/common/schedule.h"

#include <gtest/gtest.h>

#include "ros/support/fake_clock.h"

namespace dtsdf {
namespace {

using std::chrono::milliseconds;
using Map = MapSchedule::Action;
using Output = OutputSchedule::Action;

constexpr MapSchedule::Situation kFrameAndListener{true, true};
constexpr MapSchedule::Situation kListener{false, true};
constexpr MapSchedule::Situation kFrame{true, false};
constexpr MapSchedule::Situation kNothing{false, false};

class MapScheduleTest : public testing::Test {
 protected:
  FakeClock clock_;
  MapSchedule schedule_{2.0, clock_.reader()};
};

TEST_F(MapScheduleTest, WithoutFramesThereIsNothingToDo) {
  EXPECT_EQ(schedule_.next(kNothing), Map::kWait);
  EXPECT_EQ(schedule_.next(kListener), Map::kWait);
  EXPECT_GT(schedule_.idleTime(kListener), milliseconds(0));
}

TEST_F(MapScheduleTest, ACorrectionHasTheTimeThatNothingElseNeeds) {
  MapSchedule::Situation correcting = kNothing, busy = kFrameAndListener;
  correcting.correcting = busy.correcting = true;
  EXPECT_EQ(schedule_.next(correcting), Map::kCorrect);
  EXPECT_EQ(schedule_.next(busy), Map::kFuse);
  busy.correction_first = true;
  EXPECT_EQ(schedule_.next(busy), Map::kCorrect);
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(busy), Map::kBeginMesh);
  EXPECT_EQ(schedule_.next(correcting), Map::kReport);
}

TEST_F(MapScheduleTest, WithoutListenersNothingIsMeshed) {
  schedule_.frameFused();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFrame), Map::kFuse);
  EXPECT_EQ(schedule_.next(kNothing), Map::kWait);
  EXPECT_TRUE(schedule_.meshOutdated());
  EXPECT_EQ(schedule_.next(kListener), Map::kBeginMesh) << "what was fused before counts";
}

TEST_F(MapScheduleTest, MeshRunsBesideTheNextFrame) {
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kBeginMesh);
  schedule_.meshBegun();
  EXPECT_FALSE(schedule_.meshOutdated());
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kFuse);
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kFinishMesh);
}

TEST_F(MapScheduleTest, MeshThatIsMadeDoesNotWaitForAFrame) {
  MapSchedule::Situation made = kFrameAndListener;
  made.mesh_made = true;
  schedule_.frameFused();
  schedule_.meshBegun();
  EXPECT_EQ(schedule_.next(made), Map::kFinishMesh);
}

TEST_F(MapScheduleTest, MeshIsFinishedAtOnceWhenNoFrameIsThere) {
  schedule_.frameFused();
  schedule_.meshBegun();
  EXPECT_EQ(schedule_.next(kListener), Map::kFinishMesh);
  EXPECT_EQ(schedule_.next(kNothing), Map::kFinishMesh) << "also when the listener has gone";
  schedule_.meshEnded();
  EXPECT_FALSE(schedule_.meshUnderWay());
}

/// Who follows space needs surfaces twice a second, whether or not anybody listens to the mesh, and
/// whatever rates are set for that.
TEST_F(MapScheduleTest, SpaceIsFollowedByAMeshOfItsOwnRate) {
  constexpr MapSchedule::Situation kFollowed{false, false, true};
  constexpr MapSchedule::Situation kFollowedAndListener{false, true, true};
  const auto mesh = [&] {
    schedule_.meshBegun();
    schedule_.meshEnded();
    schedule_.frameFused();
    schedule_.reported();
  };
  EXPECT_EQ(schedule_.next(kFollowed), Map::kWait) << "nothing has changed";
  schedule_.setMeshRate(0.1);
  schedule_.setSpaceRate(0.1);
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(kFollowed), Map::kBeginMesh);
  mesh();
  EXPECT_EQ(schedule_.next(kFollowed), Map::kWait);
  clock_.advance(0.48);
  EXPECT_EQ(schedule_.idleTime(kFollowed), milliseconds(20));
  clock_.advance(0.02);
  EXPECT_EQ(schedule_.next(kListener), Map::kWait);
  EXPECT_EQ(schedule_.next(kFollowedAndListener), Map::kBeginMesh) << "the sooner one counts";
  mesh();
  schedule_.setSpaceRate(10.0);
  clock_.advance(0.1);
  EXPECT_EQ(schedule_.next(kFollowed), Map::kBeginMesh);
  mesh();
  schedule_.meshTook(milliseconds(2000));
  schedule_.reported();
  clock_.advance(1.99);
  EXPECT_EQ(schedule_.next(kFollowed), Map::kWait) << "frames get as much time as it took";
  clock_.advance(0.01);
  EXPECT_EQ(schedule_.next(kFollowed), Map::kBeginMesh);
}

TEST_F(MapScheduleTest, ANewMapIsMeshed) {
  constexpr MapSchedule::Situation kFollowed{false, false, true};
  schedule_.mapReplaced();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFollowed), Map::kBeginMesh);
  schedule_.cleared();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFollowed), Map::kWait) << "an empty one has no surfaces";
}

TEST_F(MapScheduleTest, MeshKeepsItsRate) {
  schedule_.frameFused();
  schedule_.meshBegun();
  schedule_.meshEnded();
  schedule_.meshTook(milliseconds(10));
  schedule_.frameFused();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kFuse);
  EXPECT_EQ(schedule_.next(kListener), Map::kWait);
  clock_.advance(0.48);
  EXPECT_EQ(schedule_.idleTime(kListener), milliseconds(20)) << "until the mesh is due";
  clock_.advance(0.02);
  EXPECT_EQ(schedule_.next(kListener), Map::kBeginMesh);
}

TEST_F(MapScheduleTest, ANewRateCountsAtOnce) {
  schedule_.setMeshRate(0.01);
  schedule_.frameFused();
  schedule_.meshBegun();
  schedule_.meshEnded();
  schedule_.frameFused();
  schedule_.reported();
  clock_.advance(1.0);
  EXPECT_EQ(schedule_.next(kListener), Map::kWait);
  schedule_.setMeshRate(2.0);
  clock_.advance(0.5);
  EXPECT_EQ(schedule_.next(kListener), Map::kBeginMesh);
}

TEST_F(MapScheduleTest, FramesGetAsMuchTimeAsALongMesh) {
  schedule_.frameFused();
  schedule_.meshBegun();
  clock_.advance(2.0);
  schedule_.meshEnded();
  schedule_.meshTook(milliseconds(2000));
  schedule_.frameFused();
  schedule_.reported();
  clock_.advance(1.99);
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kFuse);
  clock_.advance(0.01);
  EXPECT_EQ(schedule_.next(kFrameAndListener), Map::kBeginMesh);
}

TEST_F(MapScheduleTest, ReportsAtOnceWhenIdleAndNowAndThenWhenBusy) {
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(kNothing), Map::kReport);
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kNothing), Map::kWait);
  schedule_.frameFused();
  EXPECT_EQ(schedule_.next(kFrame), Map::kFuse);
  EXPECT_EQ(schedule_.next(kNothing), Map::kReport);
  clock_.advance(0.1);
  EXPECT_EQ(schedule_.next(kFrame), Map::kReport);
}

TEST_F(MapScheduleTest, ClearingForgetsWhatWasDue) {
  schedule_.frameFused();
  schedule_.meshBegun();
  schedule_.frameFused();
  schedule_.cleared();
  schedule_.reported();
  EXPECT_FALSE(schedule_.meshUnderWay());
  EXPECT_FALSE(schedule_.meshOutdated());
  EXPECT_EQ(schedule_.next(kListener), Map::kWait);
}

class OutputScheduleTest : public testing::Test {
 protected:
  FakeClock clock_;
  OutputSchedule schedule_{2.0, 1.0, clock_.reader()};

  /// Does it, and takes that long.
  void act(Output action, double seconds) {
    const SteadyTime begin = clock_.reader()();
    clock_.advance(seconds);
    schedule_.done(action, begin);
  }
};

TEST_F(OutputScheduleTest, PublishesWhatIsOutdated) {
  EXPECT_EQ(schedule_.next({false, false, false}), Output::kWait);
  EXPECT_EQ(schedule_.next({true, false, false}), Output::kPublishMesh);
  EXPECT_EQ(schedule_.next({false, false, true}), Output::kPublishPoints);
}

TEST_F(OutputScheduleTest, EachTopicKeepsItsOwnRate) {
  act(Output::kPublishMesh, 0.0);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kPublishPoints);
  act(Output::kPublishPoints, 0.0);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kWait);
  clock_.advance(0.499);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kWait);
  EXPECT_EQ(schedule_.idleTime({true, false, true}), milliseconds(1));
  clock_.advance(0.001);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kPublishMesh);
  act(Output::kPublishMesh, 0.0);
  clock_.advance(0.499);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kWait);
  clock_.advance(0.001);
  EXPECT_EQ(schedule_.next({false, false, true}), Output::kPublishPoints);
}

/// The mesh comes at about the same rate: one that was once published late would wait each time.
TEST_F(OutputScheduleTest, WhatComesLateDoesNotPutOffTheNext) {
  act(Output::kPublishMesh, 0.0);
  clock_.advance(0.8);
  act(Output::kPublishMesh, 0.01);
  clock_.advance(0.189);
  EXPECT_EQ(schedule_.next({true, false, false}), Output::kWait);
  clock_.advance(0.001);
  EXPECT_EQ(schedule_.next({true, false, false}), Output::kPublishMesh);
  clock_.advance(0.5);
  act(Output::kPublishMesh, 0.0);
  clock_.advance(0.499);
  EXPECT_EQ(schedule_.next({true, false, false}), Output::kWait) << "after a period no arrears";
}

TEST_F(OutputScheduleTest, WhoIsBehindCatchesUpInBetween) {
  EXPECT_EQ(schedule_.next({true, true, true}), Output::kPublishMesh);
  act(Output::kPublishMesh, 0.0);
  EXPECT_EQ(schedule_.next({true, true, true}), Output::kCatchUp);
  act(Output::kCatchUp, 0.1);
  EXPECT_EQ(schedule_.next({true, true, false}), Output::kWait) << "it rests as long as it took";
  EXPECT_EQ(schedule_.next({true, true, true}), Output::kPublishPoints);
  EXPECT_GT(schedule_.idleTime({false, true, false}), milliseconds(0));
  clock_.advance(0.1);
  EXPECT_EQ(schedule_.next({true, true, false}), Output::kCatchUp);
}

TEST_F(OutputScheduleTest, RatesMayChange) {
  schedule_.setRates(0.01, 0.01);
  for (const Output action : {Output::kPublishMesh, Output::kPublishPoints}) {
    schedule_.done(action, clock_.reader()());
  }
  clock_.advance(10.0);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kWait);
  schedule_.setRates(0.01, 10.0);
  clock_.advance(0.1);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kPublishPoints);
}

TEST_F(OutputScheduleTest, WhatTakesLongRestsAsLong) {
  act(Output::kPublishPoints, 3.0);
  clock_.advance(2.999);
  EXPECT_EQ(schedule_.next({false, false, true}), Output::kWait);
  EXPECT_EQ(schedule_.next({true, false, true}), Output::kPublishMesh) << "the other one does not";
  clock_.advance(0.001);
  EXPECT_EQ(schedule_.next({false, false, true}), Output::kPublishPoints);
}

}  // namespace
}  // namespace dtsdf
