/// Tests a colour camera whose image size and rate differ from those of the depth camera. Depth
/// must be fused even if colour images arrive late, lack transforms or stop arriving.
#include <gtest/gtest.h>
#include <rosbag/bag.h>

#include <algorithm>

#include "dtsdf_mapping/mapper.h"
#include "io/bag_frames.h"
#include "ros/support/camera_topics.h"
#include "ros/support/messages.h"
#include "ros/support/output_folder.h"
#include "ros/support/status_watcher.h"
#include "ros/support/wait.h"
#include "simulation/scene.h"
#include "support/temporary_folder.h"
#include "tools/reconstruction.h"

namespace dtsdf {
namespace {

/// The colour camera is 5 cm to the right of the depth camera.
const Eigen::Translation3d kColourOffset(0.05, 0.0, 0.0);

struct Lens {
  int width, height;
  Intrinsics K;
};
const Lens kDepthLens{96, 72, {80.0f, 80.0f, 47.5f, 35.5f}};
const Lens kColourLens{128, 80, {70.0f, 70.0f, 63.5f, 39.5f}};

/// A depth or colour image with its camera_info and transform.
struct Sent {
  sensor_msgs::Image image;
  sensor_msgs::CameraInfo info;
  tf2_msgs::TFMessage transform;
};

template <class Pixel>
Sent makeSent(const Lens& lens, const std_msgs::Header& header, const std::string& encoding,
              const std::vector<Pixel>& pixels, const Eigen::Isometry3d& T_W_C) {
  const sensor_msgs::Image image =
      makeImageMessage(header, encoding, lens.width, lens.height, pixels);
  return {image, makeCameraInfo(image, lens.K),
          makeTfMessage("map", header.frame_id, T_W_C, header.stamp)};
}

const Scene& room() {
  static const Scene scene = makeRoomScene();
  return scene;
}

Sent makeDepth(const ros::Time& stamp, double lap_s) {
  const Eigen::Isometry3d T_W_C = roomCameraPose(lap_s, 6.0);
  return makeSent(kDepthLens, makeHeader(stamp, "depth"), "32FC1",
                  renderDepth(room(), kDepthLens.K, kDepthLens.width, kDepthLens.height, T_W_C),
                  T_W_C);
}

Sent makeColour(const ros::Time& stamp, double lap_s) {
  const Eigen::Isometry3d T_W_C = roomCameraPose(lap_s, 6.0) * kColourOffset;
  return makeSent(kColourLens, makeHeader(stamp, "color"), "rgb8",
                  renderPaint(room(), kColourLens.K, kColourLens.width, kColourLens.height, T_W_C),
                  T_W_C);
}

class Colour : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(waitUntil([&] {
      return status_.received() && tf_.getNumSubscribers() > 0 && depth_.isConnected() &&
             colour_.isConnected();
    }));
    begin();
  }

  /// Sets start_ to a time after all stamps sent so far. Stamps sent before the next call may be up
  /// to two seconds after start_.
  void begin() {
    static ros::Time last;
    start_ = last = std::max(last + ros::Duration(2.0), ros::Time::now());
  }

  void sendDepth(const Sent& sent) {
    tf_.publish(sent.transform);
    depth_.send(sent.image, sent.info);
  }

  void sendColour(const Sent& sent, bool with_transform = true) {
    if (with_transform) tf_.publish(sent.transform);
    colour_.send(sent.image, sent.info);
  }

  const dtsdf_mapping::StreamStatus& stream(size_t i) const {
    return status_.status().cameras.at(0).streams.at(i);
  }
  uint64_t fused() const { return stream(0).fused; }
  uint64_t painted() const { return stream(1).fused; }

  uint64_t colourDropped(const std::string& reason) const {
    for (const auto& drop : stream(1).dropped) {
      if (drop.reason == reason) return drop.count;
    }
    return 0;
  }

  bool waitForFused(uint64_t count) const {
    return waitUntil([&] { return fused() >= count; });
  }
  bool waitForPainted(uint64_t count) const {
    return waitUntil([&] { return painted() >= count; });
  }

  /// Checks that depth and colour are still fused.
  void expectBothFused() {
    const uint64_t fused_before = fused(), painted_before = painted();
    begin();
    sendDepth(makeDepth(start_, 0.0));
    sendColour(makeColour(start_, 0.0));
    EXPECT_TRUE(waitForFused(fused_before + 1)) << status_.status().message;
    EXPECT_TRUE(waitForPainted(painted_before + 1)) << status_.status().message;
    EXPECT_EQ(status_.status().frames_dropped, 0u);
  }

  ros::NodeHandle nh_;
  const CameraTopics depth_{nh_, "/camera/depth"}, colour_{nh_, "/camera/color"};
  ros::Publisher tf_ = advertiseUntilExit<tf2_msgs::TFMessage>(nh_, "/tf");
  StatusWatcher status_{nh_};
  ros::Time start_;
};

std::string savedBytes(const std::string& name) {
  const auto saved = saveMesh(name);
  EXPECT_TRUE(saved.success) << saved.message;
  return readBytes(saved.path);
}

