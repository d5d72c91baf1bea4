#include <cmath>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kRemovedSide_m = 0.4;
constexpr double kBoardFront_m = kOff_m - 0.11;  // leaves a gap of 0.1 m between board and wall

/// Mesh area away from the true scene, as a percentage of `was_m2`, the same area measured before
/// the object was removed.
double leftPercent(const Scene& truth, const SceneSetup& setup, SceneMap& map, double was_m2) {
  return 100.0 * areaAwayFrom(truth, 2.0 * setup.voxel(), map.surface()) / was_m2;
}

/// Measures how much of the object is left after 10 and after 30 frames without it.
template <class Watch>
std::vector<Figure> measureRemoval(SceneMap& map, const SceneSetup& setup, const Scene& truth,
                                   double was_m2, const Watch& watch) {
  watch(0, 10);
  const double early = leftPercent(truth, setup, map, was_m2);
  watch(10, 30);
  return {reported("left after 10 frames", "%", early),
          atMost("left after 30 frames", 2.0, "%", leftPercent(truth, setup, map, was_m2))};
}

/// Maps a board in front of a wall from `frames` images taken from `distance_m` away. If `frames`
/// exceeds 30, fuses a single image repeatedly.
SceneMap showBoard(const SceneSetup& setup, const Scene& wall, double distance_m, int frames) {
  Scene scene = wall;
  scene.add(boardAt(0.0, 0.0, kBoardFront_m, kRemovedSide_m, kRemovedSide_m));
  SceneMap map(setup);
  SceneCamera camera = roomCamera(setup);
  const Vector3d eye(0.011, 0.007, kBoardFront_m - distance_m);
  if (frames <= 30) {
    map.watch(scene, camera, eye, frames);
  } else {
    camera = {80, 60, 0.5 * camera.focal_px};  // small images, to save time
    map.fuse(look(scene, camera, lookAlongZ(eye)), frames);
  }
  return map;
}

std::vector<Figure> measureBoard(const SceneSetup& setup, double distance_m, int frames) {
  Scene wall;
  wall.add(wallAt(kOff_m));
  SceneMap map = showBoard(setup, wall, distance_m, frames);
  const double was_m2 = areaAwayFrom(wall, 2.0 * setup.voxel(), map.surface());
  return measureRemoval(map, setup, wall, was_m2, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const Vector3d eye = Vector3d(0.0, 0.0, kOff_m - 3.0) + sway(i, 0.01);
      map.fuse(look(wall, roomCamera(setup), lookAlongZ(eye)));
    }
  });
}

/// With fusion/clearing off, nothing should be removed.
std::vector<Figure> measureKept(SceneSetup setup) {
  setup.params.fusion.clearing = false;
  Scene wall;
  wall.add(wallAt(kOff_m));
  SceneMap map = showBoard(setup, wall, 3.0, 30);
  const double was_m2 = areaAwayFrom(wall, 2.0 * setup.voxel(), map.surface());
  map.watch(wall, roomCamera(setup), Vector3d(0.0, 0.0, kOff_m - 3.0), 30);
  const double is_m2 = areaAwayFrom(wall, 2.0 * setup.voxel(), map.surface());
  return {atLeast("left after 30 frames", 99.0, "%", 100.0 * is_m2 / was_m2)};
}

/// The i-th of 30 poses on an arc around the centre of a room, facing the centre.
Eigen::Isometry3d aroundTheMiddle(int i) {
  const double angle = (i - 14.5) / 15.0;  // radians
  const Vector3d eye(2.2 * std::sin(angle), -0.1, -2.2 * std::cos(angle));
  return lookFrom(eye, Vector3d(0.0, 0.05, 0.0));
}

/// A person-sized box in mid-air, more than 1 m from the floor, ceiling and walls of a room.
std::vector<Figure> measurePerson(const SceneSetup& setup) {
  Scene room;
  room.add(Room{Vector3d(-2.5037, -2.0037, -2.5037), Vector3d(2.5037, 2.0037, 2.5037)});
  Scene scene = room;
  scene.add(makeBox(Vector3d(0.0, 0.0, 0.0), Vector3d(0.5, 1.8, 0.4)));
  SceneMap map(setup);
  const auto walk = [&](const Scene& now, int begin, int end) {
    for (int i = begin; i < end; ++i) map.fuse(look(now, roomCamera(setup), aroundTheMiddle(i)));
  };
  walk(scene, 0, 30);
  const double was_m2 = areaAwayFrom(room, 2.0 * setup.voxel(), map.surface());
  return measureRemoval(map, setup, room, was_m2,
                        [&](int begin, int end) { walk(room, begin, end); });
}

/// A board in mid-air in front of a background that is out of range. The floor ensures that frames
/// without the board contain measurements.
std::vector<Figure> measureOutOfRange(SceneSetup setup) {
  setup.params.fusion.max_depth_m = 3.0f;
  Scene background;
  background.add(wallAt(4.0));
  background.add(Plane{Vector3d(0.0, 0.5037, 0.0), -Vector3d::UnitY()});
  Scene scene = background;
  scene.add(boardAt(0.0, 0.0, kOff_m, kRemovedSide_m, kRemovedSide_m));
  SceneMap map(setup);
  const Vector3d eye(0.011, 0.007, -2.0);
  map.watch(scene, roomCamera(setup), eye, 30);
  const double was_m2 = areaAwayFrom(background, 2.0 * setup.voxel(), map.surface());
  return measureRemoval(map, setup, background, was_m2, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      map.fuse(look(background, roomCamera(setup), lookAlongZ(eye + sway(i, 0.01))));
    }
  });
}

}  // namespace

void addRemovedCases(std::vector<SceneCase>& cases) {
  const auto add = [&](const std::string& variant, bool quick,
                       const std::function<std::vector<Figure>(const SceneSetup&)>& measure) {
    cases.push_back({"removed", variant, quick, measure});
  };
  const std::pair<const char*, double> distances[] = {{"3 m", 3.0}, {"2 m", 2.0}, {"0.4 m", 0.4}};
  for (const auto& [text, distance_m] : distances) {
    for (const int frames : {30, 3000}) {
      const bool quick = frames == 30 || distance_m == 0.4;
      add("board, " + std::to_string(frames) + " frames from " + text, quick,
          [distance_m = distance_m, frames](const SceneSetup& setup) {
            return measureBoard(setup, distance_m, frames);
          });
    }
  }
  add("board, 30 frames from 2 m, memory_frames 19", true, [](SceneSetup setup) {
    setup.params.fusion.memory_frames = 19;
    return measureBoard(setup, 2.0, 30);
  });
  add("board, clearing off", true, measureKept);
  add("person in mid-room", true, measurePerson);
  add("background out of range", true, measureOutOfRange);
}

}  // namespace dtsdf
