#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "io/bag_frames.h"
#include "io/recorded_images.h"
#include "params/printable.h"
#include "ros/bag/bag_messages.h"
#include "ros/input/image_kind.h"
#include "ros/input/images.h"
#include "ros/input/rectification.h"

namespace dtsdf {
namespace {

/// How much earlier or later than its image a mask may have been recorded.
constexpr double kMaskRecordedNear_s = 5.0;

bool isDepth(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) {
    return isDepthEncoding(image->encoding);
  }
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed && holdsDepth(*compressed);
}

/// Nothing for what is no image, or a damaged one.
sensor_msgs::ImageConstPtr depthImageOf(const rosbag::MessageInstance& message) {
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed) return message.instantiate<sensor_msgs::Image>();
  try {
    return decodeDepth(*compressed);
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

std::string chooseDepthTopic(const rosbag::Bag& bag) {
  const std::string& path = bag.getFileName();
  const std::set<std::string> topics = findImageTopics(bag, isDepth, kCompressedDepthTopic);
  if (topics.size() == 1) return *topics.begin();
  if (topics.empty()) throw std::runtime_error("'" + path + "' has no topic with depth images");
  std::string list;
  for (const std::string& topic : topics) list += " " + topic;
  throw std::runtime_error("'" + path + "' has several topics with depth images:" + list +
                           "; choose one by --depth-topic");
}

/// The depth topic named, or the only one: as it is, or as it was compressed.
std::string depthTopicOf(const rosbag::Bag& bag, const BagOptions& options) {
  const std::string topic =
      options.depth_topic.empty() ? chooseDepthTopic(bag) : options.depth_topic;
  const std::string compressed = topic + kCompressedDepthTopic;
  if (hasMessages(bag, topic)) return topic;
  if (hasMessages(bag, compressed)) return compressed;
  std::string others;
  for (const std::string& other : findImageTopics(bag, isDepth, kCompressedDepthTopic)) {
    others += (others.empty() ? "; depth is on '" : ", '") + printable(other) + "'";
  }
  throw std::runtime_error("'" + printable(bag.getFileName()) + "' has no messages on '" +
                           printable(topic) + "'" +
                           (others.empty() ? ", nor any topic with depth images" : others));
}

class BagFrames : public FrameSource {
 public:
  explicit BagFrames(const BagOptions& options)
      : options_(options), units_{options.unit_16uc1_m, options.unit_32fc1_m} {
    try {
      bag_.open(options.path, rosbag::bagmode::Read);
      chooseTopics();
      poses_ = std::make_unique<BagPoses>(bag_, options_);
      infos_ = std::make_unique<BagCameraInfos>(bag_, options_.info_topic, options_.intrinsics,
                                                options_.latest_camera_info);
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("cannot read the bag '" + options.path + "': " + error.what());
    }
    images_ = std::make_unique<rosbag::View>(bag_, rosbag::TopicQuery(options_.depth_topic));
    next_ = images_->begin();
    checkSelection(options_.selection, images_->size());
  }

  std::optional<size_t> size() const override {
    return options_.selection.countIn(images_->size());
  }

  std::optional<SourceFrame> next() override {
    try {
      for (; next_ != images_->end(); ++index_) {
        const rosbag::View::iterator current = next_++;
        if (!options_.selection.contains(index_)) continue;
        if (auto frame = makeFrame(depthImageOf(*current), current->getTime())) {
          frame->index = index_++;
          return frame;
        }
      }
      return std::nullopt;
    } catch (const rosbag::BagException& error) {
      throw brokenBag(options_, error);
    }
  }

  const std::map<std::string, size_t>& skipped() const override { return skipped_; }

 private:
  void chooseTopics() {
    options_.depth_topic = depthTopicOf(bag_, options_);
    if (options_.info_topic.empty()) {
      options_.info_topic =
          topicBeside(withoutEnding(options_.depth_topic, kCompressedDepthTopic), "camera_info");
    }
    if (!options_.intrinsics) requireMessages(bag_, options_.info_topic);
    if (!options_.mask_topic.empty()) requireMessages(bag_, options_.mask_topic);
  }

  std::optional<SourceFrame> skip(const std::string& reason) {
    ++skipped_[reason];
    return std::nullopt;
  }

  CameraImage rectified(const CameraImage& raw) {
    if (!rectification_) rectification_.emplace(rectifyChoice(options_), options_.depth_topic);
    return rectification_->applyAndWarn(raw);
  }

  /// The mask of an image's stamp, recorded near it.
  sensor_msgs::ImageConstPtr maskOf(const sensor_msgs::Image& image,
                                    const ros::Time& recorded) const {
    const ros::Duration reach(std::min(kMaskRecordedNear_s, recorded.toSec()));
    rosbag::View masks(bag_, rosbag::TopicQuery(options_.mask_topic), recorded - reach,
                       recorded + reach);
    for (const rosbag::MessageInstance& message : masks) {
      const auto mask = message.instantiate<sensor_msgs::Image>();
      if (mask && mask->header.stamp == image.header.stamp) return mask;
    }
    return nullptr;
  }

  /// The image without what its mask hides, or why it cannot be had.
  std::optional<DropReason> hideMasked(sensor_msgs::ImageConstPtr& image,
                                       const ros::Time& recorded) const {
    if (options_.mask_topic.empty()) return std::nullopt;
    const sensor_msgs::ImageConstPtr mask = maskOf(*image, recorded);
    if (!mask) return DropReason::kNoMask;
    if (const auto rejection = checkMask(*mask, *image)) return rejection->reason;
    image = applyMask(*mask, *image);
    return std::nullopt;
  }

  std::optional<Eigen::Isometry3d> poseOf(const std_msgs::Header& header) {
    if (!options_.first_pose_only) return poses_->of(header);
    if (!first_T_W_C_) first_T_W_C_ = poses_->of(header).value_or(Eigen::Isometry3d::Identity());
    return first_T_W_C_;
  }

  std::optional<SourceFrame> makeFrame(sensor_msgs::ImageConstPtr image,
                                       const ros::Time& recorded) {
    if (!image) return skip(toString(DropReason::kBadImage));
    const sensor_msgs::CameraInfoConstPtr info = infos_->of(*image);
    if (!info) return skip(toString(DropReason::kNoCameraInfo));
    if (const auto rejection = checkDepthImage(*image, *info)) {
      return skip(toString(rejection->reason));
    }
    if (std::exchange(last_stamp_, image->header.stamp) == image->header.stamp) {
      return skip(toString(DropReason::kRepeatedStamp));
    }
    if (const auto reason = hideMasked(image, recorded)) return skip(toString(*reason));
    const std::optional<Eigen::Isometry3d> T_W_C = poseOf(image->header);
    if (!T_W_C) {
      poses_->requireFrames(image->header, options_.path);
      return skip(poses_->whyNone());
    }
    const auto pixels = std::make_shared<cv_bridge::CvImageConstPtr>();
    SourceFrame frame;
    const CameraImage camera = rectified({image, info});
    frame.depth = makeDepthFrame(camera.image, *camera.info, units_, *pixels);
    frame.depth.T_W_C = *T_W_C;
    frame.pixels = pixels;
    frame.stamp_s = image->header.stamp.toSec();
    return frame;
  }

  BagOptions options_;
  DepthUnits units_;
  rosbag::Bag bag_;
  std::unique_ptr<BagPoses> poses_;
  std::unique_ptr<BagCameraInfos> infos_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;  ///< With first_pose_only, once it is known.
  std::optional<Rectification> rectification_;    ///< Once the topic is known.
  std::unique_ptr<rosbag::View> images_;
  rosbag::View::iterator next_;
  ros::Time last_stamp_;
  size_t index_ = 0;  ///< Of the image at `next_`.
  std::map<std::string, size_t> skipped_;
};

}  // namespace

std::string depthCameraFrame(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.camera_frame.empty()) return options.camera_frame;
  for (const rosbag::MessageInstance& message :
       rosbag::View(bag, rosbag::TopicQuery(depthTopicOf(bag, options)))) {
    if (const auto image = depthImageOf(message)) return image->header.frame_id;
  }
  return "";
}

std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options) {
  return std::make_unique<BagFrames>(options);
}

}  // namespace dtsdf
