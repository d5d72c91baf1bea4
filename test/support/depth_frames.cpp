#include "support/depth_frames.h"
#include "mapper/probed_mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace dtsdf {

SceneFrame renderFrame(const Scene& scene, const Eigen::Isometry3d& T_W_C, int width, int height) {
  SceneFrame result;
  const float focal_px = 0.785f * static_cast<float>(width);
  const Intrinsics intrinsics{focal_px, focal_px, 0.5f * static_cast<float>(width - 1),
                              0.5f * static_cast<float>(height - 1)};
  result.depth_m = renderDepth(scene, intrinsics, width, height, T_W_C);
  result.frame = depthFrameOf(result.depth_m, intrinsics, width, height, T_W_C);
  result.frame.data = nullptr;  // see view()
  return result;
}

std::vector<SceneFrame> renderFrames(const Scene& scene,
                                     const std::vector<Eigen::Isometry3d>& T_W_C, int width,
                                     int height) {
  std::vector<SceneFrame> frames;
  for (const Eigen::Isometry3d& pose : T_W_C) {
    frames.push_back(renderFrame(scene, pose, width, height));
  }
  return frames;
}

Scene makeBallRoom() {
  Scene scene;
  scene.add(Room{Eigen::Vector3d(-1.49, -1.18, -0.97), Eigen::Vector3d(1.51, 1.22, 1.03)});
  scene.add(Sphere{{0.3, 0.1, 0.0}, 0.35});
  return scene;
}

std::vector<SceneFrame> movingFrames(int count) {
  std::vector<SceneFrame> frames;
  for (int i = 0; i < count; ++i) {
    Scene scene;
    scene.add(Plane{{1.6, 0.0, 0.0}, -Eigen::Vector3d::UnitX()});
    if (i < 12) scene.add(makeBox({1.1, 0.06 * (i - 6), 0.0}, {0.2, 0.3, 0.3}, 0.3));
    const Eigen::Vector3d eye(0.0, 0.01 * (i % 5), 0.01 * (i % 3));
    frames.push_back(renderFrame(
        scene, lookAt(eye, eye + Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()), 120, 90));
  }
  return frames;
}

std::vector<Eigen::Isometry3d> sphereOfPoses(const Eigen::Vector3d& centre_W, double distance_m,
                                             int count) {
  const double golden_angle = 3.14159265358979323846 * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z), angle = golden_angle * i;
    const Eigen::Vector3d direction(radius * std::cos(angle), radius * std::sin(angle), z);
    poses.push_back(lookAt(centre_W + distance_m * direction, centre_W,
                           Eigen::Vector3d(0.31, 0.17, 0.93).normalized()));
  }
  return poses;
}

MapperParams makeCpuParams(FusionMode mode, bool directional, float voxel_size_m, int threads) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.threads = threads;
  params.fusion.mode = mode;
  params.map.directional = directional;
  params.map.voxel_size_m = voxel_size_m;
  return params;
}

std::string modeName(FusionMode mode, bool directional) {
  const std::string fusion =
      mode == FusionMode::kVoxelProjection
          ? "VoxelProjection"
          : (mode == FusionMode::kRayCasting ? "RayCasting" : "NormalRayCasting");
  return fusion + (directional ? "Directional" : "Undirected");
}

MapperParams pagedParams(MapperParams params, int max_memory_mb, const std::string& folder) {
  params.map.max_memory_mb = max_memory_mb;
  params.map.page_folder = folder;
  params.map.page_max_gb = 1.0f;
  return params;
}

Mesh reconstruct(const MapperParams& params, const std::vector<SceneFrame>& frames) {
  const std::unique_ptr<ProbedMapper> mapper = makeProbedMapper(params);
  for (const SceneFrame& frame : frames) {
    const IntegrationResult result = mapper->integrate(frame.view());
    EXPECT_EQ(result.status, FrameStatus::kFused) << result.message;
  }
  MeshStore store(params.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  return store.assemble();
}

SurfaceError measureError(const Mesh& mesh, const Scene& scene) {
  SurfaceError error;
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    const std::array<double, 3> p_W = positionInMap(mesh, i);
    const double distance = scene.distanceToSurface(Eigen::Vector3d(p_W[0], p_W[1], p_W[2]));
    error.rms_m += distance * distance;
    error.max_m = std::max(error.max_m, distance);
  }
  error.vertices = mesh.vertices_m.size();
  if (error.vertices > 0)
    error.rms_m = std::sqrt(error.rms_m / static_cast<double>(error.vertices));
  return error;
}

}  // namespace dtsdf
