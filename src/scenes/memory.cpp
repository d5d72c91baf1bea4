#include <algorithm>
#include <cmath>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

/// Small images: what counts is the number of frames.
SceneCamera watchingCamera() { return {80, 60, 65.0}; }

/// A way through the room that does not come back to where it was.
Vector3d placeOf(int i) {
  return {1.2 * std::sin(0.0311 * i), 0.7 * std::sin(0.0173 * i), 0.9 * std::sin(0.0233 * i)};
}

/// A camera in a corner of a room watches a box move about.
std::vector<Figure> measure(const SceneSetup& setup) {
  Scene room;
  room.add(Room{Vector3d(-2.0037, -1.3037, -2.0037), Vector3d(2.0037, 1.3037, 2.0037)});
  SceneMap map(setup);
  MapStats early, late;  // the largest in the first and in the last 500 frames
  for (int i = 0; i < 2000; ++i) {
    Scene scene = room;
    scene.add(makeBox(placeOf(i), Vector3d(0.4, 0.6, 0.4), 0.01 * i));
    const Vector3d eye(-1.7, -0.9, -1.7);
    map.fuse(look(scene, watchingCamera(), lookFrom(eye + sway(i, 0.02), Vector3d(0.2, 0.1, 0.2))));
    if (i >= 500 && i < 1500) continue;
    const MapStats now = map.mapper().stats();
    MapStats& part = i < 500 ? early : late;
    part.blocks = std::max(part.blocks, now.blocks);
    part.voxel_arrays = std::max(part.voxel_arrays, now.voxel_arrays);
    part.map_bytes = std::max(part.map_bytes, now.map_bytes);
  }
  const auto percent = [](size_t is, size_t was) {
    return 100.0 * static_cast<double>(is) / static_cast<double>(was);
  };
  return {reported("memory in the first 500 frames", "MiB",
                   static_cast<double>(early.map_bytes) / 1048576.0),
          atMost("blocks, last to first 500 frames", 105.0, "%",
                 percent(late.blocks, early.blocks)),
          atMost("arrays, last to first 500 frames", 105.0, "%",
                 percent(late.voxel_arrays, early.voxel_arrays)),
          atMost("memory, last to first 500 frames", 105.0, "%",
                 percent(late.map_bytes, early.map_bytes))};
}

}  // namespace

void addMemoryCases(std::vector<SceneCase>& cases) {
  cases.push_back({"memory", "a box moves about for 2000 frames", true, measure});
}

}  // namespace dtsdf
