// Tests walls up to two voxels thick, mapped from both sides.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "support/depth_frames.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kThinVoxel_m = 0.02;
const Vector3d kCentre(0.013, 0.007, 0.004);

/// Results for the central 0.6 m x 0.6 m of one side of the wall, well away from its rim. Lengths
/// are in voxels.
struct WallSide {
  double coverage = 0.0;  ///< Area of the mesh divided by the area of the side.
  double outwards = 0.0;  ///< Mean distance in front of the true side.
  double worst = 0.0;     ///< Greatest distance from the true side.
};

struct WallSides {
  WallSide front, back;
};

Scene makeWall(double thickness_voxels, double yaw_rad) {
  Scene scene;
  scene.add(makeBox(kCentre, Vector3d(0.8, thickness_voxels * kThinVoxel_m, 0.8), yaw_rad));
  return scene;
}

/// Eight views, four from each side, up to 35 degrees from the y axis.
std::vector<Eigen::Isometry3d> wallPoses() {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 8; ++i) {
    const double angle = -0.6 + 0.4 * (i / 2);
    poses.push_back(
        lookAt(Vector3d(std::sin(angle), (i % 2 ? 1 : -1) * std::cos(angle), 0.1 * std::sin(i)),
               Vector3d::Zero(), Vector3d::UnitZ()));
  }
  return poses;
}

WallSides measureSides(const Mesh& mesh, double thickness_voxels, double yaw_rad) {
  const Eigen::Matrix3d R_B_W = Eigen::AngleAxisd(-yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  WallSides sides;
  for (const auto& t : mesh.triangles) {
    Vector3d p_B[3];
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f& v = mesh.vertices_m[t[k]];
      p_B[k] = R_B_W * (Vector3d(v.x, v.y, v.z) - kCentre);
    }
    const Vector3d middle = (p_B[0] + p_B[1] + p_B[2]) / 3.0;
    if (std::abs(middle.x()) > 0.3 || std::abs(middle.z()) > 0.3) continue;
    const Vector3d area = 0.5 * (p_B[1] - p_B[0]).cross(p_B[2] - p_B[0]);
    const double sign = area.y() > 0.0 ? 1.0 : -1.0;
    WallSide& side = area.y() > 0.0 ? sides.front : sides.back;
    const double outwards = sign * middle.y() / kThinVoxel_m - 0.5 * thickness_voxels;
    side.coverage += area.norm() / 0.36;
    side.outwards += area.norm() * outwards;
    side.worst = std::max(side.worst, std::abs(outwards));
  }
  for (WallSide* side : {&sides.front, &sides.back}) side->outwards /= 0.36 * side->coverage;
  return sides;
}

WallSides mapWall(double thickness_voxels, double yaw_rad, FusionMode mode, bool directional) {
  const Scene scene = makeWall(thickness_voxels, yaw_rad);
  const Mesh mesh = reconstruct(makeCpuParams(mode, directional, static_cast<float>(kThinVoxel_m)),
                                renderFrames(scene, wallPoses()));
  return measureSides(mesh, thickness_voxels, yaw_rad);
}

class ThinWall : public testing::TestWithParam<std::tuple<double, double>> {
 protected:
  double thickness() const { return std::get<0>(GetParam()); }
  double yaw() const { return std::get<1>(GetParam()); }
};

TEST_P(ThinWall, TheDirectionalMapKeepsBothSidesInPlace) {
  for (const FusionMode mode : {FusionMode::kRayCasting, FusionMode::kNormalRayCasting}) {
    SCOPED_TRACE(modeName(mode, true));
    const WallSides sides = mapWall(thickness(), yaw(), mode, true);
    for (const WallSide& side : {sides.front, sides.back}) {
      EXPECT_NEAR(side.coverage, 1.0,
                  0.05);  // triangles at the border of the square count in full or not at all
      EXPECT_LT(side.worst, 0.05);
    }
  }
}

/// The undirected map mixes the distances of both sides. Walls up to 1.5 voxels thick become
/// thicker.
TEST_P(ThinWall, TheUndirectedMapDistortsIt) {
  const WallSides sides = mapWall(thickness(), yaw(), FusionMode::kNormalRayCasting, false);
  const double too_thick = sides.front.outwards + sides.back.outwards;
  if (thickness() <= 1.5) {
    EXPECT_GT(too_thick, 0.15);
  }
  EXPECT_GT(std::max(sides.front.worst, sides.back.worst), 0.05);
}

INSTANTIATE_TEST_SUITE_P(ThicknessesAndYaws, ThinWall,
                         testing::Combine(testing::Values(0.5, 1.0, 1.5, 2.0),
                                          testing::Values(0.0, 0.35)),
                         [](const testing::TestParamInfo<std::tuple<double, double>>& info) {
                           return "Tenths" +
                                  std::to_string(static_cast<int>(10 * std::get<0>(info.param))) +
                                  (std::get<1>(info.param) > 0.0 ? "Turned" : "Aligned");
                         });

}  // namespace
}  // namespace dtsdf
