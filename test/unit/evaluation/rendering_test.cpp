#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "dtsdf_mapping/io/recording.h"
#include "evaluation/depth_noise.h"
#include "simulation/scene.h"
#include "support/temporary_folder.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

/// Mean and standard deviation of the valid pixels, and their fraction of all pixels.
struct DepthStats {
  double mean_m = 0.0, sigma_m = 0.0, share = 0.0;
};

DepthStats statsOf(const std::vector<float>& depth_m) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (const float z : depth_m) {
    if (z <= 0.0f) continue;
    count += 1.0;
    sum += static_cast<double>(z);
    squares += static_cast<double>(z) * static_cast<double>(z);
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean)),
          count / static_cast<double>(depth_m.size())};
}

/// Renders a large rectangle from 2 m above.
DepthView frontalView() {
  return renderView(MeshScene(makeRectangle(-5, -5, 5, 5, 0)), ViewCamera{},
                    lookAt({0, 0, 2}, {0, 0, 0}, Eigen::Vector3d::UnitY()));
}

TEST(Orbit, PosesLookAtTheOrigin) {
  for (const OrbitShape shape : {OrbitShape::kCircle, OrbitShape::kHelix, OrbitShape::kSphere}) {
    for (const Eigen::Isometry3d& T_W_C : orbitPoses(shape, 97, 2.0)) {
      EXPECT_TRUE(T_W_C.linear().isUnitary(1e-9));
      EXPECT_NEAR(T_W_C.linear().determinant(), 1.0, 1e-9);
      EXPECT_LT((T_W_C * Eigen::Vector3d(0, 0, 2)).norm(), 1e-9);
      EXPECT_LE(T_W_C.linear()(1, 1), 1e-9) << "the image should not be upside down";
    }
  }
}

TEST(RenderView, MatchesTheAnalyticScene) {
  const TriangleMesh cube = makeCube(0.4f);
  Scene truth;
  truth.add(makeBox(Eigen::Vector3d::Zero(), 2.0 * 0.4f * Eigen::Vector3d::Ones()));
  const MeshScene scene(cube);
  const ViewCamera camera;
  for (const Eigen::Isometry3d& T_W_C : orbitPoses(OrbitShape::kSphere, 5, 2.0)) {
    const auto depth_m = renderView(scene, camera, T_W_C).depth_m;
    const auto expected_m =
        renderDepth(truth, camera.intrinsics, camera.width, camera.height, T_W_C);
    size_t different = 0;
    for (size_t i = 0; i < depth_m.size(); ++i) {
      if (std::abs(depth_m[i] - expected_m[i]) > 1e-5f) ++different;
    }
    EXPECT_LT(different, 20u) << "only pixels on the silhouette should differ";
  }
}

TEST(RenderView, GivesTheAngleOfIncidence) {
  const DepthView view = frontalView();
  const size_t centre = 240 * 640 + 320;
  EXPECT_NEAR(view.depth_m[centre], 2.0f, 1e-6f);
  EXPECT_NEAR(view.incidence_cosine[centre], 1.0f, 1e-5f);
  EXPECT_NEAR(view.incidence_cosine[240 * 640], std::cos(std::atan(319.5f / 525.0f)), 1e-4f);
}

TEST(ReadViews, BenchmarkFoldersDefaultToTheBenchmarksCamera) {
  const TemporaryFolder folder;
  const TumWriter writer(folder / "freiburg1", centredCamera(640, 480, 300.0),
                         orbitPoses(OrbitShape::kHelix, 3, 1.5));
  writer.finish("cube");
  EXPECT_EQ(readViews(folder / "freiburg1").camera.intrinsics.fx, 300.0f);
  std::filesystem::remove(folder / "freiburg1/camera_info.yaml");
  EXPECT_EQ(readViews(folder / "freiburg1").camera.intrinsics.fx, 525.0f);
  std::filesystem::rename(folder / "freiburg1", folder / "own");
  EXPECT_THROW(readViews(folder / "own"), std::runtime_error);
}

