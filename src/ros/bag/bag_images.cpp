/// Depth and colour images of a bag.
#include <ros/console.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

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

bool isOf(const ImageKind& kind, const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) {
    return kind.has_encoding(image->encoding);
  }
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed && kind.has_format(*compressed);
}

/// Null for what is no image, or a damaged one.
sensor_msgs::ImageConstPtr imageOf(const ImageKind& kind, const rosbag::MessageInstance& message) {
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed) return message.instantiate<sensor_msgs::Image>();
  try {
    return kind.decode(*compressed);
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

std::set<std::string> topicsOf(const ImageKind& kind, const rosbag::Bag& bag) {
  return findImageTopics(
      bag, [&](const auto& message) { return isOf(kind, message); }, kind.compressed_topic);
}

std::string inList(const std::set<std::string>& topics) {
  std::string list;
  for (const std::string& topic : topics) list += " '" + printable(topic) + "'";
  return list;
}

/// The topic as it is, or as it was compressed.
std::string recordedTopic(const ImageKind& kind, const rosbag::Bag& bag, const std::string& topic) {
  const std::string compressed = topic + kind.compressed_topic;
  if (hasMessages(bag, topic)) return topic;
  if (hasMessages(bag, compressed)) return compressed;
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
  if (topics.empty()) throw std::runtime_error(path + " has no topic with depth images");
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
      info_topic = topicBeside(withoutEnding(topic, kind_.compressed_topic), "camera_info");
    }
    if (!kind_.isColour() && !options.intrinsics) requireMessages(bag, info_topic);
    poses_ = std::make_unique<BagPoses>(bag, options);
    infos_ = std::make_unique<BagCameraInfos>(bag, info_topic, options.intrinsics,
                                              options.latest_camera_info);
    rectification_.emplace(rectifyChoice(options), topic, kind_.rectified_as);
  }

  sensor_msgs::ImageConstPtr imageOf(const rosbag::MessageInstance& message) const {
    return dtsdf::imageOf(kind_, message);
  }

  /// A frame of the image, of which `make` makes what is fused; none where it has to be skipped.
  template <class Frame, class Make>
  std::optional<Frame> makeFrame(sensor_msgs::ImageConstPtr image, const ros::Time& recorded,
                                 const Make& make) {
    if (!image) return skip(toString(DropReason::kBadImage));
    const sensor_msgs::CameraInfoConstPtr info = infos_->of(*image);
    if (!info) return skip(toString(DropReason::kNoCameraInfo));
    if (const auto rejection = kind_.check(*image, *info)) {
      return skip(toString(rejection->reason));
    }
    if (!kind_.isColour() &&
        std::exchange(last_stamp_, image->header.stamp) == image->header.stamp) {
      return skip(toString(DropReason::kRepeatedStamp));
    }
    if (const auto reason = hideMasked(image, recorded)) return skip(toString(*reason));
    const std::optional<Eigen::Isometry3d> T_W_C = poseOf(image->header);
    if (!T_W_C) {
      if (!kind_.isColour()) poses_->requireFrames(image->header, options.path);
      return skip(poses_->whyNone());
    }
    const auto pixels = std::make_shared<cv_bridge::CvImageConstPtr>();
    Frame frame;
    try {
      make(rectification_->apply({image, info}), *T_W_C, *pixels, frame);
    } catch (const std::exception&) {  // of OpenCV or cv_bridge
      return skip(toString(DropReason::kBadImage));
    }
    frame.pixels = pixels;
    frame.stamp_s = image->header.stamp.toSec();
    return frame;
  }

  /// @throws std::runtime_error where the work meets a damaged bag.
  template <class Work>
  auto read(const Work& work) const -> decltype(work()) {
    try {
      return work();
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("cannot read the bag '" + options.path + "' any further: " +
                               errorText(error) + "; try rosbag reindex, or rosbag fix");
    }
  }

  BagOptions options;
  rosbag::Bag bag;
  std::string topic;
  std::map<std::string, size_t> skipped;

 private:
  std::nullopt_t skip(const std::string& reason) {
    ++skipped[(kind_.isColour() ? "colour images: " : "") + reason];
    return std::nullopt;
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
  std::optional<DropReason> hideMasked(sensor_msgs::ImageConstPtr& image,
                                       const ros::Time& recorded) const {
    if (options.mask_topic.empty()) return std::nullopt;
    const sensor_msgs::ImageConstPtr mask = maskOf(*image, recorded);
    if (!mask) return DropReason::kNoMask;
    if (const auto rejection = checkMask(*mask, *image)) return rejection->reason;
    image = applyMask(*mask, *image);
    return std::nullopt;
  }

  std::optional<Eigen::Isometry3d> poseOf(const std_msgs::Header& header) {
    if (!options.first_pose_only) return poses_->of(header);
    if (!first_T_W_C_) first_T_W_C_ = poses_->of(header).value_or(Eigen::Isometry3d::Identity());
    return first_T_W_C_;
  }

  const ImageKind& kind_;
  std::unique_ptr<BagPoses> poses_;
  std::unique_ptr<BagCameraInfos> infos_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;  ///< With first_pose_only, once it is known.
  std::optional<Rectification> rectification_;
  ros::Time last_stamp_;
};

