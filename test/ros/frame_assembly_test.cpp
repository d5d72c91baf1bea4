#include "ros/input/frame_assembly.h"

#include <gtest/gtest.h>

#include "ros/support/transforms.h"

namespace dtsdf {
namespace {

/// What came of the messages: stamps of whole frames, and reasons with the stamps of the others.
class FrameAssemblyTest : public testing::Test {
 protected:
  void want(CameraInfoChoice info, bool mask, FrameAssembly::Room room = {}) {
    assembly_ = std::make_unique<FrameAssembly>(
        FrameAssembly::Wanted{info, mask}, room,
        [this](const FrameMessages& frame) {
          EXPECT_TRUE(frame.image && frame.info);
          complete_.push_back(frame.image->header.stamp.toSec());
          info_stamps_.push_back(frame.info->header.stamp.toSec());
          last_ = frame;
        },
        [this](const sensor_msgs::Image& depth, DropReason reason) {
          incomplete_.emplace_back(depth.header.stamp.toSec(), reason);
        });
  }

  void addImage(double stamp_s) { assembly_->addImage(makeDepthImage(stamp_s)); }
  void addInfo(double stamp_s) { assembly_->addInfo(makeCameraInfo(stamp_s)); }
  void addMask(double stamp_s) {
    assembly_->addMask(makeMask(stamp_s, std::vector<uint8_t>(8, 0)));
  }

