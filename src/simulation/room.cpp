#include <cmath>

#include "simulation/scene.h"

namespace dtsdf {

namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// A rod that stands on the floor.
Rod makePost(double x, double y, double height_m, double radius_m) {
  return {Vector3d(x, y, 0.0), Vector3d(x, y, height_m), radius_m};
}

}  // namespace

Scene makeRoomScene() {
  Scene scene;
  scene.add(Room{Vector3d(-3.0, -2.5, 0.0), Vector3d(3.0, 2.5, 2.6)});
  // The wall to be seen from both sides: 30 mm thin.
  scene.add(makeBox(Vector3d(0.0, 0.0, 0.85), Vector3d(1.8, 0.03, 1.7)));
  // Plates of 10, 20 and 40 mm that stand on the floor, none aligned with the grid but the first.
  scene.add(makeBox(Vector3d(-0.6, 0.55, 0.4), Vector3d(0.5, 0.01, 0.8)));
  scene.add(makeBox(Vector3d(0.5, 0.55, 0.45), Vector3d(0.5, 0.02, 0.9), 0.6));
  scene.add(makeBox(Vector3d(0.1, -0.55, 0.45), Vector3d(0.5, 0.04, 0.9), -0.35));
  // A table of one thin plate on four rods.
  scene.add(makeBox(Vector3d(-0.7, -0.6, 0.61), Vector3d(0.6, 0.5, 0.02), 0.2));
  for (const double dx : {-0.22, 0.22}) {
    for (const double dy : {-0.17, 0.17}) scene.add(makePost(-0.7 + dx, -0.6 + dy, 0.6, 0.015));
  }
  scene.add(makePost(1.2, 0.25, 1.6, 0.01));
  scene.add(makePost(1.2, -0.35, 1.6, 0.03));
  scene.add(Rod{Vector3d(1.2, -0.32, 1.3), Vector3d(1.2, 0.24, 1.3), 0.02});
  // Something round, and furniture along the walls.
  scene.add(Sphere{Vector3d(0.75, -0.6, 0.2), 0.2});
  scene.add(makeBox(Vector3d(-2.7, 0.8, 0.5), Vector3d(0.6, 1.2, 1.0)));
  scene.add(makeBox(Vector3d(0.8, 2.3, 1.2), Vector3d(1.2, 0.4, 0.02)));
  scene.add(makeBox(Vector3d(2.65, -1.5, 0.35), Vector3d(0.5, 0.5, 0.7), 0.4));
  return scene;
}

std::vector<Sphere> roomBalls(int count, double time_s) {
  constexpr double kLap_s = 10.0, kRadius_m = 0.15;
  std::vector<Sphere> balls;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * kPi * (time_s / kLap_s + static_cast<double>(i) / count);
    const Vector3d centre_W(1.2 * std::cos(angle), 0.9 * std::sin(angle),
                            1.2 + 0.3 * std::sin(3.0 * angle + i));
    balls.push_back({centre_W, kRadius_m});
  }
  return balls;
}

Eigen::Isometry3d roomCameraPose(double time_s, double lap_s) {
  const double angle = 2.0 * kPi * time_s / lap_s;
  const Vector3d eye_W(2.15 * std::cos(angle), 1.75 * std::sin(angle),
                       1.35 + 0.35 * std::sin(2.0 * angle));
  // The gaze swings about the middle, so that the corners of the room come into view as well.
  const Vector3d target_W(0.5 * std::sin(3.0 * angle), 0.4 * std::cos(2.0 * angle),
                          0.75 + 0.25 * std::sin(3.0 * angle + 1.0));
  return lookAt(eye_W, target_W, Vector3d::UnitZ());
}

}  // namespace dtsdf
