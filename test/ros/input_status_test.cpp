#include "ros/input/input_status.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

PublishedTopics published;
constexpr char kImage[] = "sensor_msgs/Image", kCompressed[] = "sensor_msgs/CompressedImage";

/// Computes the input status from reports and times set by the test.
class InputStatusTest : public testing::Test {
 protected:
  InputStatusTest() {
    published = {};
    now_ = ros::Time(100.0);
    streams_.resize(1);
    depth().kind = "depth";
    depth().topic = "/camera/depth/image_rect";
    depth().info_topic = "/camera/depth/camera_info";
  }

  StreamReport& depth() { return streams_[0]; }
  void drop(const DropReason& reason, uint64_t count) {
    depth().dropped_by[reason] += count;
    depth().received += count;
    depth().last_drop = "frame stamped 1 dropped";
  }
  void fuse(uint64_t count) {
    depth().received += count;
    depth().fused += count;
    depth().camera_infos += count;
    depth().received_age_s = depth().fused_age_s = 0.0;
  }

  const MapStatus& update(double after_s = 1.0) {
    at_ += toSteadyDuration(after_s);
    now_ += ros::Duration(after_s);
    status_ = MapStatus();
    status_.message = "mapping";
    status_.transform_age_s = -1.0f;
    input_status_.fill(streams_, paused_, at_, now_, status_);
    return status_;
  }

  void expect(uint8_t level, uint8_t code, const std::string& message) {
    update();
    EXPECT_EQ(status_.level, level) << status_.message;
    EXPECT_EQ(status_.code, code) << status_.message;
    EXPECT_EQ(status_.message, message);
  }

  std::vector<StreamReport> streams_;
  bool paused_ = false;
  SteadyTime at_;
  ros::Time now_;
  InputStatus input_status_{5.0, [] { return published; }};
  MapStatus status_;
};

TEST_F(InputStatusTest, DistinguishesUnreachableFromMissingPublishers) {
  at_ = SteadyTime(std::chrono::seconds(1000));
  published = {{depth().topic, kImage}};
  EXPECT_NE(update().message.find("it is published, but not received"), std::string::npos);
  EXPECT_EQ(status_.code, MapStatus::NO_IMAGES);
}

TEST_F(InputStatusTest, ReportsThatDepthIsPublishedAsClouds) {
  published = {{depth().topic, "sensor_msgs/PointCloud2"}};
  update();
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect': it is published as "
         "sensor_msgs/PointCloud2; set image_transport:=cloud");
  depth().is_cloud = true;
  depth().received = 1;
  drop(drop::kUnorganised, 1);
  EXPECT_EQ(update().message, "no frame fused yet: frame stamped 1 dropped");
}

/// Steps through the states from no images to mapping and checks the message for each state.
TEST_F(InputStatusTest, ReportsWhatIsMissingStepByStep) {
  at_ = SteadyTime(std::chrono::seconds(1000));
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect': it has no publisher");
  published = {{"/a/depth", kImage}, {"/b/depth/compressed", kCompressed}, {"/c/rgb", kImage}};
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect': it has no publisher; depth is "
         "published on '/a/depth' and '/b/depth'");
  published = {{depth().topic + "/compressedDepth", kCompressed}};
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect': it is published as "
         "sensor_msgs/CompressedImage; set image_transport:=compressedDepth");
  depth().image_publishers = 1;
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect': its publisher has sent nothing "
         "yet");
  depth().received = 1;
  published = {{"/info", "sensor_msgs/CameraInfo"}};
  expect(MapStatus::WARN, MapStatus::NO_CAMERA_INFO,
         "depth images are received, but no camera_info on '/camera/depth/camera_info'; "
         "camera_info is published on '/info'; set camera_info:=");
  depth().camera_infos = 1;
  expect(MapStatus::OK, MapStatus::NO_FRAME_YET, "waiting for the first frame");
  depth().waiting_for = "no transform from 'camera' to 'map'";
  expect(MapStatus::WARN, MapStatus::NO_FRAME_YET,
         "no frame fused yet: no transform from 'camera' to 'map'");
  depth().waiting_for.clear();
  drop(drop::kNoTransform, 1);
  expect(MapStatus::WARN, MapStatus::NO_FRAME_YET, "no frame fused yet: frame stamped 1 dropped");
  fuse(10);
  drop(drop::kMisfit, 2);
  expect(MapStatus::OK, MapStatus::MAPPING, "mapping");
  fuse(88);
  expect(
      MapStatus::WARN, MapStatus::SOME_DROPPED,
      "3 % of the latest depth images were dropped, mostly as misfit: check the pose estimate, or "
      "raise poses/sigma_m and poses/sigma_rad");
  depth().warning = "'camera' is not an optical frame";
  expect(MapStatus::WARN, MapStatus::DOUBTFUL_INPUT, "'camera' is not an optical frame");
  depth().warning.clear();
  fuse(1000);
  expect(MapStatus::OK, MapStatus::MAPPING, "mapping");
  paused_ = true;
  drop(drop::kPaused, 100);
  expect(MapStatus::OK, MapStatus::PAUSED, "paused");
}

