// Compares rendered views of maps with rays cast into the analytic scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "support/colour_frames.h"
#include "support/map_equality.h"
#include "support/same_bytes.h"
#include "support/session.h"

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr float kViewVoxel_m = 0.02f;
constexpr int kViewWidth = 240, kViewHeight = 180;

Isometry3d lookFrom(const Vector3d& eye, const Vector3d& at) {
  return lookAt(eye, at, Vector3d::UnitZ());
}

RenderCamera cameraOf(const DepthFrame& frame) {
  return {frame.width, frame.height, frame.intrinsics};
}

/// Fuses three frames of a scene from each pose.
void see(Session& session, const Scene& scene, const std::vector<Isometry3d>& T_W_C) {
  for (int i = 0; i < 3; ++i) {
    for (const Isometry3d& pose : T_W_C) {
      session.integrate(renderFrame(scene, pose, kViewWidth, kViewHeight));
    }
  }
}

/// Differences between a rendered view and the scene's true depth.
struct Differences {
  double median_voxels = 0.0, p95_voxels = 0.0;
  size_t missing = 0, extra = 0,
         pixels = 0;  ///< Missing: only in the scene. Extra: only in the view.
};

Differences compare(const RenderedView& view, const SceneFrame& truth) {
  Differences result;
  result.pixels = truth.depth_m.size();
  std::vector<double> voxels;
  for (size_t i = 0; i < result.pixels; ++i) {
    const float expected = truth.depth_m[i], found = view.depth_m[i];
    if (expected > 0.0f && found > 0.0f) {
      voxels.push_back(std::abs(expected - found) / kViewVoxel_m);
    } else {
      result.missing += expected > 0.0f;
      result.extra += found > 0.0f;
    }
  }
  std::sort(voxels.begin(), voxels.end());
  if (voxels.empty()) return result;
  result.median_voxels = voxels[voxels.size() / 2];
  result.p95_voxels = voxels[voxels.size() * 95 / 100];
  return result;
}

/// Two walls, a floor and a ball.
Scene cornerWithBall() {
  Scene scene;
  scene.add(Plane{{2.0, 0.0, 0.0}, -Vector3d::UnitX()});
  scene.add(Plane{{0.0, 2.0, 0.0}, -Vector3d::UnitY()});
  scene.add(Plane{{0.0, 0.0, -1.0}, Vector3d::UnitZ()});
  scene.add(Sphere{{1.2, 1.1, -0.5}, 0.3});
  return scene;
}

std::vector<Isometry3d> cornerPoses() {
  return {lookFrom({0.2, 0.1, 0.2}, {2.0, 2.0, -1.0}), lookFrom({0.6, -0.1, 0.3}, {1.6, 2.0, -1.0}),
          lookFrom({-0.1, 0.5, 0.1}, {2.0, 1.7, -1.0})};
}

class Views : public testing::TestWithParam<bool> {};

/// The pose of the view lies between those of the fused images.
TEST_P(Views, MatchTheScene) {
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, GetParam(), kViewVoxel_m));
  see(session, cornerWithBall(), cornerPoses());
  const Isometry3d T_W_C = lookFrom({0.3, 0.2, 0.2}, {1.9, 1.9, -0.9});
  const SceneFrame truth = renderFrame(cornerWithBall(), T_W_C, kViewWidth, kViewHeight);
  const RenderedView view = session.mapper().render(cameraOf(truth.view()), T_W_C);
  ASSERT_EQ(view.depth_m.size(), static_cast<size_t>(kViewWidth * kViewHeight));
  EXPECT_TRUE(view.colours.empty());
  const Differences found = compare(view, truth);
  EXPECT_LT(found.median_voxels, 0.05);
  EXPECT_LT(found.p95_voxels, 0.5);
  EXPECT_LT(found.missing, found.pixels / 20);  // the surface behind the ball is not mapped
  EXPECT_EQ(found.extra, 0u);
}

INSTANTIATE_TEST_SUITE_P(Maps, Views, testing::Bool());

