/// Frames that are wrong, late or alone: each is fused with its true pose, or dropped and counted
/// under its reason. What is wrong with images and transforms is for ros_parts_test, one by one.
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <ros/master.h>
#include <sensor_msgs/CompressedImage.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <string>
#include <vector>

#include "ros/input/published_topics.h"
#include "ros/support/messages.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

class Input : public WallCamera {
 protected:
  /// Sends a frame that has a transform, but may be spoilt, and waits for it to be dropped.
  void expectDrop(const std::string& reason, const sensor_msgs::Image& image,
                  const sensor_msgs::CameraInfo& info) {
    const uint64_t dropped = status_.dropped(reason);
    const uint64_t fused = status_.status().frames_fused;
    camera_.sendTransform(image.header.stamp);
    camera_.send(image, info);
    EXPECT_TRUE(status_.waitForDrop(reason, dropped)) << reason;
    EXPECT_EQ(status_.status().frames_fused, fused);
  }

  void expectFused(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) {
    const uint64_t fused = status_.status().frames_fused;
    camera_.sendTransform(image.header.stamp);
    camera_.send(image, info);
    EXPECT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
  }

  void expectGoodFrameFused() {
    const ros::Time stamp = camera_.nextStamp();
    expectFused(camera_.image(stamp), camera_.info(stamp));
    EXPECT_TRUE(waitUntil([&] { return status_.status().last_fused_stamp == stamp; }));
  }
};

// Before any frame was fused, the status has to say what is missing.
TEST_F(Input, StatusSaysThatImagesAreMissing) {
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().message.find("no depth image received on '/camera/depth/image_rect'") !=
           std::string::npos;
  })) << status_.status().message;
  EXPECT_EQ(status_.status().level, dtsdf_mapping::MapStatus::WARN);
}

TEST_F(Input, TopicsOfDepthAreFound) {
  const ros::Publisher compressed =
      nh_.advertise<sensor_msgs::CompressedImage>("/b/depth/image_raw/compressedDepth", 1);
  const ros::Publisher colour = nh_.advertise<sensor_msgs::Image>("/b/rgb/image_raw", 1);
  using Names = std::vector<std::string>;
  const PublishedTopics topics = findPublishedTopics();
  EXPECT_EQ(topics.depth, (Names{"/b/depth/image_raw", "/camera/depth/image_rect"}));
  EXPECT_EQ(topics.only_compressed, Names{"/b/depth/image_raw"});
  EXPECT_EQ(topics.colour, Names{"/b/rgb/image_raw"});
  EXPECT_EQ(topics.camera_info, Names{"/camera/depth/camera_info"});
}

TEST_F(Input, MissingTransformIsWaitedForAndSaid) {
  const uint64_t dropped = status_.dropped("no_transform");
  const ros::Time stamp = camera_.nextStamp();
  sensor_msgs::Image image = camera_.image(stamp);
  image.header.frame_id = "nowhere";
  camera_.send(image, camera_.info(stamp));
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().frames_waiting == 1 &&
           status_.status().message.find("'nowhere' to 'map'") != std::string::npos;
  })) << status_.status().message;
  EXPECT_TRUE(status_.waitForDrop("no_transform", dropped));
  EXPECT_EQ(status_.status().frames_fused, 0u);
  EXPECT_NE(status_.status().message.find("'nowhere' to 'map'"), std::string::npos);
}

TEST_F(Input, LargerThanAMapTakes) {
  const ros::Time stamp = camera_.nextStamp();
  sensor_msgs::Image image = camera_.image(stamp);
  image.width = 8192;
  image.height = 4096;
  expectDrop("too_large", image, camera_.info(stamp));
  expectGoodFrameFused();
}

