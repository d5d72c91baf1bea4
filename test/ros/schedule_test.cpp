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

TEST_F(MapScheduleTest, MeshIsFinishedAtOnceWhenNoFrameIsThere) {
  schedule_.frameFused();
  schedule_.meshBegun();
  EXPECT_EQ(schedule_.next(kListener), Map::kFinishMesh);
  EXPECT_EQ(schedule_.next(kNothing), Map::kFinishMesh) << "also when the listener has gone";
  schedule_.meshEnded();
  EXPECT_FALSE(schedule_.meshUnderWay());
}

/// What is told of space has the surfaces of a mesh that is finished; who was told nothing has not
/// to wait for a frame.
TEST_F(MapScheduleTest, SpaceIsToldAfterTheMesh) {
  constexpr MapSchedule::Situation kFollower{false, true, true, false};
  constexpr MapSchedule::Situation kNewcomer{false, true, true, true};
  schedule_.setSpaceRate(1.0);
  EXPECT_EQ(schedule_.next(kFollower), Map::kWait);
  EXPECT_EQ(schedule_.next(kNewcomer), Map::kTellSpace);
  schedule_.frameFused();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kNewcomer), Map::kBeginMesh);
  schedule_.meshBegun();
  EXPECT_EQ(schedule_.next(kNewcomer), Map::kFinishMesh);
  schedule_.meshEnded();
  schedule_.spaceChanged();
  EXPECT_EQ(schedule_.next(kListener), Map::kWait) << "nobody asks";
  EXPECT_EQ(schedule_.next(kFollower), Map::kTellSpace);
  schedule_.spaceTold(clock_.reader()());
  EXPECT_EQ(schedule_.next(kFollower), Map::kWait);
}

TEST_F(MapScheduleTest, SpaceKeepsItsRate) {
  constexpr MapSchedule::Situation kFollower{false, false, true, false};
  schedule_.setSpaceRate(4.0);
  schedule_.spaceChanged();
  schedule_.spaceTold(clock_.reader()());
  schedule_.spaceChanged();
  clock_.advance(0.2);
  EXPECT_EQ(schedule_.next(kFollower), Map::kWait);
  clock_.advance(0.1);
  EXPECT_EQ(schedule_.next(kFollower), Map::kTellSpace);
  const SteadyTime begin = clock_.reader()();
  clock_.advance(2.0);
  schedule_.spaceTold(begin);
  schedule_.spaceChanged();
  clock_.advance(1.9);
  EXPECT_EQ(schedule_.next(kFollower), Map::kWait) << "frames get as much time as it took";
  clock_.advance(0.2);
  EXPECT_EQ(schedule_.next(kFollower), Map::kTellSpace);
}

/// Of a map that takes another's place nothing is told before its surfaces are known.
TEST_F(MapScheduleTest, SpaceOfANewMapWaitsForItsMesh) {
  constexpr MapSchedule::Situation kFollower{false, true, true, false};
  schedule_.mapReplaced();
  schedule_.reported();
  EXPECT_EQ(schedule_.next(kFollower), Map::kBeginMesh);
  schedule_.cleared();
  EXPECT_EQ(schedule_.next(kFollower), Map::kTellSpace) << "an empty one has none";
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
