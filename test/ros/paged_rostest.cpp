/// Tests a map that is mostly on disk. The published mesh must stay complete, late subscribers must
/// receive all of it, and saved files must equal those of a map in memory.
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/SaveMap.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/mapper.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

class PagedMap : public WallCamera {
 protected:
  static constexpr int kFrames = 100;

  /// Fuses frames while moving along the wall.
  void fly() {
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_NO_FATAL_FAILURE(fuseFrame({1.2 * i, 0.0, 0.0}));
      ASSERT_NO_FATAL_FAILURE(fuseFrame({1.2 * i, 0.0, 0.0}));
      ASSERT_NO_FATAL_FAILURE(fuseFrame({1.2 * i, 0.0, 0.0}));
    }
  }

  dtsdf_mapping::MemoryPart partOf(const std::string& name) {
    for (const dtsdf_mapping::MemoryPart& part : status_.status().memory) {
      if (part.name == name) return part;
    }
    return {};
  }

  /// Checks that the distances returned by the node along the whole wall equal those in `space`.
  void expectSameDistances(Space& space) {
    space.updateDistances();
    dtsdf_mapping::GetDistances call;
    for (int i = 0; i < 10 * kFrames; ++i) {
      geometry_msgs::Point point;
      point.x = 0.12 * i;
      point.y = 0.03 * (i % 7) - 0.1;
      point.z = 0.01 * (i % 130);
      call.request.points.push_back(point);
    }
    const auto is_same = [&] {
      if (!callService("/mapping/get_distances", call) || !call.response.success) {
        return false;
      }
      size_t same = 0;
      for (size_t i = 0; i < call.request.points.size(); ++i) {
        const geometry_msgs::Point& p = call.request.points[i];
        const SpaceDistance expected = space.distanceAt({p.x, p.y, p.z});
        same += bool(call.response.known[i]) == expected.known &&
                call.response.distances[i] == expected.distance_m;
      }
      return same == call.request.points.size();
    };
    EXPECT_TRUE(waitUntil(is_same)) << call.response.message;
    const std::vector<float>& distances = call.response.distances;
    EXPECT_GT(std::count_if(distances.begin(), distances.end(),
                            [](float d) { return std::abs(d) > 0.1f && std::abs(d) < 0.9f; }),
              2 * kFrames);
  }

  /// Saves the map and loads it into memory. Checks that its distances equal those of the node.
  /// Returns the contents of its mesh as a .ply file.
  std::string meshOfSavedMap() {
    const auto saved = saveMapAs("map.dtsdf");
    EXPECT_TRUE(saved.success) << saved.message;
    const MapContents contents = loadMap(saved.path);
    MapperParams params = withSettingsOf(contents, MapperParams());
    params.backend = Backend::kCpu;
    params.space.enabled = true;
    const auto mapper = makeMapper(params, contents);
    MeshStore store(params.map.voxel_size_m);
    store.apply(mapper->updateMesh());
    expectSameDistances(*mapper->space());
    return plyOf(store.assemble(), MeshColour::kAuto);
  }
};

TEST_F(PagedMap, IsShownAndSavedAsAWhole) {
  size_t triangles_on_display = 0;
  {
    const MeshWatcher early(nh_);
    ASSERT_NO_FATAL_FAILURE(fly());
    const auto saved = saveMesh("mesh.ply");
    ASSERT_TRUE(saved.success) << saved.message;
    EXPECT_TRUE(waitUntil([&] { return early.triangles() == saved.triangles; }));
    triangles_on_display = saved.triangles;
    EXPECT_TRUE(readBytes(saved.path) == meshOfSavedMap());
    ASSERT_TRUE(waitUntil([&] { return status_.status().triangles == saved.triangles; }));
  }
  const dtsdf_mapping::MapStatus status = status_.status();
  EXPECT_EQ(status.refused_blocks, 0u);
  EXPECT_GT(status.paged_blocks, status.blocks);
  EXPECT_EQ(status.pages_lost + status.page_failures, 0u) << status.message;
  EXPECT_LE(partOf("mesh").bytes, partOf("mesh").limit_bytes);
  EXPECT_EQ(partOf("mesh").limit_bytes, uint64_t{1} << 18);
  EXPECT_GT(partOf("pages").bytes, status.paged_bytes + 2 * partOf("mesh").bytes);

  const MeshWatcher late(nh_);
  EXPECT_TRUE(waitUntil([&] { return late.triangles() == triangles_on_display; }))
      << late.triangles() << " of " << triangles_on_display;

  // Save the other formats, too.
  for (const char* name : {"mesh.obj", "mesh.stl", "mesh.glb"}) {
    const auto saved = saveMesh(name);
    EXPECT_TRUE(saved.success) << saved.message;
    EXPECT_EQ(saved.triangles, triangles_on_display);
  }
  // On the way back, blocks on disk change and the changes are published.
  for (int i = kFrames; i-- > 0;) ASSERT_NO_FATAL_FAILURE(fuseFrame({1.2 * i, 0.1, 0.0}));
  const auto again = saveMesh("again.ply");
  ASSERT_TRUE(again.success) << again.message;
  EXPECT_TRUE(waitUntil([&] { return late.triangles() == again.triangles; }));
  EXPECT_TRUE(readBytes(again.path) == meshOfSavedMap());
  EXPECT_EQ(status_.status().refused_blocks, 0u);
}

}  // namespace
}  // namespace dtsdf
