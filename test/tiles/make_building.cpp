/// Writes a recording of an analytic building of ten rooms: make_building FOLDER FRAMES [WIDTH
/// [COLOURS]], with a colour image, half as wide, for each COLOURS-th frame.
/// Rooms of 5 m x 4 m lie along both sides of a corridor; the camera goes into each, turns round in
/// its middle and comes out again.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "support/scene_colours.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr int kRoomsPerSide = 5;
constexpr double kRoomWidth = 5.0, kRoomDepth = 4.0, kCorridor = 2.0, kHeight = 2.6;
constexpr double kWall = 0.12, kDoor = 1.0, kDoorHeight = 2.1;
constexpr double kLength = kRoomsPerSide * kRoomWidth, kWidth = 2.0 * kRoomDepth + kCorridor;

/// A box between two corners.
void addBox(Scene& scene, const Vector3d& min, const Vector3d& max) {
  scene.add(makeBox(0.5 * (min + max), max - min));
}

void addShell(Scene& scene) {
  addBox(scene, {0.0, 0.0, -0.2}, {kLength, kWidth, 0.0});
  addBox(scene, {0.0, 0.0, kHeight}, {kLength, kWidth, kHeight + 0.2});
  addBox(scene, {-0.2, 0.0, 0.0}, {0.0, kWidth, kHeight});
  addBox(scene, {kLength, 0.0, 0.0}, {kLength + 0.2, kWidth, kHeight});
  addBox(scene, {0.0, -0.2, 0.0}, {kLength, 0.0, kHeight});
  addBox(scene, {0.0, kWidth, 0.0}, {kLength, kWidth + 0.2, kHeight});
}

/// The wall between a room and the corridor, with a door in its middle.
void addDoorWall(Scene& scene, double x, double y) {
  const double left = x + 0.5 * (kRoomWidth - kDoor), right = left + kDoor;
  addBox(scene, {x, y, 0.0}, {left, y + kWall, kHeight});
  addBox(scene, {right, y, 0.0}, {x + kRoomWidth, y + kWall, kHeight});
  addBox(scene, {left, y, kDoorHeight}, {right, y + kWall, kHeight});
}

/// A cupboard, a table of a thin plate and a post, each room's in other places.
void addFurniture(Scene& scene, const Vector3d& first, int room) {
  const double turn = 0.3 * room;
  const Vector3d middle = first + Vector3d(0.5 * kRoomWidth, 0.5 * kRoomDepth, 0.0);
  scene.add(makeBox(middle + Vector3d(1.7, 1.1, 0.8), {0.6, 0.9, 1.6}, turn));
  scene.add(makeBox(middle + Vector3d(-1.6, 0.9, 0.72), {1.2, 0.8, 0.02}, 0.5 * turn));
  scene.add(makeBox(middle + Vector3d(-1.6, 0.9, 0.36), {0.1, 0.1, 0.7}, turn));
  scene.add(Rod{middle + Vector3d(1.4, -1.2, 0.0), middle + Vector3d(1.4, -1.2, 1.8), 0.03});
  scene.add(Sphere{middle + Vector3d(-1.5, -1.2, 0.3), 0.3});
}

Vector3d firstCornerOf(int room) {
  const double y = room < kRoomsPerSide ? 0.0 : kRoomDepth + kCorridor;
  return {room % kRoomsPerSide * kRoomWidth, y, 0.0};
}

Scene makeBuilding() {
  Scene scene;
  addShell(scene);
  for (int room = 0; room < 2 * kRoomsPerSide; ++room) {
    const Vector3d first = firstCornerOf(room);
    addFurniture(scene, first, room);
    addDoorWall(scene, first.x(), room < kRoomsPerSide ? kRoomDepth - kWall : first.y());
    if (room % kRoomsPerSide == 0) continue;
    addBox(scene, first - Vector3d(0.5 * kWall, 0.0, 0.0),
           first + Vector3d(0.5 * kWall, kRoomDepth, kHeight));
  }
  return scene;
}

/// Where the camera stands and looks at a share of its way, from 0 to 1.
Eigen::Isometry3d poseAt(double share) {
  const double way = share * 2 * kRoomsPerSide;
  const int room = std::min(static_cast<int>(way), 2 * kRoomsPerSide - 1);
  const double at = way - room;  // in the room's part of the way
  const bool is_low = room < kRoomsPerSide;
  const double inwards = is_low ? -0.5 * kPi : 0.5 * kPi;
  const Vector3d middle = firstCornerOf(room) + Vector3d(0.5 * kRoomWidth, 0.5 * kRoomDepth, 0.0);
  const Vector3d before(middle.x(), 0.5 * kWidth, 0.0);  // the door, in the corridor
  const double in = at < 0.25 ? 4.0 * at : at < 0.75 ? 1.0 : 4.0 * (1.0 - at);
  const double yaw = at < 0.25   ? inwards
                     : at < 0.75 ? inwards + 4.0 * kPi * (at - 0.25)
                                 : inwards + kPi + 0.5 * std::sin(12.0 * at);
  const Vector3d eye = before + in * (middle - before) + Vector3d(0.0, 0.0, 1.4);
  const double pitch = -0.15 + 0.25 * std::sin(40.0 * at);
  return lookAt(eye, eye + Vector3d(std::cos(yaw), std::sin(yaw), std::tan(pitch)),
                Vector3d::UnitZ());
}

/// Waves of colour, other ones in each room.
Colour colourAt(const Vector3d& p_W) {
  const auto channel = [](double x) { return static_cast<uint8_t>(128.0 + 90.0 * std::sin(x)); };
  return {channel(3.0 * p_W.x()), channel(4.0 * p_W.y() + p_W.x()), channel(5.0 * p_W.z())};
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  const int frames = argc > 2 ? std::atoi(argv[2]) : 0, width = argc > 3 ? std::atoi(argv[3]) : 320;
  const int colours = argc > 4 ? std::atoi(argv[4]) : 0;
  if (frames < 2 || width < 16 || colours < 0 || std::filesystem::exists(argv[1])) {
    std::fprintf(stderr,
                 "usage: make_building FOLDER FRAMES [WIDTH [COLOURS]], FOLDER being new\n");
    return 2;
  }
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < frames; ++i) poses.push_back(poseAt(static_cast<double>(i) / (frames - 1)));
  const Scene building = makeBuilding();
  writeSceneRecording(argv[1], building, poses, width, width * 3 / 4);
  if (colours > 0) {
    writeSceneColours(argv[1], building, colourAt, poses, width / 2, width * 3 / 8,
                      static_cast<size_t>(colours));
  }
  return 0;
}
