/// Reads depth and colour images with camera_info and poses from a bag, and finds the vertical from
/// its IMU.
#include <ros/console.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>
#include <boost/make_shared.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/bag_frames.h"
#include "io/pose_files.h"
#include "io/recorded_images.h"
#include "io/trajectory.h"
#include "level/still_gravity.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/input/clouds.h"
#include "ros/input/conversions.h"
#include "ros/input/images.h"
#include "ros/input/rectification.h"
#include "ros/input/transforms.h"

namespace dtsdf {
namespace {

bool hasMessages(const rosbag::Bag& bag, const std::string& topic) {
  return rosbag::View(bag, rosbag::TopicQuery(topic)).size() > 0;
}

/// Lists the topics of a bag: "; its topics are '/a' (sensor_msgs/Image), '/b'
/// (tf2_msgs/TFMessage)".
std::string topicsOf(const rosbag::Bag& bag) {
  std::set<std::string> topics;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections()) {
    topics.insert("'" + printable(connection->topic) + "' (" + printable(connection->datatype) +
                  ")");
  }
  return "; its topics are " + joined({topics.begin(), topics.end()});
}

/// @throws std::runtime_error if the topic has no messages. The error text lists the bag's topics
/// and ends with `help`.
void requireMessages(const rosbag::Bag& bag, const std::string& topic,
                     const std::string& help = "") {
  if (hasMessages(bag, topic)) return;
  throw std::runtime_error("'" + printable(bag.getFileName()) + "' has no messages on '" +
                           printable(topic) + "'" + topicsOf(bag) + help);
}

/// Topics whose first message satisfies `is_wanted`. If images were recorded both raw and
/// compressed, only the raw topic counts.
std::set<std::string> findImageTopics(
    const rosbag::Bag& bag, const std::function<bool(const rosbag::MessageInstance&)>& is_wanted) {
  std::set<std::string> all, topics;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections()) {
    all.insert(connection->topic);
  }
  for (const std::string& topic : all) {  // sorted: raw topics precede their compressed topics
    rosbag::View messages(bag, rosbag::TopicQuery(topic));
    const bool is_known = topics.count(withoutTransport(topic)) > 0;
    if (!is_known && messages.size() > 0 && is_wanted(*messages.begin())) topics.insert(topic);
  }
  return topics;
}

/// @return the only topic. @throws std::runtime_error if there are none or several.
std::string onlyOneOf(const std::set<std::string>& topics, const rosbag::Bag& bag,
                      const std::string& content, const std::string& option) {
  if (topics.size() == 1) return *topics.begin();
  throw std::runtime_error("'" + printable(bag.getFileName()) + "' has " +
                           (topics.empty() ? "no topic" : "several topics") + " with " + content +
                           topicsOf(bag) + "; choose one with " + option);
}

/// Calls `read`, and turns exceptions from rosbag into std::runtime_error.
template <class Read>
auto readingBag(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + path + "': " + errorText(error) +
                             "; try rosbag reindex, or rosbag fix");
  }
}

/// Camera poses, from a trajectory file if one is given, else from the bag's transforms.
class BagPoses {
 public:
  /// @throws std::runtime_error if the trajectory cannot be read.
  BagPoses(const rosbag::Bag& bag, const BagOptions& options) : options_(options) {
    ros::Time::init();  // needed by the ROS log
    for (std::string* frame : {&options_.map_frame, &options_.input.camera_frame}) {
      *frame = stripLeadingSlash(*frame);
    }
    if (options_.tf_topic.empty()) options_.tf_topic = "/tf";
    if (!options.poses_path.empty()) {
      trajectory_ = readTrajectory(options.poses_path, "expected a file with poses");
      return;
    }
    const std::vector<std::string> topics{options_.tf_topic, options_.tf_topic + "_static",
                                          "/tf_static", "tf", "tf_static"};
    for (const auto& message : rosbag::View(bag, rosbag::TopicQuery(topics))) {
      const auto tf = message.instantiate<tf2_msgs::TFMessage>();
      if (!tf) continue;
      const bool is_static = endsWith(message.getTopic(), "_static");
      for (const auto& transform : tf->transforms) transforms_.take(transform, "bag", is_static);
    }
  }

