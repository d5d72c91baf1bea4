#include "ros/input/frame_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "ros/support/map_host.h"

namespace dtsdf {
namespace {

constexpr size_t kImageBytes = 4 * 2 * sizeof(uint16_t);

struct Limits {
  size_t images = 30;
  size_t bytes = 256u << 20;
  double merge_wait_s = 0.1;
};

class FrameQueueTest : public testing::Test {
 protected:
  FrameQueueTest() { ros::Time::init(); }

  void make(Limits limits, int cameras = 1, std::optional<std::string> no_mask = std::nullopt) {
    limits_ = limits;
    queue_ = std::make_unique<FrameQueue>(
        limits.images, limits.bytes, limits.merge_wait_s, [] {}, clock_.reader());
    for (int i = 0; i < cameras; ++i) {
      queue_->addStream(false, "there is none", no_mask, accounting_[i]);
    }
    colour_ = queue_->addStream(true, "", std::nullopt, accounting_[cameras]);
  }

  void image(double stamp_s, size_t stream = 0) {
    accounting_[stream].imageReceived(ros::Time(stamp_s));
    queue_->add(stream, {makeDepthImage(stamp_s)});
  }
  void info(double stamp_s, size_t stream = 0) {
    queue_->add(stream, {nullptr, makeCameraInfo(stamp_s)});
  }
  /// Gives a pose to the first complete frame of the stream.
  bool pose(size_t stream = 0) {
    return queue_->poseFirst(stream, [](const CameraImage& messages, auto&&...) {
      PosedFrame frame;
      frame.stamp = messages.image->header.stamp;
      DepthFrame depth;
      depth.height = 2;
      depth.row_bytes = kImageBytes / 2;
      frame.image = depth;
      return frame;
    });
  }
  void posed(double stamp_s, size_t stream = 0) {
    image(stamp_s, stream);
    info(stamp_s, stream);
    ASSERT_TRUE(pose(stream));
  }
  std::vector<double> taken() {
    std::vector<double> stamps;
    while (const auto frame = queue_->take()) {
      frame->accounting->fused(frame->stamp);
      stamps.push_back(frame->stamp.toSec());
    }
    return stamps;
  }
  uint64_t dropped(const DropReason& reason, size_t stream = 0) const {
    return accounting_[stream].counts().dropped_by[reason];
  }
  using Stamps = std::vector<double>;

