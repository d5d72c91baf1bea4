/// Tests pose corrections while mapping continues. The corrected map must be identical to the one
/// that reconstruct builds from the journal and the corrected poses.
#include <dtsdf_mapping/CorrectPoses.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <future>

#include "io/trajectory.h"
#include "ros/support/blocks_watcher.h"
#include "ros/support/mesh_of_map.h"
#include "ros/support/output_folder.h"
#include "ros/support/room_camera.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

constexpr double kPeriod_s = 1.0 / 15.0;

/// Drift of camera pose `i`.
Eigen::Isometry3d drift(int i) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(0.001 * i, Eigen::Vector3d::UnitZ()));
  T.translation() = Eigen::Vector3d(0.0, 0.005 * i, 0.0);
  return T;
}

Eigen::Isometry3d truth(int i) { return roomCameraPose(kPeriod_s * i); }
Eigen::Isometry3d drifted(int i) { return drift(i) * truth(i); }

template <class Service>
std::string saved(const std::string& service, const std::string& name) {
  Service call;
  call.request.file_name = name;
  EXPECT_TRUE(callService(service, call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  return readBytes(call.response.path);
}

using PoseOf = Eigen::Isometry3d (*)(int);
using Answer = dtsdf_mapping::CorrectPoses::Response;

Answer callCorrect(const std::string& node, const std::string& file_name,
                   const std::string& frame_id = "", const std::string& child_frame = "") {
  dtsdf_mapping::CorrectPoses call;
  call.request.file_name = file_name;
  call.request.frame_id = frame_id;
  call.request.child_frame = child_frame;
  callService(node + "/correct_poses", call);
  return call.response;
}

class Correction : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(camera_.connect());
    ASSERT_TRUE(waitUntil([&] { return status_.received(); }));
    fs::create_directories(folder_);
    clearMap();
    start_ = ros::Time(std::ceil(currentImageTime_s()));
    ASSERT_TRUE(waitUntil([&] { return hasReceivedTransform(); })) << status_.status().message;
  }

  /// Sends a transform and returns whether the node has received any from this test yet. A busy
  /// node may connect late.
  bool hasReceivedTransform() {
    camera_.sendTransform("map", "base", Eigen::Isometry3d::Identity(),
                          start_ - ros::Duration(0.5));
    const dtsdf_mapping::MapStatus& status = status_.status();
    return status.transform_age_s >= 0.0f &&
           status.header.stamp - ros::Duration(status.transform_age_s) > begun_;
  }
  void TearDown() override {
    last_s_ = stampOf(sent_).toSec();
    last_at_ = ros::WallTime::now();
  }

  /// Stamp of the last image plus the wall time since it was sent. On a busy machine, stamps fall
  /// behind the wall time.
  static double currentImageTime_s() {
    if (last_s_ == 0.0) return ros::Time::now().toSec();
    return last_s_ + (ros::WallTime::now() - last_at_).toSec();
  }
  static void TearDownTestSuite() { removeOutputFolder(); }

  std::string in(const std::string& name) const { return folder_ + "/" + name; }

  /// Stamps are in whole milliseconds, which a trajectory file represents exactly.
  ros::Time stampOf(int i) const { return start_ + ros::Duration(i / 15, (i % 15) * 66000000); }

  void send(PoseOf poseOf) {
    const ros::Time stamp = stampOf(sent_);
    camera_.sendTransform("map", "base", poseOf(sent_) * mount().inverse(), stamp);
    camera_.sendTransform("base", "camera", mount(), stamp);
    camera_.see(truth(sent_++), stamp);
  }

  void drive(int count, PoseOf poseOf) {
    const uint64_t fused = status_.status().frames_fused;
    for (int i = 0; i < count; ++i) {
      send(poseOf);
      if (i % 8 == 7) {
        // Do not send more images than fit into the queue.
        ASSERT_TRUE(status_.waitForFused(fused + i - 1)) << status_.status().message;
      }
    }
    ASSERT_TRUE(status_.waitForFused(fused + count)) << status_.status().message;
  }

  std::vector<StampedPose> posesOf(PoseOf poseOf, int step = 1) const {
    std::vector<StampedPose> poses;
    for (int i = 0; i < sent_; i += step) poses.push_back({stampOf(i).toSec(), poseOf(i)});
    return poses;
  }

  /// The true path of the frame `base`, which the parameter corrections/path_frame names.
  nav_msgs::Path truthOfBase() const {
    nav_msgs::Path path;
    path.header.frame_id = "map";
    for (int i = 0; i < sent_; i += 4) {
      const Eigen::Isometry3d T_W_B = truth(i) * mount().inverse();
      geometry_msgs::PoseStamped pose;
      pose.header.stamp = stampOf(i);
      pose.pose.position.x = T_W_B.translation().x();
      pose.pose.position.y = T_W_B.translation().y();
      pose.pose.position.z = T_W_B.translation().z();
      const Eigen::Quaterniond q(T_W_B.linear());
      pose.pose.orientation.x = q.x();
      pose.pose.orientation.y = q.y();
      pose.pose.orientation.z = q.z();
      pose.pose.orientation.w = q.w();
      path.poses.push_back(pose);
    }
    return path;
  }

  /// Contents of the map and mesh files that reconstruct writes.
  struct Made {
    std::string map, mesh;
  };
  Made reconstructed(const std::string& poses_file = "",
                     const std::string& folder = "journals") const {
    const std::string command = std::string(DTSDF_RECONSTRUCT) + " " + newestJournalIn(in(folder)) +
                                " --backend cpu --save-map " + in("again.dtsdf") + " --mesh " +
                                in("again.ply") +
                                (poses_file.empty() ? "" : " --poses " + in(poses_file)) + " > " +
                                in("reconstruct.log") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << readBytes(in("reconstruct.log"));
    return {readBytes(in("again.dtsdf")), readBytes(in("again.ply"))};
  }

  static std::string map() { return saved<dtsdf_mapping::SaveMap>("/mapping/save_map", "m.dtsdf"); }
  static std::string mesh() {
    return saved<dtsdf_mapping::SaveMesh>("/mapping/save_mesh", "m.ply");
  }

  /// Checks that reconstruct restores the map from the journal. Retries, because the last records
  /// may not be in the file yet.
  void expectJournalRestoresMap() const {
    const std::string now = map();
    ASSERT_FALSE(now.empty());
    EXPECT_TRUE(waitUntil([&] { return reconstructed().map == now; }))
        << readBytes(in("reconstruct.log"));
  }

  ros::NodeHandle nh_;
  RoomCamera camera_{nh_};
  const OdometryWatcher transforms_{nh_};
  const StatusWatcher status_{nh_};
  const std::string folder_ = outputFolder();
  const ros::Time begun_ = ros::Time::now();
  ros::Time start_;
  int sent_ = 0;
  static double last_s_;
  static ros::WallTime last_at_;
};
double Correction::last_s_ = 0.0;
ros::WallTime Correction::last_at_;