// They were in no count, and as many as would come: each one up to the largest message.
TEST_F(Input, ImagesThatWaitForTheirCameraInfoAreCountedAndBounded) {
  constexpr int kImages = 60;
  ASSERT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  const uint64_t received = status_.status().images_received;
  const ros::Publisher images = nh_.advertise<sensor_msgs::Image>("/camera/depth/image_rect", 100);
  ASSERT_TRUE(waitUntil([&] { return images.getNumSubscribers() > 0; }));
  size_t most_waiting = 0;
  uint64_t most_bytes = 0;
  for (int i = 0; i < kImages; ++i) {
    sensor_msgs::Image image = camera_.image(camera_.nextStamp());
    image.data.resize(1 << 20);
    images.publish(image);
    ros::WallDuration(0.02).sleep();
    ros::spinOnce();
    const auto& status = status_.status();
    EXPECT_EQ(status.images_received,
              status.frames_fused + status.frames_dropped + status.frames_waiting);
    most_waiting = std::max<size_t>(most_waiting, status.frames_waiting);
    for (const auto& part : status.memory) {
      if (part.name == "images") {
        most_bytes = std::max(most_bytes, part.bytes);
        EXPECT_EQ(part.limit_bytes, 2u * (8u << 20)) << "of depth and of colour";
      }
    }
  }
  EXPECT_TRUE(waitUntil([&] { return status_.status().images_received == received + kImages; }));
  EXPECT_LE(most_waiting, 9u) << "8 MB have room, and one may be in work";
  EXPECT_GE(most_waiting, 6u);
  EXPECT_LE(most_bytes, 8u << 20);
  EXPECT_GE(most_bytes, 6u << 20);
  EXPECT_NE(status_.status().cameras.at(0).streams.at(0).waiting_for.find("wait for camera_info"),
            std::string::npos);
  expectGoodFrameFused();  // which gives up those before it
  EXPECT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  EXPECT_EQ(status_.status().images_received,
            status_.status().frames_fused + status_.status().frames_dropped);
}

TEST_F(Input, RatesMayChangeWhileItRuns) {
  dynamic_reconfigure::Reconfigure call;
  call.request.config.doubles.resize(1);
  dynamic_reconfigure::DoubleParameter& rate = call.request.config.doubles[0];
  rate.name = "status_rate_hz";
  rate.value = 0.5;
  ASSERT_TRUE(ros::service::call("/mapping/publish/set_parameters", call));
  ros::WallDuration(0.2).sleep();
  const ros::Time seen = status_.status().header.stamp;
  EXPECT_FALSE(
      waitUntil([&] { return status_.status().header.stamp > seen + ros::Duration(0.3); }, 1.0));
  rate.value = 1e9;  // the most there is
  ASSERT_TRUE(ros::service::call("/mapping/publish/set_parameters", call));
  EXPECT_EQ(call.response.config.doubles.at(2).value, 100.0);
  const ros::Time before = status_.status().header.stamp;
  EXPECT_TRUE(waitUntil([&] { return status_.status().header.stamp > before; }, 1.0));
  rate.value = 20.0;  // as the other tests expect
  ASSERT_TRUE(ros::service::call("/mapping/publish/set_parameters", call));
}

// A stamp at the end of time made tf2 throw in the listener's thread, and one that is ahead made it
// refuse all true ones.
TEST_F(Input, TransformsThatCannotBeTrueAreRefusedAndNamed) {
  expectGoodFrameFused();
  const uint64_t refused = status_.status().transforms_refused;
  camera_.sendTransform(ros::Time(4294967295u, 0), {100.0, 0.0, 0.0});
  camera_.sendTransform(ros::Time(4294967270u, 0), {100.0, 0.0, 0.0});
  camera_.sendTransform(ros::Time::now() + ros::Duration(60.0), {100.0, 0.0, 0.0});
  camera_.sendTransform(ros::Time(4000000000u, 0), {100.0, 0.0, 0.0});
  EXPECT_TRUE(waitUntil([&] { return status_.status().transforms_refused == refused + 4; }));
  EXPECT_EQ(status_.status().refused_transforms.at(0).reason,
            "frame 'camera' of " + ros::this_node::getName() + ": ahead of time");
  expectGoodFrameFused();
}

