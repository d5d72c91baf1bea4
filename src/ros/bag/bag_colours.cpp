#include <ros/console.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <vector>

#include "io/bag_frames.h"
#include "ros/bag/bag_messages.h"
#include "ros/input/image_kind.h"
#include "ros/input/images.h"
#include "ros/input/rectification.h"

namespace dtsdf {
namespace {

bool mayBeColour(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) {
    return showsColour(image->encoding);
  }
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed && holdsColour(*compressed);
}

/// Stamp and place of one image: bags have messages in the order in which they were recorded.
struct Recorded {
  ros::Time stamp;
  ros::Time recorded;
};

class BagColours : public ColourSource {
 public:
  explicit BagColours(const BagOptions& options) : options_(options) {
    try {
      bag_.open(options_.path, rosbag::bagmode::Read);
      if (!chooseTopics()) return;
      poses_ = std::make_unique<BagPoses>(bag_, ofColour(options_));
      infos_ = std::make_unique<BagCameraInfos>(bag_, options_.colour_info_topic, std::nullopt,
                                                options_.latest_camera_info);
      listImages();
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("cannot read the bag '" + options_.path + "': " + error.what());
    }
  }

  /// Whether there are colour images.
  bool isThere() const { return !options_.colour_topic.empty(); }

  std::optional<SourceColour> next() override {
    try {
      for (; next_ < images_.size(); ++next_) {
        if (!isListed(next_)) continue;
        if (auto colour = makeColour(read(images_[next_]))) {
          colour->index = next_++;
          return colour;
        }
      }
      return std::nullopt;
    } catch (const rosbag::BagException& error) {
      throw brokenBag(options_, error);
    }
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  bool isListed(size_t place) const {
    const auto& listed = options_.listed_colours;
    return listed == nullptr || std::binary_search(listed->begin(), listed->end(), place);
  }

  /// The frame of colour images is their own.
  BagOptions ofColour(BagOptions options) const {
    if (options.first_pose_only) {
      options.map_frame = depthCameraFrame(bag_, options);
      options.poses_path.clear();
    }
    options.camera_frame.clear();
    return options;
  }

  /// False if there is no colour.
  bool chooseTopics() {
    std::string& topic = options_.colour_topic;
    if (topic.empty()) {
      const std::set<std::string> topics = findImageTopics(bag_, mayBeColour, kCompressedTopic);
      if (topics.size() != 1) return askForChoice(topics);
      topic = *topics.begin();
    }
    if (options_.colour_info_topic.empty()) {
      options_.colour_info_topic =
          topicBeside(withoutEnding(topic, kCompressedTopic), "camera_info");
    }
    if (!hasMessages(bag_, topic) && hasMessages(bag_, topic + kCompressedTopic)) {
      topic += kCompressedTopic;
    }
    requireMessages(bag_, topic);
    return true;
  }

  /// Several cameras: which one is meant, nobody has said.
  static bool askForChoice(const std::set<std::string>& topics) {
    std::string list;
    for (const std::string& topic : topics) list += " " + topic;
    if (!list.empty()) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                            "several topics with colour images, so none is "
                            "used:"
                                << list << "; choose one by --color-topic");
    }
    return false;
  }

  void listImages() {
    rosbag::View view(bag_, rosbag::TopicQuery(options_.colour_topic));
    for (const rosbag::MessageInstance& message : view) {
      if (const auto stamp = stampOf(message)) images_.push_back({*stamp, message.getTime()});
    }
    std::stable_sort(images_.begin(), images_.end(),
                     [](const Recorded& a, const Recorded& b) { return a.stamp < b.stamp; });
  }

  static std::optional<ros::Time> stampOf(const rosbag::MessageInstance& message) {
    if (const auto image = message.instantiate<sensor_msgs::Image>()) return image->header.stamp;
    const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
    if (compressed) return compressed->header.stamp;
    return std::nullopt;
  }

  /// The image; null where it is damaged.
  sensor_msgs::ImageConstPtr read(const Recorded& listed) const {
    rosbag::View view(bag_, rosbag::TopicQuery(options_.colour_topic), listed.recorded,
                      listed.recorded);
    for (const rosbag::MessageInstance& message : view) {
      if (stampOf(message) != listed.stamp) continue;
      const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
      if (!compressed) return message.instantiate<sensor_msgs::Image>();
      try {
        return decodeColour(*compressed);
      } catch (const std::runtime_error&) {
        return nullptr;
      }
    }
    return nullptr;
  }

  CameraImage rectified(const CameraImage& raw) {
    if (!rectification_) {
      rectification_.emplace(rectifyChoice(options_), options_.colour_topic,
                             Rectification::Kind::kColour);
    }
    return rectification_->applyAndWarn(raw);
  }

  std::optional<SourceColour> skip(const std::string& reason) {
    ++skipped_["colour images: " + reason];
    return std::nullopt;
  }

  std::optional<SourceColour> makeColour(const sensor_msgs::ImageConstPtr& image) {
    if (!image) return skip(toString(DropReason::kBadImage));
    const sensor_msgs::CameraInfoConstPtr info = infos_->of(*image);
    if (!info) return skip(toString(DropReason::kNoCameraInfo));
    if (const auto rejection = checkColourImage(*image, *info)) {
      return skip(toString(rejection->reason));
    }
    const std::optional<Eigen::Isometry3d> T_W_C = poses_->of(image->header);
    if (!T_W_C) return skip(poses_->whyNone());
    const auto pixels = std::make_shared<cv_bridge::CvImageConstPtr>();
    SourceColour colour;
    try {
      const CameraImage camera = rectified({image, info});
      colour.colour = makeColourFrame(camera.image, *camera.info, *pixels);
    } catch (const std::exception&) {  // of OpenCV or cv_bridge
      return skip(toString(DropReason::kBadImage));
    }
    colour.colour.T_W_C = *T_W_C;
    colour.pixels = pixels;
    colour.stamp_s = image->header.stamp.toSec();
    return colour;
  }

  BagOptions options_;
  rosbag::Bag bag_;
  std::unique_ptr<BagPoses> poses_;
  std::unique_ptr<BagCameraInfos> infos_;
  std::optional<Rectification> rectification_;  ///< Once the topic is known.
  std::vector<Recorded> images_;                ///< By stamp.
  size_t next_ = 0;
  std::map<std::string, size_t> skipped_;
};

}  // namespace

std::unique_ptr<ColourSource> openBagColours(const BagOptions& options) {
  auto colours = std::make_unique<BagColours>(options);
  if (!colours->isThere()) return nullptr;
  return colours;
}

}  // namespace dtsdf