TEST_F(Correction, GivesTheSameMapAsReconstruct) {
  const BlocksWatcher blocks(nh_);
  drive(40, drifted);
  saveTrajectory(posesOf(truth, 3), in("poses.txt"));
  expectJournalRestoresMap();  // the journal is complete
  const Made expected = reconstructed("poses.txt");
  const std::string before = map();
  ASSERT_FALSE(before == expected.map);
  const size_t chunks = blocks.state().addedChunks();

  const Answer answer = callCorrect("/mapping", "poses.txt");
  ASSERT_TRUE(answer.success) << answer.message;
  EXPECT_EQ(answer.moved, 39u) << "all images except the first have drifted";
  EXPECT_EQ(answer.fused, 40u);
  EXPECT_GT(answer.seconds, 0.0);
  EXPECT_TRUE(map() == expected.map);
  EXPECT_TRUE(mesh() == expected.mesh);
  expectJournalRestoresMap();
  EXPECT_TRUE(waitUntil([&] { return status_.status().last_correction == answer.message; }))
      << status_.status().last_correction;
  // Subscribers receive the corrected mesh.
  const MeshOfMap corrected = meshOfMap(in("again.dtsdf"));
  EXPECT_TRUE(waitUntil([&] { return status_.status().triangles == corrected.triangles; }));
  EXPECT_TRUE(waitUntil([&] { return blocks.state().triangles() == corrected.shown; }))
      << blocks.state().triangles() << " of " << corrected.shown << " triangles";
  EXPECT_GT(blocks.state().addedChunks(), chunks);

  // New frames with the same drift are fused relative to the corrected frames.
  drive(10, drifted);
  expectJournalRestoresMap();
}

TEST_F(Correction, MayBeGivenAsAPathOfTheBase) {
  ros::Publisher topic = nh_.advertise<nav_msgs::Path>("/corrected_path", 1);
  drive(24, drifted);
  ASSERT_TRUE(waitUntil([&] { return topic.getNumSubscribers() > 0; }));
  const std::string before = map(), last = status_.status().last_correction;
  topic.publish(truthOfBase());
  ASSERT_TRUE(waitUntil([&] { return status_.status().last_correction != last; }));
  EXPECT_EQ(status_.status().last_correction.find("23 frames moved"), 0u)
      << status_.status().last_correction;
  EXPECT_FALSE(map() == before);
  expectJournalRestoresMap();
  saveTrajectory(posesOf(truth, 4), in("same.txt"));
  const Answer same = callCorrect("/mapping", "same.txt");
  EXPECT_TRUE(same.success) << same.message;
  EXPECT_EQ(same.moved, 0u) << "the same poses must not move the map again";
}

