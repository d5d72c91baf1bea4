#include "ros/input/frame_intake.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "ros/support/fake_clock.h"
#include "ros/support/transforms.h"

namespace dtsdf {
namespace {

class FrameIntakeTest : public testing::Test {
 protected:
  FrameIntakeTest() {
    ros::Time::init();  // real time, as it is without a master
    params_.tf_timeout_s = 1.0;
    makeIntake(3);
  }

  void makeIntake(int queue_size) {
    params_.queue_size = queue_size;
    intake_ = std::make_unique<FrameIntake>(
        params_,
        FrameIntake::Parts{poses_, posed_frames_, ledger_, stream_, 0, [this] { restartStamps(); }},
        kind_, "", clock_.reader());
  }

  /// Image number i, ten a second, whose transform is there.
  void pushInTime(int i) {
    clock_.advance(0.1);
    push(1.0 + 0.1 * i);
    intake_->step();
  }

  void push(double stamp_s) {
    intake_->push({makeDepthImage(stamp_s), makeCameraInfo(stamp_s), nullptr});
  }

  void restartStamps() {
    intake_->restartStamps();
    posed_frames_.forgetStamps();
    poses_.clear();
  }

  uint64_t dropped(DropReason reason) const {
    return accounting_.counts().dropped[static_cast<size_t>(reason)];
  }

  std::vector<double> posedStamps() {
    std::vector<double> stamps;
    while (const auto frame = posed_frames_.take()) stamps.push_back(frame->stamp.toSec());
    return stamps;
  }

  static const DepthFrame& depthOf(const PosedFrame& frame) {
    return std::get<DepthFrame>(frame.image);
  }

