#include "ros/session/path_input.h"

#include <exception>
#include <utility>

#include "params/printable.h"
#include "ros/common/callback_guard.h"
#include "ros/session/requests.h"

namespace dtsdf {
namespace {

GivenPoses readPath(const nav_msgs::Path& path) {
  GivenPoses given;
  given.frame_id = path.header.frame_id;
  given.poses.reserve(path.poses.size());
  for (const geometry_msgs::PoseStamped& pose : path.poses) {
    given.poses.push_back({pose.header.stamp.toSec(), readPose(pose.pose)});
  }
  return given;
}

}  // namespace

PathInput::PathInput(ros::NodeHandle nh, const std::string& topic, std::string child_frame,
                     std::function<void(GivenPoses)> take,
                     std::function<void(const std::string&)> refuse)
    : child_frame_(std::move(child_frame)), take_(std::move(take)), refuse_(std::move(refuse)) {
  // Of several that wait only the newest counts.
  subscriber_ = nh.subscribe(topic, 1, &PathInput::onMessage, this);
}

void PathInput::onMessage(const nav_msgs::Path::ConstPtr& path) const {
  guarded("corrected_path", [&] {
    try {
      GivenPoses given = readPath(*path);
      given.child_frame = child_frame_;
      if (!given.poses.empty()) take_(std::move(given));
    } catch (const std::exception& error) {
      refuse_(errorText(error));
    }
  });
}

}  // namespace dtsdf
