#include "ros/input/transforms.h"

#include <gtest/gtest.h>

#include <limits>

#include "ros/input/pose_source.h"
#include "ros/support/fake_clock.h"
#include "ros/support/transforms.h"

namespace dtsdf {
namespace {

/// Ten o'clock of a day in November 2026.
constexpr double kToday_s = 1.795e9;

class TransformBufferTest : public testing::Test {
 protected:
  bool put(double stamp_s, double x = 0.0, const std::string& child = "camera") {
    const Eigen::Isometry3d T(Eigen::Translation3d(x, 0.0, 0.0));
    return transforms_.setTransform(makeTransform("map", child, T, ros::Time(stamp_s)), "/slam",
                                    is_static_);
  }

  bool isKnown(double stamp_s) {
    return poses_.lookUp("camera", ros::Time(stamp_s)).kind == PoseAnswer::Kind::kKnown;
  }

  void pass(double seconds) {
    clock_.advance(seconds);
    if (!now_.isZero()) now_ += ros::Duration(seconds);
  }

  FakeClock clock_;
  ros::Time now_{kToday_s};
  bool is_static_ = false;
  TransformBuffer transforms_{{5.0, 30.0}, clock_.reader(), [this] { return now_; }};
  PoseSource poses_{transforms_, "map"};
};

TEST_F(TransformBufferTest, AnotherParentIsKnownWhateverCameLast) {
  EXPECT_EQ(transforms_.otherParentOf("camera", "map"), "");
  put(now_.toSec());
  EXPECT_EQ(transforms_.otherParentOf("camera", "map"), "");
  EXPECT_EQ(transforms_.otherParentOf("camera", "odom"), "map");
  putTransform(transforms_, now_.toSec(), 0.0, "camera", "camera_link");
  EXPECT_EQ(transforms_.otherParentOf("camera", "map"), "camera_link");
  put(now_.toSec() + 0.1);
  EXPECT_EQ(transforms_.otherParentOf("camera", "map"), "camera_link");
}

TEST_F(TransformBufferTest, OneAheadOfTimeChangesNothing) {
  for (const double ahead_s : {5.1, 60.0, 3.2e9 - kToday_s}) {
    EXPECT_TRUE(put(now_.toSec() - 0.1));
    EXPECT_FALSE(put(now_.toSec() + ahead_s, 100.0));
    EXPECT_TRUE(put(now_.toSec(), 1.0));
    const PoseAnswer answer = poses_.lookUp("camera", now_ - ros::Duration(0.05));
    ASSERT_EQ(answer.kind, PoseAnswer::Kind::kKnown) << answer.text;
    EXPECT_NEAR(answer.T_W_C.translation().x(), 0.5, 1e-6);
    pass(1.0);
  }
  const TransformReport report = transforms_.report();
  EXPECT_EQ(report.refused, 3u);
  ASSERT_EQ(report.refused_by.size(), 1u);
  EXPECT_EQ(report.refused_by.begin()->first, "frame 'camera' of /slam: ahead of time");
  EXPECT_NE(report.last_refusal.find("input/tf_max_ahead_s"), std::string::npos);
}

TEST_F(TransformBufferTest, TheEndOfTimeIsRefusedWhateverIsKnownOfThePresent) {
  now_ = ros::Time();  // simulated time that has not begun
  for (uint32_t back = 0; back < 31; ++back) {
    EXPECT_FALSE(put(std::numeric_limits<uint32_t>::max() - static_cast<double>(back)));
  }
  EXPECT_EQ(transforms_.report().refused, 31u);
  EXPECT_TRUE(put(1.0));
  EXPECT_TRUE(isKnown(1.0));
}

TEST_F(TransformBufferTest, PosesMayBeToldInAdvance) {
  EXPECT_TRUE(put(now_.toSec() + 1.0)) << "as localisation does that is slower than the camera";
  EXPECT_TRUE(put(now_.toSec() + 4.9));
}

TEST_F(TransformBufferTest, AMachineWhoseClockIsAheadMapsAsItsImagesDo) {
  EXPECT_FALSE(put(now_.toSec() + 3600.0)) << "no image has said so yet";
  transforms_.imageCame(now_ + ros::Duration(3600.0));
  EXPECT_TRUE(put(now_.toSec() + 3600.1));
  EXPECT_FALSE(put(now_.toSec() + 3606.0));
  pass(10.0);  // without an image
  EXPECT_TRUE(put(now_.toSec() + 3600.0)) << "the images' time goes on";
}

TEST_F(TransformBufferTest, OneImageAheadOfTimeChangesNothing) {
  transforms_.imageCame(now_);
  const ros::Time tomorrow = now_ + ros::Duration(86400.0);
  for (int i = 0; i < 5; ++i) transforms_.imageCame(tomorrow);  // as long as it waits
  EXPECT_FALSE(put(tomorrow.toSec()));
  EXPECT_TRUE(put(now_.toSec()));
  EXPECT_TRUE(isKnown(now_.toSec()));
  transforms_.imageCame(tomorrow + ros::Duration(0.1));  // it was no mistake
  EXPECT_TRUE(put(tomorrow.toSec() + 0.1));
}

TEST_F(TransformBufferTest, ARecordingOfAnotherYearHasItsOwnPresent) {
  EXPECT_TRUE(put(1.3e9));
  EXPECT_TRUE(isKnown(1.3e9));
  EXPECT_FALSE(put(1.3e9 + 60.0)) << "though it is long ago by the clock";
  EXPECT_TRUE(put(1.3e9 + 0.1));
  EXPECT_TRUE(isKnown(1.3e9 + 0.1));
}

TEST_F(TransformBufferTest, ImagesThatAreLateDoNotHoldUpTheClock) {
  transforms_.imageCame(now_ - ros::Duration(10.0));
  EXPECT_TRUE(put(now_.toSec()));
}

TEST_F(TransformBufferTest, WithoutAnyPresentTheFrameRecovers) {
  now_ = ros::Time();
  EXPECT_TRUE(put(100.0));
  EXPECT_TRUE(put(100000.0)) << "nothing tells that it is ahead";
  int refused = 0;
  for (double stamp_s = 100.1; !isKnown(stamp_s - 0.1) && refused < 100; stamp_s += 0.1) {
    put(stamp_s);
    ++refused;
  }
  EXPECT_LE(refused, 20) << "what stays behind for long shows that the newest was wrong";
}

TEST_F(TransformBufferTest, OneThatIsTooOldForgetsNothing) {
  EXPECT_TRUE(put(kToday_s));
  for (int i = 1; i < 50; ++i) {
    put(kToday_s - 1000.0);
    put(kToday_s + 0.01 * i);
  }
  EXPECT_TRUE(isKnown(kToday_s));
}

TEST_F(TransformBufferTest, WhatIsNoTransformIsRefused) {
  const auto good = makeTransform("map", "camera", Eigen::Isometry3d::Identity(), now_);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto bad = good;
  bad.transform.translation.y = nan;
  EXPECT_FALSE(transforms_.setTransform(bad, "/slam"));
  bad = good;
  bad.transform.rotation.w = 0.5;
  EXPECT_FALSE(transforms_.setTransform(bad, "/slam"));
  bad = good;
  bad.child_frame_id = "/map";
  EXPECT_FALSE(transforms_.setTransform(bad, "/slam"));
  bad = good;
  bad.header.frame_id = "";
  EXPECT_FALSE(transforms_.setTransform(bad, "/slam", true));
  EXPECT_EQ(transforms_.report().refused, 4u);
  EXPECT_TRUE(transforms_.setTransform(good, "/slam"));
}

TEST_F(TransformBufferTest, StaticTransformsHaveNoTime) {
  is_static_ = true;
  EXPECT_TRUE(put(4294967290.0, 3.0));
  EXPECT_TRUE(isKnown(17.0));
  EXPECT_FALSE(transforms_.report().age_s);
}

TEST_F(TransformBufferTest, MadeUpNamesDoNotFillTheReport) {
  for (int i = 0; i < 1000; ++i) put(4.2e9, 0.0, "frame\x1b[31m" + std::to_string(i));
  const TransformReport report = transforms_.report();
  EXPECT_EQ(report.refused, 1000u);
  EXPECT_EQ(report.refused_by.size(), 20u);
  EXPECT_EQ(report.refused_by.begin()->first.find('\x1b'), std::string::npos);
}

class ManyFramesTest : public testing::Test {
 protected:
  bool put(const std::string& child, const std::string& parent, bool is_static = false) {
    return transforms_.setTransform(
        makeTransform(parent, child, Eigen::Isometry3d::Identity(), ros::Time(kToday_s)), "/swarm",
        is_static);
  }