// tf2 keeps each name for ever: 200 000 of them took 400 MB.
TEST_F(Input, NamesOfFramesAreBoundedAndThoseOfACameraKept) {
  const auto link = [](const std::string& child, const std::string& parent) {
    return makeTransform(parent, child, Eigen::Isometry3d::Identity(), ros::Time::now());
  };
  constexpr bool kLatched = true;
  const ros::Publisher tf_static = nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, kLatched);
  tf2_msgs::TFMessage crowd;
  for (int i = 0; i < 3000; ++i) crowd.transforms.push_back(link("r" + std::to_string(i), "map"));
  // Behind all of them, and not sent again.
  crowd.transforms.push_back(link("arm_camera", "arm"));
  crowd.transforms.push_back(link("arm", "map"));
  ASSERT_TRUE(waitUntil([&] { return tf_static.getNumSubscribers() > 0; }));
  tf_static.publish(crowd);
  ASSERT_TRUE(waitUntil([&] { return !status_.status().refused_transforms.empty(); }));
  const auto isNamed = [](const dtsdf_mapping::DropCount& refused) {
    return refused.reason == ros::this_node::getName() + ": more than 1000 frames";
  };
  const auto& refused = status_.status().refused_transforms;
  EXPECT_TRUE(waitUntil([&] { return std::any_of(refused.begin(), refused.end(), isNamed); }));
  const uint64_t fused = status_.status().frames_fused;
  for (int i = 0; i < 50 && status_.status().frames_fused == fused; ++i) {
    const ros::Time stamp = camera_.nextStamp();
    sensor_msgs::Image image = camera_.image(stamp);
    image.header.frame_id = "arm_camera";
    camera_.send(image, camera_.info(stamp));
    waitUntil([&] { return status_.status().frames_fused > fused; }, 0.2);
  }
  EXPECT_GT(status_.status().frames_fused, fused) << status_.status().message;
}

TEST_F(Input, SilenceIsWarnedOfThenAnErrorThenOver) {
  expectGoodFrameFused();
  const auto level = [&] { return status_.status().level; };
  const auto isSilent = [&] {
    return status_.status().message.find(
               "no depth image is received on '/camera/depth/image_rect'") != std::string::npos;
  };
  EXPECT_TRUE(waitUntil([&] { return level() == dtsdf_mapping::MapStatus::WARN && isSilent(); }))
      << status_.status().message;
  EXPECT_TRUE(waitUntil([&] { return level() == dtsdf_mapping::MapStatus::ERROR; }));
  expectGoodFrameFused();
  // What other tests had dropped lately is warned of still.
  EXPECT_TRUE(waitUntil([&] { return !isSilent(); })) << status_.status().message;
  EXPECT_NE(level(), dtsdf_mapping::MapStatus::ERROR);
}

/// Asks the master as whoever `caller` is; false if it refuses.
bool askMaster(const std::string& method, const std::string& caller,
               const std::vector<std::string>& arguments, XmlRpc::XmlRpcValue& answer) {
  XmlRpc::XmlRpcValue request, response;
  request[0] = caller;
  for (size_t i = 0; i < arguments.size(); ++i) request[static_cast<int>(i) + 1] = arguments[i];
  return ros::master::execute(method, request, response, answer, false);
}

// As after a restart of the master, for one service of the node.
TEST_F(Input, AMasterThatHasForgottenTheNodeIsReported) {
  expectGoodFrameFused();
  const std::string service = "/mapping/pause";
  XmlRpc::XmlRpcValue uri, node_uri, answer;
  ASSERT_TRUE(askMaster("lookupService", ros::this_node::getName(), {service}, uri));
  std::string node;
  for (const char* const name : {"/mapping", "/mapping_manager"}) {
    if (node.empty() && askMaster("unregisterService", name, {service, uri}, answer) &&
        !askMaster("lookupService", name, {service}, answer)) {
      node = name;
    }
  }
  ASSERT_NE(node, "");
  const auto isReported = [&] {
    return status_.status().message.find("no longer knows this node") != std::string::npos;
  };
  EXPECT_TRUE(waitUntil(isReported)) << status_.status().message;
  EXPECT_EQ(status_.status().level, dtsdf_mapping::MapStatus::ERROR);
  ASSERT_TRUE(askMaster("lookupNode", node, {node}, node_uri));
  ASSERT_TRUE(askMaster("registerService", node, {service, uri, node_uri}, answer));
  EXPECT_TRUE(waitUntil([&] { return !isReported(); })) << "and once it is known again";
}

}  // namespace
}  // namespace dtsdf