  FakeClock clock_;
  FrameAccounting accounting_[4];
  Limits limits_;
  std::unique_ptr<FrameQueue> queue_;
  size_t colour_ = 1;
};

TEST_F(FrameQueueTest, MessagesAreMatchedByStamp) {
  make({});
  info(1.0);
  EXPECT_FALSE(pose());
  image(1.0);
  EXPECT_TRUE(pose());
  image(2.0);
  info(2.5);
  EXPECT_FALSE(pose());
  image(3.0);
  info(3.0);
  EXPECT_TRUE(pose()) << "the image without camera_info should be dropped";
  EXPECT_EQ(dropped(drop::kNoCameraInfo), 1u);
  EXPECT_EQ(taken(), (Stamps{1.0, 3.0}));
  EXPECT_EQ(queue_->bytes(), 0u);
}

TEST_F(FrameQueueTest, FramesWaitForTheirMasks) {
  make({}, 1, "no mask");
  image(1.0);
  EXPECT_EQ(queue_->waitingFor(0), "there is none");
  info(1.0);
  EXPECT_EQ(queue_->waitingFor(0), "no mask");
  EXPECT_FALSE(pose());
  queue_->add(0, {nullptr, nullptr, makeMask(1.0, std::vector<uint8_t>(8, 0))});
  EXPECT_TRUE(pose());
  queue_->add(0, {makeDepthImage(2.0), makeCameraInfo(0.5)});  // with the latest camera_info
  EXPECT_FALSE(pose());
  image(3.0);
  info(3.0);
  queue_->add(0, {nullptr, nullptr, makeMask(3.0, std::vector<uint8_t>(8, 0))});
  EXPECT_TRUE(pose());
  EXPECT_EQ(dropped(drop::kNoMask), 1u);
}

TEST_F(FrameQueueTest, LaterStampsDoNotBlockEarlierOnes) {
  make({5, 1 << 20, 0.1});
  for (int i = 0; i < 100; ++i) info(1000.0 + i);  // then the recording starts again
  for (int i = 0; i < 10; ++i) image(2000.0 + i);
  for (const double stamp_s : {1.0, 2.0, 3.0}) {
    info(stamp_s);
    image(stamp_s);
    EXPECT_TRUE(pose()) << stamp_s;
  }
  EXPECT_EQ(taken(), (Stamps{1.0, 2.0, 3.0}));
}

/// The image with the stamp far ahead waits for its camera_info, which arrives after the next
/// image.
TEST_F(FrameQueueTest, AStampFarAheadDropsNoFrames) {
  make({});
  image(60.0);
  image(1.0);
  info(60.0);
  info(1.0);
  EXPECT_TRUE(pose());
  EXPECT_TRUE(pose());
  EXPECT_EQ(taken(), (Stamps{1.0, 60.0}));
}

TEST_F(FrameQueueTest, TheOldestFramesAreDroppedWhenFull) {
  make({3, 1 << 20, 0.1});
  for (int i = 1; i <= 5; ++i) posed(i);
  EXPECT_EQ(dropped(drop::kQueueFull), 2u);
  EXPECT_EQ(taken(), (Stamps{3.0, 4.0, 5.0}));
}

/// The limit includes pixels, distortion coefficients and names, even those of incomplete frames.
TEST_F(FrameQueueTest, AllWaitingDataCountsTowardsTheLimit) {
  make({100, 4000, 0.1});
  const auto large = makeCameraInfo(1.0);
  large->D.assign(64, 0.1);
  large->header.frame_id.assign(200, 'x');
  queue_->add(0, {nullptr, large});
  EXPECT_GE(queue_->bytes(), 64 * sizeof(double) + 200);
  for (int i = 2; i < 100; ++i) {
    const auto next = makeCameraInfo(i);
    next->D.assign(64, 0.1);
    queue_->add(0, {nullptr, next});
    EXPECT_LE(queue_->bytes(), 4000u);
  }
  for (int i = 100; i < 500; ++i) {
    image(i);
    EXPECT_LE(queue_->bytes(), 4000u);
  }
  EXPECT_GT(dropped(drop::kQueueFull) + dropped(drop::kNoCameraInfo), 200u);
}

TEST_F(FrameQueueTest, CamerasAreMergedByStamp) {
  make({}, 2);
  posed(1.0, 1);
  EXPECT_TRUE(taken().empty()) << "the frame should wait for the other camera";
  posed(0.9, 0);
  EXPECT_EQ(taken(), (Stamps{0.9}));
  posed(1.0, 0);
  EXPECT_EQ(taken(), (Stamps{1.0, 1.0}));
  posed(2.0, 0);
  clock_.advance(0.11);
  EXPECT_EQ(taken(), (Stamps{2.0})) << "the frame should be taken after merge_wait_s";
  posed(1.5, 1);
  EXPECT_EQ(dropped(drop::kOutOfOrder, 1), 1u);
}

/// The first colour frame is taken even if it is older than the last depth frame.
TEST_F(FrameQueueTest, DepthWaitsOnceColourHasArrived) {
  make({});
  posed(1.0);
  EXPECT_EQ(taken(), (Stamps{1.0}));
  posed(0.5, colour_);
  EXPECT_EQ(taken(), (Stamps{0.5}));
  posed(2.0);
  EXPECT_TRUE(taken().empty());
  posed(2.0, colour_);
  EXPECT_EQ(taken(), (Stamps{2.0, 2.0}));
}

/// Two cameras send frames with equal stamps, but only half of the frames are taken.
TEST_F(FrameQueueTest, NoCameraStarves) {
  make({5, 1 << 20, 0.1}, 2);
  for (int i = 1; i <= 400; ++i) {
    posed(i, 0);
    posed(i, 1);
    if (const auto frame = queue_->take()) frame->accounting->fused(frame->stamp);
  }
  EXPECT_GT(accounting_[0].counts().fused, 100u);
  EXPECT_GT(accounting_[1].counts().fused, 100u);
}

TEST_F(FrameQueueTest, ColourDoesNotStarveDepth) {
  make({5, 1 << 20, 0.1});
  for (int i = 1; i <= 400; ++i) {
    posed(i, colour_);
    posed(i);
    if (const auto frame = queue_->take()) frame->accounting->fused(frame->stamp);
  }
  EXPECT_GT(accounting_[0].counts().fused, 100u);
}

/// One in every three frames is a colour image, and only a third of the frames are taken.
TEST_F(FrameQueueTest, InfrequentColourAndDepthBothProgress) {
  make({5, 1 << 20, 0.1});
  for (int i = 1; i <= 400; ++i) {
    posed(i, colour_);
    posed(i + 0.1);
    posed(i + 0.6);
    if (const auto frame = queue_->take()) frame->accounting->fused(frame->stamp);
  }
  EXPECT_GT(accounting_[0].counts().fused, 100u);
  EXPECT_GT(accounting_[1].counts().fused, 20u);
}

/// If all frames arrive in time, the order in which they are taken does not depend on how the
/// streams interleave.
TEST_F(FrameQueueTest, TheOrderDoesNotDependOnArrival) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    make({30, 1 << 20, 1.0}, 3);
    std::vector<int> next(3, 0);
    std::vector<const FrameAccounting*> order, expected;
    for (int i = 0; i < 30; ++i) expected.push_back(&accounting_[i % 3]);
    for (int pushes = 0; pushes < 30;) {
      const size_t stream = random() % 3;
      if (next[stream] == 10) continue;
      posed(1.0 + next[stream]++, stream);
      ++pushes;
      while (const auto frame = queue_->take()) order.push_back(frame->accounting);
    }
    ASSERT_EQ(order, expected) << "round " << round;
  }
}

