#include <algorithm>
#include <cmath>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// A camera with small images, since only the number of frames matters.
SceneCamera watchingCamera() { return {80, 60, 65.0}; }

/// Position of the box in frame i. It stays in view: surfaces left behind outside the view could
/// not be cleared.
Vector3d placeOf(int i) {
  return {0.3 + 0.45 * std::sin(0.0311 * i), 0.15 + 0.2 * std::sin(0.0173 * i),
          0.3 + 0.4 * std::sin(0.0233 * i)};
}

/// A camera in a corner of a room observes a box that moves around. The size of the map during the
/// last quarter of the frames is compared with that during the first quarter.
std::vector<Figure> measure(const SceneSetup& setup, int frames) {
  Scene room;
  room.add(Room{Vector3d(-1.2037, -0.9037, -1.2037), Vector3d(1.2037, 0.9037, 1.2037)});
  SceneMap map(setup);
  MapStats early, late;  // maxima during the first and the last quarter
  for (int i = 0; i < frames; ++i) {
    Scene scene = room;
    scene.add(makeBox(placeOf(i), Vector3d(0.25, 0.4, 0.25), 0.01 * i));
    const Vector3d eye(-1.0, -0.6, -1.0);
    map.fuse(look(scene, watchingCamera(), lookFrom(eye + sway(i, 0.02), Vector3d(0.2, 0.1, 0.2))));
    if (i >= frames / 4 && i < frames - frames / 4) continue;
    const MapStats now = map.mapper().stats();
    MapStats& part = i < frames / 4 ? early : late;
    part.blocks = std::max(part.blocks, now.blocks);
    part.voxel_arrays = std::max(part.voxel_arrays, now.voxel_arrays);
    part.map_bytes = std::max(part.map_bytes, now.map_bytes);
  }
  const auto percent = [](size_t is, size_t was) {
    return 100.0 * static_cast<double>(is) / static_cast<double>(was);
  };
  return {atMost("blocks, last quarter relative to first", 105.0, "%",
                 percent(late.blocks, early.blocks)),
          atMost("arrays, last quarter relative to first", 105.0, "%",
                 percent(late.voxel_arrays, early.voxel_arrays)),
          atMost("memory, last quarter relative to first", 105.0, "%",
                 percent(late.map_bytes, early.map_bytes))};
}

}  // namespace

void addMemoryCases(std::vector<SceneCase>& cases) {
  for (const int frames : {400, 2000}) {
    cases.push_back({"memory", "a box moves about for " + std::to_string(frames) + " frames",
                     frames == 400,
                     [frames](const SceneSetup& setup) { return measure(setup, frames); }});
  }
}

}  // namespace dtsdf
