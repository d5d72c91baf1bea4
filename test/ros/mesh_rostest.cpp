/// Tests the published and saved mesh: chunks (cubes of blocks, one marker each), late subscribers,
/// surface points and services.
#include <dtsdf_mapping/MeshBlocks.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>
#include <sstream>
#include <thread>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "ros/support/blocks_watcher.h"
#include "ros/support/mesh_watcher.h"
#include "ros/support/raw_listener.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;
using visualization_msgs::Marker;

class MeshTest : public WallCamera {
 protected:
  /// Waits until the markers contain as many triangles as the status reports.
  bool waitForMesh(const MeshWatcher& mesh) {
    return waitUntil(
        [&] { return mesh.triangles() > 0 && mesh.triangles() == status_.status().triangles; });
  }

  const std::string folder_ = outputFolder();
};

TEST_F(MeshTest, EmptyMeshIsNotSaved) {
  const auto response = saveMesh("empty.ply");
  EXPECT_FALSE(response.success);
  EXPECT_NE(response.message.find("empty"), std::string::npos) << response.message;
  EXPECT_FALSE(fs::exists(folder_ + "/empty.ply"));
}

TEST_F(MeshTest, NothingIsMeshedWithoutSubscribers) {
  fuseFrames(3);
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().code == dtsdf_mapping::MapStatus::NO_SUBSCRIBER;
  })) << status_.status().message;
  EXPECT_EQ(status_.status().triangles, 0u);
  EXPECT_GT(status_.status().blocks, 0u);
}

TEST_F(MeshTest, MarkersShowTheWallInPlace) {
  const MeshWatcher mesh(nh_);  // subscribes late, and must still get the whole mesh
  ASSERT_TRUE(waitForMesh(mesh));
  EXPECT_GT(mesh.shown().size(), 1u);
  for (const auto& [id, marker] : mesh.shown()) {
    EXPECT_EQ(marker.type, Marker::TRIANGLE_LIST);
    EXPECT_EQ(marker.ns, "mesh");
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_EQ(marker.pose.orientation.w, 1.0);
    EXPECT_EQ(marker.scale.x, 1.0);
    EXPECT_FALSE(marker.frame_locked);
    ASSERT_EQ(marker.points.size() % 3, 0u);
    ASSERT_EQ(marker.colors.size(), marker.points.size());
    for (const geometry_msgs::Point& point : marker.points) {
      EXPECT_NEAR(point.z, 1.0, 0.005);
      EXPECT_LT(std::abs(point.x), 0.7);
    }
  }
}

TEST_F(MeshTest, LateSubscriberGetsTheWholeMesh) {
  const MeshWatcher early(nh_);
  ASSERT_TRUE(waitForMesh(early));

  std::ostringstream command;
  command << DTSDF_LATE_LISTENER << " " << early.triangles();
  FILE* pipe = popen(command.str().c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  size_t triangles = 0, markers = 0, added = 0;
  EXPECT_EQ(std::fscanf(pipe, "%zu %zu %zu", &triangles, &markers, &added), 3);
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_EQ(triangles, early.triangles());
  EXPECT_EQ(markers, early.shown().size());
  EXPECT_EQ(added, markers) << "each chunk should be sent only once";

  clearMap();
  EXPECT_TRUE(waitUntil([&] { return early.shown().empty(); }));
  EXPECT_EQ(early.deletedMarkers(), markers);
}

/// The blocks must contain the same mesh as the markers, and a new subscriber must receive each
/// chunk only once.
TEST_F(MeshTest, BlocksContainTheMeshOfTheMarkers) {
  const MeshWatcher mesh(nh_);
  const BlocksWatcher blocks(nh_);
  fuseFrames(2);
  ASSERT_TRUE(waitForMesh(mesh));
  const BlocksState& state = blocks.state();
  ASSERT_TRUE(waitUntil([&] { return state.triangles() == mesh.triangles(); }));
  EXPECT_EQ(state.frame(), "map");
  EXPECT_EQ(state.chunks().size(), mesh.shown().size());
  EXPECT_EQ(state.stepM(), static_cast<double>(0.05f) / 512);
  for (const std::array<double, 3>& p_W : state.corners()) EXPECT_NEAR(p_W[2], 1.0, 0.005);
  for (const auto& [origin, chunk] : state.chunks()) {
    for (size_t i = 0; i < chunk.normals.size(); i += 2) {
      EXPECT_LT(normalOfPacked(chunk.normals[i], chunk.normals[i + 1]).z, -0.99f);
    }
  }

  using dtsdf_mapping::MeshBlocks;
  RawListener newcomer = listenRaw<MeshBlocks>("/mapping/mesh_blocks");
  BlocksState late;
  bool is_first = true;
  while (late.triangles() < state.triangles()) {
    const auto message = newcomer.readMessage<MeshBlocks>(10.0);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->begins_anew, is_first);
    is_first = false;
    late.take(*message);
  }
  EXPECT_TRUE(late.corners() == state.corners());
  EXPECT_EQ(late.addedChunks(), state.chunks().size());

  clearMap();
  EXPECT_TRUE(waitUntil([&] { return state.chunks().empty(); }));
}

