/// Subscribes to the mesh until the given number of triangles has arrived, but for at most 15 s.
/// Prints the numbers of triangles, visible markers and added markers. Exits with 1 if triangles
/// are missing.
#include <ros/ros.h>

#include <cstdio>
#include <cstdlib>

#include "ros/support/mesh_watcher.h"
#include "ros/support/wait.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "late_listener", ros::init_options::AnonymousName);
  const size_t expected = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
  const dtsdf::MeshWatcher mesh{ros::NodeHandle()};
  const bool complete = dtsdf::waitUntil([&] { return mesh.triangles() >= expected; }, 15.0);
  std::printf("%zu %zu %zu\n", mesh.triangles(), mesh.shown().size(),
              static_cast<size_t>(mesh.addedMarkers()));
  return complete ? 0 : 1;
}
