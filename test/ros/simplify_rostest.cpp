/// Tests that mesh simplification is cancelled at once if another call saves a file or the node
/// ends. The cancelled call must report this and must not leave a file.
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "ros/support/output_folder.h"
#include "ros/support/wait.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using SaveMesh = dtsdf_mapping::SaveMesh;

/// Long enough for a call to start, but short compared with the duration of a call.
constexpr std::chrono::milliseconds kStartDelay{150};

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A wavy wall of several hundred thousand triangles.
MapContents makeWaves() {
  constexpr int kWidth = 640, kHeight = 480;
  MapperParams params;
  params.backend = Backend::kCpu;
  params.map.voxel_size_m = 0.0065f;
  const auto mapper = makeMapper(params);
  std::vector<uint16_t> depth_mm(kWidth * kHeight);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double wave = std::sin(0.05 * u) * std::sin(0.04 * v);
      depth_mm[static_cast<size_t>(v * kWidth + u)] = static_cast<uint16_t>(2500.0 + 30.0 * wave);
    }
  }
  DepthFrame frame;
  frame.data = depth_mm.data();
  frame.row_bytes = kWidth * sizeof(uint16_t);
  frame.width = kWidth;
  frame.height = kHeight;
  frame.encoding = DepthEncoding::kUint16;
  frame.unit_m = 0.001f;
  frame.intrinsics = {400.0f, 400.0f, 319.5f, 239.5f};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(mapper->integrate(frame).status, FrameStatus::kFused);
  MapContents contents = mapper->contents();
  contents.map_frame = "map";
  return contents;
}

/// The result of a call to save_mesh.
struct Saved {
  bool answered = false;
  SaveMesh::Response response;
  double seconds = 0.0;
};

Saved saveSimplified(const std::string& node, const std::string& file_name) {
  SaveMesh call;
  call.request.file_name = file_name;
  call.request.simplify_error_m = 0.002;
  Saved saved;
  const Clock::time_point begin = Clock::now();
  saved.answered = callService(node + "/save_mesh", call);
  saved.response = call.response;
  saved.seconds = secondsSince(begin);
  return saved;
}

class Simplify : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ASSERT_TRUE(ros::service::waitForService("/mapping/load_map", 20000));
    folder_ = outputFolder();
    fs::create_directories(folder_);
    saveMap(makeWaves(), folder_ + "/waves.dtsdf");
    ASSERT_TRUE(loadMapFrom("waves.dtsdf").success);
    // The first call also extracts the mesh; the second measures the uninterrupted duration.
    ASSERT_TRUE(saveSimplified("/mapping", "first.ply").response.success);
    const Saved whole = saveSimplified("/mapping", "whole.ply");
    ASSERT_TRUE(whole.response.success) << whole.response.message;
    EXPECT_GT(whole.response.triangles, 1000u);
    EXPECT_GT(whole.response.error_m, 0.0);
    whole_s_ = whole.seconds;
    RecordProperty("seconds_of_the_whole", std::to_string(whole_s_));
    ASSERT_GT(whole_s_, 3.0 * std::chrono::duration<double>(kStartDelay).count());
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  /// Number of files, including partly written ones, whose names contain `begin`.
  static size_t filesNamed(const std::string& begin) {
    size_t count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
      if (entry.path().filename().string().find(begin) != std::string::npos) ++count;
    }
    return count;
  }

  static void expectCancelled(const Saved& saved) {
    ASSERT_TRUE(saved.answered);
    EXPECT_FALSE(saved.response.success);
    EXPECT_NE(saved.response.message.find("cancelled"), std::string::npos)
        << saved.response.message;
    EXPECT_TRUE(saved.response.path.empty());
    EXPECT_EQ(saved.response.triangles, 0u);
    EXPECT_LT(saved.seconds, whole_s_);
  }

  inline static std::string folder_;
  inline static double whole_s_ = 0.0;
};

TEST_F(Simplify, IsCancelledBySavingTheMap) {
  auto slow = std::async(std::launch::async, [] { return saveSimplified("/mapping", "slow.ply"); });
  std::this_thread::sleep_for(kStartDelay);
  EXPECT_TRUE(saveMapAs("meanwhile.dtsdf").success);
  expectCancelled(slow.get());
  EXPECT_EQ(filesNamed("slow"), 0u);
  EXPECT_TRUE(fs::exists(folder_ + "/meanwhile.dtsdf"));
}

TEST_F(Simplify, IsCancelledBySavingAnotherMesh) {
  auto slow = std::async(std::launch::async, [] { return saveSimplified("/mapping", "slow.glb"); });
  std::this_thread::sleep_for(kStartDelay);
  const Saved next = saveSimplified("/mapping", "next.ply");
  EXPECT_TRUE(next.response.success) << next.response.message;
  expectCancelled(slow.get());
  EXPECT_EQ(filesNamed("slow"), 0u);
  EXPECT_TRUE(readBytes(folder_ + "/next.ply") == readBytes(folder_ + "/whole.ply"));
}

/// Stops a separate node with the same map while it is simplifying the mesh.
TEST_F(Simplify, EndsWithTheNode) {
  ros::param::set("/ending/backend", "cpu");
  ros::param::set("/ending/output_directory", folder_);
  ros::param::set("/ending/map/load_file", folder_ + "/waves.dtsdf");
  const pid_t node = fork();
  if (node == 0) {
    execl(DTSDF_MAPPING_NODE, DTSDF_MAPPING_NODE, "__name:=ending", nullptr);
    _exit(127);
  }
  ASSERT_TRUE(ros::service::waitForService("/ending/save_mesh", 20000));
  EXPECT_TRUE(saveSimplified("/ending", "before.ply").response.success);
  auto slow = std::async(std::launch::async, [] { return saveSimplified("/ending", "slow.ply"); });
  std::this_thread::sleep_for(kStartDelay);
  const Clock::time_point begin = Clock::now();
  kill(node, SIGINT);
  int status = 0;
  EXPECT_EQ(waitpid(node, &status, 0), node);
  RecordProperty("seconds_to_the_end", std::to_string(secondsSince(begin)));
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_LT(secondsSince(begin), 10.0);
  const Saved saved = slow.get();  // roscpp may or may not deliver the response
  EXPECT_FALSE(saved.answered && saved.response.success) << saved.response.message;
  EXPECT_EQ(filesNamed("slow"), 0u);
  ros::param::del("/ending");
}

}  // namespace
}  // namespace dtsdf