TEST_F(MeshTest, OnlyChangedChunksAreSent) {
  const MeshWatcher mesh(nh_);
  fuseFrames(2);
  ASSERT_TRUE(waitForMesh(mesh));
  const size_t chunks = mesh.shown().size();
  std::set<int> old_ids;
  for (const auto& [id, marker] : mesh.shown()) old_ids.insert(id);
  const uint64_t added = mesh.addedMarkers();

  // None of the old chunks is visible from the new position. The first frame after the jump is
  // dropped, and a surface is meshed only after two frames.
  const uint64_t fused = status_.status().frames_fused;
  for (int i = 0; i < 3; ++i) {
    const ros::Time stamp = camera_.nextStamp();
    camera_.sendTransform(stamp, {20.0, 0.0, 0.0});
    camera_.send(camera_.image(stamp), camera_.info(stamp));
  }
  ASSERT_TRUE(status_.waitForFused(fused + 2));
  ASSERT_TRUE(waitUntil([&] { return mesh.shown().size() > chunks; }));
  ASSERT_TRUE(waitForMesh(mesh));
  EXPECT_EQ(mesh.addedMarkers() - added, mesh.shown().size() - chunks);
  for (const int id : old_ids) EXPECT_EQ(mesh.shown().count(id), 1u);
}

TEST_F(MeshTest, SurfacePointsAreTheVerticesWithNormals) {
  sensor_msgs::PointCloud2 cloud;
  const ros::Subscriber subscriber = nh_.subscribe<sensor_msgs::PointCloud2>(
      "/mapping/surface_points", 1,
      [&](const sensor_msgs::PointCloud2::ConstPtr& message) { cloud = *message; });
  const auto saved = saveMesh("points.ply");
  ASSERT_TRUE(waitUntil([&] { return cloud.width * cloud.height == saved.vertices; }));
  EXPECT_EQ(cloud.header.frame_id, "map");
  std::set<std::string> fields;
  for (const sensor_msgs::PointField& field : cloud.fields) fields.insert(field.name);
  for (const char* name : {"x", "y", "z", "rgb", "normal_x", "normal_y", "normal_z"}) {
    EXPECT_EQ(fields.count(name), 1u) << name;
  }
  const sensor_msgs::PointCloud2ConstIterator<float> p_W(cloud, "x"), normal(cloud, "normal_x");
  EXPECT_NEAR(p_W[2], 1.0f, 0.005f) << "the point should be on the wall";
  EXPECT_LT(normal[2], -0.99f);
}

/// Tests examples/mesh_blocks_to_ply, which documents the format of the blocks.
TEST_F(MeshTest, ExampleWritesTheBlocksThatItReads) {
  const auto saved = saveMesh("saved.ply");
  const std::string path = folder_ + "/read.ply";
  const std::string command =
      std::string(DTSDF_ENVIRONMENT) + " python3 -B " + DTSDF_EXAMPLE + " " + path;
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string header = readBytes(path);
  EXPECT_NE(header.find("element face " + std::to_string(saved.triangles) + "\n"),
            std::string::npos);
  EXPECT_NE(header.find("property double x\n"), std::string::npos);
  // The first vertex is 1 m ahead, and its normal points towards the camera.
  const size_t begin = header.find("end_header\n") + 11;
  double p_W[3];
  float normal[3];
  ASSERT_LT(begin + sizeof(p_W) + sizeof(normal), header.size());
  std::memcpy(p_W, &header[begin], sizeof(p_W));
  std::memcpy(normal, &header[begin + sizeof(p_W)], sizeof(normal));
  EXPECT_NEAR(p_W[2], 1.0, 0.005);
  EXPECT_LT(normal[2], -0.99f);
}

/// A block with a triangle but no vertices is invalid and must be refused.
TEST_F(MeshTest, ExampleRefusesInvalidMeshes) {
  dtsdf_mapping::MeshBlocks message;
  message.step_m = 0.001;
  message.blocks.resize(1);
  message.blocks[0].triangles = {0, 1, 2};
  constexpr bool kLatched = true;
  const ros::Publisher publisher = nh_.advertise<dtsdf_mapping::MeshBlocks>("/blocks", 1, kLatched);
  publisher.publish(message);
  const std::string path = folder_ + "/from_outside.ply";
  const std::string command = std::string(DTSDF_ENVIRONMENT) + " python3 -B " + DTSDF_EXAMPLE +
                              " " + path + " --topic /blocks --wait-s 10";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
  EXPECT_FALSE(fs::exists(path));
}

