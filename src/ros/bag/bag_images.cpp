/// Depth and colour images of a bag.
#include <ros/console.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "io/recorded_images.h"
#include "params/printable.h"
#include "ros/bag/bag_messages.h"
#include "ros/input/images.h"
#include "ros/input/rectification.h"

namespace dtsdf {
namespace {

/// How much earlier or later than its image a mask may have been recorded.
constexpr double kMaskRecordedNear_s = 5.0;

bool isOf(const ImageKind& kind, const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) {
    return kind.has_encoding(image->encoding);
  }
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed && kind.has_format(*compressed);
}

/// Null for what is no image, or a damaged one, with what is wrong.
sensor_msgs::ImageConstPtr imageOf(const ImageKind& kind, const rosbag::MessageInstance& message,
                                   std::string* problem = nullptr) {
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed) return message.instantiate<sensor_msgs::Image>();
  try {
    return kind.decode(*compressed);
  } catch (const std::runtime_error& error) {
    if (problem != nullptr) *problem = errorText(error);
    return nullptr;
  }
}

std::set<std::string> topicsOf(const ImageKind& kind, const rosbag::Bag& bag) {
  return findImageTopics(bag, [&](const auto& message) { return isOf(kind, message); });
}

/// "; its images are on '/a' (64FC1), '/b' (jpeg)"; empty where it has none.
std::string imagesInList(const rosbag::Bag& bag) {
  std::string list;
  findImageTopics(bag, [&](const rosbag::MessageInstance& message) {
    const auto image = message.instantiate<sensor_msgs::Image>();
    const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
    if (!image && !compressed) return false;
    list += (list.empty() ? "; its images are on '" : ", '") + printable(message.getTopic()) +
            "' (" + printable(image ? image->encoding : compressed->format) + ")";
    return true;
  });
  return list.empty() ? "" : list + "; depth must be 16UC1 or 32FC1";
}

std::string inList(const std::set<std::string>& topics) {
  std::string list;
  for (const std::string& topic : topics) list += " '" + printable(topic) + "'";
  return list;
}

/// The topic as it is, or as it was compressed.
std::string recordedTopic(const ImageKind& kind, const rosbag::Bag& bag, const std::string& topic) {
  for (const char* const ending : {"", kind.compressed_topic, kCompressedTopic}) {
    if (hasMessages(bag, topic + ending)) return topic + ending;
  }
  const std::set<std::string> others = topicsOf(kind, bag);
  const std::string name = kind.name;
  throw std::runtime_error("'" + printable(bag.getFileName()) + "' has no messages on '" +
                           printable(topic) + "'" +
                           (others.empty() ? ", nor any topic with " + name + " images"
                                           : "; " + name + " is on" + inList(others)));
}

/// The depth topic named, or the only one.
std::string depthTopicOf(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.depth_topic.empty()) return recordedTopic(kDepthImages, bag, options.depth_topic);
  const std::string path = "'" + bag.getFileName() + "'";
  const std::set<std::string> topics = topicsOf(kDepthImages, bag);
  if (topics.empty()) {
    throw std::runtime_error(path + " has no topic with depth images" + imagesInList(bag));
  }
  if (topics.size() == 1) return *topics.begin();
  throw std::runtime_error(path + " has several topics with depth images:" + inList(topics) +
                           "; choose one by --depth-topic");
}

/// The colour topic named, or the only one; empty where there is none, or nobody has said which.
std::string colourTopicOf(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.colour_topic.empty()) return recordedTopic(kColourImages, bag, options.colour_topic);
  const std::set<std::string> topics = topicsOf(kColourImages, bag);
  if (topics.size() == 1) return *topics.begin();
  if (!topics.empty()) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "several topics with colour images, so none is used:"
                                               << inList(topics)
                                               << "; choose one by --color-topic");
  }
  return "";
}