TEST_F(Correction, IsRefusedWithAReasonIfInvalid) {
  saveTrajectory({{1.0, truth(0)}}, in("early.txt"));
  Answer answer = callCorrect("/mapping", "early.txt");
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("no frame has been fused"), std::string::npos) << answer.message;
  drive(12, drifted);
  const std::string before = map();
  const auto expectRefused = [&](const std::string& name, const std::string& word,
                                 const std::string& frame = "", const std::string& child = "") {
    answer = callCorrect("/mapping", name, frame, child);
    EXPECT_FALSE(answer.success) << name;
    EXPECT_NE(answer.message.find(word), std::string::npos) << answer.message;
    EXPECT_TRUE(map() == before) << "changed by " << name;
  };
  expectRefused("early.txt", "no corrected pose matches the stamp of an image");
  std::vector<StampedPose> far = posesOf(truth);
  far[3].T_W_C.translation().x() += 1e4;
  saveTrajectory(far, in("far.txt"));
  expectRefused("far.txt", "10000 m from where its image was fused");
  writeBytes(in("nan.txt"), std::to_string(stampOf(3).toSec()) + " nan 0 0 0 0 0 1\n");
  expectRefused("nan.txt", "nan.txt");
  expectRefused("missing.txt", "missing.txt");
  expectRefused("/nowhere/poses.txt", "no such file");  // poses may be read from any folder
  saveTrajectory(posesOf(truth), in("fine.txt"));
  expectRefused("fine.txt", "'nowhere'", "nowhere");
  expectRefused("fine.txt", "'nowhere'", "", "nowhere");
  EXPECT_TRUE(callCorrect("/mapping", "fine.txt").success);
}

TEST_F(Correction, StatusSaysWhyAPathIsRefused) {
  ros::Publisher topic = nh_.advertise<nav_msgs::Path>("/corrected_path", 1);
  drive(12, drifted);
  ASSERT_TRUE(waitUntil([&] { return topic.getNumSubscribers() > 0; }));
  const std::string before = map();
  const auto expectRefused = [&](const std::string& frame, double x, const std::string& word) {
    nav_msgs::Path path;
    path.header.frame_id = frame;
    path.poses.resize(1);
    path.poses[0].header.stamp = stampOf(3);
    path.poses[0].pose.position.x = x;
    topic.publish(path);
    EXPECT_TRUE(waitUntil([&] {
      const std::string& last = status_.status().last_correction;
      return last.find("refused: ") == 0 && last.find(word) != std::string::npos;
    })) << status_.status().last_correction;
    EXPECT_TRUE(map() == before) << word;
  };
  expectRefused("map", std::nan(""), "not finite");
  expectRefused("map", 1e4, "m from where its image was fused");
  expectRefused("nowhere", 0.0, "'nowhere'");
}

TEST_F(Correction, MappingContinuesMeanwhile) {
  drive(60, drifted);
  saveTrajectory(posesOf(truth), in("live.txt"));
  const uint64_t dropped = status_.status().frames_dropped;
  std::future<Answer> answer =
      std::async(std::launch::async, callCorrect, "/mapping", "live.txt", "", "");
  ASSERT_TRUE(waitUntil([&] { return status_.status().correction_total > 0; }));
  drive(4, drifted);
  drive(41, truth);  // from here on, the SLAM system provides true poses
  const Answer done = answer.get();
  ASSERT_TRUE(done.success) << done.message;
  EXPECT_GT(done.fused, 60u) << "images fused during the correction should be included";
  EXPECT_EQ(status_.status().frames_dropped, dropped);
  expectJournalRestoresMap();
  // The correction also moved the 4 drifted images that were fused while it ran, so only the
  // drift since the last corrected image remains. The 41 images after them have true poses and need
  // not move.
  saveTrajectory(posesOf(truth), in("all.txt"));
  const Answer rest = callCorrect("/mapping", "all.txt");
  ASSERT_TRUE(rest.success) << rest.message;
  EXPECT_EQ(rest.moved, 4u);
  const std::string by = "by up to ";
  ASSERT_NE(rest.message.find(by), std::string::npos) << rest.message;
  EXPECT_LT(std::stod(rest.message.substr(rest.message.find(by) + by.size())), 0.03);
}