  /// Pose of the camera for the image with this header.
  PoseAnswer of(const std_msgs::Header& header) const {
    PoseAnswer pose;
    if (trajectory_) {
      pose.T_W_C = trajectory_->poseAt(header.stamp.toSec(), options_.pose_tolerance_s);
    } else {
      pose = find(header, header.stamp);
    }
    if (pose.T_W_C) pose.T_W_C = opticalPose(*pose.T_W_C, options_.pose_convention);
    return pose;
  }

  /// Why an image has no pose.
  std::string missingPoseReason() const {
    return trajectory_ ? noPoseWithin(options_.pose_tolerance_s) : drop::kNoTransform.name;
  }

  /// @throws std::runtime_error if no transforms connect the header's frame to the map frame.
  void requireFrames(const std_msgs::Header& header, const rosbag::Bag& bag) const {
    if (trajectory_) return;
    const PoseAnswer newest = find(header, ros::Time(0));
    if (newest.T_W_C) return;
    throw std::runtime_error("'" + printable(bag.getFileName()) + "': " + newest.text +
                             topicsOf(bag) +
                             "; give --tf-topic, a trajectory with --poses, or --poses-mode track");
  }

 private:
  PoseAnswer find(const std_msgs::Header& header, const ros::Time& stamp) const {
    const std::string frame = options_.input.camera_frame.empty()
                                  ? stripLeadingSlash(header.frame_id)
                                  : options_.input.camera_frame;
    return transforms_.find(options_.map_frame, frame, stamp);
  }

  static constexpr double kKeepAll_s = 1.0e8;  ///< Longer than any recording.

  BagOptions options_;  ///< Frame names have no leading slashes.
  Transforms transforms_{std::chrono::steady_clock::now, kKeepAll_s};
  std::optional<Trajectory> trajectory_;  ///< If set, replaces the transforms.
};

/// The image in a message; null if the message is not an image or is damaged. If it is damaged,
/// sets `problem`.
sensor_msgs::ImageConstPtr imageOf(const ImageKind& kind, const rosbag::MessageInstance& message,
                                   std::string& problem) {
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed) return message.instantiate<sensor_msgs::Image>();
  try {
    return kind.decode(*compressed);
  } catch (const std::runtime_error& error) {
    problem = errorText(error);
    return nullptr;
  }
}

/// The header of an image or a cloud; empty for other messages.
std_msgs::Header headerOf(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) return image->header;
  if (const auto cloud = message.instantiate<sensor_msgs::PointCloud2>()) return cloud->header;
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed ? compressed->header : std_msgs::Header();
}

/// Returns `named` or its compressed topic. If `named` is empty, returns the only topic with images
/// of this kind or, for depth, with organised clouds. For colour, returns an empty name if there is
/// no such topic, or more than one.
/// @throws std::runtime_error if `named` has no messages, or if there are no depth topics or
/// several.
std::string topicOf(const ImageKind& kind, const rosbag::Bag& bag, const std::string& named) {
  for (const char* const ending : {"", kind.compressed_topic, kCompressedTopic}) {
    if (!named.empty() && hasMessages(bag, named + ending)) return named + ending;
  }
  if (!named.empty()) requireMessages(bag, named);
  std::set<std::string> topics = findImageTopics(bag, [&](const auto& message) {
    const auto image = message.template instantiate<sensor_msgs::Image>();
    if (image) return kind.has_encoding(image->encoding);
    const auto compressed = message.template instantiate<sensor_msgs::CompressedImage>();
    return compressed && kind.has_format(*compressed);
  });
  if (topics.empty() && !kind.is_colour) {
    topics = findImageTopics(bag, [](const auto& message) {
      const auto cloud = message.template instantiate<sensor_msgs::PointCloud2>();
      return cloud && cloud->height > 1;
    });
  }
  if (!kind.is_colour) {
    return onlyOneOf(topics, bag, "depth images (16UC1 or 32FC1) or organised clouds",
                     "--depth-topic");
  }
  if (topics.size() == 1) return *topics.begin();
  if (!topics.empty()) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                          "several topics with colour images, so none is used: "
                              << printableMessage(joined({topics.begin(), topics.end()}))
                              << "; choose one with --color-topic");
  }
  return "";
}

