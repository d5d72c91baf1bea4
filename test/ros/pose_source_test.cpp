#include "ros/input/pose_source.h"

#include <gtest/gtest.h>

#include <chrono>

#include "ros/support/transforms.h"

namespace dtsdf {
namespace {

using Kind = PoseAnswer::Kind;

class PoseSourceTest : public testing::Test {
 protected:
  bool says(const PoseAnswer& answer, const std::string& text) const {
    return answer.text.find(text) != std::string::npos;
  }

  /// As long as ROS's clock is not known, whatever other tests have made of it.
  TransformBuffer transforms_{TransformBuffer::Options(), std::chrono::steady_clock::now,
                              [] { return ros::Time(); }};
  PoseSource poses_{transforms_, "/map"};
};

TEST_F(PoseSourceTest, MapFrameLosesItsSlash) { EXPECT_EQ(poses_.mapFrame(), "map"); }

TEST_F(PoseSourceTest, WithoutAFrameImagesHaveNoPoseAndDoNotWait) {
  const PoseSource none(transforms_, "");
  const PoseAnswer answer = none.lookUp("camera", ros::Time(10.0));
  EXPECT_EQ(answer.kind, Kind::kKnown);
  EXPECT_TRUE(answer.T_W_C.matrix().isIdentity());
}

TEST_F(PoseSourceTest, FindsACameraOnItsBase) {
  putTransform(transforms_, 10.0, 0.3, "camera", "base");
  EXPECT_NEAR(poses_.findIn("base", "camera").T_W_C.translation().x(), 0.3, 1e-9);
  EXPECT_EQ(poses_.findIn("base", "other").kind, Kind::kNotYet);
  EXPECT_TRUE(says(poses_.findIn("base", "other"), "from 'other' to 'base'"));
}

TEST_F(PoseSourceTest, InterpolatesBetweenTransforms) {
  putTransform(transforms_, 10.0, 1.0);
  putTransform(transforms_, 11.0, 2.0);
  const PoseAnswer answer = poses_.lookUp("camera", ros::Time(10.25));
  ASSERT_EQ(answer.kind, Kind::kKnown);
  EXPECT_NEAR(answer.T_W_C.translation().x(), 1.25, 1e-9);
}

TEST_F(PoseSourceTest, NeverTakesTheNewestForTheTrueOne) {
  putTransform(transforms_, 10.0, 1.0);
  const PoseAnswer answer = poses_.lookUp("camera", ros::Time(10.1));
  EXPECT_EQ(answer.kind, Kind::kNotYet);
  EXPECT_TRUE(says(answer, "0.1 s before the image")) << answer.text;
}

TEST_F(PoseSourceTest, KnowsWhenATransformCannotComeAnyMore) {
  putTransform(transforms_, 10.0, 1.0);
  const PoseAnswer answer = poses_.lookUp("camera", ros::Time(9.5));
  EXPECT_EQ(answer.kind, Kind::kNever);
  EXPECT_TRUE(says(answer,
                   "the image is 0.5 s older than the oldest transform that is kept; normal "
                   "for the first images only"))
      << answer.text;
  putTransform(transforms_, 12.0, 1.0);
  EXPECT_TRUE(says(poses_.lookUp("camera", ros::Time(9.75)), "the image is 0.25 s older"));
}

TEST_F(PoseSourceTest, AChainIsAsNewAsItsOldestLink) {
  putTransform(transforms_, 10.0, 1.0, "camera", "base");
  putTransform(transforms_, 9.0, 1.0, "base", "map");
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(9.5)).kind, Kind::kNotYet);
  putTransform(transforms_, 10.0, 2.0, "base", "map");
  putTransform(transforms_, 9.0, 1.0, "camera", "base");
  const PoseAnswer answer = poses_.lookUp("camera", ros::Time(9.5));
  ASSERT_EQ(answer.kind, Kind::kKnown);
  EXPECT_NEAR(answer.T_W_C.translation().x(), 2.5, 1e-9);
}

TEST_F(PoseSourceTest, SaysWhichFrameIsUnknown) {
  const PoseAnswer answer = poses_.lookUp("nowhere", ros::Time(1.0));
  EXPECT_EQ(answer.kind, Kind::kNotYet);
  EXPECT_TRUE(says(answer, "'nowhere' to 'map'")) << answer.text;
  EXPECT_TRUE(says(answer, "nothing has been received on /tf or /tf_static")) << answer.text;
  putTransform(transforms_, 1.0, 1.0, "camera", "odom");
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(1.0)).text,
            "no transform from 'camera' to 'map': TF has no frame 'map'; it has 'camera', 'odom'; "
            "set map_frame to one of these, or start what publishes 'map'");
  EXPECT_EQ(poses_.findIn("odom", "nowhere").text,
            "no transform from 'nowhere' to 'odom': TF has no frame 'nowhere'; it has 'camera', "
            "'odom'; start what publishes 'nowhere'");
  putTransform(transforms_, 1.0, 1.0, "base", "map");
  EXPECT_TRUE(says(poses_.lookUp("camera", ros::Time(1.0)), "no chain of transforms between"));
  for (int i = 0; i < 20; ++i) putTransform(transforms_, 1.0, 1.0, "f" + std::to_string(i), "odom");
  EXPECT_TRUE(says(poses_.lookUp("camera", ros::Time(1.0)), "' and more"));
}

TEST_F(PoseSourceTest, ForgetsOnDemand) {
  putTransform(transforms_, 10.0, 1.0);
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(10.0)).kind, Kind::kKnown);
  poses_.clear();
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(10.0)).kind, Kind::kNotYet);
}

TEST_F(PoseSourceTest, StampsFarApartAreNoError) {
  putTransform(transforms_, 1.0, 1.0);
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(4.0e9)).kind, Kind::kNotYet);
  poses_.clear();
  putTransform(transforms_, 4.0e9, 1.0);
  EXPECT_EQ(poses_.lookUp("camera", ros::Time(1.0)).kind, Kind::kNever);
}

}  // namespace
}  // namespace dtsdf
