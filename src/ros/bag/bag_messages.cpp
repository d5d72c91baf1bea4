#include "ros/bag/bag_messages.h"

#include <geometry_msgs/TransformStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <stdexcept>
#include <vector>

#include "io/bag_frames.h"
#include "io/pose_files.h"
#include "io/trajectory.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/input/conversions.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

/// Longer than any recording: no transform is forgotten.
const ros::Duration kKeepAll(1.0e8);

}  // namespace

bool hasMessages(const rosbag::Bag& bag, const std::string& topic) {
  return rosbag::View(bag, rosbag::TopicQuery(topic)).size() > 0;
}

void requireMessages(const rosbag::Bag& bag, const std::string& topic) {
  if (hasMessages(bag, topic)) return;
  throw std::runtime_error("'" + bag.getFileName() + "' has no messages on '" + topic +
                           "'; rosbag info lists its topics");
}

std::set<std::string> findImageTopics(
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

std::string inList(const std::set<std::string>& topics) {
  std::string list;
  for (const std::string& topic : topics) list += " '" + printable(topic) + "'";
  return list;
}

BagPoses::BagPoses(const rosbag::Bag& bag, const BagOptions& options)
    : options_(options), transforms_(kKeepAll) {
  for (std::string* frame : {&options_.map_frame, &options_.camera_frame}) {
    *frame = stripLeadingSlash(*frame);
  }
  if (options_.tf_topic.empty()) options_.tf_topic = "/tf";
  if (options.poses_path.empty()) {
    readTransforms(bag);
  } else {
    trajectory_ = readTrajectory(options.poses_path, "poses are expected there");
  }
}

void BagPoses::readTransforms(const rosbag::Bag& bag) {
  const std::vector<std::string> topics{options_.tf_topic, options_.tf_topic + "_static",
                                        "/tf_static", "tf", "tf_static"};
  if (!hasMessages(bag, options_.tf_topic)) {
    others_ = findImageTopics(
        bag, [](const auto& m) { return m.template isType<tf2_msgs::TFMessage>(); });
  }
  rosbag::View view(bag, rosbag::TopicQuery(topics));
  for (const rosbag::MessageInstance& message : view) {
    const auto tf = message.instantiate<tf2_msgs::TFMessage>();
    if (!tf) continue;
    const bool is_static = message.getTopic().find("tf_static") != std::string::npos;
    for (geometry_msgs::TransformStamped transform : tf->transforms) {
      transform.header.frame_id = stripLeadingSlash(transform.header.frame_id);
      transform.child_frame_id = stripLeadingSlash(transform.child_frame_id);
      try {
        if (!transforms_.setTransform(transform, "bag", is_static)) ++refused_;
      } catch (const std::runtime_error&) {
        // A stamp at the end of all time that ROS has; nothing in the bag is of then.
      }
    }
  }
}

std::string BagPoses::whyNone() const {
  return trajectory_ ? noPoseWithin(options_.pose_tolerance_s) : toString(DropReason::kNoTransform);
}

std::string BagPoses::cameraFrame(const std_msgs::Header& header) const {
  return options_.camera_frame.empty() ? stripLeadingSlash(header.frame_id) : options_.camera_frame;
}

void BagPoses::requireFrames(const std_msgs::Header& header, const std::string& bag_path) const {
  if (trajectory_) return;
  std::vector<std::string> frames;
  transforms_._getFrameStrings(frames);
  std::sort(frames.begin(), frames.end());
  std::string known = !frames.empty()   ? "its frames are " + listOfFrames(frames)
                      : others_.empty() ? "it has none at all: record /tf and /tf_static"
                                        : "it has transforms elsewhere";
  if (refused_ > 0) {
    known += "; " + std::to_string(refused_) + " transforms were refused (NaN, or no rotation)";
  }
  for (const std::string& topic : others_) {
    if (!endsWith(topic, "_static")) known += "; give --tf-topic " + printable(topic);
  }
  const auto require = [&](const std::string& frame, const std::string& key) {
    if (std::binary_search(frames.begin(), frames.end(), frame)) return;
    throw std::runtime_error("no transform in '" + printable(bag_path) + "' has the frame '" +
                             printable(frame) + "' (" + key + "); " + known +
                             "; or give poses by --poses, or none with --poses-mode track");
  };
  require(options_.map_frame, "map_frame");
  require(cameraFrame(header), "of the depth images");
}

std::optional<Eigen::Isometry3d> BagPoses::of(const std_msgs::Header& header,
                                              std::string* why_none) const {
  std::optional<Eigen::Isometry3d> pose;
  try {
    pose =
        trajectory_
            ? trajectory_->poseAt(header.stamp.toSec(), options_.pose_tolerance_s)
            : toIsometry(
                  transforms_.lookupTransform(options_.map_frame, cameraFrame(header), header.stamp)
                      .transform);
  } catch (const std::runtime_error& error) {
    // tf2's own exceptions, and that of ros::Duration where stamps lie over 68 years apart.
    if (why_none != nullptr) *why_none = errorText(error);
  }
  if (pose) pose = opticalPose(*pose, options_.pose_convention);
  return pose;
}

// Up in the map frame, as an inertial sensor of a bag measures it.

namespace {

bool isInertial(const rosbag::MessageInstance& message) {
  return message.isType<sensor_msgs::Imu>();
}

std::string chooseTopic(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.imu_topic.empty()) {
    requireMessages(bag, options.imu_topic);
    return options.imu_topic;
  }
  const std::set<std::string> topics = findImageTopics(bag, isInertial);
  if (topics.size() == 1) return *topics.begin();
  throw std::runtime_error("map/level is imu, and '" + options.path + "' has " +
                           (topics.empty() ? "no topic of type sensor_msgs/Imu; set map/level to "
                                             "floor or none"
                                           : "several topics of type sensor_msgs/Imu:" +
                                                 inList(topics) + "; choose one with --imu-topic"));
}

Eigen::Vector3d findUp(const rosbag::Bag& bag, const BagOptions& options) {
  const std::string topic = chooseTopic(bag, options);
  BagOptions of_sensor = options;
  of_sensor.camera_frame.clear();  // the frame is that of the messages
  const BagPoses poses(bag, of_sensor);
  StillGravity gravity;
  bool was_still = false;
  for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto imu = message.instantiate<sensor_msgs::Imu>();
    const auto sample = imu ? sampleOf(*imu) : std::nullopt;
    const auto up_I = sample ? gravity.add(*sample) : std::nullopt;
    if (!up_I) continue;
    was_still = true;
    if (const auto T_M_I = poses.of(imu->header)) return T_M_I->linear() * *up_I;
  }
  throw std::runtime_error(
      "map/level is imu, but '" + printable(topic) + "' of '" + options.path + "' " +
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
