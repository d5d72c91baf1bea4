#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// Whether a view may affect a point. False only if the point is far enough behind the camera or
/// outside the image, or if the point and its surroundings are hidden by a much nearer surface.
bool isWithinReach(const Scene& scene, const SceneView& view, const Vector3d& p_W, double voxel_m) {
  const double margin_m = 10.0 * voxel_m;
  const Vector3d p_C = view.T_W_C.inverse() * p_W;
  if (p_C.z() < -margin_m) return false;
  const double reach_m = 2.0 * margin_m + std::max(0.0, p_C.z());
  const double half_width = 0.5 * view.camera.width / view.camera.focal_px;
  if (std::abs(p_C.x()) > half_width * reach_m || std::abs(p_C.y()) > half_width * reach_m) {
    return false;
  }
  const Vector3d eye_W = view.T_W_C.translation(), ray_W = p_W - eye_W;
  for (const double dy : {-margin_m, 0.0, margin_m}) {
    for (const double dx : {-margin_m, 0.0, margin_m}) {
      const Vector3d beside_W = ray_W + view.T_W_C.linear() * Vector3d(dx, dy, 0.0);
      const double hit = scene.intersect(eye_W, beside_W);
      if (!(hit * beside_W.norm() < beside_W.norm() - margin_m)) return true;
    }
  }
  return false;
}

struct ByteComparison {
  size_t compared = 0, changed = 0;
};

/// The first voxel of each voxel array, by block and direction.
using ArrayWords = std::map<std::pair<PackedKey, int>, const uint64_t*>;

ArrayWords arraysOf(const MapContents& contents) {
  ArrayWords arrays;
  const uint64_t* words = contents.voxels.data();
  for (const MapBlock& block : contents.blocks) {
    for (int d = 0; d < 6; ++d) {
      if (!(block.directions >> d & 1)) continue;
      arrays[{packedKeyOf(block.key), d}] = words;
      words += kBlockSide * kBlockSide * kBlockSide;
    }
  }
  return arrays;
}

/// Compares the voxels that no frame may affect, except those that were all zero before.
ByteComparison compareOutside(const MapContents& before, const MapContents& after, double voxel_m,
                              const Zone& isReached) {
  ByteComparison result;
  const ArrayWords then = arraysOf(before), now = arraysOf(after);
  for (const MapBlock& block : before.blocks) {
    for (int i = 0; i < kBlockSide * kBlockSide * kBlockSide; ++i) {
      const Vector3d offset(i % kBlockSide, i / kBlockSide % kBlockSide,
                            i / (kBlockSide * kBlockSide));
      const Vector3d p =
          voxel_m * (kBlockSide * Vector3d(block.key.x, block.key.y, block.key.z) + offset);
      if (isReached(p)) continue;
      for (int d = 0; d < 6; ++d) {
        const std::pair<PackedKey, int> place{packedKeyOf(block.key), d};
        const auto was = then.find(place), is = now.find(place);
        if (was == then.end() || was->second[i] == 0) continue;
        ++result.compared;
        result.changed += is == now.end() || is->second[i] != was->second[i];
      }
    }
  }
  return result;
}

/// Maps a room in all directions, then puts a board in front of a wall and fuses ten more frames.
/// These frames must not change voxels that are outside their images or hidden by the board.
std::vector<Figure> measureBytes(const SceneSetup& setup) {
  Scene scene;
  scene.add(Room{Vector3d(-1.5037, -1.0037, -1.5037), Vector3d(1.5037, 1.0037, 1.5037)});
  const SceneCamera camera = coarseCamera();
  SceneMap map(setup);
  for (int i = 0; i < 24; ++i) {
    const Vector3d eye = sway(i, 0.02), ahead(std::sin(0.5236 * i), 0.1, std::cos(0.5236 * i));
    map.fuse(look(scene, camera, lookFrom(eye, eye + ahead)));
  }
  const MapContents before = map.mapper().contents();
  scene.add(boardAt(0.0, 0.0, 0.8037, 0.8, 0.8));
  std::vector<SceneView> views;
  for (int i = 0; i < 10; ++i) {
    views.push_back(look(scene, camera, lookAlongZ(sway(i, 0.02))));
    map.fuse(views.back());
  }
  const auto isReached = [&](const Vector3d& p_W) {
    return std::any_of(views.begin(), views.end(), [&](const SceneView& view) {
      return isWithinReach(scene, view, p_W, setup.voxel());
    });
  };
  const ByteComparison result =
      compareOutside(before, map.mapper().contents(), setup.voxel(), isReached);
  return {atLeast("voxels out of reach", 1000.0, "", static_cast<double>(result.compared)),
          atMost("of these changed", 0.0, "", static_cast<double>(result.changed))};
}

