/// Tests that wrong, late or incomplete frames are either fused at their true pose or dropped and
/// counted by reason. ros_parts_test covers individual errors in images and transforms.
#include <dtsdf_mapping/ClearRegion.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/CompressedImage.h>
#include <signal.h>
#include <sys/wait.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "ros/input/input_status.h"
#include "ros/support/kept_topics.h"
#include "ros/support/messages.h"
#include "ros/support/raw_listener.h"
#include "ros/support/wait.h"
#include "ros/support/wall_camera.h"

namespace dtsdf {
namespace {

class Input : public WallCamera {
 protected:
  /// Sends an image with its transform, and waits until it is dropped.
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

  ros::Publisher tf_ = advertiseUntilExit<tf2_msgs::TFMessage>(nh_, "/tf");
};

/// Must be the first test, before any image is received.
TEST_F(Input, StatusReportsMissingImages) {
  EXPECT_TRUE(waitUntil([&] {
    return status_.status().code == dtsdf_mapping::MapStatus::NO_IMAGES;
  })) << status_.status().message;
  EXPECT_EQ(status_.status().level, dtsdf_mapping::MapStatus::WARN);
}

TEST_F(Input, PublishedTopicsAreFound) {
  const ros::Publisher compressed =
      nh_.advertise<sensor_msgs::CompressedImage>("/b/depth/image_raw/compressedDepth", 1);
  const PublishedTopics topics = findPublishedTopics();
  EXPECT_EQ(topics.at("/b/depth/image_raw/compressedDepth"), "sensor_msgs/CompressedImage");
  EXPECT_EQ(topics.at("/camera/depth/image_rect"), "sensor_msgs/Image");
  EXPECT_EQ(topics.at("/camera/depth/camera_info"), "sensor_msgs/CameraInfo");
}

TEST_F(Input, MissingTransformsAreAwaitedAndReported) {
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

TEST_F(Input, OversizedImagesAreDropped) {
  const ros::Time stamp = camera_.nextStamp();
  sensor_msgs::Image image = camera_.image(stamp);
  image.width = 8192;
  image.height = 4096;
  expectDrop("too_large", image, camera_.info(stamp));
  expectGoodFrameFused();
}

/// Images waiting for camera_info may use at most input/queue_mb, and the status must count them.
TEST_F(Input, WaitingImagesAreCountedAndBounded) {
  constexpr int kImages = 60;
  ASSERT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  const uint64_t received = status_.status().images_received;
  const ros::Publisher images = nh_.advertise<sensor_msgs::Image>("/camera/depth/image_rect", 100);
  ASSERT_TRUE(waitUntil([&] { return images.getNumSubscribers() > 0; }));
  size_t max_waiting = 0;
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
    max_waiting = std::max<size_t>(max_waiting, status.frames_waiting);
    for (const auto& part : status.memory) {
      if (part.name == "images") {
        most_bytes = std::max(most_bytes, part.bytes);
        EXPECT_EQ(part.limit_bytes, 8u << 20);
      }
    }
  }
  EXPECT_TRUE(waitUntil([&] { return status_.status().images_received == received + kImages; }));
  EXPECT_LE(max_waiting, 9u) << "at most 8 images of 1 MB should wait, plus one in progress";
  EXPECT_GE(max_waiting, 6u);
  EXPECT_LE(most_bytes, 8u << 20);
  EXPECT_GE(most_bytes, 6u << 20);
  expectGoodFrameFused();  // drops the waiting images
  EXPECT_TRUE(waitUntil([&] { return status_.status().frames_waiting == 0; }));
  EXPECT_EQ(status_.status().images_received,
            status_.status().frames_fused + status_.status().frames_dropped);
}

TEST_F(Input, RatesMayChangeAtRunTime) {
  dynamic_reconfigure::Reconfigure call;
  call.request.config.doubles.resize(1);
  dynamic_reconfigure::DoubleParameter& rate = call.request.config.doubles[0];
  rate.name = "status_rate_hz";
  rate.value = 0.5;
  ASSERT_TRUE(callService("/mapping/publish/set_parameters", call));
  ros::WallDuration(0.2).sleep();
  const ros::Time seen = status_.status().header.stamp;
  EXPECT_FALSE(
      waitUntil([&] { return status_.status().header.stamp > seen + ros::Duration(0.3); }, 1.0));
  rate.value = 1e9;  // clamped to 100
  ASSERT_TRUE(callService("/mapping/publish/set_parameters", call));
  EXPECT_EQ(call.response.config.doubles.at(2).value, 100.0);
  const ros::Time before = status_.status().header.stamp;
  EXPECT_TRUE(waitUntil([&] { return status_.status().header.stamp > before; }, 1.0));
  rate.value = 20.0;  // as in test.yaml
  ASSERT_TRUE(callService("/mapping/publish/set_parameters", call));
}

/// After a transform stamped an hour ahead, tf2 rejects all current transforms as too old. The node
/// must recover.
TEST_F(Input, MappingRecoversFromAWrongTransform) {
  expectGoodFrameFused();
  constexpr bool kLatched = true;
  const ros::Publisher tf_static = nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, kLatched);
  ASSERT_TRUE(waitUntil([&] { return tf_static.getNumSubscribers() > 0; }));
  tf2_msgs::TFMessage rogue;
  rogue.transforms.push_back(makeTransform("map", "camera", Eigen::Isometry3d::Identity(),
                                           ros::Time::now() + ros::Duration(3600.0)));
  tf_static.publish(rogue);
  tf_.publish(rogue);
  ros::WallDuration(0.2).sleep();
  const uint64_t fused = status_.status().frames_fused;
  const auto isMapping = [&] {
    const ros::Time stamp = camera_.nextStamp();
    camera_.sendTransform(stamp);
    camera_.send(camera_.image(stamp), camera_.info(stamp));
    ros::WallDuration(0.05).sleep();
    return status_.status().frames_fused > fused + 10;
  };
  EXPECT_TRUE(waitUntil(isMapping)) << status_.status().message;
  EXPECT_EQ(status_.status().transform_restarts, 1u);
}

/// After a stamp far in the future, the next image is treated as a jump back in time, so queued
/// frames and all transforms are discarded.
TEST_F(Input, MappingRecoversFromAStampFarAhead) {
  expectGoodFrameFused();
  const uint64_t dropped = status_.dropped("time_jump");
  const ros::Time ahead = camera_.nextStamp() + ros::Duration(60.0);
  camera_.send(camera_.image(ahead), camera_.info(ahead));
  EXPECT_TRUE(waitUntil(
      [&] { return !status_.status().cameras.at(0).streams.at(0).waiting_for.empty(); }, 0.4));
  const ros::Time stamp = camera_.nextStamp();
  camera_.send(camera_.image(stamp), camera_.info(stamp));
  EXPECT_TRUE(status_.waitForDrop("time_jump", dropped));
  expectGoodFrameFused();
  expectGoodFrameFused();
}

/// If the camera stays at its new position, the next frame is fused.
TEST_F(Input, APoseJumpCostsOneFrame) {
  expectGoodFrameFused();
  const uint64_t dropped = status_.dropped("pose_jump"), fused = status_.status().frames_fused;
  for (int i = 0; i < 2; ++i) {
    const ros::Time stamp = camera_.nextStamp();
    camera_.sendTransform(stamp, {100.0, 0.0, 0.0});
    camera_.send(camera_.image(stamp), camera_.info(stamp));
    if (i == 0) {
      EXPECT_TRUE(status_.waitForDrop("pose_jump", dropped));
    }
  }
  EXPECT_TRUE(status_.waitForFused(fused + 1)) << status_.status().message;
  const ros::Time stamp = camera_.nextStamp();
  expectDrop("pose_jump", camera_.image(stamp), camera_.info(stamp));
  expectGoodFrameFused();
}

/// The node must not store frame names of 20 MB, because they could exhaust its memory.
TEST_F(Input, LongNamesAreRefused) {
  expectGoodFrameFused();
  const int process = publishingProcess("/mapping/status");
  const std::string name(20 << 20, 'x');
  dtsdf_mapping::ClearRegion call;
  call.request.frame_id = name;
  call.request.sphere.radius = 1.0;
  ASSERT_TRUE(callService("/mapping/clear_region", call));
  const size_t before = residentBytes(process);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(callService("/mapping/clear_region", call));
    EXPECT_FALSE(call.response.success);
    EXPECT_NE(call.response.message.find("longer than 200 bytes"), std::string::npos);
  }
  for (int i = 0; i < 10; ++i) {
    const ros::Time stamp = camera_.nextStamp();
    sensor_msgs::Image image = camera_.image(stamp);
    image.header.frame_id = name;
    const uint64_t dropped = status_.dropped("long_name");
    sensor_msgs::CameraInfo info = camera_.info(stamp);
    info.D.assign(2 << 20, 0.1);
    camera_.send(image, info);
    EXPECT_TRUE(status_.waitForDrop("long_name", dropped));
    tf2_msgs::TFMessage transforms;
    transforms.transforms.push_back(
        makeTransform("map", name, Eigen::Isometry3d::Identity(), stamp));
    const uint64_t refused = status_.status().transforms_refused;
    tf_.publish(transforms);
    EXPECT_TRUE(waitUntil([&] { return status_.status().transforms_refused > refused; }));
  }
  EXPECT_LT(residentBytes(process), before + (100u << 20));
  expectGoodFrameFused();
}

