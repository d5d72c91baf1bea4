/// Publishes a wavy surface of at least TRIANGLES triangles under the name of the mapping node, in
/// the same way as the node publishes its mesh. Usage: publish_mesh TRIANGLES.
#include <ros/ros.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "kernels/meshing/corner_grid.h"
#include "ros/steps/make_steps.h"
#include "support/grid_mesh.h"

namespace dtsdf {
namespace {

constexpr float kVoxelSize = 0.01f;
constexpr size_t kTrianglesOfBlock = 2 * kBlockSide * kBlockSide;

/// Height above the bottom of the blocks, in voxels.
float heightAt(int x, int y) {
  const auto u = static_cast<float>(x), v = static_cast<float>(y);
  return 4.0f + 2.0f * std::sin(0.31f * u) * std::cos(0.23f * v);
}

BlockMesh sheetIn(const BlockKey& key) {
  BlockMesh mesh;
  mesh.key = key;
  for (int y = 0; y <= kBlockSide; ++y) {
    for (int x = 0; x <= kBlockSide; ++x) {
      const float z = heightAt(kBlockSide * key.x + x, kBlockSide * key.y + y);
      const int edge = edgeNumber(cornerIndex(x, y, static_cast<int>(z)), 2, 0);
      mesh.vertices.push_back(
          {{static_cast<float>(x), static_cast<float>(y), z}, static_cast<uint32_t>(edge)});
    }
  }
  mesh.triangles = gridTriangles(kCornerGridSide);
  return mesh;
}

void publishSheet(size_t triangles) {
  const auto side = static_cast<int>(std::ceil(std::sqrt(triangles / kTrianglesOfBlock + 1.0)));
  ros::NodeHandle private_nh("~");
  NodeParams params;
  params.mapper.map.voxel_size_m = kVoxelSize;
  const std::atomic<double> rate_hz{params.mesh_rate_hz};
  const std::unique_ptr<Step> topics = makeMeshTopicsStep(params, rate_hz);
  topics->advertise({private_nh, private_nh, private_nh, private_nh, private_nh, ""});
  ShownMesh mesh(params.mapper.map);
  MeshChanges changes;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const BlockKey key{x - side / 2, y - side / 2, 0};
      changes.blocks[packKey(key)] = std::make_shared<const BlockMesh>(sheetIn(key));
    }
  }
  apply(changes, mesh.meshes);
  topics->changed(changes);
  std::printf("%zu triangles\n", mesh.meshes.triangleCount());
  std::fflush(stdout);
  for (ros::WallRate rate(50.0); ros::ok(); rate.sleep()) {
    ros::spinOnce();  // serves new subscribers
    mesh.stamp = ros::Time::now();
    topics->publish(&mesh);
  }
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  ros::init(argc, argv, "mapping");
  dtsdf::publishSheet(argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1000000);
  return 0;
}
