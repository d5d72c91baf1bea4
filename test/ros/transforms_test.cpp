#include "ros/input/transforms.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <utility>

#include "ros/support/fake_clock.h"
#include "ros/support/transforms.h"

namespace dtsdf {
namespace {

class TransformsTest : public testing::Test {
 protected:
  TransformsTest() { ros::Time::init(); }  // needed to throttle warnings

  bool says(const PoseAnswer& answer, const std::string& text) const {
    return answer.text.find(text) != std::string::npos;
  }

  PoseAnswer lookUp(const std::string& frame, const ros::Time& stamp) const {
    return transforms_.find("map", frame, stamp);
  }
  PoseAnswer findIn(const std::string& parent, const std::string& frame) const {
    return transforms_.find(parent, frame, ros::Time(0));
  }

  /// Adds ten transforms per second and looks up a pose at each stamp. Returns the number of poses
  /// found.
  int map(double from_s, double duration_s) {
    int found = 0;
    for (double stamp_s = from_s; stamp_s < from_s + duration_s - 0.05; stamp_s += 0.1) {
      clock_.advance(0.1);
      putTransform(transforms_, stamp_s, 1.0);
      const bool is_found = lookUp("camera", ros::Time(stamp_s)).T_W_C.has_value();
      transforms_.recordLookUp(is_found);
      found += is_found ? 1 : 0;
    }
    return found;
  }

  FakeClock clock_;
  dtsdf_mapping::MapStatus status() const {
    dtsdf_mapping::MapStatus status;
    transforms_.fill(status);
    return status;
  }

