#include "evaluation/depth_registration.h"

#include <gtest/gtest.h>

#include "evaluation/depth_renderer.h"
#include "simulation/scene.h"
#include "support/pose_distance.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

ViewCamera quarterCamera() { return {{131.25f, 131.25f, 79.5f, 59.5f}, 160, 120}; }

/// A floor and two walls that meet at the origin.
TriangleMesh makeRoomCorner() {
  TriangleMesh mesh;
  addQuad(mesh, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  addQuad(mesh, {0, 0, 0}, {0, 4, 0}, {0, 4, 4}, {0, 0, 4});
  addQuad(mesh, {0, 0, 0}, {0, 0, 4}, {4, 0, 4}, {4, 0, 0});
  return mesh;
}

Eigen::Isometry3d lookIntoCorner() {
  return lookAt({1.6, 1.9, 1.4}, {0.1, 0.0, 0.2}, Vector3d::UnitZ());
}

Eigen::Isometry3d spoilt(const Eigen::Isometry3d& T_W_C, const Vector3d& shift_W, double turn_deg) {
  Eigen::Isometry3d spoilt = T_W_C;
  spoilt.rotate(Eigen::AngleAxisd(turn_deg * kDegree, Vector3d(0.6, -0.5, 0.4).normalized()));
  return spoilt.pretranslate(shift_W);
}

/// Of an image of a wall, z = 0, from so far in front of it, recorded with a pose off by a shift.
Registration registerWall(double distance_m, const Vector3d& shift_W) {
  const MeshScene scene(makeRectangle(-5, -5, 5, 5, 0));
  const Eigen::Isometry3d truth = lookAt({0, 0, distance_m}, {0, 0, 0}, Vector3d::UnitY());
  const std::vector<float> depth_m = renderView(scene, quarterCamera(), truth).depth_m;
  return registerDepth(scene, quarterCamera(), depth_m, spoilt(truth, shift_W, 0.0), 6);
}

TEST(DepthRegistration, FindsThePoseInARoomCorner) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d truth = lookIntoCorner();
  const std::vector<float> depth_m = renderView(scene, quarterCamera(), truth).depth_m;
  const Eigen::Isometry3d recorded = spoilt(truth, Vector3d(0.02, -0.015, 0.01), 0.8);
  const Registration found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
  EXPECT_LT((found.T_W_C.translation() - truth.translation()).norm(), 1e-4);
  EXPECT_LT(turnBetween_rad(found.T_W_C, truth), 0.005 * kDegree);
  EXPECT_NEAR(found.shift_m, Vector3d(0.02, -0.015, 0.01).norm(), 1e-4);
  EXPECT_NEAR(found.turn_rad, 0.8 * kDegree, 0.005 * kDegree);
  EXPECT_GT(found.points, 300u);
}

/// A box that is measured before the corner and is not in the mesh, in a sixth of the image.
TEST(DepthRegistration, PassesOverWhatTheMeshDoesNotHave) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d truth = lookIntoCorner();
  std::vector<float> depth_m = renderView(scene, quarterCamera(), truth).depth_m;
  for (size_t v = 60; v < 110; ++v) {
    for (size_t u = 50; u < 114; ++u) depth_m[v * 160 + u] -= 0.25f;
  }
  const Eigen::Isometry3d recorded = spoilt(truth, Vector3d(0.02, -0.015, 0.01), 0.3);
  const Registration found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
  EXPECT_LT((found.T_W_C.translation() - truth.translation()).norm(), 5e-4);
  EXPECT_LT(turnBetween_rad(found.T_W_C, truth), 0.02 * kDegree);
}

/// The wall holds the image by one shift and two turns only.
TEST(DepthRegistration, KeepsItsPlaceAlongAWall) {
  const Registration found = registerWall(2.0, {0.03, 0.02, 0.015});
  EXPECT_LT((found.T_W_C.translation() - Vector3d(0.03, 0.02, 2.0)).norm(), 1e-4);
  EXPECT_LT(found.turn_rad, 0.005 * kDegree);
}

/// By more than the depth by which a pixel may differ at last, 25 mm.
TEST(DepthRegistration, FindsAWallCloseByFromFarOff) {
  const Registration found = registerWall(0.5, {0.0, 0.0, 0.06});
  EXPECT_GT(found.points, 300u);
  EXPECT_LT((found.T_W_C.translation() - Vector3d(0.0, 0.0, 0.5)).norm(), 1e-4);
}

TEST(DepthRegistration, LeavesThePoseWhereTooLittleIsThere) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d recorded = lookIntoCorner();
  const std::vector<float> nothing(160 * 120, 0.0f), far(160 * 120, 9.0f);
  for (const std::vector<float>& depth_m : {nothing, far}) {
    const Registration found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
    EXPECT_EQ(found.points, 0u);
    EXPECT_EQ(found.shift_m, 0.0);
    EXPECT_TRUE(found.T_W_C.isApprox(recorded, 0.0));
  }
}

}  // namespace
}  // namespace dtsdf