/// A slanted wall, where the depth and normal of each pixel are known.
TEST(Render, NormalsMatchTheWall) {
  Scene wall;
  const Vector3d normal = Vector3d(-1.0, 0.4, 0.2).normalized();
  wall.add(Plane{{2.0, 0.0, 0.0}, normal});
  const Isometry3d T_W_C = lookFrom({0.0, 0.1, 0.1}, {2.0, 0.0, 0.0});
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, kViewVoxel_m));
  see(session, wall, {T_W_C});
  const SceneFrame truth = renderFrame(wall, T_W_C, kViewWidth, kViewHeight);
  const RenderedView view = session.mapper().render(cameraOf(truth.view()), T_W_C);
  const Vector3d expected_C = T_W_C.linear().transpose() * normal;
  size_t seen = 0;
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    if (!(view.depth_m[i] > 0.0f)) continue;
    ++seen;
    const Vec3f& n = view.normals_C[i];
    ASSERT_GT(expected_C.dot(Vector3d(n.x, n.y, n.z)), 0.995) << i;
    ASSERT_NEAR(std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z), 1.0, 1e-5);
  }
  EXPECT_GT(seen, view.depth_m.size() * 9 / 10);
  EXPECT_LT(compare(view, truth).p95_voxels, 0.05);
}

constexpr Colour kFront{220, 30, 30}, kBack{30, 30, 220};
constexpr double kHalfThickness_m = 0.0025;

/// A plate a quarter of a voxel thick.
Scene plate() {
  Scene scene;
  scene.add(Box{Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.0)), {kHalfThickness_m, 0.4, 0.4}});
  return scene;
}

TEST(Render, EachSideOfAPlateHasItsOwnDepthAndColour) {
  const Isometry3d front = lookFrom({0.0, 0.1, 0.1}, {1.0, 0.0, 0.0});
  const Isometry3d back = lookFrom({2.0, 0.1, 0.1}, {1.0, 0.0, 0.0});
  const auto colour = [](const Vector3d& p_W) { return p_W.x() < 1.0 ? kFront : kBack; };
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, kViewVoxel_m));
  see(session, plate(), {front, back});
  for (const Isometry3d& pose : {front, back}) {
    session.mapper().paint(renderColour(plate(), colour, pose, kViewWidth, kViewHeight).view());
  }
  for (const Isometry3d& pose : {front, back}) {
    const SceneFrame truth = renderFrame(plate(), pose, kViewWidth, kViewHeight);
    const RenderedView view = session.mapper().render(cameraOf(truth.view()), pose);
    const Differences found = compare(view, truth);
    EXPECT_LT(found.p95_voxels, 0.05);
    EXPECT_LT(found.missing + found.extra, found.pixels / 50);
    const Colour expected = pose.translation().x() < 1.0 ? kFront : kBack;
    ASSERT_EQ(view.colours.size(), view.depth_m.size());
    size_t seen = 0, right = 0;
    for (size_t i = 0; i < view.colours.size(); ++i) {
      if (!(view.depth_m[i] > 0.0f)) {
        ASSERT_EQ(view.colours[i].painted, 0);
        continue;
      }
      ++seen;
      right += std::abs(view.colours[i].red - expected[0]) < 12 &&
               std::abs(view.colours[i].blue - expected[2]) < 12;
    }
    EXPECT_GT(right, seen * 9 / 10);
  }
}

/// A rod 1.3 pixels wide in front of a wall.
TEST(Render, ThinObjectsAreNotMissed) {
  Scene scene;
  scene.add(Plane{{3.0, 0.0, 0.0}, -Vector3d::UnitX()});
  scene.add(Box{Isometry3d(Eigen::Translation3d(1.5, 0.0, 0.0)), {0.02, 0.02, 2.0}});
  const Isometry3d T_W_C = lookFrom({0.0, 0.01, 0.0}, {3.0, 0.0, 0.0});
  Session session(makeCpuParams(FusionMode::kNormalRayCasting, true, kViewVoxel_m));
  for (int i = 0; i < 6; ++i) session.integrate(renderFrame(scene, T_W_C, 640, 480));
  RenderCamera camera = cameraOf(renderFrame(scene, T_W_C, 64, 48).view());
  const RenderedView view = session.mapper().render(camera, T_W_C);
  for (int v = 8; v < 40; ++v) {
    int on_rod = 0;
    for (int u = 0; u < camera.width; ++u) {
      const float depth_m = view.depth_m[static_cast<size_t>(v * camera.width + u)];
      on_rod += depth_m > 1.4f && depth_m < 1.6f;
    }
    EXPECT_GE(on_rod, 1) << v;
  }
}

bool sameViews(const RenderedView& a, const RenderedView& b) {
  return a.width == b.width && a.height == b.height && sameBytes(a.depth_m, b.depth_m) &&
         sameBytes(a.normals_C, b.normals_C) && sameBytes(a.colours, b.colours);
}