  Transforms transforms_{clock_.reader()};
};

TEST_F(TransformsTest, FindsACameraInItsBaseFrame) {
  putTransform(transforms_, 10.0, 0.3, "camera", "base");
  EXPECT_NEAR(findIn("base", "camera").T_W_C->translation().x(), 0.3, 1e-9);
}

TEST_F(TransformsTest, InterpolatesBetweenTransforms) {
  putTransform(transforms_, 10.0, 1.0);
  putTransform(transforms_, 11.0, 2.0);
  const PoseAnswer answer = lookUp("camera", ros::Time(10.25));
  ASSERT_TRUE(answer.T_W_C);
  EXPECT_NEAR(answer.T_W_C->translation().x(), 1.25, 1e-9);
}

TEST_F(TransformsTest, DoesNotExtrapolate) {
  putTransform(transforms_, 10.0, 1.0);
  const PoseAnswer answer = lookUp("camera", ros::Time(10.1));
  EXPECT_TRUE(answer.may_come);
  EXPECT_TRUE(says(answer, "extrapolation")) << answer.text;
}

TEST_F(TransformsTest, StampsBeforeTheFirstTransformFail) {
  putTransform(transforms_, 10.0, 1.0);
  const PoseAnswer answer = lookUp("camera", ros::Time(9.5));
  EXPECT_FALSE(answer.T_W_C || answer.may_come);
  EXPECT_TRUE(says(answer, "extrapolation")) << answer.text;
}

TEST_F(TransformsTest, AChainIsAsNewAsItsOldestLink) {
  putTransform(transforms_, 10.0, 1.0, "camera", "base");
  putTransform(transforms_, 9.0, 1.0, "base", "map");
  EXPECT_TRUE(lookUp("camera", ros::Time(9.5)).may_come);
  putTransform(transforms_, 10.0, 2.0, "base", "map");
  putTransform(transforms_, 9.0, 1.0, "camera", "base");
  const PoseAnswer answer = lookUp("camera", ros::Time(9.5));
  ASSERT_TRUE(answer.T_W_C);
  EXPECT_NEAR(answer.T_W_C->translation().x(), 2.5, 1e-9);
}

TEST_F(TransformsTest, ErrorsNameTheUnknownFrame) {
  const PoseAnswer answer = lookUp("nowhere", ros::Time(1.0));
  EXPECT_TRUE(answer.may_come);
  EXPECT_TRUE(says(answer, "'nowhere' to 'map'")) << answer.text;
  EXPECT_TRUE(says(answer, "nothing has been received on /tf or /tf_static")) << answer.text;
  geometry_msgs::TransformStamped broken;
  broken.header.frame_id = "map";
  broken.child_frame_id = "camera";
  broken.transform.rotation.w = std::nan("");
  transforms_.take(broken, "", false);
  EXPECT_TRUE(says(lookUp("camera", ros::Time(1.0)), "refused"));
  putTransform(transforms_, 1.0, 1.0, "camera", "odom");
  EXPECT_EQ(
      lookUp("camera", ros::Time(1.0)).text,
      "no transform from 'camera' to 'map': TF contains 'camera', 'odom'; start the publisher "
      "that connects the two, or set map_frame to one of these");
}

TEST_F(TransformsTest, ClearForgetsTransforms) {
  putTransform(transforms_, 10.0, 1.0);
  EXPECT_TRUE(lookUp("camera", ros::Time(10.0)).T_W_C);
  transforms_.clear();
  EXPECT_TRUE(lookUp("camera", ros::Time(10.0)).may_come);
}

TEST_F(TransformsTest, ToleratesStampsFarApart) {
  putTransform(transforms_, 1.0, 1.0);
  EXPECT_TRUE(lookUp("camera", ros::Time(4.0e9)).may_come);
  transforms_.clear();
  putTransform(transforms_, 4.0e9, 1.0);
  EXPECT_FALSE(lookUp("camera", ros::Time(1.0)).T_W_C || lookUp("camera", ros::Time(1.0)).may_come);
}

geometry_msgs::TransformStamped cameraAt(double stamp_s) {
  return makeTransform("map", "camera", Eigen::Isometry3d::Identity(), ros::Time(stamp_s));
}

/// After a static transform stamped an hour ahead, tf2 would reject all transforms of the same
/// frame on /tf.
TEST_F(TransformsTest, IgnoresStaticTransformsOfAMovingFrame) {
  EXPECT_EQ(map(100.0, 2.0), 20);
  transforms_.take(cameraAt(3700.0), "rogue", true);
  EXPECT_EQ(map(102.0, 3.0), 30);
  EXPECT_EQ(status().transform_restarts, 0u);
}

TEST_F(TransformsTest, IgnoresStaticTransformsThatCameBeforeAMovingFrame) {
  transforms_.take(makeTransform("camera", "lens", Eigen::Isometry3d::Identity(), ros::Time(1.0)),
                   "test", true);
  transforms_.take(cameraAt(3700.0), "rogue", true);
  putTransform(transforms_, 100.0, 1.0);
  putTransform(transforms_, 102.0, 3.0);
  const PoseAnswer between = lookUp("camera", ros::Time(101.0));
  ASSERT_TRUE(between.T_W_C);
  EXPECT_DOUBLE_EQ(between.T_W_C->translation().x(), 2.0);
  EXPECT_TRUE(lookUp("camera", ros::Time(103.0)).may_come);
  EXPECT_TRUE(findIn("camera", "lens").T_W_C) << "static transforms should be kept";
}

TEST_F(TransformsTest, RecoversFromATransformFarAhead) {
  transforms_.take(makeTransform("camera", "lens", Eigen::Isometry3d::Identity(), ros::Time(1.0)),
                   "test", true);
  EXPECT_EQ(map(100.0, 2.0), 20);
  for (const double stamp_s : {3700.0, 4294967200.0}) {
    transforms_.take(cameraAt(stamp_s), "rogue");
    map(102.0, 20.0);
    EXPECT_GE(map(122.0, 5.0), 49) << stamp_s;
  }
  EXPECT_EQ(status().transform_restarts, 2u);
  EXPECT_TRUE(findIn("camera", "lens").T_W_C) << "static transforms should be kept";
}

TEST_F(TransformsTest, RestartsAreLimited) {
  for (int i = 0; i < 600; ++i) {  // a wrong transform each second, for ten minutes
    putTransform(transforms_, 3700.0 + i, 1.0);
    map(100.0 + i, 1.0);
  }
  EXPECT_GE(status().transform_restarts, 3u);
  EXPECT_LE(status().transform_restarts, 9u);
}

TEST_F(TransformsTest, LongNamesAreRefused) {
  const std::string name(201, 'x');
  putTransform(transforms_, 1.0, 1.0, name, "map");
  putTransform(transforms_, 1.0, 1.0, "camera", name);
  EXPECT_EQ(status().transforms_refused, 2u);
  EXPECT_TRUE(says(lookUp("camera", ros::Time(1.0)), "all transforms received were refused"));
  EXPECT_TRUE(says(lookUp(name, ros::Time(1.0)), "longer than 200 bytes"));
}

TEST_F(TransformsTest, FindsAnotherParentOfAFrame) {
  EXPECT_EQ(transforms_.otherParentOf("camera", "map", ros::Time(1.0)), "");
  putTransform(transforms_, 1.0, 1.0, "camera", "odom");
  EXPECT_EQ(transforms_.otherParentOf("camera", "map", ros::Time(5.0)), "odom");
  EXPECT_EQ(transforms_.otherParentOf("camera", "map", ros::Time(7.0)), "");
  EXPECT_EQ(transforms_.otherParentOf("camera", "odom", ros::Time(1.0)), "");
  const auto mount = makeTransform("arm", "lens", Eigen::Isometry3d::Identity(), ros::Time(1.0));
  transforms_.take(mount, "test", true);
  EXPECT_EQ(transforms_.otherParentOf("lens", "map", ros::Time(700.0)), "arm");
}

Eigen::Isometry3d poseAt(double x_m, double turn_deg = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = x_m;
  T.linear() =
      Eigen::AngleAxisd(turn_deg * M_PI / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

class FindJumpTest : public testing::Test {
 protected:
  bool jumps(double stamp_s, const Eigen::Isometry3d& T_W_C) {
    const auto last = std::exchange(last_, std::make_pair(stamp_s, T_W_C));
    return findJump(last, stamp_s, T_W_C, max_speed_m_s_, max_turn_deg_s_).has_value();
  }

  double max_speed_m_s_ = 10.0, max_turn_deg_s_ = 720.0;
  std::optional<std::pair<double, Eigen::Isometry3d>> last_;
};

TEST_F(FindJumpTest, APersistentJumpCostsOneFrame) {
  EXPECT_FALSE(jumps(1.0, poseAt(0.0)));
  EXPECT_FALSE(jumps(1.1, poseAt(0.9)));
  EXPECT_TRUE(jumps(1.2, poseAt(2.0)));
  EXPECT_FALSE(jumps(1.3, poseAt(2.1)));
}

TEST_F(FindJumpTest, DetectsRotations) {
  EXPECT_FALSE(jumps(1.0, poseAt(0.0)));
  EXPECT_FALSE(jumps(1.1, poseAt(0.0, 70.0)));
  EXPECT_TRUE(jumps(1.2, poseAt(0.0, 150.0)));
}

/// Limits of 0 disable the check.
TEST_F(FindJumpTest, ResetsWhenStampsGoBack) {
  EXPECT_FALSE(jumps(100.0, poseAt(0.0)));
  EXPECT_FALSE(jumps(1.0, poseAt(50.0)));
  max_speed_m_s_ = max_turn_deg_s_ = 0.0;
  EXPECT_FALSE(jumps(1.1, poseAt(500.0, 180.0)));
}

}  // namespace
}  // namespace dtsdf