TEST_F(InputStatusTest, NamesThePublishedTransport) {
  const std::string topic = depth().topic;
  published = {{topic, kImage}};
  EXPECT_EQ(update().message.find("image_transport"), std::string::npos);
  depth().topic = topic + "/compressedDepth";
  expect(MapStatus::WARN, MapStatus::NO_IMAGES,
         "no depth image received on '/camera/depth/image_rect/compressedDepth': it is published "
         "as sensor_msgs/Image; set image_transport:=raw");
}

TEST_F(InputStatusTest, UnexpectedDropsAreReportedForAWhile) {
  const auto statusAfter = [&](uint64_t fused, const DropReason& reason, uint64_t dropped) {
    fuse(fused);
    if (dropped > 0) drop(reason, dropped);
    return update(10.0).code;
  };
  EXPECT_EQ(statusAfter(300, drop::kBeforeTransforms, 40), MapStatus::MAPPING);
  EXPECT_EQ(statusAfter(300, drop::kQueueFull, 3), MapStatus::MAPPING);
  EXPECT_EQ(statusAfter(237, drop::kQueueFull, 63), MapStatus::SOME_DROPPED);
  EXPECT_NE(status_.message.find("mostly as queue_full: use larger voxels"), std::string::npos);
  EXPECT_EQ(statusAfter(20, drop::kQueueFull, 80), MapStatus::SOME_DROPPED);
  EXPECT_EQ(statusAfter(300, drop::kPaused, 100), MapStatus::SOME_DROPPED);
  statusAfter(300, drop::kPaused, 0);
  statusAfter(300, drop::kPaused, 0);
  EXPECT_EQ(statusAfter(300, drop::kPaused, 0), MapStatus::MAPPING);
  drop(drop::kNoMask, 100);
  EXPECT_EQ(update().message.find("no_mask: "), std::string::npos)
      << "the last drop text should not be used for a different reason";
  depth().last_reason = drop::kNoMask;
  EXPECT_NE(update().message.find("no_mask: frame stamped 1"), std::string::npos);
}

TEST_F(InputStatusTest, SilenceIsAWarningThenAnError) {
  fuse(10);
  for (int i = 0; i < 20; ++i) update();
  depth().received_age_s = depth().fused_age_s = 6.0;
  expect(MapStatus::WARN, MapStatus::SILENT,
         "no depth image is received on '/camera/depth/image_rect' (its publisher is gone); last "
         "image 6 s ago, last transform never, last fused frame 6 s ago");
  depth().received_age_s = 0.1;
  depth().fused_age_s = 16.0;
  drop(drop::kNoTransform, 1);
  depth().waiting_for = "no mask";
  expect(MapStatus::ERROR, MapStatus::NOT_FUSED,
         "no frame is fused: no mask; last image 0 s ago, last transform never, "
         "last fused frame 16 s ago");
  paused_ = true;
  EXPECT_EQ(update().code, MapStatus::PAUSED);
  paused_ = false;
  EXPECT_NE(update().code, MapStatus::NOT_FUSED) << "the timeout should start again";
}

TEST_F(InputStatusTest, MissingColourIsReportedOnlyIfNeeded) {
  fuse(10);
  streams_.emplace_back();
  StreamReport& colour = streams_[1];
  colour.kind = "color";
  colour.topic = "/color";
  EXPECT_EQ(update().code, MapStatus::MAPPING);
  colour.is_needed = true;
  expect(MapStatus::WARN, MapStatus::NO_COLOUR,
         "no colour image received on '/color', which colour/enabled: always requires");
  colour.received = 1;
  expect(MapStatus::WARN, MapStatus::COLOUR_NOT_PAINTED,
         "colour images are received, but no camera_info on ''");
}

