#include "level/pose_convention.h"

#include <gtest/gtest.h>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr int kViewWidth = 96, kViewHeight = 72;
const Intrinsics kIntrinsics{80.0f, 80.0f, 47.5f, 35.5f};

/// The transform from the camera's body frame (x forward, z up) to its optical frame.
Eigen::Isometry3d opticalFromBody() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return T;
}

/// What PoseConvention reports after the first 4 s of a lap of `lap_s` seconds if each input pose
/// is poseOf(true pose).
template <class PoseOf>
std::string doubtAbout(const PoseOf& poseOf, double lap_s = 6.0,
                       DepthEncoding encoding = DepthEncoding::kFloat32) {
  const Scene scene = makeRoomScene();
  PoseConvention convention;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Isometry3d T_W_O = roomCameraPose(0.1 * i, lap_s);
    const std::vector<float> depth_m =
        renderDepth(scene, kIntrinsics, kViewWidth, kViewHeight, T_W_O);
    std::vector<uint16_t> raw(depth_m.size());
    for (size_t k = 0; k < raw.size(); ++k) raw[k] = static_cast<uint16_t>(1000.0f * depth_m[k]);
    DepthFrame frame;
    const bool is_float = encoding == DepthEncoding::kFloat32;
    frame.data = is_float ? static_cast<const void*>(depth_m.data()) : raw.data();
    frame.row_bytes = kViewWidth * (is_float ? sizeof(float) : sizeof(uint16_t));
    frame.width = kViewWidth;
    frame.height = kViewHeight;
    frame.encoding = encoding;
    frame.unit_m = is_float ? 1.0f : 0.001f;
    frame.intrinsics = kIntrinsics;
    frame.T_W_C = poseOf(T_W_O);
    convention.add(frame);
  }
  return convention.doubt();
}

Eigen::Isometry3d asGiven(const Eigen::Isometry3d& T_W_O) { return T_W_O; }
Eigen::Isometry3d ofBody(const Eigen::Isometry3d& T_W_O) { return T_W_O * opticalFromBody(); }
Eigen::Isometry3d ofOpenGl(const Eigen::Isometry3d& T_W_O) {
  return T_W_O * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX());
}
Eigen::Isometry3d inverted(const Eigen::Isometry3d& T_W_O) { return T_W_O.inverse(); }
Eigen::Isometry3d turned(const Eigen::Isometry3d& T_W_O) {
  return T_W_O * Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized());
}

TEST(PoseConvention, OtherConventionsAreNamed) {
  EXPECT_NE(doubtAbout(ofBody).find("the camera's body"), std::string::npos);
  EXPECT_NE(doubtAbout(ofBody, 12.0, DepthEncoding::kUint16).find("body"), std::string::npos);
  EXPECT_NE(doubtAbout(ofOpenGl).find("those of OpenGL"), std::string::npos);
  EXPECT_NE(doubtAbout(inverted).find("invert each"), std::string::npos);
}

TEST(PoseConvention, CorrectPosesRaiseNoDoubt) { EXPECT_EQ(doubtAbout(asGiven), ""); }

TEST(PoseConvention, AStillCameraRaisesNoDoubt) { EXPECT_EQ(doubtAbout(ofBody, 1e9), ""); }

TEST(PoseConvention, OtherWrongPosesRaiseNoDoubt) { EXPECT_EQ(doubtAbout(turned), ""); }

}  // namespace
}  // namespace dtsdf
