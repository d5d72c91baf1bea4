/// Tests that organised point clouds give the same mesh as equivalent depth images.
#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "ros/support/cloud.h"
#include "ros/support/kept_topics.h"
#include "ros/support/messages.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "simulation/scene.h"

namespace dtsdf {
namespace {

constexpr int kCloudWidth = 96, kCloudHeight = 72;
const Intrinsics kCloudCamera{80.0f, 80.0f, 47.5f, 35.5f};

class Clouds : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(waitUntil([&] {
      return clouds_.getNumSubscribers() > 0 && transforms_.getNumSubscribers() > 0 &&
             status_.received();
    }));
  }
  static void TearDownTestSuite() { removeOutputFolder(); }

  ros::NodeHandle nh_;
  ros::Publisher clouds_ =
      advertiseUntilExit<sensor_msgs::PointCloud2>(nh_, "/camera/depth/image_rect");
  ros::Publisher transforms_ = advertiseUntilExit<tf2_msgs::TFMessage>(nh_, "/tf");
  StatusWatcher status_{nh_};
};

TEST_F(Clouds, UnorganisedCloudsAreDroppedWithAdvice) {
  sensor_msgs::PointCloud2 cloud =
      makeCloud(makeHeader(ros::Time::now(), "camera"), kCloudCamera, kCloudWidth, kCloudHeight,
                std::vector<float>(kCloudWidth * kCloudHeight, 1.0f));
  cloud.width *= cloud.height;
  cloud.height = 1;
  clouds_.publish(cloud);
  EXPECT_TRUE(status_.waitForDrop("unorganised", 0));
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().message.find("or organised clouds") != std::string::npos;
  })) << status_.status().message;
}

TEST_F(Clouds, GiveTheSameMeshAsDepthImages) {
  const NodeParams params = nodeParams();
  const std::unique_ptr<Mapper> mapper = makeMapper(params.mapper);
  const Scene room = makeRoomScene();
  const uint64_t fused = status_.status().frames_fused;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d T_W_C = roomCameraPose(0.1 * i, 6.0);
    const std::vector<float> depth_m =
        renderDepth(room, kCloudCamera, kCloudWidth, kCloudHeight, T_W_C);
    const ros::Time stamp = ros::Time::now();
    transforms_.publish(makeTfMessage("map", "camera", T_W_C, stamp));
    clouds_.publish(
        makeCloud(makeHeader(stamp, "camera"), kCloudCamera, kCloudWidth, kCloudHeight, depth_m));
    ASSERT_TRUE(status_.waitForFused(fused + 1 + static_cast<uint64_t>(i)))
        << status_.status().message;
    DepthFrame frame = depthFrameOf(depth_m, kCloudCamera, kCloudWidth, kCloudHeight, T_W_C);
    // Convert the rotation to a quaternion and back, because the node receives a quaternion.
    frame.T_W_C = toIsometry(makeTransform("map", "camera", T_W_C, stamp).transform);
    mapper->integrate(frame);
  }
  MeshStore store(params.mapper.map.voxel_size_m);
  store.apply(mapper->updateMesh());
  const auto saved = saveMesh("clouds.ply");
  ASSERT_TRUE(saved.success) << saved.message;
  EXPECT_TRUE(readBytes(saved.path) == plyOf(store.assemble(), params.mapper.mesh.colour));
  const auto& depth = status_.status().cameras[0].streams[0];
  EXPECT_EQ(depth.fitted_camera.rfind("96 x 72, fx 80, fy 80, cx 47.5, cy 35.5, ", 0), 0u)
      << depth.fitted_camera;
}

}  // namespace
}  // namespace dtsdf
