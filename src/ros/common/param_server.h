/// Reads the private namespace of a node from the ROS parameter server.
#pragma once

#include <ros/node_handle.h>

#include <vector>

#include "params/node_params.h"

namespace dtsdf {

/// What a namespace holds, flattened; without the keys that ROS itself reads there.
struct ServerParams {
  ParamTree tree;
  std::vector<ParamViolation> violations;  ///< Values that no setting can have, such as lists.
};

ServerParams readParamServer(const ros::NodeHandle& private_nh);

}  // namespace dtsdf
