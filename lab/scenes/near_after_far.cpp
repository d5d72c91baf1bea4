#include <cmath>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// z coordinate of the wall, chosen so that the wall does not lie in a grid plane.
constexpr double kNearWall_m = 0.0037;

std::vector<Figure> measure(const SceneSetup& setup, const std::vector<double>& distances_m) {
  Scene scene;
  scene.add(wallAt(kNearWall_m));
  // Half the width of an area well inside the part of the wall that is visible from 3 m.
  const double half_m = 1.2 * setup.image_width / 320.0;
  const auto insideWall = [&](const Vector3d& p) {
    return std::abs(p.x()) < half_m && std::abs(p.y()) < 0.75 * half_m;
  };
  SceneMap map(setup);
  for (const double z : distances_m) {
    map.watch(scene, roomCamera(setup), Vector3d(0.013, 0.007, kNearWall_m - z), 30);
  }
  const Mesh mesh = map.mesh();
  const double area_m2 = areaOf(surfaceOf(mesh), insideWall);
  return {atMost("open edges inside", 0, "", static_cast<double>(countOpenEdges(mesh, insideWall))),
          within("area of the wall", 99.0, 101.0, "%", 100.0 * area_m2 / (3.0 * half_m * half_m))};
}

}  // namespace

void addNearAfterFarCases(std::vector<SceneCase>& cases) {
  const auto add = [&](const std::string& variant, const std::vector<double>& distances_m) {
    cases.push_back({"near_after_far", variant, true, [distances_m](const SceneSetup& setup) {
                       return measure(setup, distances_m);
                     }});
  };
  add("3 m only", {3.0});
  add("3 m, then 0.4 m", {3.0, 0.4});
  add("0.4 m, then 3 m", {0.4, 3.0});
}

}  // namespace dtsdf