/// The depth or the colour images in a bag: depth in recording order, colour in the order of
/// stamps.
template <class Frame>
class BagImages : public ImageSource<Frame> {
 public:
  explicit BagImages(const BagOptions& options) : options_(options) {
    bag_.open(options.path, rosbag::bagmode::Read);
    topic_ = topicOf(kKind, bag_, kIsColour ? options.colour_topic : options.depth_topic);
    if (topic_.empty()) return;
    if (kIsColour) chooseForColour();
    const std::string image_topic = withoutTransport(topic_);
    info_topic_ = kIsColour ? options_.colour_info_topic : options_.info_topic;
    if (info_topic_.empty()) {
      info_topic_ = image_topic.substr(0, image_topic.rfind('/') + 1) + "camera_info";
    }
    rosbag::View view(bag_, rosbag::TopicQuery(topic_));
    if (view.begin()->isType<sensor_msgs::PointCloud2>()) clouds_.emplace(topic_);
    if (!kIsColour && !options_.intrinsics && !clouds_) {
      requireMessages(bag_, info_topic_,
                      "; choose one with --info-topic (if it is sent only once, also --set "
                      "input/camera_info=latest), or give --intrinsics");
    }
    if (!options_.mask_topic.empty()) requireMessages(bag_, options_.mask_topic);
    for (const auto& message : rosbag::View(bag_, rosbag::TopicQuery(options_.mask_topic))) {
      masks_.emplace(headerOf(message).stamp, message);
    }
    poses_ = std::make_unique<BagPoses>(bag_, options_);
    // Reads all camera_infos first, because an image may be recorded before its camera_info.
    for (const auto& message : rosbag::View(bag_, rosbag::TopicQuery(info_topic_))) {
      const auto info = message.instantiate<sensor_msgs::CameraInfo>();
      if (info) infos_[info->header.stamp] = info;
    }
    rectification_.emplace(options_.input.rectify, image_topic, kIsColour);
    for (const rosbag::MessageInstance& message : view) {
      messages_.emplace(kIsColour ? headerOf(message).stamp : ros::Time(), message);
    }
    next_ = messages_.begin();
    if (!kIsColour) checkSelection(options_.selection, messages_.size());
  }

  bool isEmpty() const { return topic_.empty(); }

  std::optional<size_t> size() const override {
    if (kIsColour) return std::nullopt;
    return options_.selection.countIn(messages_.size());
  }

  /// The next selected image that is usable and has a pose.
  /// @throws std::runtime_error if the bag is damaged.
  std::optional<Frame> next() override {
    return readingBag(options_.path, [&]() -> std::optional<Frame> {
      for (; next_ != messages_.end(); ++index_) {
        const rosbag::MessageInstance& message = (next_++)->second;
        if (!isSelected(options_, kIsColour, index_)) continue;
        if (auto frame = makeFrame(message)) {
          frame->index = index_++;
          return frame;
        }
      }
      return std::nullopt;
    });
  }

 private:
  static constexpr bool kIsColour = std::is_same_v<Frame, SourceColour>;
  static constexpr const ImageKind& kKind = kIsColour ? kColourImages : kDepthImages;