void writeBag(const std::string& path, const std::vector<Sent>& depth,
              const std::vector<Sent>& colour) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  const auto write = [&](const std::string& name, const std::vector<Sent>& images) {
    for (const Sent& sent : images) {
      const ros::Time stamp = sent.image.header.stamp;
      bag.write("/tf", stamp, sent.transform);
      bag.write("/camera/" + name + "/camera_info", stamp, sent.info);
      bag.write("/camera/" + name + "/image_rect", stamp, sent.image);
    }
  };
  write("depth", depth);
  write("color", colour);
  bag.close();
}

std::string bytesOfBag(const std::string& bag_path) {
  const NodeParams params = nodeParams();
  BagOptions options;
  options.path = bag_path;
  const std::unique_ptr<FrameSource> depth = openBagFrames(options);
  const std::unique_ptr<ColourSource> colours = openBagColours(options);
  if (colours == nullptr) return "the bag contains no colour images";
  const std::unique_ptr<Mapper> mapper = makeMapper(params.mapper);
  const ReconstructionResult result =
      reconstruct({*depth, colours.get()}, *mapper, params.mapper.map, 0, [](size_t) {});
  EXPECT_TRUE(result.skipped.empty()) << describeSkipped(result.skipped);
  return plyOf(result.meshes->all().assemble(), params.mapper.mesh.colour);
}

/// Live messages and a bag of the same messages must give identical meshes. This must be the first
/// test, because it needs an empty map.
TEST_F(Colour, BagAndLiveGiveTheSameBytes) {
  std::vector<Sent> depth, colour;
  for (int i = 0; i < 10; ++i) depth.push_back(makeDepth(start_ + ros::Duration(0.1 * i), 0.3 * i));
  for (int i = 0; i < 15; ++i) {  // every third stamp is also a depth stamp
    colour.push_back(makeColour(start_ + ros::Duration(0.1 * i * 2 / 3), 0.2 * i));
  }
  while (colour.back().image.header.stamp > depth.back().image.header.stamp) colour.pop_back();
  size_t next = 0;
  for (const Sent& sent : depth) {
    for (; next < colour.size() && colour[next].image.header.stamp <= sent.image.header.stamp;
         ++next) {
      sendColour(colour[next]);
    }
    sendDepth(sent);
    ros::WallDuration(0.05).sleep();
  }
  ASSERT_TRUE(waitForFused(depth.size())) << status_.status().message;
  ASSERT_TRUE(waitForPainted(colour.size())) << stream(1).last_drop;
  EXPECT_GT(status_.status().memory.at(1).bytes, 0u);
  const std::string bytes = savedBytes("live.ply");
  const TemporaryFolder folder;
  writeBag(folder / "room.bag", depth, colour);
  EXPECT_TRUE(bytes == bytesOfBag(folder / "room.bag"));
  colour.pop_back();
  writeBag(folder / "less.bag", depth, colour);
  EXPECT_FALSE(bytes == bytesOfBag(folder / "less.bag"));
}

TEST_F(Colour, IsPaintedEvenIfLate) {
  expectBothFused();
  const uint64_t fused_before = fused(), painted_before = painted();
  std::vector<Sent> late;
  for (int i = 1; i <= 3; ++i) {
    sendDepth(makeDepth(start_ + ros::Duration(0.1 * i), 0.0));
    late.push_back(makeColour(start_ + ros::Duration(0.1 * i - 0.03), 0.0));
  }
  ASSERT_TRUE(waitForFused(fused_before + 3));
  for (const Sent& sent : late) sendColour(sent);
  EXPECT_TRUE(waitForPainted(painted_before + 3)) << stream(1).last_drop;
  EXPECT_EQ(status_.status().frames_dropped, 0u);
}

TEST_F(Colour, IsDroppedWithoutItsTransform) {
  expectBothFused();
  const uint64_t painted_before = painted(), dropped = colourDropped("no_transform");
  Sent sent = makeColour(start_ + ros::Duration(0.1), 0.0);
  sent.image.header.frame_id = "nowhere";
  sendColour(sent, false);
  sendDepth(makeDepth(start_ + ros::Duration(0.15), 0.0));
  EXPECT_TRUE(waitUntil([&] { return colourDropped("no_transform") > dropped; }));
  EXPECT_EQ(painted(), painted_before);
  EXPECT_NE(stream(1).last_drop.find("colour: frame stamped"), std::string::npos);
  expectBothFused();
}

TEST_F(Colour, MayStopWhileDepthContinues) {
  expectBothFused();
  const uint64_t fused_before = fused(), painted_before = painted();
  for (int i = 1; i <= 10; ++i) {
    sendDepth(makeDepth(start_ + ros::Duration(0.1 * i), 0.3 * i));
    ros::WallDuration(0.05).sleep();
  }
  EXPECT_TRUE(waitForFused(fused_before + 10)) << status_.status().message;
  EXPECT_EQ(painted(), painted_before);
  EXPECT_EQ(status_.status().frames_dropped, 0u);
  EXPECT_EQ(status_.status().level, dtsdf_mapping::MapStatus::OK) << status_.status().message;
  expectBothFused();
}

}  // namespace
}  // namespace dtsdf