TEST_F(InputStatusTest, EachCameraIsNamedAndCounted) {
  streams_.push_back(streams_[0]);
  streams_[0].camera = "front";
  streams_[1].camera = "rear";
  fuse(10);
  drop(drop::kQueueFull, 1);
  depth().waiting = 2;
  depth().last_fused_stamp = ros::Time(7.0);
  EXPECT_EQ(update().message.find("rear: no depth image received"), 0u);
  EXPECT_EQ(status_.frames_fused, 10u);
  EXPECT_EQ(status_.cameras[1].streams.at(0).received_age_s, -1.0f);
  StreamReport& rear = streams_[1];
  rear = depth();
  rear.camera = "rear";
  rear.waiting = 0;
  rear.dropped_by[drop::kQueueFull] = 2;
  rear.received = 12;
  rear.last_fused_stamp = ros::Time(6.0);
  rear.received_age_s = 0.25;
  EXPECT_EQ(update().code, MapStatus::MAPPING);
  EXPECT_EQ(status_.images_received, 23u);
  EXPECT_EQ(status_.frames_fused, 20u);
  EXPECT_EQ(status_.frames_dropped, 3u);
  ASSERT_EQ(status_.dropped.size(), 1u);
  EXPECT_EQ(status_.dropped[0].reason, "queue_full");
  EXPECT_EQ(status_.dropped[0].count, 3u);
  EXPECT_EQ(status_.frames_waiting, 2u);
  EXPECT_EQ(status_.last_fused_stamp, ros::Time(7.0));
  ASSERT_EQ(status_.cameras.size(), 2u);
  EXPECT_EQ(status_.cameras[1].name, "rear");
  const dtsdf_mapping::StreamStatus& stream = status_.cameras[1].streams.at(0);
  EXPECT_EQ(stream.kind, "depth");
  EXPECT_EQ(stream.received, 12u);
  EXPECT_EQ(stream.dropped.at(0).count, 2u);
  EXPECT_EQ(stream.received_age_s, 0.25f);
  drop(drop::kOutOfOrder, 50);
  EXPECT_EQ(update().message.find("front: 100 % of the latest depth"), 0u) << status_.message;
}

TEST_F(InputStatusTest, StoppedTimeIsNotAnError) {
  fuse(10);
  update();
  now_ -= ros::Duration(0.9);
  EXPECT_EQ(update(0.9).code, MapStatus::MAPPING)
      << "simulated time should be allowed to advance in steps";
  now_ -= ros::Duration(3.0);
  for (int i = 0; i < 3; ++i) {
    update();
    now_ -= ros::Duration(1.0);
  }
  EXPECT_EQ(update().code, MapStatus::TIME_STANDS);
  EXPECT_EQ(status_.level, MapStatus::OK);
  depth().received_age_s = depth().fused_age_s = 16.0;
  EXPECT_EQ(update().code, MapStatus::MAPPING) << "the timeout should start again";
  for (int i = 0; i < 3; ++i) {  // /use_sim_time without /clock
    status_ = MapStatus();
    input_status_.fill(streams_, false, at_ += std::chrono::seconds(1), ros::Time(), status_);
  }
  EXPECT_EQ(status_.code, MapStatus::MAPPING);
}

TEST(Status, TheMostImportantProblemIsReported) {
  MapStatus status;
  report(status, MapStatus::OK, MapStatus::NO_SURFACE, "no surface");
  EXPECT_EQ(status.code, MapStatus::NO_SURFACE);
  report(status, MapStatus::WARN, MapStatus::MAP_FULL, "full");
  report(status, MapStatus::WARN, MapStatus::JOURNAL_INCOMPLETE, "journal");
  EXPECT_EQ(status.message, "full");
  report(status, MapStatus::WARN, MapStatus::SILENT, "silent");
  EXPECT_EQ(status.message, "silent");
  report(status, MapStatus::ERROR, MapStatus::BACKEND_FAILED, "failed");
  report(status, MapStatus::WARN, MapStatus::PAUSED, "paused");
  EXPECT_EQ(status.message, "failed");
}

/// toTime() must not throw for any stamp.
TEST(Status, TimesAreClamped) {
  for (const double stamp_s : {-1.0, 4294967295.9999999, 1e300, std::nan("")}) toTime(stamp_s);
  EXPECT_EQ(toTime(2.5), ros::Time(2.5));
}

}  // namespace
}  // namespace dtsdf