  /// Adapts the options to colour images, whose camera's frame is always the one in their header.
  /// With first_pose_only, the map frame becomes the depth camera's frame, which is camera_frame or
  /// the frame of the first depth image.
  void chooseForColour() {
    if (options_.first_pose_only) {
      options_.map_frame = options_.input.camera_frame;
      if (options_.map_frame.empty()) {
        rosbag::View view(bag_,
                          rosbag::TopicQuery(topicOf(kDepthImages, bag_, options_.depth_topic)));
        for (auto message = view.begin(); message != view.end() && options_.map_frame.empty();
             ++message) {
          options_.map_frame = headerOf(*message).frame_id;
        }
      }
      options_.poses_path.clear();
      options_.first_pose_only = false;
    }
    options_.input.camera_frame.clear();
    options_.mask_topic.clear();
    options_.intrinsics.reset();
  }

  /// Converts a message to a frame; returns nothing if the image is skipped.
  std::optional<Frame> makeFrame(const rosbag::MessageInstance& message) {
    std::string problem = "the message is not an image";
    CameraImage given;
    if (const auto cloud = message.instantiate<sensor_msgs::PointCloud2>(); cloud && clouds_) {
      const bool has_info = options_.intrinsics || !infos_.empty();
      auto converted = clouds_->convert(*cloud, has_info, std::numeric_limits<size_t>::max());
      if (const auto* const bad = std::get_if<Rejection>(&converted)) return skip(*bad);
      given = std::get<CameraImage>(std::move(converted));
    } else {
      given.image = imageOf(kKind, message, problem);
    }
    if (!given.image) return skip({drop::kBadImage, problem});
    if (!given.info) given.info = infoOf(*given.image);
    if (!given.info) {
      return skip({drop::kNoCameraInfo,
                   noInfoText(printable(info_topic_), options_.input.latest_camera_info)});
    }
    const std_msgs::Header& header = given.image->header;
    given.mask = maskOf(*given.image);
    if (const auto rejection = kKind.check(given)) return skip(*rejection);
    if (!kIsColour && std::exchange(last_stamp_, header.stamp) == header.stamp) {
      return skip({drop::kRepeatedStamp, kRepeatedStampText});
    }
    if (!given.mask && !options_.mask_topic.empty()) {
      return skip({drop::kNoMask, noMaskText(printable(options_.mask_topic))});
    }
    const PoseAnswer pose = poseOf(header);
    if (!pose.T_W_C) {
      if (!kIsColour) poses_->requireFrames(header, bag_);
      return skip(poses_->missingPoseReason(), pose.text);
    }
    const auto pixels = std::make_shared<cv_bridge::CvImageConstPtr>();
    Frame frame;
    try {
      auto made = rectification_->frameOf(given, clouds_.has_value(), options_.input, *pixels);
      const std::string& warning = rectification_->warning();
      if (!warning.empty()) ROS_WARN_STREAM_ONCE_NAMED("dtsdf_mapping", warning);
      std::visit([&](auto& of) { of.T_W_C = *pose.T_W_C; }, made);
      if constexpr (kIsColour) {
        frame.colour = std::get<ColourFrame>(made);
      } else {
        frame.depth = std::get<DepthFrame>(made);
      }
    } catch (const std::exception& error) {  // from OpenCV or cv_bridge
      return skip({drop::kBadImage, errorText(error)});
    }
    frame.pixels = pixels;
    frame.stamp_s = header.stamp.toSec();
    return frame;
  }

  std::nullopt_t skip(const Rejection& rejection) {
    return skip(rejection.reason.name, rejection.text);
  }
  std::nullopt_t skip(const std::string& name, const std::string& text) {
    const std::string reason = (kIsColour ? "colour images: " : "") + name;
    ++this->skipped_[reason];
    if (!text.empty()) this->problems_.emplace(reason, text);
    return std::nullopt;
  }

  /// The camera_info of an image; null if there is none.
  sensor_msgs::CameraInfoConstPtr infoOf(const sensor_msgs::Image& image) const {
    if (options_.intrinsics) {
      return boost::make_shared<sensor_msgs::CameraInfo>(
          makeCameraInfo(image, *options_.intrinsics));
    }
    const auto info = infos_.find(image.header.stamp);
    if (info != infos_.end()) return info->second;
    if (!options_.input.latest_camera_info || infos_.empty()) return nullptr;
    const auto after = infos_.upper_bound(image.header.stamp);
    return after == infos_.begin() ? after->second : std::prev(after)->second;
  }