/// A bag that is read for images of one kind. An exception of rosbag becomes a sentence.
class BagReader {
 public:
  explicit BagReader(const BagOptions& options, const ImageKind& kind)
      : options(options), kind_(kind) {
    bag.open(options.path, rosbag::bagmode::Read);
  }

  /// What is needed beside the images. Empty topic of `info_topic`: camera_info beside `topic`.
  void prepare(const std::string& topic, std::string info_topic) {
    this->topic = topic;
    if (info_topic.empty()) {
      const std::string image_topic = withoutTransport(topic);
      info_topic = image_topic.substr(0, image_topic.rfind('/') + 1) + "camera_info";
    }
    info_topic_ = info_topic;
    if (!kind_.is_colour && !options.intrinsics && !hasMessages(bag, info_topic)) {
      const std::set<std::string> infos = findImageTopics(bag, [](const auto& message) {
        return message.template isType<sensor_msgs::CameraInfo>();
      });
      throw std::runtime_error(
          "'" + printable(options.path) + "' has no camera_info on '" + printable(info_topic) +
          (infos.empty() ? "'; give --intrinsics"
                         : "', but on" + inList(infos) +
                               "; choose by --info-topic (where it is sent once, with --set "
                               "input/camera_info=latest), or give --intrinsics"));
    }
    poses_ = std::make_unique<BagPoses>(bag, options);
    // All of them, small as they are: an image may be recorded before its camera_info.
    for (const auto& message : rosbag::View(bag, rosbag::TopicQuery(info_topic))) {
      const auto info = message.instantiate<sensor_msgs::CameraInfo>();
      if (info) infos_[info->header.stamp] = info;
    }
    rectification_.emplace(options.rectify, withoutTransport(topic), kind_.is_colour);
  }

  /// What next() goes through, in the order of the stamps that `stamp_of` gives.
  template <class StampOf>
  void list(const StampOf& stamp_of) {
    rosbag::View view(bag, rosbag::TopicQuery(topic));
    for (const rosbag::MessageInstance& message : view)
      messages_.emplace(stamp_of(message), message);
    next_ = messages_.begin();
  }

  size_t size() const { return messages_.size(); }

