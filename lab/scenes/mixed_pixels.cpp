#include <algorithm>
#include <cmath>
#include <utility>

#include "params/text.h"
#include "scenes/cases.h"
#include "scenes/scene_map.h"
#include "simulation/random.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kBoardSide_m = 0.5;
constexpr int kViews = 40;
constexpr double kNoise = 1.5e-3;  // standard deviation in metres at 1 m; it grows with z^2

/// A board `gap_m` in front of a wall and `distance_m` away from the camera.
struct Step {
  double gap_m, distance_m;
  bool noisy;

  double sigma_m() const { return kNoise * (distance_m + gap_m) * (distance_m + gap_m); }
};

/// A camera whose pixels cover about 4 mm at 1 m, 5 mm at 2.5 m and 10 mm at 5 m, so that the board
/// fits into the image.
SceneCamera stepCamera(const Step& step) {
  return {240, 180, step.distance_m < 2.0 ? 262.5 : 525.0};
}

/// Gives each pixel on the far side of an edge a random depth between the two surfaces.
void mixPixels(SceneView& view, double gap_m, Random& random) {
  const SceneView clean = view;
  for (int v = 1; v + 1 < view.camera.height; ++v) {
    for (int u = 1; u + 1 < view.camera.width; ++u) {
      const float z = clean.at(u, v);
      float nearest = z;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) nearest = std::min(nearest, clean.at(u + du, v + dv));
      }
      if (static_cast<double>(z - nearest) < 0.5 * gap_m) continue;
      view.at(u, v) = nearest + static_cast<float>(random.uniform()) * (z - nearest);
    }
  }
}

void addNoise(SceneView& view, Random& random) {
  for (float& z : view.depth_m) z += static_cast<float>(kNoise * random.normal()) * z * z;
}

/// Pose i out of kViews, on an arc of 0.3 rad to either side of the board, at slightly varying
/// heights.
Eigen::Isometry3d viewOf(const Step& step, int i) {
  const double angle = 0.3 * (2.0 * i / (kViews - 1) - 1.0), up = 0.05 * std::sin(0.9 * i);
  const Vector3d towards(std::sin(angle), std::sin(up), -std::cos(angle));
  return lookFrom(step.distance_m * towards, Vector3d::Zero());
}

/// Measures the area of bridges between board and wall, relative to a complete bridge (skirt) from
/// the whole rim of the board to the wall.
std::vector<Figure> measureBridge(const SceneSetup& setup, const Step& step) {
  const double front_m = kOff_m, wall_m = kOff_m + step.gap_m;
  Scene scene;
  scene.add(wallAt(wall_m));
  scene.add(boardAt(0.0, 0.0, front_m, kBoardSide_m, kBoardSide_m, 0.002));
  SceneMap map(setup);
  Random random(7);
  for (int i = 0; i < kViews; ++i) {
    SceneView view = look(scene, stepCamera(step), viewOf(step, i));
    mixPixels(view, step.gap_m, random);
    if (step.noisy) addNoise(view, random);
    map.fuse(view);
  }
  const double away_m = 2.0 * setup.voxel() + (step.noisy ? 3.0 * step.sigma_m() : 0.0);
  const Surface bridge = partOf(map.surface(), [&](const Vector3d& p) {
    return p.z() > front_m && p.z() < wall_m && scene.distanceToSurface(p) > away_m;
  });
  const double skirt_m2 = 4.0 * kBoardSide_m * step.gap_m;
  return {atMost("bridge area, relative to a complete skirt", step.noisy ? 10.0 : 3.0, "%",
                 100.0 * areaOf(bridge) / skirt_m2)};
}

/// Whether there are points between board and wall that are far enough from both to count as part
/// of a bridge.
bool hasMiddle(const SceneSetup& setup, const Step& step) {
  const double noise_m = step.noisy ? 6.0 * step.sigma_m() : 0.0;
  return step.gap_m > 4.0 * setup.voxel() + noise_m + 1e-9;
}

/// A thin plate from the right or left edge of the board back to the wall, `width_px` pixels wide
/// in the image of a centred camera.
struct Side {
  Vector3d start, end;  // at y = 0

  static Side make(const Step& step, double width_px, double sign) {
    const double near = step.distance_m, far = near + step.gap_m;
    const double ratio = 0.5 * kBoardSide_m / near + width_px / stepCamera(step).focal_px;
    return {Vector3d(sign * 0.5 * kBoardSide_m, 0.0, kOff_m),
            Vector3d(sign * ratio * far, 0.0, kOff_m + step.gap_m)};
  }

