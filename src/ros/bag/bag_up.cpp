// Up in the map frame, as an inertial sensor of a bag measures it.
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>

#include <stdexcept>

#include "io/bag_frames.h"
#include "params/printable.h"
#include "ros/bag/bag_messages.h"
#include "ros/input/conversions.h"

namespace dtsdf {
namespace {

bool isInertial(const rosbag::MessageInstance& message) {
  return message.isType<sensor_msgs::Imu>();
}

std::string chooseTopic(const rosbag::Bag& bag, const BagOptions& options) {
  if (!options.imu_topic.empty()) {
    requireMessages(bag, options.imu_topic);
    return options.imu_topic;
  }
  const std::set<std::string> topics = findImageTopics(bag, isInertial, "");
  if (topics.size() == 1) return *topics.begin();
  std::string list;
  for (const std::string& topic : topics) list += " " + printable(topic);
  throw std::runtime_error("map/level is imu, and '" + options.path + "' has " +
                           (topics.empty() ? "no topic of type sensor_msgs/Imu; set map/level to "
                                             "floor or none"
                                           : "several topics of type sensor_msgs/Imu:" + list +
                                                 "; choose one with --imu-topic"));
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
  try {
    rosbag::Bag bag;
    bag.open(options.path, rosbag::bagmode::Read);
    return findUp(bag, options);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read the bag '" + options.path + "': " + errorText(error));
  }
}

}  // namespace dtsdf