constexpr double kUncontradictedSide_m = 0.4, kUncontradictedFront_m = kOff_m - 0.5;

/// Discards all measurements nearer than `nearer_m`.
void blind(SceneView& view, double nearer_m) {
  for (float& z : view.depth_m) z = static_cast<double>(z) < nearer_m ? 0.0f : z;
}

/// Maps a board that only some frames measure; all others have no depth at its pixels.
std::vector<Figure> measureGaps(const SceneSetup& setup,
                                const std::function<bool(int)>& isMeasured) {
  constexpr double kDistance_m = 1.5;
  Scene scene;
  scene.add(wallAt(kOff_m));
  scene.add(
      boardAt(0.0, 0.0, kUncontradictedFront_m, kUncontradictedSide_m, kUncontradictedSide_m));
  SceneMap map(setup);
  for (int i = 0; i < 90; ++i) {
    const Vector3d eye(0.011, 0.007, kUncontradictedFront_m - kDistance_m);
    SceneView view = look(scene, roomCamera(setup), lookAlongZ(eye + sway(i, 0.01)));
    if (!isMeasured(i)) blind(view, kDistance_m + 0.2);
    map.fuse(view);
  }
  const Points front = pointsOnRectangle(Vector3d(0.0, 0.0, kUncontradictedFront_m),
                                         {0.5 * kUncontradictedSide_m, 0.0, 0.0},
                                         {0.0, 0.5 * kUncontradictedSide_m, 0.0}, 0.005);
  return {
      atLeast("board in the mesh", 99.0, "%", coveredPercent(front, map.surface(), setup.voxel()))};
}

/// Area near a rod along y, excluding its ends.
double areaNearRod(const Surface& surface, double x_m, double reach_m) {
  const Surface near = partOf(surface, [&](const Vector3d& p) {
    return std::hypot(p.x() - x_m, p.z() - kOff_m) < reach_m && std::abs(p.y()) < 0.12;
  });
  return areaOf(refine(near, 0.002), [](const Vector3d& p) { return std::abs(p.y()) < 0.07; });
}

/// Maps rods from close by, then from a distance at which they are thinner than a pixel. The
/// distant frames must not remove them, as a pixel that measures the wall may also contain a rod.
std::vector<Figure> measureRods(const SceneSetup& setup) {
  // Diameters in mm, and x in m.
  const std::pair<double, double> rods[] = {{5.0, -0.0513}, {10.0, 0.0487}};
  Scene scene;
  scene.add(wallAt(kOff_m + 0.6));
  for (const auto& [diameter_mm, x_m] : rods) {
    scene.add(Rod{Vector3d(x_m, -0.1, kOff_m), Vector3d(x_m, 0.1, kOff_m), 0.0005 * diameter_mm});
  }
  SceneMap map(setup);
  map.watch(scene, {320, 280, 525.0}, Vector3d(0.0, 0.0, -0.5), 30, 0.015);
  const Surface before = map.surface();
  map.watch(scene, roomCamera(setup), Vector3d(0.0, 0.0, -3.0), 100, 0.015);
  const Surface after = map.surface();
  std::vector<Figure> figures;
  for (const auto& [diameter_mm, x_m] : rods) {
    const double reach_m = 0.0005 * diameter_mm + 2.0 * setup.voxel();
    const double was_m2 = areaNearRod(before, x_m, reach_m);
    const double is_m2 = areaNearRod(after, x_m, reach_m);
    const std::string of = " of the " + std::to_string(static_cast<int>(diameter_mm)) + " mm rod";
    figures.push_back(
        atLeast("area kept" + of, 95.0, "%", was_m2 > 0.0 ? 100.0 * is_m2 / was_m2 : 0.0));
  }
  return figures;
}

}  // namespace

void addUncontradictedCases(std::vector<SceneCase>& cases) {
  const auto add = [&](const std::string& variant,
                       const std::function<std::vector<Figure>(const SceneSetup&)>& measure) {
    cases.push_back({"uncontradicted", variant, true, measure});
  };
  add("out of view or hidden", measureBytes);
  add("measured in every third frame",
      [](const SceneSetup& setup) { return measureGaps(setup, [](int i) { return i % 3 == 0; }); });
  add("measured in the first 20 of 90 frames",
      [](const SceneSetup& setup) { return measureGaps(setup, [](int i) { return i < 20; }); });
  add("rods from 0.5 m, then 100 frames from 3 m", measureRods);
}

}  // namespace dtsdf