  std::unique_ptr<FrameAssembly> assembly_;
  std::vector<double> complete_, info_stamps_;
  std::vector<std::pair<double, DropReason>> incomplete_;
  FrameMessages last_;
};

using Stamps = std::vector<double>;

TEST_F(FrameAssemblyTest, PairsByStampInAnyOrder) {
  want(CameraInfoChoice::kExact, false);
  addImage(1.0);
  addInfo(1.0);
  addInfo(2.0);
  addImage(3.0);
  addImage(2.0);
  EXPECT_EQ(complete_, (Stamps{1.0, 2.0}));
  addInfo(3.0);
  EXPECT_EQ(complete_, (Stamps{1.0, 2.0, 3.0}));
  EXPECT_EQ(info_stamps_, complete_);
  EXPECT_TRUE(incomplete_.empty());
  EXPECT_FALSE(last_.mask);
}

TEST_F(FrameAssemblyTest, WholeFramesGiveUpThoseBefore) {
  want(CameraInfoChoice::kExact, true);
  addImage(1.0);
  addMask(1.0);
  addImage(2.0);
  addInfo(2.0);
  addInfo(2.5);  // no frame: nothing to tell
  addImage(3.0);
  addInfo(3.0);
  addMask(3.0);
  EXPECT_EQ(complete_, Stamps{3.0});
  EXPECT_TRUE(last_.mask);
  ASSERT_EQ(incomplete_.size(), 2u);
  EXPECT_EQ(incomplete_[0], std::make_pair(1.0, DropReason::kNoCameraInfo));
  EXPECT_EQ(incomplete_[1], std::make_pair(2.0, DropReason::kNoMask));
}

TEST_F(FrameAssemblyTest, StampsThatGoBackAreFramesToo) {
  want(CameraInfoChoice::kExact, false);
  for (const double stamp_s : {100.0, 50.0, 51.0}) {
    addImage(stamp_s);
    addInfo(stamp_s);
  }
  EXPECT_EQ(complete_, (Stamps{100.0, 50.0, 51.0}));
}

TEST_F(FrameAssemblyTest, NoMoreThanSomeWait) {
  want(CameraInfoChoice::kExact, false);
  for (int i = 0; i < 1000; ++i) addInfo(i);
  for (int i = 0; i < 60; ++i) addImage(2000.0 + i);
  EXPECT_EQ(incomplete_.size(), 10u);
  EXPECT_EQ(incomplete_[0], std::make_pair(2000.0, DropReason::kNoCameraInfo));
}

TEST_F(FrameAssemblyTest, ImagesThatWaitAreBoundedByNumber) {
  want(CameraInfoChoice::kExact, false, {5, 1 << 20});
  for (int i = 0; i < 120; ++i) addImage(1.0 + i);
  EXPECT_EQ(incomplete_.size(), 115u);
  EXPECT_EQ(assembly_->waitingImages(), 5u);
  EXPECT_EQ(incomplete_.back(), std::make_pair(115.0, DropReason::kNoCameraInfo));
}

TEST_F(FrameAssemblyTest, ImagesThatWaitAreBoundedInBytes) {
  const size_t bytes = makeDepthImage(1.0)->data.size();
  want(CameraInfoChoice::kExact, true, {50, 10 * bytes});
  for (int i = 0; i < 40; ++i) {
    addImage(1.0 + i);
    addMask(1.0 + i);
    ASSERT_LE(assembly_->waitingBytes(), 10 * bytes);
  }
  EXPECT_GE(assembly_->waitingImages(), 3u);
  EXPECT_EQ(incomplete_.size() + assembly_->waitingImages(), 40u) << "each has its fate";
  EXPECT_EQ(incomplete_.back().second, DropReason::kQueueFull);
  addInfo(40.0);
  EXPECT_EQ(complete_, Stamps{40.0});
  EXPECT_EQ(assembly_->waitingImages(), 0u);
  EXPECT_EQ(assembly_->waitingBytes(), 0u);
}

/// A camera_info is small, but for who wants to fill memory.
TEST_F(FrameAssemblyTest, LargeCameraInfosCountToo) {
  want(CameraInfoChoice::kExact, false, {50, 10000});
  for (int i = 0; i < 40; ++i) {
    const auto info = makeCameraInfo(1.0 + i);
    info->D.assign(500, 0.0);
    assembly_->addInfo(info);
    ASSERT_LE(assembly_->waitingBytes(), 10000u);
  }
  EXPECT_TRUE(incomplete_.empty()) << "no image, no frame";
}

TEST_F(FrameAssemblyTest, TwoImagesOfOneStampBothHaveAFate) {
  want(CameraInfoChoice::kExact, false);
  addImage(1.0);
  addImage(1.0);
  ASSERT_EQ(incomplete_.size(), 1u);
  EXPECT_EQ(assembly_->waitingImages(), 1u);
  addInfo(1.0);
  EXPECT_EQ(complete_, Stamps{1.0});
}

TEST_F(FrameAssemblyTest, TheLongestWaitingImageIsGivenUpOnRequest) {
  want(CameraInfoChoice::kExact, false);
  addInfo(1.0);
  addImage(3.0);
  addImage(2.0);
  EXPECT_TRUE(assembly_->giveUpImage(DropReason::kQueueFull));
  EXPECT_TRUE(assembly_->giveUpImage(std::nullopt));
  EXPECT_FALSE(assembly_->giveUpImage(std::nullopt));
  ASSERT_EQ(incomplete_.size(), 2u);
  EXPECT_EQ(incomplete_[0], std::make_pair(3.0, DropReason::kQueueFull));
  EXPECT_EQ(incomplete_[1], std::make_pair(2.0, DropReason::kNoCameraInfo));
}

TEST_F(FrameAssemblyTest, WhatWaitsInTheFutureIsInNobodysWay) {
  want(CameraInfoChoice::kExact, false);
  for (int i = 0; i < 100; ++i) addInfo(1000.0 + i);  // then the recording begins anew
  for (const double stamp_s : {1.0, 2.0, 3.0}) {
    addImage(stamp_s);
    addInfo(stamp_s);
  }
  EXPECT_EQ(complete_, (Stamps{1.0, 2.0, 3.0}));
}

TEST_F(FrameAssemblyTest, LatestCameraInfoIsForAllImages) {
  want(CameraInfoChoice::kLatest, false);
  addImage(1.0);
  addImage(2.0);
  EXPECT_TRUE(complete_.empty());
  addInfo(0.5);
  EXPECT_EQ(complete_, (Stamps{1.0, 2.0})) << "they have waited for the first one";
  addImage(3.0);
  addInfo(3.5);
  addImage(3.2);
  EXPECT_EQ(info_stamps_, (Stamps{0.5, 0.5, 0.5, 3.5}));
  EXPECT_TRUE(incomplete_.empty());
}

TEST_F(FrameAssemblyTest, LatestCameraInfoDoesNotStandForTheMask) {
  want(CameraInfoChoice::kLatest, true);
  addImage(1.0);
  addImage(2.0);
  addMask(2.0);
  EXPECT_TRUE(complete_.empty());
  addInfo(9.0);
  EXPECT_EQ(complete_, Stamps{2.0});
  ASSERT_EQ(incomplete_.size(), 1u);
  EXPECT_EQ(incomplete_[0], std::make_pair(1.0, DropReason::kNoMask));
}

}  // namespace
}  // namespace dtsdf