class BagFrames : public FrameSource {
 public:
  explicit BagFrames(const BagOptions& options) : reader_(options, kDepthImages) {
    reader_.prepare(depthTopicOf(reader_.bag, options), options.info_topic);
    if (!options.mask_topic.empty()) requireMessages(reader_.bag, options.mask_topic);
    images_ = std::make_unique<rosbag::View>(reader_.bag, rosbag::TopicQuery(reader_.topic));
    next_ = images_->begin();
    checkSelection(options.selection, images_->size());
  }

  std::optional<size_t> size() const override {
    return reader_.options.selection.countIn(images_->size());
  }

  std::optional<SourceFrame> next() override {
    return reader_.read([this]() -> std::optional<SourceFrame> {
      for (; next_ != images_->end(); ++index_) {
        const rosbag::View::iterator current = next_++;
        if (!reader_.options.selection.contains(index_)) continue;
        if (auto frame = makeFrame(*current)) {
          frame->index = index_++;
          return frame;
        }
      }
      return std::nullopt;
    });
  }

  const std::map<std::string, size_t>& skipped() const override { return reader_.skipped; }

 private:
  std::optional<SourceFrame> makeFrame(const rosbag::MessageInstance& message) {
    const DepthUnits units{reader_.options.unit_16uc1_m, reader_.options.unit_32fc1_m};
    return reader_.makeFrame<SourceFrame>(
        reader_.imageOf(message), message.getTime(),
        [&](const CameraImage& camera, const Eigen::Isometry3d& T_W_C, auto& pixels, auto& frame) {
          frame.depth = makeDepthFrame(camera.image, *camera.info, units, pixels);
          frame.depth.T_W_C = T_W_C;
        });
  }

  BagReader reader_;
  std::unique_ptr<rosbag::View> images_;
  rosbag::View::iterator next_;
  size_t index_ = 0;  ///< Of the image at `next_`.
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

/// Stamp and place of one image: bags have messages in the order in which they were recorded.
struct Recorded {
  ros::Time stamp, recorded;
};

std::optional<ros::Time> stampOf(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) return image->header.stamp;
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  return compressed ? std::optional<ros::Time>(compressed->header.stamp) : std::nullopt;
}

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
    for (const rosbag::MessageInstance& message :
         rosbag::View(reader_.bag, rosbag::TopicQuery(topic))) {
      if (const auto stamp = stampOf(message)) images_.push_back({*stamp, message.getTime()});
    }
    std::stable_sort(images_.begin(), images_.end(),
                     [](const Recorded& a, const Recorded& b) { return a.stamp < b.stamp; });
  }

  /// Whether there are colour images.
  bool isThere() const { return !reader_.topic.empty(); }

  std::optional<SourceColour> next() override {
    return reader_.read([this]() -> std::optional<SourceColour> {
      for (; next_ < images_.size(); ++next_) {
        const auto& listed = reader_.options.listed_colours;
        if (listed && !std::binary_search(listed->begin(), listed->end(), next_)) continue;
        if (auto colour = makeColour(images_[next_])) {
          colour->index = next_++;
          return colour;
        }
      }
      return std::nullopt;
    });
  }

  const std::map<std::string, size_t>& skipped() const override { return reader_.skipped; }

 private:
  sensor_msgs::ImageConstPtr imageAt(const Recorded& place) const {
    rosbag::View view(reader_.bag, rosbag::TopicQuery(reader_.topic), place.recorded,
                      place.recorded);
    for (const rosbag::MessageInstance& message : view) {
      if (stampOf(message) == place.stamp) return reader_.imageOf(message);
    }
    return nullptr;
  }

  std::optional<SourceColour> makeColour(const Recorded& place) {
    return reader_.makeFrame<SourceColour>(
        imageAt(place), place.recorded,
        [](const CameraImage& camera, const Eigen::Isometry3d& T_W_C, auto& pixels, auto& frame) {
          frame.colour = makeColourFrame(camera.image, *camera.info, pixels);
          frame.colour.T_W_C = T_W_C;
        });
  }

  BagReader reader_;
  std::vector<Recorded> images_;  ///< By stamp.
  size_t next_ = 0;
};

/// @throws std::runtime_error where rosbag cannot open it.
template <class Source>
std::unique_ptr<Source> open(const BagOptions& options) {
  try {
    return std::make_unique<Source>(options);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + options.path + "': " + error.what());
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
