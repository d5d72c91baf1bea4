/// The topic on which a SLAM publishes the poses that it holds for right by now.
#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// Corrected poses as they come from outside.
struct GivenPoses {
  std::vector<StampedPose> poses;  ///< Of `child_frame`, in `frame_id`.
  std::string frame_id;            ///< Empty: the map's frame.
  std::string child_frame;         ///< Empty: the optical frame of the first camera.
};

class PathInput {
 public:
  /// `take` gets each path, on the queue of `nh`; `refuse` gets what it throws, or why a path could
  /// not be read.
  PathInput(ros::NodeHandle nh, const std::string& topic, std::string child_frame,
            std::function<void(GivenPoses)> take, std::function<void(const std::string&)> refuse);

 private:
  void onMessage(const nav_msgs::Path::ConstPtr& path) const;

  const std::string child_frame_;
  const std::function<void(GivenPoses)> take_;
  const std::function<void(const std::string&)> refuse_;
  ros::Subscriber subscriber_;
};

}  // namespace dtsdf