/// If fusion is too slow, the queue is shortened so that the map keeps up with the camera.
TEST_F(FrameQueueTest, ALastingBacklogIsShortened) {
  make({30, 1 << 20, 0.1});
  for (int i = 0; i < 200; ++i) {
    posed(1.0 + 0.1 * i);
    if (i % 2 == 0) queue_->take();
    if (i == 57) {
      EXPECT_EQ(dropped(drop::kQueueFull), 0u);
    } else if (i > 120) {
      EXPECT_LE(queue_->bytes(), 4 * kImageBytes) << "3 frames may always wait";
    }
  }

  // Once the backlog is gone, a burst may fill the whole queue again.
  taken();
  const uint64_t dropped_before = dropped(drop::kQueueFull);
  EXPECT_GT(dropped_before, 0u);
  for (int i = 200; i < 230; ++i) posed(1.0 + 0.1 * i);
  EXPECT_EQ(queue_->bytes(), 30 * kImageBytes);
  EXPECT_EQ(dropped(drop::kQueueFull), dropped_before);
}

/// Number of images taken per image added. No images are taken while images `stall_begin` to
/// `stall_end` - 1 are added.
struct MapSpeed {
  double taken_per_image;
  size_t room;
  int stall_begin, stall_end;
};

class FrameQueueAtPace : public FrameQueueTest, public testing::WithParamInterface<MapSpeed> {};

TEST_P(FrameQueueAtPace, DropsNoFrames) {
  const MapSpeed& pace = GetParam();
  make({pace.room, 1 << 20, 0.1});
  double due = 0.0;
  for (int i = 0; i < 200; ++i) {
    posed(1.0 + 0.1 * i);
    if (i >= pace.stall_begin && i < pace.stall_end) continue;
    for (due += pace.taken_per_image; due >= 1.0; due -= 1.0) queue_->take();
  }
  EXPECT_EQ(dropped(drop::kQueueFull), 0u);
}

/// Fusion stalls, for example, while the map is being saved.
INSTANTIATE_TEST_SUITE_P(CatchingUpAfterAStall, FrameQueueAtPace,
                         testing::Values(MapSpeed{1.25, 30, 20, 35}, MapSpeed{1.5, 30, 20, 35},
                                         MapSpeed{2.0, 30, 20, 35}, MapSpeed{10.0, 30, 20, 35}));