/// Checks that views equal those of a copied map, which has no cached triangles.
void expectViewsAsOfACopy(Session& session, const MapperParams& params) {
  const RenderCamera camera{120, 90, {100.0f, 100.0f, 59.5f, 44.5f}};
  const auto copy = makeMapper(params, session.mapper().contents());
  for (const Isometry3d& pose : cornerPoses()) {
    const RenderedView expected = copy->render(camera, pose);
    EXPECT_TRUE(sameViews(expected, session.mapper().render(camera, pose)));
    EXPECT_TRUE(sameViews(expected, session.mapper().render(camera, pose)));
  }
}

class KeptViews : public testing::TestWithParam<int> {};

TEST_P(KeptViews, FollowTheMap) {
  MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kViewVoxel_m);
  params.mesh.refine = GetParam();
  Session session(params);
  const auto colour = [](const Vector3d& p_W) { return p_W.y() < 1.0 ? kFront : kBack; };
  for (size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    const Isometry3d pose = cornerPoses()[i % 3];
    session.integrate(renderFrame(cornerWithBall(), pose, kViewWidth, kViewHeight));
    if (i % 2 == 0) session.updateMesh();
    expectViewsAsOfACopy(session, params);
    if (i < 3) continue;
    session.mapper().paint(
        renderColour(cornerWithBall(), colour, pose, kViewWidth, kViewHeight).view());
    expectViewsAsOfACopy(session, params);
  }
  session.mapper().clearRegion(SphereRegion{{1.2, 1.1, -0.5}, 0.4});
  expectViewsAsOfACopy(session, params);
  session.updateMesh();
  expectViewsAsOfACopy(session, params);
}

INSTANTIATE_TEST_SUITE_P(Refined, KeptViews, testing::Values(0, 1));

/// Some blocks are rendered, but cleared before they are extracted. Their neighbours, which are
/// otherwise unchanged, must be rendered as if the cleared blocks had never existed.
TEST(Render, BlocksClearedBeforeExtractionLeaveNoTrace) {
  for (const int refine : {0, 1}) {
    MapperParams params = makeCpuParams(FusionMode::kNormalRayCasting, true, kViewVoxel_m);
    params.mesh.refine = refine;
    Session seen(params), unseen(params);
    const auto both = [&](const auto& act) {
      for (Session* session : {&seen, &unseen}) act(*session);
    };
    both([&](Session& session) {
      see(session, cornerWithBall(), {lookFrom({0.2, 0.0, 0.2}, {2.0, 0.2, 0.2})});
      session.updateMesh();
      see(session, cornerWithBall(), {lookFrom({0.2, 0.9, 0.2}, {2.0, 1.1, 0.2})});
    });
    expectViewsAsOfACopy(seen, params);
    const double block_m = 8.0 * kViewVoxel_m;
    both([&](Session& session) {
      for (int i = 1; i < 14; i += 2) {  // only every second layer of blocks
        const Isometry3d middle(
            Eigen::Translation3d(0.0, (i + 0.5) * block_m - 0.5 * kViewVoxel_m, 0.0));
        session.mapper().clearRegion(BoxRegion{middle, {18.0, block_m, 18.0}});
      }
    });
    expectViewsAsOfACopy(seen, params);
    both([](Session& session) { session.updateMesh(); });
    EXPECT_TRUE(sameMeshes(seen.mesh(), unseen.mesh())) << refine;
    expectViewsAsOfACopy(seen, params);
  }
}

TEST(Render, BadCamerasAreRefused) {
  Session session(makeCpuParams());
  const RenderCamera good;
  for (const RenderCamera& camera :
       {RenderCamera{0, 480, good.intrinsics}, RenderCamera{640, -1, good.intrinsics},
        RenderCamera{1 << 20, 1 << 20, good.intrinsics},
        RenderCamera{640, 480, {0.0f, 525.0f, 320.0f, 240.0f}},
        RenderCamera{640, 480, {525.0f, NAN, 320.0f, 240.0f}}}) {
    EXPECT_THROW(session.mapper().render(camera, Isometry3d::Identity()), std::invalid_argument);
  }
  Isometry3d pose = Isometry3d::Identity();
  pose.translation().x() = NAN;
  EXPECT_THROW(session.mapper().render(good, pose), std::invalid_argument);
  pose = Isometry3d::Identity();
  pose.linear() *= 2.0;
  EXPECT_THROW(session.mapper().render(good, pose), std::invalid_argument);
}

}  // namespace
}  // namespace dtsdf
