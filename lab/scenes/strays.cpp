#include <algorithm>

#include "scenes/cases.h"
#include "scenes/scene_map.h"
#include "simulation/random.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr int kStrayFrames = 100;
/// The last bad frame; ten good ones follow.
constexpr int kLastBad = 89;
const std::vector<int> kOneOf50 = {kLastBad - 50, kLastBad};
/// Only one bad frame: two with the same shift would be enough for a false surface in the mesh.
const std::vector<int> kOnce = {kLastBad};

/// A wall with a board, a box and a sphere in front of it.
Scene makeFurniture() {
  Scene scene;
  scene.add(wallAt(kOff_m));
  scene.add(boardAt(-0.5, 0.1, kOff_m - 0.3, 0.4, 0.5, 0.05));
  scene.add(makeBox(Vector3d(0.45, 0.2, -0.3), Vector3d(0.3, 0.4, 0.25), 0.0));
  scene.add(Sphere{Vector3d(0.05, -0.3, -0.35), 0.15});
  return scene;
}

/// The i-th pose of a camera that moves sideways by 0.3 m, facing the centre of the wall.
Eigen::Isometry3d pass(int i) {
  const Vector3d eye(0.3 * (static_cast<double>(i) / kStrayFrames - 0.5), 0.03, -1.8);
  return lookFrom(eye + sway(i, 0.01), Vector3d(0.0, 0.0, 0.0));
}

using Spoil = std::function<void(SceneView&)>;

Surface fusePass(const SceneSetup& setup, const Scene& scene, const std::vector<int>& bad,
                 const Spoil& spoil) {
  SceneMap map(setup);
  for (int i = 0; i < kStrayFrames; ++i) {
    SceneView view = look(scene, roomCamera(setup), pass(i));
    if (std::find(bad.begin(), bad.end(), i) != bad.end()) spoil(view);
    map.fuse(view);
  }
  return map.surface();
}

/// Adds patches to a view, at 0.4 to 0.9 times the measured depth. @return their points in W.
Points putPatches(SceneView& view, int side_px, Random& random) {
  Points points;
  constexpr int kAcross = 10, kDown = 8;
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      const int u0 = (2 * i + 1) * view.camera.width / (2 * kAcross);
      const int v0 = (2 * j + 1) * view.camera.height / (2 * kDown);
      const double z_m = (0.4 + 0.5 * random.uniform()) * static_cast<double>(view.at(u0, v0));
      for (int v = v0; v < v0 + side_px; ++v) {
        for (int u = u0; u < u0 + side_px; ++u) {
          view.at(u, v) = static_cast<float>(z_m);
          points.push_back(view.point(u, v, z_m));
        }
      }
    }
  }
  return points;
}

std::vector<Figure> measurePatches(const SceneSetup& setup, int side_px) {
  const Scene scene = makeFurniture();
  Random random(static_cast<uint64_t>(side_px));
  Points patches;
  const Surface surface = fusePass(setup, scene, kOneOf50, [&](SceneView& view) {
    const Points more = putPatches(view, side_px, random);
    patches.insert(patches.end(), more.begin(), more.end());
  });
  const double reach_m = 2.0 * setup.voxel();
  const auto isStray = [&](const Vector3d& p) {
    return scene.distanceToSurface(p) > reach_m &&
           std::any_of(patches.begin(), patches.end(),
                       [&](const Vector3d& patch) { return (p - patch).norm() < 2.0 * reach_m; });
  };
  const Surface strays = partOf(surface, isStray);
  return {atMost("area of strays", 0.0, "cm2", 1.0e4 * areaOf(strays))};
}

/// Additional mesh area away from the scene if the pose of one frame is off by 5 cm.
std::vector<Figure> measureShiftedPose(const SceneSetup& setup, const Vector3d& shift_C) {
  const Scene scene = makeFurniture();
  const double away_m = 2.0 * setup.voxel();
  const double clean_m2 = areaAwayFrom(scene, away_m, fusePass(setup, scene, {}, {}));
  const Surface spoilt =
      fusePass(setup, scene, kOnce, [&](SceneView& view) { view.T_W_C.translate(shift_C); });
  const double more_cm2 = 1.0e4 * (areaAwayFrom(scene, away_m, spoilt) - clean_m2);
  return {atMost("additional area due to the shifted frame", 1.0, "cm2", more_cm2)};
}

constexpr int kGlimpseFrames = 300, kGlimpse = 199;

/// In one of 300 frames, the camera faces a different corner of the room. With mesh/min_support 1,
/// this frame must be enough for a surface.
std::vector<Figure> measureGlimpse(SceneSetup setup) {
  setup.params.mesh.min_support = 1;
  Scene room;
  room.add(Room{Vector3d(-2.0037, -1.3037, -2.0037), Vector3d(2.0037, 1.3037, 2.0037)});
  SceneMap map(setup);
  const SceneCamera camera{80, 60, 131.25};
  const SceneView glimpse =
      look(room, camera, lookFrom(Vector3d(0.3, 0.0, 0.0), Vector3d(-1.9, 0.4, -1.9)));
  for (int i = 0; i < kGlimpseFrames; ++i) {
    const Vector3d eye = sway(i, 0.02);
    map.fuse(i == kGlimpse ? glimpse
                           : look(room, camera, lookFrom(eye, eye + Vector3d(1.0, 0.1, 1.0))));
  }
  Points seen;
  for (int v = 4; v < camera.height - 4; v += 2) {
    for (int u = 4; u < camera.width - 4; u += 2) {
      seen.push_back(glimpse.point(u, v, static_cast<double>(glimpse.at(u, v))));
    }
  }
  // A single image measures the surface only at its pixels.
  const double within_m = std::max(setup.voxel(), 2.8 / camera.focal_px);
  return {atLeast("glimpse in the mesh", 95.0, "%", coveredPercent(seen, map.surface(), within_m))};
}

}  // namespace

void addStrayCases(std::vector<SceneCase>& cases) {
  for (const int side_px : {2, 4}) {
    const std::string side = std::to_string(side_px);
    cases.push_back(
        {"strays", side + " x " + side + " pixels in one frame in 50", true,
         [side_px](const SceneSetup& setup) { return measurePatches(setup, side_px); }});
  }
  const std::pair<const char*, Vector3d> shifts[] = {{"backwards", Vector3d(0.0, 0.0, -0.05)},
                                                     {"forwards", Vector3d(0.0, 0.0, 0.05)},
                                                     {"sideways", Vector3d(0.05, 0.0, 0.0)}};
  for (const auto& [name, shift_C] : shifts) {
    cases.push_back({"strays", std::string("pose 5 cm ") + name + " in one frame", true,
                     [shift_C = shift_C](const SceneSetup& setup) {
                       return measureShiftedPose(setup, shift_C);
                     }});
  }
  cases.push_back({"strays", "corner glimpsed once in 300, min_support 1", true, measureGlimpse});
}

}  // namespace dtsdf