  /// The next frame that is wanted and can be made.
  /// @throws std::runtime_error where the bag is damaged.
  template <class Frame, class Make>
  std::optional<Frame> next(const Make& make) try {
    for (; next_ != messages_.end(); ++index_) {
      const rosbag::MessageInstance& message = (next_++)->second;
      if (!isWanted(index_)) continue;
      if (auto frame = makeFrame<Frame>(message, make)) {
        frame->index = index_++;
        return frame;
      }
    }
    return std::nullopt;
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + options.path + "' any further: " +
                             errorText(error) + "; try rosbag reindex, or rosbag fix");
  }

  BagOptions options;
  rosbag::Bag bag;
  std::string topic;
  std::map<std::string, size_t> skipped;
  std::map<std::string, std::string> problems;

 private:
  bool isWanted(size_t index) const {
    if (!kind_.is_colour) return options.selection.contains(index);
    if (!options.selection.containsColour(index)) return false;
    const auto& listed = options.listed_colours;
    return !listed || std::binary_search(listed->begin(), listed->end(), index);
  }

  /// A frame of the image, of which `make` makes what is fused; none where it has to be skipped.
  template <class Frame, class Make>
  std::optional<Frame> makeFrame(const rosbag::MessageInstance& message, const Make& make) {
    std::string problem = "a message of another type";
    sensor_msgs::ImageConstPtr image = imageOf(kind_, message, &problem);
    if (!image) return skip({DropReason::kBadImage, problem});
    const sensor_msgs::CameraInfoConstPtr info = infoOf(*image);
    if (!info) {
      return skip({DropReason::kNoCameraInfo,
                   noInfoText(printable(info_topic_), options.latest_camera_info)});
    }
    if (const auto rejection = kind_.check(*image, *info)) return skip(*rejection);
    if (!kind_.is_colour &&
        std::exchange(last_stamp_, image->header.stamp) == image->header.stamp) {
      return skip({DropReason::kRepeatedStamp, kRepeatedStampText});
    }
    if (const auto rejection = hideMasked(image, message.getTime())) return skip(*rejection);
    std::string why_none;
    const std::optional<Eigen::Isometry3d> T_W_C = poseOf(image->header, why_none);
    if (!T_W_C) {
      if (!kind_.is_colour) poses_->requireFrames(image->header, options.path);
      return skip(poses_->whyNone(), why_none);
    }
    const auto pixels = std::make_shared<cv_bridge::CvImageConstPtr>();
    Frame frame;
    try {
      make(rectification_->apply({image, info}), *T_W_C, *pixels, frame);
    } catch (const std::exception& error) {  // of OpenCV or cv_bridge
      return skip({DropReason::kBadImage, errorText(error)});
    }
    frame.pixels = pixels;
    frame.stamp_s = image->header.stamp.toSec();
    return frame;
  }

  std::nullopt_t skip(const Rejection& rejection) {
    return skip(toString(rejection.reason), rejection.text);
  }
  std::nullopt_t skip(const std::string& name, const std::string& text) {
    const std::string reason = (kind_.is_colour ? "colour images: " : "") + name;
    ++skipped[reason];
    if (!text.empty()) problems.emplace(reason, text);
    return std::nullopt;
  }

  /// Null if there is none for the image.
  sensor_msgs::CameraInfoConstPtr infoOf(const sensor_msgs::Image& image) const {
    if (options.intrinsics) {
      return boost::make_shared<sensor_msgs::CameraInfo>(
          makeCameraInfo(image, *options.intrinsics));
    }
    const auto info = infos_.find(image.header.stamp);
    if (info != infos_.end()) return info->second;
    if (!options.latest_camera_info || infos_.empty()) return nullptr;
    const auto after = infos_.upper_bound(image.header.stamp);
    return after == infos_.begin() ? after->second : std::prev(after)->second;
  }

  /// The mask of an image's stamp, recorded near it.
  sensor_msgs::ImageConstPtr maskOf(const sensor_msgs::Image& image,
                                    const ros::Time& recorded) const {
    const ros::Duration reach(std::min(kMaskRecordedNear_s, recorded.toSec()));
    rosbag::View masks(bag, rosbag::TopicQuery(options.mask_topic), recorded - reach,
                       recorded + reach);
    for (const rosbag::MessageInstance& message : masks) {
      const auto mask = message.instantiate<sensor_msgs::Image>();
      if (mask && mask->header.stamp == image.header.stamp) return mask;
    }
    return nullptr;
  }

  /// Takes from the image what its mask hides; or why that cannot be done.
  std::optional<Rejection> hideMasked(sensor_msgs::ImageConstPtr& image,
                                      const ros::Time& recorded) const {
    if (options.mask_topic.empty()) return std::nullopt;
    const sensor_msgs::ImageConstPtr mask = maskOf(*image, recorded);
    if (!mask) return Rejection{DropReason::kNoMask, noMaskText(printable(options.mask_topic))};
    if (auto rejection = checkMask(*mask, *image)) return rejection;
    image = applyMask(*mask, *image);
    return std::nullopt;
  }

  std::optional<Eigen::Isometry3d> poseOf(const std_msgs::Header& header, std::string& why_none) {
    if (!options.first_pose_only) return poses_->of(header, &why_none);
    if (!first_T_W_C_) first_T_W_C_ = poses_->of(header).value_or(Eigen::Isometry3d::Identity());
    return first_T_W_C_;
  }

  const ImageKind& kind_;
  std::unique_ptr<BagPoses> poses_;
  std::map<ros::Time, sensor_msgs::CameraInfoConstPtr> infos_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;  ///< With first_pose_only, once it is known.
  std::optional<Rectification> rectification_;
  ros::Time last_stamp_;
  std::string info_topic_;
  std::multimap<ros::Time, rosbag::MessageInstance> messages_;
  std::multimap<ros::Time, rosbag::MessageInstance>::const_iterator next_ = messages_.end();
  size_t index_ = 0;  ///< Of the message at `next_`.
};