  /// The mask with an image's stamp; null if there is none.
  sensor_msgs::ImageConstPtr maskOf(const sensor_msgs::Image& image) const {
    const auto mask = masks_.find(image.header.stamp);
    return mask == masks_.end() ? nullptr : mask->second.instantiate<sensor_msgs::Image>();
  }

  PoseAnswer poseOf(const std_msgs::Header& header) {
    if (!options_.first_pose_only) return poses_->of(header);
    if (!first_T_W_C_) {
      first_T_W_C_ = poses_->of(header).T_W_C.value_or(Eigen::Isometry3d::Identity());
    }
    return {first_T_W_C_};
  }

  BagOptions options_;
  rosbag::Bag bag_;
  std::string topic_, info_topic_;
  std::unique_ptr<BagPoses> poses_;
  std::map<ros::Time, sensor_msgs::CameraInfoConstPtr> infos_;
  std::map<ros::Time, rosbag::MessageInstance> masks_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;  ///< Pose of all images with first_pose_only.
  std::optional<Rectification> rectification_;
  std::optional<CloudImages> clouds_;  ///< Set if depth was recorded as clouds.
  ros::Time last_stamp_;
  std::multimap<ros::Time, rosbag::MessageInstance> messages_;
  std::multimap<ros::Time, rosbag::MessageInstance>::const_iterator next_ = messages_.end();
  size_t index_ = 0;  ///< Index of the message at `next_`.
};

}  // namespace

std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options) {
  return readingBag(options.path,
                    [&] { return std::make_unique<BagImages<SourceFrame>>(options); });
}

std::unique_ptr<ColourSource> openBagColours(const BagOptions& options) {
  auto colours =
      readingBag(options.path, [&] { return std::make_unique<BagImages<SourceColour>>(options); });
  if (colours->isEmpty()) return nullptr;
  return colours;
}

// The vertical in the map frame, from the bag's IMU.

namespace {

bool isInertial(const rosbag::MessageInstance& message) {
  return message.isType<sensor_msgs::Imu>();
}

Eigen::Vector3d findUp(const rosbag::Bag& bag, const BagOptions& options) {
  std::string topic = options.imu_topic;
  if (!topic.empty()) requireMessages(bag, topic);
  if (topic.empty()) {
    topic = onlyOneOf(findImageTopics(bag, isInertial), bag,
                      "IMU messages (sensor_msgs/Imu), which map/level: imu needs", "--imu-topic");
  }
  BagOptions of_sensor = options;
  of_sensor.input.camera_frame.clear();  // uses the frame of the messages
  const BagPoses poses(bag, of_sensor);
  StillGravity gravity;
  bool was_still = false;
  for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto imu = message.instantiate<sensor_msgs::Imu>();
    const auto sample = imu ? sampleOf(*imu) : std::nullopt;
    const auto up_I = sample ? gravity.add(*sample) : std::nullopt;
    if (!up_I) continue;
    was_still = true;
    if (const auto T_M_I = poses.of(imu->header).T_W_C) return T_M_I->linear() * *up_I;
  }
  throw std::runtime_error(
      "map/level is imu, but '" + printable(topic) + "' in '" + options.path + "' " +
      (was_still ? "has no transform to '" + printable(options.map_frame) + "' while at rest"
                 : std::string("is never at rest (9.8 m/s^2) for a second")) +
      "; set map/level to floor or none");
}

}  // namespace

Eigen::Vector3d findUpInBag(const BagOptions& options) {
  if (!options.poses_path.empty()) {
    throw std::runtime_error(
        "map/level is imu, which needs the bag's transforms; leave --poses out, or set map/level "
        "to floor or none");
  }
  return readingBag(options.path, [&] {
    rosbag::Bag bag;
    bag.open(options.path, rosbag::bagmode::Read);
    return findUp(bag, options);
  });
}

}  // namespace dtsdf