/// A queue large enough for a whole recording drops no frame.
INSTANTIATE_TEST_SUITE_P(WithRoomForAll, FrameQueueAtPace,
                         testing::Values(MapSpeed{0.25, 200, 0, 0}, MapSpeed{0.5, 200, 0, 0},
                                         MapSpeed{0.75, 200, 0, 0}, MapSpeed{0.9, 200, 0, 0}));

TEST_F(FrameQueueTest, StampsGoingBackDropLaterFrames) {
  make({});
  posed(10.0);
  image(11.0);
  image(1.0);
  queue_->restart(0, ros::Time(1.0));
  EXPECT_EQ(dropped(drop::kTimeJump), 2u);
  info(1.0);
  EXPECT_TRUE(pose());
  EXPECT_EQ(taken(), (Stamps{1.0}));
}

TEST_F(FrameQueueTest, ImagesBeforeTheFirstCameraInfoWaitForIt) {
  make({});
  for (const double stamp_s : {1.0, 2.0, 3.0}) image(stamp_s);
  EXPECT_GT(queue_->bytes(), 2 * kImageBytes);
  EXPECT_EQ(queue_->waitingFor(0), "there is none");
  queue_->restart(0, ros::Time(2.0));
  EXPECT_EQ(dropped(drop::kTimeJump), 1u);
  queue_->addToWaiting(0, makeCameraInfo(5.0));
  EXPECT_TRUE(pose() && pose());
  EXPECT_EQ(taken(), (Stamps{1.0, 2.0}));
  image(4.0);
  queue_->refuseAll(Rejection{drop::kPaused, ""});
  EXPECT_EQ(dropped(drop::kPaused), 1u);
  queue_->addToWaiting(0, makeCameraInfo(5.0));
  EXPECT_FALSE(pose());
}

TEST_F(FrameQueueTest, NothingIsTakenWhilePausedOrEnding) {
  make({});
  posed(1.0);
  image(2.0);
  queue_->refuseAll(Rejection{drop::kPaused, ""});
  image(3.0);
  EXPECT_EQ(dropped(drop::kPaused), 3u);
  EXPECT_TRUE(queue_->isPaused());
  queue_->refuseAll(std::nullopt);
  posed(4.0);
  queue_->refuseAll(Rejection{drop::kEnding, ""});
  queue_->refuseAll(std::nullopt);
  image(5.0);
  EXPECT_EQ(dropped(drop::kEnding), 2u) << "resuming should have no effect after the end";
  EXPECT_TRUE(taken().empty());
  EXPECT_EQ(queue_->bytes(), 0u);
}

/// Every image must be either taken or dropped with a reason.
TEST_F(FrameQueueTest, EveryImageIsAccountedFor) {
  std::mt19937 random(7);
  make({7, 700, 0.1}, 2);
  for (int i = 0; i < 5000; ++i) {
    const double stamp_s = 1.0 + 0.01 * static_cast<double>(i / 3) + 0.01 * (random() % 20);
    const size_t stream = random() % 3;
    switch (random() % 5) {
      case 0: image(stamp_s, stream); break;
      case 1: info(stamp_s, stream); break;
      case 2: pose(stream); break;
      case 3: clock_.advance(0.02); break;
      case 4:
        if (const auto frame = queue_->take()) frame->accounting->fused(frame->stamp);
        break;
    }
    EXPECT_LE(queue_->bytes(), 700u);
  }
  queue_->refuseAll(Rejection{drop::kEnding, ""});
  for (size_t stream = 0; stream < 3; ++stream) EXPECT_EQ(accounting_[stream].counts().waiting, 0u);
}

TEST(WaitingTime, FollowsSimulatedTimeHoweverOftenItIsAsked) {
  ros::Time::init();
  ros::Time now(100.0);
  ros::Time::setNow(now);
  const SteadyTime begin = waitingTime(), wall_begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 200; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (i % 10 == 9) ros::Time::setNow(now += ros::Duration(0.01));
    waitingTime();
  }
  const double waited_s = toSeconds(waitingTime() - begin);
  EXPECT_GE(waited_s, 0.199);
  EXPECT_LT(waited_s, 0.75 * toSeconds(std::chrono::steady_clock::now() - wall_begin));
  ros::Time::init();  // back to wall time
}

}  // namespace
}  // namespace dtsdf
