/// Starts a node: prints help, reads settings from the parameter server and reports errors.
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

/// The main function of a node. `--help` works without a master. Refuses arguments that ROS cannot
/// parse, and settings without the leading _, which ROS would take for topic remappings. Logs an
/// exception thrown by `run` as the reason why the node cannot start.
/// @return the exit code: 0, 1 if the node cannot start, 2 for wrong arguments.
/// @param defaults All settings with their defaults, from toTree().
int runNode(
    int argc, char** argv, const std::string& node_name, const std::string& usage,
    const ParamTree& defaults,
    const std::function<void(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)>& run);

/// The parameters of a namespace, flattened, without the keys that ROS itself reads.
/// @param violations Receives parameters that are neither single values nor lists of names.
ParamTree readParamServer(const ros::NodeHandle& private_nh,
                          std::vector<ParamViolation>& violations);

/// Printable text of a start error: one line per wrong setting, or one sentence.
inline std::string startErrorText(const std::exception& error) {
  if (dynamic_cast<const ParamError*>(&error) == nullptr) return errorText(error);
  return error.what() +
         std::string("\n  (ROS keeps settings from earlier runs; rosparam delete removes them)");
}

}  // namespace dtsdf
