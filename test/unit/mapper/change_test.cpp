// Tests changing scenes, with objects that disappear, return, or are visible in only one frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/depth_frames.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

const Vector3d kBall(1.1, 0.0, 0.0);
constexpr double kRadius_m = 0.15;

Scene farWall() {
  Scene scene;
  scene.add(Plane{{1.6, 0.0, 0.0}, -Vector3d::UnitX()});
  return scene;
}

Scene wallAndBall() {
  Scene scene = farWall();
  scene.add(Sphere{kBall, kRadius_m});
  return scene;
}

/// A view from the origin, rotated about the vertical axis.
SceneFrame look(const Scene& scene, double yaw_rad = 0.0) {
  const Vector3d ahead(std::cos(yaw_rad), std::sin(yaw_rad), 0.0);
  return renderFrame(scene, lookAt(Vector3d::Zero(), ahead, Vector3d::UnitZ()));
}

void see(Session& session, const SceneFrame& frame, int times) {
  for (int i = 0; i < times; ++i) session.integrate(frame);
}

/// Counts the mesh triangles on or near the ball.
size_t trianglesOfBall(Session& session) {
  const Mesh mesh = session.mesh();
  return static_cast<size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
        const Vec3f& p = mesh.vertices_m[t[0]];
        return (Vector3d(p.x, p.y, p.z) - kBall).norm() < 2.0 * kRadius_m;
      }));
}

size_t trianglesOfBallNow(Session& session) {
  session.updateMesh();
  return trianglesOfBall(session);
}

class Change : public testing::TestWithParam<bool> {
 protected:
  MapperParams params() const { return makeCpuParams(FusionMode::kNormalRayCasting, GetParam()); }
};

/// An object vanishes after the number of frames given in docs/method.md (Evidence), no matter how
/// long it was visible.
TEST_P(Change, RemovedObjectsVanish) {
  const auto check = [&](int memory_frames, int min_support, int seen, int removed_after) {
    MapperParams settings = params();
    settings.fusion.memory_frames = memory_frames;
    settings.mesh.min_support = min_support;
    Session session(settings);
    see(session, look(wallAndBall()), seen);
    ASSERT_GT(trianglesOfBallNow(session), 300u);
    see(session, look(farWall()), removed_after);
    EXPECT_EQ(trianglesOfBallNow(session), 0u)
        << "memory_frames " << memory_frames << ", min_support " << min_support
        << ", frames in view " << seen;
  };
  for (const int seen : {2, 30}) check(8, 2, seen, 12);
  check(8, 1, 30, 12);
  check(19, 2, 30, 28);
  check(19, 1, 30, 32);
}

/// Frames that only clear voxels do not raise the required support.
TEST_P(Change, ClearingFramesDoNotRaiseRequiredSupport) {
  Session session(params());
  Scene far;
  far.add(Plane{{30.0, 0.0, 0.0}, -Vector3d::UnitX()});
  see(session, look(far), 2);
  see(session, look(wallAndBall()), 1);
  EXPECT_GT(trianglesOfBallNow(session), 300u);
}

/// An object returns while the mesh update that removes it is in progress.
TEST_P(Change, ObjectsReturningDuringAnUpdateAreNotLost) {
  Session session(params()), fresh(params());
  see(session, look(wallAndBall()), 3);
  session.updateMesh();
  see(session, look(farWall()), 24);
  session.mapper().beginMeshUpdate();
  see(session, look(wallAndBall()), 3);
  session.finishMeshUpdate();
  EXPECT_EQ(trianglesOfBall(session), 0u);
  see(fresh, look(wallAndBall()), 3);
  const auto expected = static_cast<double>(trianglesOfBallNow(fresh));
  EXPECT_NEAR(static_cast<double>(trianglesOfBallNow(session)) / expected, 1.0, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Maps, Change, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& info) {
                           return info.param ? "Directional" : "Undirected";
                         });

/// Balls to the left and right of the origin, never both in one view.
Scene twoBalls() {
  Scene scene;
  scene.add(Sphere{{0.0, 1.0, 0.0}, 0.3});
  scene.add(Sphere{{0.0, -1.0, 0.0}, 0.3});
  return scene;
}

class MinSupport : public testing::TestWithParam<int> {
 protected:
  MinSupport()
      : session_([] {
          MapperParams params = makeCpuParams();
          params.mesh.min_support = GetParam();
          return params;
        }()) {}

  /// Fuses one more view of the left or right ball, then checks which balls are in the mesh.
  void see(bool left) {
    session_.integrate(look(twoBalls(), left ? 1.5708 : -1.5708));
    session_.updateMesh();
    const Mesh mesh = session_.mesh();
    shows_left_ = shows_right_ = false;
    for (const Vec3f& p : mesh.vertices_m) (p.y > 0.0f ? shows_left_ : shows_right_) = true;
  }

  Session session_;
  bool shows_left_ = false, shows_right_ = false;
};

/// The first frame is meshed immediately. From the second frame on, if min_support is 2, a surface
/// visible in only one frame disappears until a second frame supports it.
TEST_P(MinSupport, AppliesFromTheSecondFrame) {
  const bool one_is_enough = GetParam() == 1;
  see(true);
  EXPECT_TRUE(shows_left_);
  see(false);
  EXPECT_EQ(shows_left_, one_is_enough);
  EXPECT_EQ(shows_right_, one_is_enough);
  see(true);
  EXPECT_TRUE(shows_left_);
  EXPECT_EQ(shows_right_, one_is_enough);
  see(false);
  EXPECT_TRUE(shows_left_);
  EXPECT_TRUE(shows_right_);
}

TEST_P(MinSupport, StartsAfreshAfterClearing) {
  see(true);
  see(false);
  session_.clear();
  see(true);
  EXPECT_TRUE(shows_left_);
  EXPECT_FALSE(shows_right_);
}

INSTANTIATE_TEST_SUITE_P(Frames, MinSupport, testing::Values(1, 2));

}  // namespace
}  // namespace dtsdf