  void putCrowd() {
    for (int i = 0; i < 5000; ++i) put("robot" + std::to_string(i), "map");
  }

  size_t framesKept() const {
    std::vector<std::string> names;
    transforms_.core()._getFrameStrings(names);
    return names.size();
  }

  bool isKnown() {
    return poses_.find("camera", ros::Time(kToday_s)).kind == PoseAnswer::Kind::kKnown;
  }

  FakeClock clock_;
  TransformBuffer transforms_{
      {5.0, 30.0, 100}, clock_.reader(), [] { return ros::Time(kToday_s); }};
  PoseSource poses_{transforms_, "map"};
};

TEST_F(ManyFramesTest, AreBoundedAndReported) {
  putCrowd();
  EXPECT_LE(framesKept(), 101u);  // tf2 has one of no name
  const TransformReport report = transforms_.report();
  EXPECT_EQ(report.refused, 0u);
  EXPECT_EQ(report.not_kept, 5000u - 99u);
  ASSERT_EQ(report.refused_by.size(), 1u);
  EXPECT_EQ(report.refused_by.begin()->first, "/swarm: more than 100 frames");
}

TEST_F(ManyFramesTest, TheChainOfACameraIsKeptAllTheSame) {
  putCrowd();
  EXPECT_FALSE(put("camera", "camera_link")) << "nobody has asked for it yet";
  EXPECT_FALSE(isKnown());
  EXPECT_FALSE(put("camera_link", "base"));
  EXPECT_TRUE(put("camera", "camera_link"));
  EXPECT_TRUE(put("camera_link", "base"));
  EXPECT_TRUE(put("base", "map"));
  EXPECT_TRUE(isKnown());
  EXPECT_FALSE(put("other", "base"));
}

TEST_F(ManyFramesTest, StaticLinksOfACameraAreAskedForAgain) {
  putCrowd();
  EXPECT_FALSE(put("camera", "base", true));
  EXPECT_FALSE(put("base", "map", true));
  EXPECT_FALSE(transforms_.takeStaticsWanted()) << "nobody needs one";
  EXPECT_FALSE(isKnown());
  EXPECT_TRUE(transforms_.takeStaticsWanted());
  EXPECT_FALSE(transforms_.takeStaticsWanted()) << "once";
  EXPECT_FALSE(put("base", "map", true));  // in any order
  EXPECT_TRUE(put("camera", "base", true));
  EXPECT_TRUE(transforms_.takeStaticsWanted()) << "for the next link";
  EXPECT_TRUE(put("base", "map", true));
  EXPECT_TRUE(isKnown());
}

TEST_F(ManyFramesTest, MadeUpParentsOfACameraAreBoundedToo) {
  EXPECT_FALSE(isKnown());
  for (int i = 0; i < 5000; ++i) put("camera", "parent" + std::to_string(i));
  EXPECT_LE(framesKept(), 201u);
}

TEST_F(ManyFramesTest, NamesAreNoLongerThanNames) {
  EXPECT_FALSE(put(std::string(201, 'x'), "map"));
  EXPECT_FALSE(put("camera", std::string(1 << 20, 'x')));
  EXPECT_TRUE(put(std::string(200, 'x'), "map"));
  EXPECT_EQ(transforms_.report().refused, 2u);
}

TEST_F(TransformBufferTest, TellsHowLongTheLastIsAgo) {
  EXPECT_FALSE(transforms_.report().age_s);
  put(now_.toSec());
  pass(3.0);
  put(now_.toSec() + 100.0);
  EXPECT_NEAR(transforms_.report().age_s.value(), 3.0, 1e-6);
}

}  // namespace
}  // namespace dtsdf
