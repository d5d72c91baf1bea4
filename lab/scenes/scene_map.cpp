#include "scenes/scene_map.h"

#include <cmath>
#include <stdexcept>

namespace dtsdf {

using Eigen::Vector3d;

SceneCamera roomCamera(const SceneSetup& setup) {
  return {setup.image_width, setup.image_width * 3 / 4, 262.5};
}

SceneCamera coarseCamera() { return {160, 120, 131.25}; }

Intrinsics SceneView::intrinsics() const {
  const float focal_px = static_cast<float>(camera.focal_px);
  return {focal_px, focal_px, 0.5f * static_cast<float>(camera.width - 1),
          0.5f * static_cast<float>(camera.height - 1)};
}

DepthFrame SceneView::frame() const {
  return depthFrameOf(depth_m, intrinsics(), camera.width, camera.height, T_W_C);
}

size_t SceneView::indexOf(int u, int v) const {
  return static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u);
}

float& SceneView::at(int u, int v) { return depth_m[indexOf(u, v)]; }

float SceneView::at(int u, int v) const { return depth_m[indexOf(u, v)]; }

Vector3d SceneView::point(int u, int v, double z_m) const {
  const Intrinsics K = intrinsics();
  return T_W_C * Vector3d((u - static_cast<double>(K.cx)) / static_cast<double>(K.fx) * z_m,
                          (v - static_cast<double>(K.cy)) / static_cast<double>(K.fy) * z_m, z_m);
}

SceneView look(const Scene& scene, const SceneCamera& camera, const Eigen::Isometry3d& T_W_C) {
  SceneView view{camera, T_W_C, {}};
  view.depth_m = renderDepth(scene, view.intrinsics(), camera.width, camera.height, T_W_C);
  return view;
}

Eigen::Isometry3d lookFrom(const Vector3d& eye_W, const Vector3d& target_W) {
  return lookAt(eye_W, target_W, -Vector3d::UnitY());
}

Eigen::Isometry3d lookAlongZ(const Vector3d& eye_W) {
  return lookFrom(eye_W, eye_W + Vector3d::UnitZ());
}

Vector3d sway(int i, double reach_m) {
  return reach_m * Vector3d(std::sin(0.7 * i), std::cos(1.1 * i), std::sin(0.5 * i + 1.0));
}

Plane wallAt(double z_m) { return {Vector3d(0.0, 0.0, z_m), -Vector3d::UnitZ()}; }

Box boardAt(double x_m, double y_m, double front_z_m, double width_m, double height_m,
            double thickness_m) {
  return makeBox(Vector3d(x_m, y_m, front_z_m + 0.5 * thickness_m),
                 Vector3d(width_m, height_m, thickness_m));
}

SceneMap::SceneMap(const SceneSetup& setup)
    : mapper_(setup.makeMapper()), store_(setup.params.map.voxel_size_m) {}

void SceneMap::fuse(const SceneView& view, int times) {
  for (int i = 0; i < times; ++i) {
    const IntegrationResult result = mapper_->integrate(view.frame());
    const bool fine =
        result.status == FrameStatus::kFused || result.status == FrameStatus::kNoMeasurement;
    if (!fine || result.refused_blocks > 0) {
      throw std::runtime_error("a frame of the scene was not completely fused: " + result.message);
    }
  }
}

void SceneMap::watch(const Scene& scene, const SceneCamera& camera, const Vector3d& eye_W,
                     int count, double reach_m) {
  for (int i = 0; i < count; ++i) fuse(look(scene, camera, lookAlongZ(eye_W + sway(i, reach_m))));
}

Mesh SceneMap::mesh() {
  store_.apply(mapper_->updateMesh());
  return store_.assemble();
}

Surface SceneMap::surface() { return surfaceOf(mesh()); }

}  // namespace dtsdf