/// In the order in which they were recorded.
class BagFrames : public FrameSource {
 public:
  explicit BagFrames(const BagOptions& options) : reader_(options, kDepthImages) {
    reader_.prepare(depthTopicOf(reader_.bag, options), options.info_topic);
    if (!options.mask_topic.empty()) requireMessages(reader_.bag, options.mask_topic);
    reader_.list([](const auto&) { return ros::Time(); });
    checkSelection(options.selection, reader_.size());
  }

  std::optional<size_t> size() const override {
    return reader_.options.selection.countIn(reader_.size());
  }

  std::optional<SourceFrame> next() override {
    const DepthUnits units{reader_.options.unit_16uc1_m, reader_.options.unit_32fc1_m};
    return reader_.next<SourceFrame>(
        [&](const CameraImage& camera, const Eigen::Isometry3d& T_W_C, auto& pixels, auto& frame) {
          frame.depth = makeDepthFrame(camera.image, *camera.info, units, pixels);
          frame.depth.T_W_C = T_W_C;
        });
  }

  const std::map<std::string, size_t>& skipped() const override { return reader_.skipped; }
  std::map<std::string, std::string> problems() const override { return reader_.problems; }

 private:
  BagReader reader_;
};

/// The optical frame of the depth camera, by the options or by its first image.
std::string depthCameraFrame(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.camera_frame.empty()) return options.camera_frame;
  for (const rosbag::MessageInstance& message :
       rosbag::View(bag, rosbag::TopicQuery(depthTopicOf(bag, options)))) {
    if (const auto image = imageOf(kDepthImages, message)) return image->header.frame_id;
  }
  return "";
}

/// Zero of what is no image.
ros::Time stampOf(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) return image->header.stamp;
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed ? compressed->header.stamp : ros::Time();
}

/// In the order of their stamps.
class BagColours : public ColourSource {
 public:
  explicit BagColours(const BagOptions& options) : reader_(options, kColourImages) {
    const std::string topic = colourTopicOf(reader_.bag, options);
    if (topic.empty()) return;
    BagOptions& of_colour = reader_.options;
    if (options.first_pose_only) {
      of_colour.map_frame = depthCameraFrame(reader_.bag, options);
      of_colour.poses_path.clear();
      of_colour.first_pose_only = false;
    }
    of_colour.camera_frame.clear();  // the frame of colour images is their own
    of_colour.mask_topic.clear();
    of_colour.intrinsics.reset();
    reader_.prepare(topic, options.colour_info_topic);
    reader_.list(stampOf);
  }

  /// Whether there are colour images.
  bool isThere() const { return !reader_.topic.empty(); }

  std::optional<SourceColour> next() override {
    return reader_.next<SourceColour>(
        [](const CameraImage& camera, const Eigen::Isometry3d& T_W_C, auto& pixels, auto& frame) {
          frame.colour = makeColourFrame(camera.image, *camera.info, pixels);
          frame.colour.T_W_C = T_W_C;
        });
  }

  const std::map<std::string, size_t>& skipped() const override { return reader_.skipped; }
  std::map<std::string, std::string> problems() const override { return reader_.problems; }

 private:
  BagReader reader_;
};

/// @throws std::runtime_error where rosbag cannot open it.
template <class Source>
std::unique_ptr<Source> open(const BagOptions& options) {
  try {
    return std::make_unique<Source>(options);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + options.path + "': " + errorText(error) +
                             "; try rosbag reindex, or rosbag fix");
  }
}

}  // namespace

std::unique_ptr<FrameSource> openBagFrames(const BagOptions& options) {
  return open<BagFrames>(options);
}

std::unique_ptr<ColourSource> openBagColours(const BagOptions& options) {
  auto colours = open<BagColours>(options);
  if (!colours->isThere()) return nullptr;
  return colours;
}

}  // namespace dtsdf
