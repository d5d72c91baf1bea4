#include "ros/input/pose_checks.h"

#include <gtest/gtest.h>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr int kViewWidth = 96, kViewHeight = 72;
const Intrinsics kIntrinsics{80.0f, 80.0f, 47.5f, 35.5f};

/// The axes of a camera's body, x forward and z up, in its optical frame.
Eigen::Isometry3d opticalFromBody() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return T;
}

/// What is found out on a way through the room, of frames whose poses are those of the camera times
/// `T_O_frame`.
bool isBodyFrame(const Eigen::Isometry3d& T_O_frame, double lap_s, DepthEncoding encoding) {
  const Scene scene = makeRoomScene();
  OpticalFrameCheck check;
  for (int i = 0; i < 30; ++i) {
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
    frame.T_W_C = T_W_O * T_O_frame;
    check.add(frame);
  }
  return check.isBodyFrame();
}

TEST(OpticalFrameCheck, ABodyFrameIsFoundOut) {
  EXPECT_TRUE(isBodyFrame(opticalFromBody(), 6.0, DepthEncoding::kFloat32));
  EXPECT_TRUE(isBodyFrame(opticalFromBody(), 12.0, DepthEncoding::kUint16));
}

TEST(OpticalFrameCheck, AnOpticalFrameIsLeftInPeace) {
  EXPECT_FALSE(isBodyFrame(Eigen::Isometry3d::Identity(), 6.0, DepthEncoding::kFloat32));
}

TEST(OpticalFrameCheck, ACameraThatStandsStillTellsNothing) {
  EXPECT_FALSE(isBodyFrame(opticalFromBody(), 1e9, DepthEncoding::kFloat32));
}

TEST(OpticalFrameCheck, ABadPoseIsNoBodyFrame) {
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.linear() = Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  EXPECT_FALSE(isBodyFrame(turned, 6.0, DepthEncoding::kFloat32));
}

}  // namespace
}  // namespace dtsdf