TEST_F(Correction, APathReplacesAWaitingCorrection) {
  ros::Publisher topic = nh_.advertise<nav_msgs::Path>("/corrected_path", 1);
  drive(60, drifted);
  ASSERT_TRUE(waitUntil([&] { return topic.getNumSubscribers() > 0; }));
  saveTrajectory(posesOf(truth), in("replaced.txt"));
  const auto call = [] { return callCorrect("/mapping", "replaced.txt"); };
  std::future<Answer> first = std::async(std::launch::async, call);
  ASSERT_TRUE(waitUntil([&] { return status_.status().correction_total > 0; }));
  std::future<Answer> second = std::async(std::launch::async, call);
  EXPECT_TRUE(waitUntil([&] {
    topic.publish(truthOfBase());
    return second.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }));
  EXPECT_NE(second.get().message.find("a newer correction"), std::string::npos);
  clearMap();
  first.wait();
}

TEST_F(Correction, EndsWhenTheMapIsCleared) {
  drive(60, drifted);
  saveTrajectory(posesOf(truth), in("empty.txt"));
  std::future<Answer> answer =
      std::async(std::launch::async, callCorrect, "/mapping", "empty.txt", "", "");
  ASSERT_TRUE(waitUntil([&] { return status_.status().correction_total > 0; }));
  clearMap();
  const Answer refused = answer.get();
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("has been emptied"), std::string::npos) << refused.message;
  drive(3, truth);
  expectJournalRestoresMap();
}

/// Kills a separate node during a correction. The node's journal must restore either the old map or
/// the corrected map.
TEST_F(Correction, KillingTheNodeLeavesAValidJournal) {
  ros::param::set("/second/backend", "cpu");
  ros::param::set("/second/threads", 1);
  ros::param::set("/second/map/voxel_size_m", 0.05);
  ros::param::set("/second/output_directory", folder_);
  int corrected_maps = 0;
  for (const double after_s : {0.02, 0.2, 20.0}) {
    const std::string folder = "killed" + std::to_string(after_s);
    ros::param::set("/second/journal/folder", in(folder));
    const pid_t node = fork();
    if (node == 0) {
      execl(DTSDF_MAPPING_NODE, DTSDF_MAPPING_NODE, "__name:=second",
            "depth/image_rect:=/camera/depth/image_rect",
            "depth/camera_info:=/camera/depth/camera_info", nullptr);
      _exit(127);
    }
    dtsdf_mapping::MapStatus second;
    const ros::Subscriber subscriber = nh_.subscribe<dtsdf_mapping::MapStatus>(
        "/second/status", 1,
        [&](const dtsdf_mapping::MapStatus::ConstPtr& message) { second = *message; });
    ASSERT_TRUE(waitUntil([&] { return !second.backend.empty(); }));
    ASSERT_TRUE(camera_.connect(2));
    drive(30, drifted);
    EXPECT_TRUE(waitUntil([&] { return second.frames_fused >= 25; })) << second.message;
    ros::WallDuration(1.2).sleep();
    saveTrajectory(posesOf(truth), in("kill.txt"));
    const std::string before = saved<dtsdf_mapping::SaveMap>("/second/save_map", "before.dtsdf");
    EXPECT_TRUE(waitUntil([&] { return reconstructed("", folder).map == before; }));
    const std::string corrected = reconstructed("kill.txt", folder).map;
    std::future<Answer> answer =
        std::async(std::launch::async, callCorrect, "/second", "kill.txt", "", "");
    const std::future_status done = answer.wait_for(std::chrono::duration<double>(after_s));
    // The last record may not be in the file yet.
    if (done == std::future_status::ready) ros::WallDuration(1.0).sleep();
    kill(node, SIGKILL);
    int result = 0;
    EXPECT_EQ(waitpid(node, &result, 0), node);
    answer.wait();
    const std::string after = reconstructed("", folder).map;
    EXPECT_TRUE(after == before || after == corrected) << "killed after " << after_s << " s";
    if (after == corrected) ++corrected_maps;
  }
  ros::param::del("/second");
  EXPECT_GT(corrected_maps, 0) << "at least one correction should have been completed";
}

TEST_F(Correction, NeedsAJournal) {
  ros::param::set("/third/backend", "cpu");
  ros::param::set("/third/output_directory", folder_);
  const pid_t node = fork();
  if (node == 0) {
    execl(DTSDF_MAPPING_NODE, DTSDF_MAPPING_NODE, "__name:=third", nullptr);
    _exit(127);
  }
  EXPECT_TRUE(ros::service::waitForService("/third/correct_poses", 20000));
  saveTrajectory({{1.0, truth(0)}}, in("third.txt"));
  const Answer answer = callCorrect("/third", "third.txt");
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("journal/folder"), std::string::npos) << answer.message;
  kill(node, SIGINT);
  int result = 0;
  EXPECT_EQ(waitpid(node, &result, 0), node);
  ros::param::del("/third");
}

}  // namespace
}  // namespace dtsdf
