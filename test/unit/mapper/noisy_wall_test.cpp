// Tests that measurements with noise larger than a voxel average to one surface.
#include <gtest/gtest.h>

#include <random>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"
#include "support/raw_mesh.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// Frames from one pose, looking along -z. The noise is `noise` metres at 1 m and grows with z^2.
std::vector<SceneFrame> noisyFrames(const Scene& scene, const Vector3d& eye_W, int count,
                                    float noise) {
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  T_W_C.translation() = eye_W;
  std::mt19937 random(1);
  std::normal_distribution<float> error(0.0f, noise);
  std::vector<SceneFrame> frames =
      renderFrames(scene, std::vector<Eigen::Isometry3d>(count, T_W_C), 320, 240);
  for (SceneFrame& frame : frames) {
    for (float& z : frame.depth_m) z = 1.0f / (1.0f / z + error(random));
  }
  return frames;
}

/// Noise of 6 mm, with 5 mm voxels. If only samples within 1.75 voxels of a point were updated, the
/// 15 % of depths with larger errors would form separate surfaces. The actual limit grows with the
/// noise, so only the few depths off by more than the truncation distance form such surfaces.
TEST(NoisyWall, AveragesToOneSurface) {
  constexpr float kVoxel_m = 0.005f, kNoise = 0.006f;
  Scene scene;
  scene.add(Plane{Vector3d(0.0, 0.0, 0.0), Vector3d(0.2, -0.3, 1.0).normalized()});
  const std::vector<SceneFrame> frames = noisyFrames(scene, {0.0, 0.0, 1.0}, 15, kNoise);
  const Mesh mesh =
      reconstruct(makeCpuParams(FusionMode::kNormalRayCasting, true, kVoxel_m), frames);
  const SurfaceError found = measureError(mesh, scene);
  EXPECT_GT(found.vertices, 10000u);
  EXPECT_LT(found.rms_m, 0.5 * kVoxel_m);
}

/// Two walls that meet 4 m in front of the camera, with noise of 48 mm. Normals fitted in windows
/// wide enough for this noise mix both walls. Updating voxels along such normals would shift the
/// edge.
TEST(NoisyWall, KeepsAnEdgeInPlace) {
  Scene scene;
  scene.add(Plane{Vector3d(0.0, 0.0, 0.0), Vector3d(0.8, 0.1, 1.0).normalized()});
  scene.add(Plane{Vector3d(0.0, 0.0, 0.0), Vector3d(-0.8, 0.1, 1.0).normalized()});
  const std::vector<SceneFrame> frames = noisyFrames(scene, {0.0, 0.0, 4.0}, 20, 0.003f);
  const Mesh mesh = reconstruct(makeCpuParams(), frames);
  const SurfaceError found = measureError(mesh, scene);
  EXPECT_GT(found.vertices, 10000u);
  EXPECT_LT(found.rms_m, 0.009);
}

}  // namespace
}  // namespace dtsdf
