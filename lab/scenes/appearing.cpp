#include <algorithm>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kWall_m = 0.0037, kEye_m = -3.0;
constexpr double kSide_m = 0.25;

/// After 60 frames of an empty place, a board is put there, and a few more frames are fused.
std::vector<Figure> measure(const SceneSetup& setup, double front_m, int frames) {
  Scene scene;
  scene.add(wallAt(kWall_m));
  SceneMap map(setup);
  const Vector3d eye(0.011, 0.007, kEye_m);
  map.watch(scene, roomCamera(setup), eye, 60);
  scene.add(boardAt(0.0, 0.0, front_m, kSide_m, kSide_m));
  map.watch(scene, roomCamera(setup), eye, frames);
  const Points front = pointsOnRectangle(Vector3d(0.0, 0.0, front_m), {0.5 * kSide_m, 0.0, 0.0},
                                         {0.0, 0.5 * kSide_m, 0.0}, 0.005);
  // The rim can be located to within a pixel at best.
  const double within_m = std::max(setup.voxel(), (front_m - kEye_m) / roomCamera(setup).focal_px);
  return {atLeast("board in the mesh after " + std::to_string(frames) + " frames", 95.0, "%",
                  coveredPercent(front, map.surface(), within_m))};
}

}  // namespace

void addAppearingCases(std::vector<SceneCase>& cases) {
  const auto add = [&](const std::string& variant, double front_m) {
    cases.push_back({"appearing", variant, true,
                     [front_m](const SceneSetup& setup) { return measure(setup, front_m, 10); }});
  };
  add("0.1 m in front of the wall", kWall_m - 0.11);
  add("1 m in front of the wall", kWall_m - 1.0);
  add("0.6 m in front of the camera", kEye_m + 0.6037);
  cases.push_back(
      {"appearing", "1 m in front of the wall, memory_frames 19", true, [](SceneSetup setup) {
         setup.params.fusion.memory_frames = 19;
         return measure(setup, kWall_m - 1.0, 30);
       }});
}

}  // namespace dtsdf