  FakeClock clock_;
  InputParams params_;
  ImageKind kind_ = makeDepthKind(params_);
  TransformBuffer transforms_;
  PoseSource poses_{transforms_, "map"};
  int wakes_ = 0;
  FrameQueue posed_frames_{0.1, [this] { ++wakes_; }, clock_.reader()};
  const FrameQueue::Stream stream_ = posed_frames_.addStream({});
  FrameLedger ledger_;
  FrameAccounting& accounting_ = ledger_.addStream(stream_);
  std::unique_ptr<FrameIntake> intake_;
};

/// Colour comes more seldom, so that its queue reaches farther back: depth would never have its
/// turn.
TEST_F(FrameIntakeTest, WhenFramesAreTooManyColourBeforeThemGoesToo) {
  const auto stream = posed_frames_.addStream({1, ""}, StreamUse::kExtra);
  FrameAccounting& colour = ledger_.addStream(stream);
  const auto pushColour = [&](double stamp_s) {
    PosedFrame frame;
    frame.stamp = ros::Time(stamp_s);
    frame.image = ColourFrame();
    frame.stream = stream;
    EXPECT_TRUE(posed_frames_.push(stream, frame.stamp, std::move(frame)));
  };
  putTransform(transforms_, 1.0, 1.0);
  putTransform(transforms_, 3.0, 3.0);
  pushColour(1.05);
  pushColour(1.15);
  pushColour(1.35);
  for (const double stamp_s : {1.1, 1.2, 1.3, 1.4}) push(stamp_s);  // there is room for three
  intake_->step();
  push(1.5);
  EXPECT_EQ(dropped(DropReason::kQueueFull), 2u);
  EXPECT_EQ(colour.counts().dropped[static_cast<size_t>(DropReason::kQueueFull)], 2u);
  intake_->step();
  clock_.advance(1.0);  // nobody waits for later colour any more
  EXPECT_EQ(posedStamps(), (std::vector<double>{1.3, 1.35, 1.4, 1.5}));
}

TEST_F(FrameIntakeTest, FramesGoOnInOrderWithTheirPoses) {
  putTransform(transforms_, 1.0, 1.0);
  putTransform(transforms_, 2.0, 2.0);
  push(1.25);
  intake_->push({makeDepthImage(1.75, "/camera"), makeCameraInfo(1.75), nullptr});  // of old
  EXPECT_EQ(posed_frames_.size(), 0u) << "the callbacks' thread looks nothing up";
  intake_->step();
  EXPECT_EQ(wakes_, 2);
  EXPECT_EQ(intake_->size(), 2u) << "they wait for their turn";
  const auto first = posed_frames_.take();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->stamp, ros::Time(1.25));
  EXPECT_NEAR(depthOf(*first).T_W_C.translation().x(), 1.25, 1e-9);
  EXPECT_EQ(depthOf(*first).width, 4);
  EXPECT_EQ(static_cast<const uint16_t*>(depthOf(*first).data)[3], 1000);
  EXPECT_EQ(posedStamps(), std::vector<double>{1.75});
  EXPECT_EQ(intake_->size(), 0u);
}

TEST_F(FrameIntakeTest, AFrameWaitsForItsTransformAndThoseBehindItToo) {
  putTransform(transforms_, 1.0, 0.0);
  push(1.2);
  push(1.1);
  intake_->step();
  EXPECT_EQ(intake_->size(), 2u);
  EXPECT_NE(intake_->waitingFor().find("'camera' to 'map'"), std::string::npos);
  putTransform(transforms_, 1.15, 0.0);
  intake_->step();
  EXPECT_EQ(posed_frames_.size(), 0u) << "the second one has its pose, but not its turn";
  putTransform(transforms_, 1.3, 0.0);
  intake_->step();
  EXPECT_EQ(intake_->waitingFor(), "");
  EXPECT_EQ(posedStamps(), (std::vector<double>{1.2, 1.1}));
}

TEST_F(FrameIntakeTest, ATransformThatDoesNotComeIsGivenUp) {
  push(1.0);
  intake_->step();
  clock_.advance(0.99);
  intake_->step();
  EXPECT_EQ(intake_->size(), 1u);
  clock_.advance(0.01);
  intake_->step();
  EXPECT_EQ(intake_->size(), 0u);
  EXPECT_EQ(dropped(DropReason::kNoTransform), 1u);
}

TEST_F(FrameIntakeTest, ATransformThatCannotComeIsNotWaitedFor) {
  putTransform(transforms_, 5.0, 0.0);
  push(4.0);
  intake_->step();
  EXPECT_EQ(dropped(DropReason::kBeforeTransforms), 1u);
}

TEST_F(FrameIntakeTest, BothQueuesTogetherAreBoundedAndLoseTheOldest) {
  putTransform(transforms_, 1.0, 0.0);
  putTransform(transforms_, 1.2, 0.0);
  push(1.1);
  push(1.15);
  intake_->step();  // both have their poses now
  push(1.3);
  EXPECT_EQ(dropped(DropReason::kQueueFull), 0u);
  push(1.4);
  push(1.5);
  EXPECT_EQ(dropped(DropReason::kQueueFull), 2u);
  EXPECT_EQ(posed_frames_.size(), 0u);
  push(1.6);
  EXPECT_EQ(dropped(DropReason::kQueueFull), 3u);
  EXPECT_EQ(intake_->size(), 3u);
  putTransform(transforms_, 2.0, 0.0);
  intake_->step();
  EXPECT_EQ(posedStamps(), (std::vector<double>{1.4, 1.5, 1.6}));
}

/// The map takes nine of ten: the queue never runs over.
TEST_F(FrameIntakeTest, AQueueThatIsNotWorkedOffIsShortenedUntilItIsEmptied) {
  makeIntake(30);
  putTransform(transforms_, 0.0, 0.0);
  putTransform(transforms_, 30.0, 30.0);
  size_t most = 0;
  for (int i = 0; i < 200; ++i) {
    pushInTime(i);
    most = std::max(most, posed_frames_.size());
    if (i % 10 != 0) posed_frames_.take();
    if (i == 60) {
      EXPECT_EQ(dropped(DropReason::kQueueFull), 0u);
    }
  }
  EXPECT_GE(most, 6u);
  EXPECT_LE(most, 8u)
      << "one more waits after each nine that are taken, of which 30 are, past three";

  // Once it has caught up there is room for a burst again.
  posedStamps();
  const uint64_t dropped_before = dropped(DropReason::kQueueFull);
  EXPECT_GT(dropped_before, 0u);
  for (int i = 200; i < 230; ++i) pushInTime(i);
  EXPECT_EQ(posed_frames_.size(), 30u);
  EXPECT_EQ(dropped(DropReason::kQueueFull), dropped_before);
}

/// Its camera_info comes last, so that its room is made while it waits for that.
TEST_F(FrameIntakeTest, AQueueIsShortenedWhereverRoomIsMadeForAnImage) {
  makeIntake(10);
  putTransform(transforms_, 0.0, 0.0);
  putTransform(transforms_, 30.0, 30.0);
  for (int i = 0; i < 150; ++i) {
    if (intake_->size() == 10) {
      EXPECT_TRUE(intake_->makeRoom());
    }
    pushInTime(i);
    if (i % 2 == 0) posed_frames_.take();
  }
  EXPECT_LE(posed_frames_.size(), 4u);
}

/// A map that takes so many images for each that comes, but none while it stands still.
struct MapPace {
  double taken_an_image;
  int room, stall_begin, stall_end;
};

class FrameIntakeAtPace : public FrameIntakeTest, public testing::WithParamInterface<MapPace> {};

TEST_P(FrameIntakeAtPace, LosesNothing) {
  const MapPace& pace = GetParam();
  makeIntake(pace.room);
  putTransform(transforms_, 0.0, 0.0);
  putTransform(transforms_, 30.0, 30.0);
  double due = 0.0;
  for (int i = 0; i < 200; ++i) {
    pushInTime(i);
    if (i >= pace.stall_begin && i < pace.stall_end) continue;
    for (due += pace.taken_an_image; due >= 1.0; due -= 1.0) posed_frames_.take();
  }
  EXPECT_EQ(dropped(DropReason::kQueueFull), 0u);
}

/// As while a map is saved.
INSTANTIATE_TEST_SUITE_P(CatchingUpAfterAStall, FrameIntakeAtPace,
                         testing::Values(MapPace{1.25, 30, 20, 35}, MapPace{1.5, 30, 20, 35},
                                         MapPace{2.0, 30, 20, 35}, MapPace{10.0, 30, 20, 35}));

/// Who has room for a whole recording wants all of it.
INSTANTIATE_TEST_SUITE_P(WithRoomForAll, FrameIntakeAtPace,
                         testing::Values(MapPace{0.25, 200, 0, 0}, MapPace{0.5, 200, 0, 0},
                                         MapPace{0.75, 200, 0, 0}, MapPace{0.9, 200, 0, 0}));

/// What a stall leaves no room for is lost, and no more.
TEST_F(FrameIntakeTest, AfterALongStallAFastMapLosesOnlyWhatThereIsNoRoomFor) {
  makeIntake(20);
  putTransform(transforms_, 0.0, 0.0);
  putTransform(transforms_, 30.0, 30.0);
  for (int i = 0; i < 60; ++i) {
    pushInTime(i);
    for (int k = 0; i >= 40 && k < 2; ++k) posed_frames_.take();
  }
  EXPECT_EQ(dropped(DropReason::kQueueFull), 21u) << "41 came until the first was taken";
}

TEST_F(FrameIntakeTest, WhatWaitsIsBoundedInBytes) {
  params_.queue_size = 1000;
  params_.queue_mb = 1;
  const auto stream = posed_frames_.addStream({1, "b"});
  const FrameAccounting& accounting = ledger_.addStream(stream, "b");
  FrameIntake intake(params_, {poses_, posed_frames_, ledger_, stream}, kind_, "", clock_.reader());
  constexpr int kImages = 20;
  for (int i = 0; i < kImages; ++i) {
    const auto image = makeDepthImage(1.0 + 0.1 * i);
    image->data.resize(100000);  // more than its rows need
    intake.push({image, makeCameraInfo(1.0 + 0.1 * i), nullptr});
    ASSERT_LE(intake.waitingBytes(), size_t{1} << 20);
  }
  EXPECT_EQ(intake.size(), 10u);
  EXPECT_EQ(accounting.counts().droppedSum(), kImages - 10u);
}

TEST_F(FrameIntakeTest, PausingDropsWhatWaitsAndWhatComes) {
  putTransform(transforms_, 1.0, 0.0);
  push(1.0);
  intake_->step();
  push(1.1);
  intake_->setPaused(true);
  EXPECT_EQ(intake_->size(), 0u);
  push(1.2);
  EXPECT_EQ(dropped(DropReason::kPaused), 3u);
  intake_->setPaused(false);
  push(1.3);
  EXPECT_EQ(intake_->size(), 1u);
}

/// Also not a frame that is on its way from one queue to the other: whoever pauses waits for it.
TEST_F(FrameIntakeTest, NothingIsPassedOnOnceItIsPaused) {
  std::future<void> pausing;
  kind_.fill = [&, fill = kind_.fill](const CameraImage& camera, PosedFrame& frame) {
    pausing = std::async(std::launch::async, [&] { intake_->setPaused(true); });
    EXPECT_EQ(pausing.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
    fill(camera, frame);
  };
  makeIntake(3);
  putTransform(transforms_, 1.0, 0.0);
  push(1.0);
  intake_->step();
  pausing.get();
  EXPECT_EQ(intake_->size(), 0u);
  EXPECT_EQ(dropped(DropReason::kPaused), 1u);
}

TEST_F(FrameIntakeTest, StampsThatGoBackForgetFramesAndTransforms) {
  putTransform(transforms_, 100.0, 7.0);
  push(100.0);
  intake_->step();
  push(100.1);
  push(50.0);
  EXPECT_EQ(dropped(DropReason::kTimeJump), 2u);
  intake_->step();
  EXPECT_EQ(intake_->size(), 1u) << "the old transforms do not say that it is too late";
  putTransform(transforms_, 50.0, 1.0);
  intake_->step();
  const auto frame = posed_frames_.take();
  ASSERT_TRUE(frame);
  EXPECT_EQ(depthOf(*frame).T_W_C.translation().x(), 1.0);
}

/// A day ahead, as of a camera whose clock slips once: those before and after it go on.
TEST_F(FrameIntakeTest, OneStampFarAheadCostsOneFrame) {
  putTransform(transforms_, 100.0, 0.0);
  for (const double stamp_s : {100.1, 100.2, 86500.0, 100.3}) push(stamp_s);
  EXPECT_NE(accounting_.counts().last_drop.find("86399.8 s ahead"), std::string::npos)
      << accounting_.counts().last_drop;
  push(100.4);
  EXPECT_EQ(dropped(DropReason::kTimeJump), 1u);
  putTransform(transforms_, 100.5, 0.0);
  intake_->step();
  EXPECT_EQ(posedStamps(), (std::vector<double>{100.2, 100.3, 100.4})) << "three have room";
  EXPECT_EQ(dropped(DropReason::kQueueFull), 1u);
}

/// It was given up before the next one came.
TEST_F(FrameIntakeTest, OneStampFarAheadHoldsUpNobodyOnceItHasGone) {
  putTransform(transforms_, 100.0, 0.0);
  push(100.0);
  intake_->step();
  push(86500.0);
  clock_.advance(2.0);
  intake_->step();
  EXPECT_EQ(dropped(DropReason::kNoTransform), 1u);
  push(100.0);
  intake_->step();
  EXPECT_EQ(posedStamps(), (std::vector<double>{100.0, 100.0}));
  EXPECT_EQ(dropped(DropReason::kTimeJump), 0u);
}

TEST_F(FrameIntakeTest, StampsMayGoOnAfterAGap) {
  for (const double stamp_s : {100.0, 200.0, 200.1}) push(stamp_s);
  EXPECT_EQ(intake_->size(), 3u);
  push(150.0);  // back from there
  EXPECT_EQ(dropped(DropReason::kTimeJump), 3u);
}

TEST_F(FrameIntakeTest, ALittleDisorderIsNoJump) {
  push(1.0);
  push(0.6);
  EXPECT_EQ(dropped(DropReason::kTimeJump), 0u);
  EXPECT_EQ(intake_->size(), 2u);
}

TEST_F(FrameIntakeTest, AJumpingPoseCostsOneFrame) {
  putTransform(transforms_, 1.0, 0.0);
  putTransform(transforms_, 1.1, 50.0);
  putTransform(transforms_, 1.2, 50.0);
  for (const double stamp_s : {1.0, 1.1, 1.2}) push(stamp_s);
  intake_->step();
  EXPECT_EQ(dropped(DropReason::kPoseJump), 1u);
  EXPECT_EQ(posedStamps(), (std::vector<double>{1.0, 1.2}));
}

TEST_F(FrameIntakeTest, BadImagesDoNotGetIn) {
  const auto image = makeDepthImage(1.0);
  image->encoding = "bgr8";
  intake_->push({image, makeCameraInfo(1.0), nullptr});
  EXPECT_EQ(dropped(DropReason::kBadEncoding), 1u);
  intake_->push({makeDepthImage(1.0, ""), makeCameraInfo(1.0), nullptr});
  EXPECT_EQ(dropped(DropReason::kNoTransform), 1u);
  EXPECT_EQ(intake_->size(), 0u);
}

TEST_F(FrameIntakeTest, MasksTakeMeasurementsAway) {
  putTransform(transforms_, 1.0, 0.0);
  const auto image = makeDepthImage(1.0);
  intake_->push({image, makeCameraInfo(1.0), makeMask(1.0, {0, 1, 255, 0, 0, 0, 0, 7})});
  intake_->step();
  const auto frame = posed_frames_.take();
  ASSERT_TRUE(frame);
  const auto* pixels = static_cast<const uint16_t*>(depthOf(*frame).data);
  EXPECT_EQ(std::vector<uint16_t>(pixels, pixels + 8),
            (std::vector<uint16_t>{1000, 0, 0, 1000, 1000, 1000, 1000, 0}));
  EXPECT_EQ(image->data, makeDepthImage(1.0)->data) << "the message belongs to others, too";
}

TEST_F(FrameIntakeTest, RawImagesAreRectified) {
  putTransform(transforms_, 1.0, 0.0);
  const auto info = makeCameraInfo(1.0);
  info->K = {4.0, 0.0, 1.5, 0.0, 4.0, 0.5, 0.0, 0.0, 1.0};
  info->distortion_model = "plumb_bob";
  info->D = {-0.1, 0.01, 0.0, 0.0, 0.0};
  intake_->push({makeDepthImage(1.0), info, nullptr});
  intake_->step();
  const auto frame = posed_frames_.take();
  ASSERT_TRUE(frame);
  EXPECT_EQ(depthOf(*frame).intrinsics.fx, 5.0f);
  EXPECT_EQ(static_cast<const uint16_t*>(depthOf(*frame).data)[0], 1000);
}

TEST_F(FrameIntakeTest, BadMasksDropTheirFrames) {
  const auto pushWith = [&](const sensor_msgs::ImagePtr& mask) {
    intake_->push({makeDepthImage(1.0), makeCameraInfo(1.0), mask});
  };
  auto mask = makeMask(1.0, std::vector<uint8_t>(8, 0));
  mask->encoding = "bgr8";
  pushWith(mask);
  EXPECT_EQ(dropped(DropReason::kBadEncoding), 1u);
  mask = makeMask(1.0, std::vector<uint8_t>(8, 0));
  mask->height = 3;
  pushWith(mask);
  EXPECT_EQ(dropped(DropReason::kSizeMismatch), 1u);
  pushWith(makeMask(1.0, std::vector<uint8_t>(7, 0)));
  EXPECT_EQ(dropped(DropReason::kBadImage), 1u);
  EXPECT_EQ(intake_->size(), 0u);
}

}  // namespace
}  // namespace dtsdf