TEST(TumWriter, RecordingsAreReadBackUnchanged) {
  const TemporaryFolder folder;
  const auto poses = orbitPoses(OrbitShape::kHelix, 3, 1.5);
  const ViewCamera camera;
  const TumWriter writer(folder.path(), camera, poses);
  const MeshScene scene(makeCube(0.4f));
  std::vector<std::vector<uint16_t>> images;
  for (size_t i = 0; i < poses.size(); ++i) {
    images.push_back(toTumDepth(renderView(scene, camera, poses[i]).depth_m));
    writer.write(i, images.back());
  }
  writer.finish("cube");

  const Views views = readViews(folder.path());
  ASSERT_EQ(views.poses_W_C.size(), poses.size());
  EXPECT_FLOAT_EQ(views.camera.intrinsics.cy, 239.5f);
  RecordingOptions options;
  options.path = folder.path();
  options.format = "tum";
  const auto frames = openRecording(options);
  for (size_t i = 0; i < poses.size(); ++i) {
    EXPECT_TRUE(views.poses_W_C[i].isApprox(poses[i], 1e-8));
    const auto frame = frames->next();
    ASSERT_TRUE(frame);
    EXPECT_TRUE(frame->depth.T_W_C.isApprox(poses[i], 1e-8));
    ASSERT_EQ(frame->depth.width, camera.width);
    for (int v = 0; v < camera.height; ++v) {
      const auto* row =
          reinterpret_cast<const uint16_t*>(static_cast<const char*>(frame->depth.data) +
                                            static_cast<size_t>(v) * frame->depth.row_bytes);
      for (int u = 0; u < camera.width; ++u) {
        ASSERT_EQ(row[u], images[i][static_cast<size_t>(v * camera.width + u)]);
      }
    }
  }
}

TEST(TumDepth, RoundsAndDropsValuesOutOfRange) {
  EXPECT_EQ(toTumDepth({0.0f, 1.0f, 1.00011f, 13.2f, -1.0f}),
            (std::vector<uint16_t>{0, 5000, 5001, 0, 0}));
}

/// Values from Nguyen et al.: axial noise of 1.2 mm at 0.4 m and of 6.1 mm at 2 m (also at an angle
/// of 0.5 rad), and lateral noise of 0.8 pixels.
TEST(DepthNoise, FollowsTheCitedFormulas) {
  EXPECT_NEAR(axialSigma(0.4, 0.0), 0.0012, 1e-12);
  EXPECT_NEAR(axialSigma(2.0, 0.5), 0.0012 + 0.0019 * 2.56, 1e-12);
  EXPECT_GT(axialSigma(2.0, 1.3), axialSigma(2.0, 1.0));
  EXPECT_NEAR(lateralSigma(0.0), 0.8, 1e-12);
  EXPECT_TRUE(std::isfinite(axialSigma(2.0, 1.5707963)));
  const DepthStats stats = statsOf(addNoise(frontalView(), {}, DepthNoise::kKinect, 1));
  const double step_m = 4.0 / 315.0;  // one disparity step at 2 m
  EXPECT_NEAR(stats.mean_m, 2.0, 1e-3);
  EXPECT_NEAR(stats.sigma_m, std::hypot(axialSigma(2.0, 0.0), step_m / std::sqrt(12.0)), 2e-4);
  EXPECT_DOUBLE_EQ(stats.share, 1.0);
}

TEST(DepthNoise, QuantisesTheDisparity) {
  DepthView view = frontalView();
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    view.depth_m[i] = 1.0f + 3.0f * static_cast<float>(i) / static_cast<float>(view.depth_m.size());
  }
  const auto depth_m = addNoise(view, {}, DepthNoise::kKinect, 1);
  for (size_t i = 0; i < depth_m.size(); i += 97) {
    const double steps = 525.0 * 0.075 / static_cast<double>(depth_m[i]) / 0.125;
    ASSERT_NEAR(steps, std::round(steps), 1e-3);
  }
}

TEST(DepthNoise, LosesGrazingAnglesAndEdges) {
  DepthView flat = frontalView();
  std::fill(flat.incidence_cosine.begin(), flat.incidence_cosine.end(), 0.1f);  // 84 degrees
  for (const float z_m : addNoise(flat, {}, DepthNoise::kKinect, 1)) ASSERT_EQ(z_m, 0.0f);
  DepthView step = frontalView();
  for (size_t i = 0; i < step.depth_m.size(); ++i) {
    if (i % 640 < 320) step.depth_m[i] = 1.0f;
  }
  const auto depth_m = addNoise(step, {}, DepthNoise::kKinect, 1);
  size_t lost = 0;
  for (size_t i = 0; i < depth_m.size(); ++i) {
    if (depth_m[i] > 0.0f) continue;
    ++lost;
    ASSERT_NEAR(i % 640, 319.5, 5.0) << "only pixels near the edge should be lost";
  }
  EXPECT_NEAR(lost, 480, 60) << "about half of the pixels in two columns should be lost";
}

}  // namespace
}  // namespace dtsdf
