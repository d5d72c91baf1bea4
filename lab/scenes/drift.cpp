#include <cmath>

#include "scenes/cases.h"
#include "scenes/scene_map.h"
#include "simulation/random.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr int kFrames = 40;

/// A corner of a room with a floor (+y is down), a board and boxes.
Scene makeCorner() {
  Scene scene;
  scene.add(Room{Vector3d(-1.2037, -3.0, -6.0), Vector3d(4.0, 0.9037, 1.2037)});
  scene.add(makeBox(Vector3d(0.6, 0.0, 0.9), Vector3d(0.5, 0.7, 0.02), 0.0));
  scene.add(makeBox(Vector3d(-0.8, 0.65, 0.5), Vector3d(0.5, 0.5, 0.6)));
  scene.add(makeBox(Vector3d(0.3, 0.75, 0.1), Vector3d(0.4, 0.3, 0.4)));
  scene.add(makeBox(Vector3d(-1.05, -0.3, 0.2), Vector3d(0.3, 0.03, 0.8)));
  return scene;
}

Eigen::Isometry3d passBy(int i) {
  const double angle = 0.9 * (static_cast<double>(i) / (kFrames - 1)) - 0.2;
  const Vector3d eye(2.2 * std::sin(angle), -0.3, -1.4 * std::cos(angle));
  return lookFrom(eye + sway(i, 0.01), Vector3d(-0.1, 0.3, 0.7));
}

/// Pose errors: standard deviation per axis in each frame, and total drift over all frames.
struct PoseError {
  double jitter_m, jitter_rad, drift_m;
};

Eigen::Isometry3d perturb(const Eigen::Isometry3d& T_W_C, const PoseError& error, int i,
                          Random& random) {
  const auto draw = [&] {
    const double x = random.normal(), y = random.normal();
    return Vector3d(x, y, random.normal());
  };
  const Vector3d shift = error.jitter_m * draw(), turn = error.jitter_rad * draw();
  const Vector3d drift = error.drift_m * i / (kFrames - 1) * Vector3d(0.6, 0.0, 0.8);
  Eigen::Isometry3d spoilt = T_W_C;
  if (turn.norm() > 0.0) spoilt.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  spoilt.pretranslate(shift + drift);
  return spoilt;
}

Surface fuseCorner(SceneSetup setup, const std::vector<SceneView>& views, bool clearing) {
  setup.params.fusion.clearing = clearing;
  SceneMap map(setup);
  for (const SceneView& view : views) map.fuse(view);
  return map.surface();
}

/// Measures what percentage of the visible surface is removed by clearing.
std::vector<Figure> measure(const SceneSetup& setup, const PoseError& error) {
  const Scene scene = makeCorner();
  const SceneCamera camera = coarseCamera();
  Random random(3);
  std::vector<SceneView> views;
  Points seen;
  for (int i = 0; i < kFrames; ++i) {
    views.push_back(look(scene, camera, passBy(i)));
    SceneView& view = views.back();
    for (int v = 1; v < camera.height && i % 5 == 0; v += 3) {
      for (int u = 1; u < camera.width; u += 3) {
        seen.push_back(view.point(u, v, static_cast<double>(view.at(u, v))));
      }
    }
    view.T_W_C = perturb(view.T_W_C, error, i, random);
  }
  seen = thinOut(seen, 0.02);
  const double within_m = 2.0 * setup.voxel() + 2.0 * error.jitter_m + std::max(error.drift_m, 0.0);
  const double kept = coveredPercent(seen, fuseCorner(setup, views, false), within_m);
  const double cleared = coveredPercent(seen, fuseCorner(setup, views, true), within_m);
  return {atMost("removed by clearing", 1.0, "%", kept - cleared)};
}

}  // namespace

void addDriftCases(std::vector<SceneCase>& cases) {
  constexpr double kDegree = 3.14159265358979323846 / 180.0;
  const std::pair<const char*, PoseError> errors[] = {
      {"poses are exact", {0.0, 0.0, 0.0}},
      {"poses jitter by 5 mm and 0.3 degrees", {0.005, 0.3 * kDegree, 0.0}},
      {"poses drift by 3 cm", {0.0, 0.0, 0.03}}};
  for (const auto& [name, error] : errors) {
    const bool quick = error.drift_m > 0.0 || error.jitter_m > 0.0;
    cases.push_back({"corner", name, quick,
                     [error = error](const SceneSetup& setup) { return measure(setup, error); }});
  }
}

}  // namespace dtsdf
