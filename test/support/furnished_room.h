/// An empty room, a furnished room in which each part looks different, and camera poses in these
/// rooms.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "support/depth_frames.h"

namespace dtsdf {

inline Scene emptyRoom() {
  Scene scene;
  scene.add(Room{Eigen::Vector3d(-2.0, -1.5, 0.0), Eigen::Vector3d(2.0, 1.5, 2.4)});
  return scene;
}

inline Scene roomWithFurniture() {
  Scene scene = emptyRoom();
  scene.add(makeBox({1.2, 0.3, 0.4}, {0.8, 0.6, 0.8}, 0.4));
  scene.add(makeBox({1.6, -0.9, 0.9}, {0.4, 0.5, 1.8}));
  scene.add(Sphere{{0.9, 0.9, 1.0}, 0.3});
  scene.add(makeBox({-1.5, 0.8, 0.3}, {0.6, 0.9, 0.6}, -0.3));
  scene.add(makeBox({-1.7, -1.1, 0.6}, {0.3, 0.4, 1.2}));
  return scene;
}

inline Eigen::Isometry3d cameraTowards(const Eigen::Vector3d& eye, double azimuth,
                                       double elevation = -0.25) {
  const Eigen::Vector3d way(std::cos(azimuth) * std::cos(elevation),
                            std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
  return lookAt(eye, eye + way, Eigen::Vector3d::UnitZ());
}

/// Camera poses at a few positions, facing in all directions.
inline std::vector<Eigen::Isometry3d> viewsAround() {
  std::vector<Eigen::Isometry3d> looks;
  for (const Eigen::Vector3d& eye :
       {Eigen::Vector3d(0.2, -0.1, 1.2), Eigen::Vector3d(-1.0, 0.2, 1.5),
        Eigen::Vector3d(0.3, 1.2, 1.6)}) {
    for (int i = 0; i < 16; ++i) {
      looks.push_back(cameraTowards(eye, 0.3927 * i, i % 2 == 0 ? -0.5 : 0.1));
    }
  }
  return looks;
}

}  // namespace dtsdf