/// Converted to double, this stamp rounds up to 2^32 s, for which ros::Time throws.
TEST_F(Input, AStampAtTheEndOfTimeIsHarmless) {
  const ros::Time end(4294967295u, 999999900u);
  camera_.send(camera_.image(end), camera_.info(end));
  EXPECT_TRUE(status_.waitForDrop("bad_stamp", 0));
  const ros::Time seen = status_.status().header.stamp;
  EXPECT_TRUE(waitUntil([&] { return status_.status().header.stamp > seen; }));
  expectGoodFrameFused();
}

/// Stops a separate node while many images and long paths are queued.
TEST_F(Input, NodeEndsSoonDespiteWaitingInput) {
  ros::param::set("/second/backend", "cpu");
  ros::param::set("/second/threads", 1);
  ros::param::set("/second/journal/folder", outputFolder() + "/journals");
  const pid_t node = fork();
  if (node == 0) {
    execl(DTSDF_MAPPING_NODE, DTSDF_MAPPING_NODE, "__name:=second",
          "depth/image_rect:=/camera/depth/image_rect",
          "depth/camera_info:=/camera/depth/camera_info", nullptr);
    _exit(127);
  }
  const ros::Publisher paths = nh_.advertise<nav_msgs::Path>("/corrected_path", 100);
  EXPECT_TRUE(waitUntil([&] { return paths.getNumSubscribers() > 0; }));
  nav_msgs::Path path;
  path.poses.resize(20000);
  for (size_t i = 0; i < path.poses.size(); ++i) {
    path.poses[i].header.stamp = ros::Time(1.0 + 0.1 * static_cast<double>(i));
    path.poses[i].pose.orientation.w = 1.0;
  }
  const std::string name(20 << 20, 'x');
  for (int i = 0; i < 30; ++i) {
    const ros::Time stamp = camera_.nextStamp();
    sensor_msgs::Image image = camera_.image(stamp);
    camera_.sendTransform(stamp);
    camera_.send(image, camera_.info(stamp));
    paths.publish(path);
    path.header.frame_id = i % 3 == 0 ? name : "";
  }
  ros::WallDuration(0.5).sleep();
  const ros::WallTime begin = ros::WallTime::now();
  kill(node, SIGINT);
  int result = 0;
  EXPECT_EQ(waitpid(node, &result, 0), node);
  EXPECT_LT((ros::WallTime::now() - begin).toSec(), 3.0);
  EXPECT_TRUE(WIFEXITED(result) && WEXITSTATUS(result) == 0) << result;
  ros::param::del("/second");
}

TEST_F(Input, SilenceIsAWarningThenAnError) {
  expectGoodFrameFused();
  const auto level = [&] { return status_.status().level; };
  const auto isSilent = [&] { return status_.status().code == dtsdf_mapping::MapStatus::SILENT; };
  EXPECT_TRUE(waitUntil([&] { return level() == dtsdf_mapping::MapStatus::WARN && isSilent(); }))
      << status_.status().message;
  EXPECT_TRUE(waitUntil([&] { return level() == dtsdf_mapping::MapStatus::ERROR; }));
  expectGoodFrameFused();
  // Frames dropped in earlier tests may still cause a warning.
  EXPECT_TRUE(waitUntil([&] { return !isSilent(); })) << status_.status().message;
  EXPECT_NE(level(), dtsdf_mapping::MapStatus::ERROR);
}

}  // namespace
}  // namespace dtsdf