  /// The plate as a box, whose front lies in the plane of the side.
  Box plate() const {
    constexpr double kThickness_m = 0.002;
    const Vector3d along = (end - start).normalized();
    Vector3d inwards = along.cross(Vector3d::UnitY());
    if (inwards.x() * start.x() > 0.0) inwards = -inwards;
    Box box{Eigen::Isometry3d::Identity(),
            0.5 * Vector3d(kThickness_m, kBoardSide_m, (end - start).norm())};
    box.T_W_B.linear().col(0) = inwards;
    box.T_W_B.linear().col(1) = along.cross(inwards);
    box.T_W_B.linear().col(2) = along;
    box.T_W_B.translation() = 0.5 * (start + end) + 0.5 * kThickness_m * inwards;
    return box;
  }

  Points points(double spacing_m) const {
    return pointsOnRectangle(0.5 * (start + end), 0.5 * (end - start),
                             Vector3d(0.0, 0.5 * kBoardSide_m, 0.0), spacing_m);
  }
};

/// Measures real sides between board and wall, where bridges would be. The camera moves along their
/// edges, so that their width in the image hardly changes.
std::vector<Figure> measureSides(const SceneSetup& setup, const Step& step, double width_px) {
  const Side sides[] = {Side::make(step, width_px, -1.0), Side::make(step, width_px, 1.0)};
  Scene scene;
  scene.add(wallAt(kOff_m + step.gap_m));
  scene.add(boardAt(0.0, 0.0, kOff_m, kBoardSide_m, kBoardSide_m, 0.002));
  for (const Side& side : sides) scene.add(side.plate());
  SceneMap map(setup);
  Random random(11);
  for (int i = 0; i < kViews; ++i) {
    const double up = 0.15 * (2.0 * i / (kViews - 1) - 1.0) * step.distance_m;
    const double across = 0.002 * step.distance_m * std::sin(0.9 * i);
    SceneView view =
        look(scene, stepCamera(step), lookAlongZ(Vector3d(across, up, kOff_m - step.distance_m)));
    if (step.noisy) addNoise(view, random);
    map.fuse(view);
  }
  const double inner_m = 0.5 * kBoardSide_m - 2.0 * setup.voxel();
  Points between;  // points at a distance from both board and wall
  for (const Side& side : sides) {
    for (const Vector3d& p : side.points(0.25 * setup.voxel())) {
      const double depth_m = p.z() - kOff_m;
      if (std::abs(p.y()) < inner_m && depth_m > 2.0 * setup.voxel() &&
          depth_m < step.gap_m - 2.0 * setup.voxel()) {
        between.push_back(p);
      }
    }
  }
  const double pixel_m = (step.distance_m + step.gap_m) / stepCamera(step).focal_px;
  const double within_m = std::max(1.5 * setup.voxel(), pixel_m);
  const double there = coveredPercent(between, map.surface(), within_m);
  // The slope of a side one pixel wide cannot be measured, so in some views it cannot be told apart
  // from mixed pixels.
  const bool isBounded = width_px > 1.5 && !step.noisy;
  return {isBounded ? atLeast("side in the mesh", 90.0, "%", there)
                    : reported("side in the mesh", "%", there)};
}

std::string describe(const Step& step) {
  return formatted("gap %g m at %g m%s", step.gap_m, step.distance_m, step.noisy ? ", noise" : "");
}

using MeasureStep = std::function<std::vector<Figure>(const SceneSetup&, const Step&)>;

void addStep(std::vector<SceneCase>& cases, const std::string& what, const Step& step, bool quick,
             const MeasureStep& measure) {
  cases.push_back({"mixed_pixels", what + ", " + describe(step), quick,
                   [step, measure](const SceneSetup& setup) {
                     return hasMiddle(setup, step) ? measure(setup, step) : std::vector<Figure>();
                   }});
}

}  // namespace

void addMixedPixelCases(std::vector<SceneCase>& cases) {
  const double gaps_m[] = {0.05, 0.1, 0.2, 0.5}, distances_m[] = {1.0, 2.5, 5.0};
  const std::pair<double, double> quick[] = {{0.1, 1.0}, {0.2, 2.5}, {0.5, 5.0}};
  const auto isQuick = [&](double gap_m, double distance_m) {
    return std::find(std::begin(quick), std::end(quick), std::pair(gap_m, distance_m)) !=
           std::end(quick);
  };
  for (const bool noisy : {false, true}) {
    for (const double distance_m : distances_m) {
      for (const double gap_m : gaps_m) {
        addStep(cases, "bridge", {gap_m, distance_m, noisy}, isQuick(gap_m, distance_m),
                measureBridge);
      }
    }
  }
  for (const bool noisy : {false, true}) {
    for (const auto& [gap_m, distance_m] : quick) {
      for (const int width_px : {1, 2, 3}) {
        addStep(cases, "side of " + std::to_string(width_px) + " px", {gap_m, distance_m, noisy},
                !noisy && distance_m < 2.0, [width_px](const SceneSetup& setup, const Step& step) {
                  return measureSides(setup, step, width_px);
                });
      }
    }
  }
}

}  // namespace dtsdf
