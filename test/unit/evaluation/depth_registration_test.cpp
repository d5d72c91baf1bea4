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

Eigen::Isometry3d perturbed(const Eigen::Isometry3d& T_W_C, const Vector3d& shift_W,
                            double turn_deg) {
  Eigen::Isometry3d perturbed = T_W_C;
  perturbed.rotate(Eigen::AngleAxisd(turn_deg * kDegree, Vector3d(0.6, -0.5, 0.4).normalized()));
  return perturbed.pretranslate(shift_W);
}

TEST(DepthRegistration, FindsThePoseInARoomCorner) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d truth = lookIntoCorner();
  const std::vector<float> depth_m = renderView(scene, quarterCamera(), truth).depth_m;
  const Eigen::Isometry3d recorded = perturbed(truth, Vector3d(0.02, -0.015, 0.01), 0.8);
  const Eigen::Isometry3d found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
  EXPECT_LT((found.translation() - truth.translation()).norm(), 1e-4);
  EXPECT_LT(turnBetween_rad(found, truth), 0.005 * kDegree);
}

/// A box that is not part of the mesh covers a sixth of the image.
TEST(DepthRegistration, IgnoresObjectsMissingFromTheMesh) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d truth = lookIntoCorner();
  std::vector<float> depth_m = renderView(scene, quarterCamera(), truth).depth_m;
  for (size_t v = 60; v < 110; ++v) {
    for (size_t u = 50; u < 114; ++u) depth_m[v * 160 + u] -= 0.25f;
  }
  const Eigen::Isometry3d recorded = perturbed(truth, Vector3d(0.02, -0.015, 0.01), 0.3);
  const Eigen::Isometry3d found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
  EXPECT_LT((found.translation() - truth.translation()).norm(), 5e-4);
  EXPECT_LT(turnBetween_rad(found, truth), 0.02 * kDegree);
}

TEST(DepthRegistration, KeepsThePoseWithoutMatchingDepths) {
  const MeshScene scene(makeRoomCorner());
  const Eigen::Isometry3d recorded = lookIntoCorner();
  const std::vector<float> nothing(160 * 120, 0.0f), far(160 * 120, 9.0f);
  for (const std::vector<float>& depth_m : {nothing, far}) {
    const Eigen::Isometry3d found = registerDepth(scene, quarterCamera(), depth_m, recorded, 6);
    EXPECT_TRUE(found.isApprox(recorded, 0.0));
  }
}

}  // namespace
}  // namespace dtsdf
