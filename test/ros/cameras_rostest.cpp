/// Tests two cameras that share a map: frames are fused in order of their stamps, in whatever order
/// they arrive, and give the same mesh as when fused offline.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <map>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "ros/input/images.h"
#include "ros/input/transforms.h"
#include "ros/support/camera_topics.h"
#include "ros/support/messages.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "simulation/scene.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr int kFramesEach = 9;
const Intrinsics kIntrinsics{80.0f, 80.0f, 47.5f, 35.5f};

struct SentFrame {
  std::string camera;
  sensor_msgs::ImagePtr image;
  sensor_msgs::CameraInfo info;
  geometry_msgs::TransformStamped transform;
};

SentFrame makeFrame(const std::string& camera, const ros::Time& stamp, double lap_s) {
  static const Scene scene = makeRoomScene();
  const Eigen::Isometry3d T_W_C = roomCameraPose(lap_s, 6.0);
  const auto image = boost::make_shared<sensor_msgs::Image>(
      makeImageMessage(makeHeader(stamp, camera), "32FC1", kWidth, kHeight,
                       renderDepth(scene, kIntrinsics, kWidth, kHeight, T_W_C)));
  return {camera, image, makeCameraInfo(*image, kIntrinsics),
          makeTransform("map", camera, T_W_C, stamp)};
}

/// The mesh file of the frames, fused in the given order without a node.
std::string bytesOffline(const std::vector<SentFrame>& frames) {
  const NodeParams params = nodeParams();
  const std::unique_ptr<Mapper> mapper = makeMapper(params.mapper);
  Transforms transforms;
  for (const SentFrame& frame : frames) transforms.take(frame.transform, "test");
  for (const SentFrame& frame : frames) {
    cv_bridge::CvImageConstPtr pixels;
    DepthFrame depth = makeDepthFrame(frame.image, frame.info, pixels);
    depth.T_W_C = *transforms.find("map", frame.camera, frame.image->header.stamp).T_W_C;
    EXPECT_EQ(mapper->integrate(depth).status, FrameStatus::kFused);
  }
  MeshStore store(params.mapper.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  return plyOf(store.assemble(), params.mapper.mesh.colour);
}

class Cameras : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(waitUntil([&] {
      return tf_.getNumSubscribers() > 0 && status_.received() &&
             std::all_of(topics_.begin(), topics_.end(),
                         [](const auto& camera) { return camera.second.isConnected(); });
    }));
  }

  void send(const SentFrame& frame) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(frame.transform);
    tf_.publish(message);
    topics_.at(frame.camera).send(*frame.image, frame.info);
  }

  const dtsdf_mapping::StreamStatus& depthOf(size_t camera) const {
    return status_.status().cameras.at(camera).streams.at(0);
  }

  ros::NodeHandle nh_;
  const std::map<std::string, CameraTopics> topics_{{"front", {nh_, "/front/depth"}},
                                                    {"rear", {nh_, "/rear/depth"}}};
  ros::Publisher tf_ = advertiseUntilExit<tf2_msgs::TFMessage>(nh_, "/tf");
  StatusWatcher status_{nh_};
};

TEST_F(Cameras, StatusNamesTheMissingCamera) {
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().code == dtsdf_mapping::MapStatus::NO_IMAGES &&
           status_.status().message.find(
               "front: no depth image received on '/front/depth/image_rect'") != std::string::npos;
  })) << status_.status().message;
  ASSERT_EQ(status_.status().cameras.size(), 2u);
  EXPECT_EQ(status_.status().cameras[1].name, "rear");
  EXPECT_EQ(depthOf(1).topic, "/rear/depth/image_rect");
  EXPECT_EQ(depthOf(1).received_age_s, -1.0f);
}

TEST_F(Cameras, FramesAreFusedInStampOrder) {
  const ros::Time start = ros::Time::now();
  std::vector<SentFrame> in_order;
  for (int i = 0; i < kFramesEach; ++i) {
    const ros::Time stamp = start + ros::Duration(0.1 * i);
    // Every third pair has equal stamps: the first of `cameras` is then fused first.
    const ros::Time rear_stamp = i % 3 == 0 ? stamp : stamp + ros::Duration(0.04);
    in_order.push_back(makeFrame("front", stamp, 0.3 * i));
    in_order.push_back(makeFrame("rear", rear_stamp, 3.0 + 0.3 * i));
  }
  // Three rear frames always arrive before the corresponding three front frames.
  for (int first = 0; first < kFramesEach; first += 3) {
    for (const char* camera : {"rear", "front"}) {
      for (int i = first; i < first + 3; ++i) send(in_order[2 * i + (camera[0] == 'r' ? 1 : 0)]);
      ros::WallDuration(0.1).sleep();
    }
  }
  ASSERT_TRUE(status_.waitForFused(2 * kFramesEach)) << status_.status().message;
  EXPECT_EQ(status_.status().frames_dropped, 0u);
  EXPECT_EQ(depthOf(0).fused, static_cast<uint64_t>(kFramesEach));
  EXPECT_EQ(depthOf(1).fused, static_cast<uint64_t>(kFramesEach));
  EXPECT_EQ(depthOf(1).last_stamp, in_order.back().image->header.stamp);
  EXPECT_GE(depthOf(1).fused_age_s, 0.0f);
  EXPECT_LT(depthOf(1).fused_age_s, 20.0f);

  const auto saved = saveMesh("cameras.ply");
  ASSERT_TRUE(saved.success) << saved.message;
  const std::string bytes = readBytes(saved.path);
  EXPECT_TRUE(bytes == bytesOffline(in_order));
  std::swap(in_order[0], in_order[1]);
  EXPECT_FALSE(bytes == bytesOffline(in_order))
      << "the order of these frames must matter, otherwise nothing is tested";
  removeOutputFolder();
}

TEST_F(Cameras, LateFramesAreDroppedAndCounted) {
  const ros::Time stamp = ros::Time::now() + ros::Duration(2.0);
  send(makeFrame("rear", stamp, 0.0));
  ASSERT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == stamp; }));
  send(makeFrame("front", stamp - ros::Duration(0.1), 0.0));
  EXPECT_TRUE(status_.waitForDrop("out_of_order", 0));
  EXPECT_EQ(depthOf(0).dropped.at(0).reason, "out_of_order");
  EXPECT_TRUE(depthOf(1).dropped.empty());
  send(makeFrame("front", stamp + ros::Duration(0.1), 0.0));
  EXPECT_TRUE(
      waitUntil([&] { return status_.status().last_fused_stamp == stamp + ros::Duration(0.1); }));
}

TEST_F(Cameras, StampsGoingBackRestartAllCameras) {
  const ros::Time back = ros::Time::now() - ros::Duration(1000.0);
  const uint64_t fused = status_.status().frames_fused;
  SentFrame front = makeFrame("front", back, 0.0);
  SentFrame rear = makeFrame("rear", back, 3.0);
  topics_.at("front").send(*front.image, front.info);
  topics_.at("rear").send(*rear.image, rear.info);
  ASSERT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 2; }));
  // The jump back in time has removed later transforms, so earlier stamps are accepted again.
  tf2_msgs::TFMessage message;
  message.transforms = {front.transform, rear.transform};
  tf_.publish(message);
  EXPECT_TRUE(status_.waitForFused(fused + 2)) << status_.status().message;
}

}  // namespace
}  // namespace dtsdf
