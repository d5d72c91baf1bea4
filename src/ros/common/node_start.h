/// How nodes begin: their help, the settings on the parameter server, and what one that cannot
/// start says.
#pragma once

#include <ros/node_handle.h>

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"
#include "params/node_params.h"
#include "params/printable.h"

namespace dtsdf {

/// Runs a program that is a node. `--help` is answered before ROS looks for a master, and arguments
/// are refused that ROS cannot read, or would take for topics: settings without the _ that they
/// begin with. What `run` throws says why the node cannot start.
/// @return its exit code: 0, 1 where it cannot start, 2 for wrong arguments.
/// @param defaults Of its settings: see toTree().
int runNode(
    int argc, char** argv, const std::string& node_name, const std::string& usage,
    const ParamTree& defaults,
    const std::function<void(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)>& run);

/// What a namespace holds, flattened; without the keys that ROS itself reads there.
/// @param violations Gets values that no setting can have, such as lists.
ParamTree readParamServer(const ros::NodeHandle& private_nh,
                          std::vector<ParamViolation>& violations);

/// Wrong settings in a line each, whose names and values are printable; else one sentence.
inline std::string startErrorText(const std::exception& error) {
  if (dynamic_cast<const ParamError*>(&error) == nullptr) return errorText(error);
  return error.what() + std::string("\n  (ROS keeps settings of earlier runs: rosparam delete)");
}

}  // namespace dtsdf
