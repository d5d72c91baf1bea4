#include "evaluation/mesh_registration.h"

#include <gtest/gtest.h>

#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kOneDegree = 3.14159265358979323846 / 180.0;

/// A floor and two walls that meet at the origin.
TriangleMesh cornerOfSide(float side_m) {
  const float s = side_m;
  TriangleMesh mesh;
  addQuad(mesh, {0, 0, 0}, {s, 0, 0}, {s, s, 0}, {0, s, 0});
  addQuad(mesh, {0, 0, 0}, {0, s, 0}, {0, s, s}, {0, 0, s});
  addQuad(mesh, {0, 0, 0}, {0, 0, s}, {s, 0, s}, {s, 0, 0});
  return mesh;
}

Eigen::Isometry3d offTheTruth() {
  Eigen::Isometry3d motion(
      Eigen::AngleAxisd(1.5 * kOneDegree, Vector3d(0.6, -0.5, 0.4).normalized()));
  return motion.pretranslate(Vector3d(0.05, -0.02, 0.03));
}

/// A part of it, as the middle of the faces of a smaller corner are on the larger one.
TEST(MeshRegistration, FindsTheMotionBack) {
  TriangleMesh mesh = cornerOfSide(2.0f);
  move(mesh, offTheTruth());
  const MeshRegistration found = registerMesh(MeshScene(cornerOfSide(4.0f)), mesh, 40);
  const Eigen::Isometry3d rest = found.motion * offTheTruth();
  EXPECT_LT(rest.translation().norm(), 1e-5);
  EXPECT_LT(Eigen::AngleAxisd(rest.linear()).angle(), 1e-5);
  EXPECT_NEAR(found.turn_rad, 1.5 * kOneDegree, 1e-5);
  EXPECT_GT(found.points, 49000u);
}

/// What the truth does not have, a plate half a metre before a wall, does not draw it away.
TEST(MeshRegistration, PassesOverWhatIsFarOff) {
  TriangleMesh mesh = joined(cornerOfSide(2.0f), makeRectangle(1.0f, 1.0f, 1.8f, 1.8f, 0.3f));
  move(mesh, offTheTruth());
  const MeshRegistration found = registerMesh(MeshScene(cornerOfSide(4.0f)), mesh, 40);
  EXPECT_LT((found.motion * offTheTruth()).translation().norm(), 1e-5);
}

TEST(MeshRegistration, StaysAlongWhatHoldsNothing) {
  const TriangleMesh mesh = makeRectangle(-1.0f, -1.0f, 1.0f, 1.0f, 0.02f);
  const MeshRegistration found =
      registerMesh(MeshScene(makeRectangle(-3.0f, -3.0f, 3.0f, 3.0f, 0.0f)), mesh, 40);
  EXPECT_NEAR(found.shift_m, 0.02, 1e-5);
  EXPECT_LT(found.motion.translation().head<2>().norm(), 1e-5);
  EXPECT_LT(found.turn_rad, 1e-5);
}

TEST(MeshRegistration, LeavesAMeshThatIsElsewhere) {
  const TriangleMesh far = makeRectangle(-1.0f, -1.0f, 1.0f, 1.0f, 5.0f);
  const MeshRegistration found = registerMesh(MeshScene(cornerOfSide(1.0f)), far, 10);
  EXPECT_EQ(found.points, 0u);
  EXPECT_TRUE(found.motion.matrix().isIdentity());
}

}  // namespace
}  // namespace dtsdf