/// The contents of the files are covered by unit tests.
TEST_F(MeshTest, SavesEveryFormatAndReportsCounts) {
  const auto ply = saveMesh("folder/mesh.ply");
  ASSERT_TRUE(ply.success) << ply.message;
  EXPECT_EQ(ply.path, fs::weakly_canonical(folder_ + "/folder/mesh.ply").string());
  EXPECT_GT(ply.triangles, 0u);
  EXPECT_EQ(ply.error_m, 0.0);
  const std::string bytes = readBytes(ply.path);
  EXPECT_NE(bytes.find("element vertex " + std::to_string(ply.vertices) + "\n"), std::string::npos);
  EXPECT_NE(bytes.find("element face " + std::to_string(ply.triangles) + "\n"), std::string::npos);
  for (const std::string ending : {".stl", ".obj", ".glb"}) {
    const auto saved = saveMesh("mesh" + ending);
    ASSERT_TRUE(saved.success) << saved.message;
    EXPECT_EQ(saved.triangles, ply.triangles);
  }
  EXPECT_TRUE(readBytes(saveMesh("again.ply").path) == bytes);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_TRUE(entry.is_directory() || !meshFormatOf(entry.path().string()).empty())
        << "left behind: " << entry.path();
  }
}

/// All fields except the file name are omitted, so rosservice sets them to zero.
TEST_F(MeshTest, SavingNeedsOnlyAFileName) {
  const std::string command =
      std::string(DTSDF_ENVIRONMENT) +
      " rosservice call /mapping/save_mesh \"file_name: 'by_yaml.ply'\" | grep -q 'success: True'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_TRUE(readBytes(folder_ + "/by_yaml.ply") == readBytes(saveMesh("whole.ply").path));
}

TEST_F(MeshTest, SavesOnlyARegion) {
  const auto whole = saveMesh("whole.ply");
  dtsdf_mapping::SaveMesh call;
  call.request.file_name = "left.ply";
  call.request.region.pose.position.x = -5.0;
  call.request.region.size.x = 10.0;  // up to x = 0
  call.request.region.size.y = call.request.region.size.z = 100.0;
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  EXPECT_GT(call.response.triangles, whole.triangles / 10);
  EXPECT_LT(call.response.triangles, whole.triangles);
  call.request.frame_id = "camera";  // at x = 20 or 0, depending on the tests that ran before
  call.request.region.pose.position.x = 500.0;
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("region"), std::string::npos) << call.response.message;
  call.request.frame_id = "nowhere";
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_NE(call.response.message.find("nowhere"), std::string::npos) << call.response.message;
  call.request.frame_id = "";
  call.request.region.size.x = -1.0;
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("size"), std::string::npos) << call.response.message;
}

TEST_F(MeshTest, SavesASimplifiedMeshWithItsError) {
  const auto whole = saveMesh("whole.ply");
  dtsdf_mapping::SaveMesh call;
  call.request.file_name = "simple.glb";
  call.request.simplify_error_m = 0.01;
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  EXPECT_LT(call.response.triangles, whole.triangles);
  EXPECT_LE(call.response.error_m, 0.01);
  EXPECT_NE(call.response.message.find("m from the unsimplified mesh"), std::string::npos);
  call.request.simplify_error_m = 1e308;
  ASSERT_TRUE(callService("/mapping/save_mesh", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("larger than the whole mesh"), std::string::npos);
  for (const double error_m : {-1.0, std::nan("")}) {
    call.request.simplify_error_m = error_m;
    ASSERT_TRUE(callService("/mapping/save_mesh", call));
    EXPECT_FALSE(call.response.success);
    EXPECT_NE(call.response.message.find("simplify_error_m"), std::string::npos);
  }
}

/// Also tests that calls are served while mapping is paused.
TEST_F(MeshTest, ConcurrentCallsSaveTheSameMesh) {
  pauseMapping(true);
  std::vector<std::thread> callers;
  for (int i = 0; i < 6; ++i) {
    callers.emplace_back([i] { EXPECT_TRUE(saveMesh(std::to_string(i % 3) + ".glb").success); });
  }
  for (std::thread& caller : callers) caller.join();
  const std::string bytes = readBytes(saveMesh("alone.glb").path);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(readBytes(folder_ + "/" + std::to_string(i) + ".glb") == bytes);
  }
  pauseMapping(false);
}

}  // namespace
}  // namespace dtsdf
