#include "evaluation/space_scenes.h"

#include <cmath>
#include <stdexcept>

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// A camera with the field of view of a Kinect, and a quarter of its pixels.
ViewCamera smallCamera() { return {{262.5f, 262.5f, 159.5f, 119.5f}, 320, 240}; }

Scene makeShapes() {
  Scene scene;
  scene.add(Room{Vector3d(-2.51, -2.02, -1.23), Vector3d(2.53, 2.04, 1.37)});
  scene.add(Sphere{Vector3d(0.83, 0.31, 0.07), 0.4});
  Box block{Eigen::Isometry3d::Identity(), Vector3d(0.35, 0.25, 0.3)};
  block.T_W_B.translate(Vector3d(-0.71, -0.42, 0.05));
  block.T_W_B.rotate(Eigen::AngleAxisd(0.6, Vector3d(1.0, 2.0, 0.7).normalized()));
  scene.add(block);
  Box plate{Eigen::Isometry3d::Identity(), Vector3d(0.4, 0.005, 0.4)};
  plate.T_W_B.translate(Vector3d(-0.2, 0.9, 0.1));
  plate.T_W_B.rotate(Eigen::AngleAxisd(0.5, Vector3d(0.3, 0.4, 1.0).normalized()));
  scene.add(plate);
  return scene;
}

/// Two laps around the centre of the room. On the first lap the camera faces the centre; on the
/// second, it points past the centre, up and down.
std::vector<Eigen::Isometry3d> posesInShapes() {
  constexpr int kPerLap = 48;
  std::vector<Eigen::Isometry3d> poses_W_C;
  for (int i = 0; i < 2 * kPerLap; ++i) {
    const double a = 2.0 * kPi * i / kPerLap, height_m = 0.8 * std::sin(3.0 * a);
    const Vector3d eye_W(2.1 * std::cos(a), 1.7 * std::sin(a), height_m);
    const Vector3d outwards(std::cos(a + 0.7), std::sin(a + 0.7), std::sin(5.0 * a));
    poses_W_C.push_back(lookAt(
        eye_W, i < kPerLap ? Vector3d(0.0, 0.0, -0.3 * height_m) : Vector3d(eye_W - 1.5 * outwards),
        Vector3d::UnitZ()));
  }
  return poses_W_C;
}

}  // namespace

ViewedScene viewedShapes() { return {makeShapes(), {smallCamera(), posesInShapes(), {}}}; }

void fuseScene(const ViewedScene& viewed, Mapper& mapper) {
  const ViewCamera& camera = viewed.views.camera;
  for (const Eigen::Isometry3d& T_W_C : viewed.views.poses_W_C) {
    const std::vector<float> depth_m =
        renderDepth(viewed.scene, camera.intrinsics, camera.width, camera.height, T_W_C);
    const IntegrationResult result = mapper.integrate(
        depthFrameOf(depth_m, camera.intrinsics, camera.width, camera.height, T_W_C));
    if (result.status != FrameStatus::kFused) throw std::runtime_error(result.message);
  }
}

}  // namespace dtsdf
