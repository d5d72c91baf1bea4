/// What images of a bag need beside themselves, whatever kind they are: topics, camera_info, poses.
#pragma once

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <functional>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/bag_frames.h"
#include "io/pose_files.h"
#include "io/trajectory.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/input/images.h"
#include "ros/input/transforms.h"

namespace dtsdf {

inline bool hasMessages(const rosbag::Bag& bag, const std::string& topic) {
  return rosbag::View(bag, rosbag::TopicQuery(topic)).size() > 0;
}

/// @throws std::runtime_error if it has none.
inline void requireMessages(const rosbag::Bag& bag, const std::string& topic) {
  if (hasMessages(bag, topic)) return;
  throw std::runtime_error("'" + bag.getFileName() + "' has no messages on '" + topic +
                           "'; rosbag info lists its topics");
}

/// The topics whose first message is wanted. An image that was recorded both ways counts once, as
/// it was before it was compressed.
inline std::set<std::string> findImageTopics(
    const rosbag::Bag& bag, const std::function<bool(const rosbag::MessageInstance&)>& is_wanted) {
  std::set<std::string> topics;
  rosbag::View all(bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    rosbag::View messages(bag, rosbag::TopicQuery(connection->topic));
    if (messages.size() > 0 && is_wanted(*messages.begin())) topics.insert(connection->topic);
  }
  for (auto topic = topics.begin(); topic != topics.end();) {
    const std::string raw = withoutTransport(*topic);
    const bool twice = raw != *topic && topics.count(raw) > 0;
    topic = twice ? topics.erase(topic) : std::next(topic);
  }
  return topics;
}

/// " '/a' '/b'".
inline std::string inList(const std::set<std::string>& topics) {
  std::string list;
  for (const std::string& topic : topics) list += " '" + printable(topic) + "'";
  return list;
}

/// What `read` returns. @throws std::runtime_error in place of an exception of rosbag.
template <class Read>
auto readingBag(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + path + "': " + errorText(error) +
                             "; try rosbag reindex, or rosbag fix");
  }
}

/// The poses of cameras: from the transforms of the whole bag, or a trajectory in their place.
class BagPoses {
 public:
  /// @throws std::runtime_error if the trajectory cannot be read.
  BagPoses(const rosbag::Bag& bag, const BagOptions& options) : options_(options) {
    ros::Time::init();  // for the log
    for (std::string* frame : {&options_.map_frame, &options_.input.camera_frame}) {
      *frame = stripLeadingSlash(*frame);
    }
    if (options_.tf_topic.empty()) options_.tf_topic = "/tf";
    if (!options.poses_path.empty()) {
      trajectory_ = readTrajectory(options.poses_path, "poses are expected there");
      return;
    }
    const std::vector<std::string> topics{options_.tf_topic, options_.tf_topic + "_static",
                                          "/tf_static", "tf", "tf_static"};
    for (const auto& message : rosbag::View(bag, rosbag::TopicQuery(topics))) {
      const auto tf = message.instantiate<tf2_msgs::TFMessage>();
      if (!tf) continue;
      const bool is_static = message.getTopic().find("tf_static") != std::string::npos;
      for (const auto& transform : tf->transforms) transforms_.take(transform, "bag", is_static);
    }
    if (hasMessages(bag, options_.tf_topic)) return;
    others_ = findImageTopics(
        bag, [](const auto& m) { return m.template isType<tf2_msgs::TFMessage>(); });
  }

  /// Pose of the image with this header; `why_none` says why there is none.
  std::optional<Eigen::Isometry3d> of(const std_msgs::Header& header,
                                      std::string* why_none = nullptr) const {
    PoseAnswer pose;
    if (trajectory_) {
      pose.T_W_C = trajectory_->poseAt(header.stamp.toSec(), options_.pose_tolerance_s);
    } else {
      pose = find(header, header.stamp);
    }
    if (why_none != nullptr) *why_none = pose.text;
    if (pose.T_W_C) pose.T_W_C = opticalPose(*pose.T_W_C, options_.pose_convention);
    return pose.T_W_C;
  }

  /// Why an image has no pose.
  std::string whyNone() const {
    return trajectory_ ? noPoseWithin(options_.pose_tolerance_s) : drop::kNoTransform.name;
  }

  /// @throws std::runtime_error if no image with this header can have one, as no transforms of the
  /// bag lead from its frame to the map's.
  void requireFrames(const std_msgs::Header& header, const std::string& bag_path) const {
    if (trajectory_) return;
    const PoseAnswer newest = find(header, ros::Time(0));
    if (newest.T_W_C) return;
    std::string help;
    for (const std::string& topic : others_) {
      if (!endsWith(topic, "_static")) help += "; give --tf-topic " + printable(topic);
    }
    throw std::runtime_error("'" + printable(bag_path) + "': " + newest.text + help +
                             "; or give poses by --poses, or none with --poses-mode track");
  }

 private:
  PoseAnswer find(const std_msgs::Header& header, const ros::Time& stamp) const {
    const std::string frame = options_.input.camera_frame.empty()
                                  ? stripLeadingSlash(header.frame_id)
                                  : options_.input.camera_frame;
    return transforms_.find(options_.map_frame, frame, stamp);
  }

  static constexpr double kKeepAll_s = 1.0e8;  ///< Longer than any recording.

  BagOptions options_;            ///< Frames without leading slashes.
  std::set<std::string> others_;  ///< Topics with transforms, where the bag has none on that named.
  Transforms transforms_{std::chrono::steady_clock::now, kKeepAll_s};
  std::optional<Trajectory> trajectory_;  ///< In place of the transforms.
};

}  // namespace dtsdf
