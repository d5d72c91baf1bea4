/// How nodes begin: their help, the settings on the parameter server, and what one that cannot
/// start says.
#pragma once

#include <ros/node_handle.h>

#include <exception>
#include <string>
#include <vector>

#include "dtsdf_mapping/params/param_set.h"
#include "params/node_params.h"
#include "params/printable.h"

namespace dtsdf {

// `--help` of the programs that are nodes: answered before ROS looks for a master.

/// Prints `usage`, and a line for each setting with its default, if --help or -h is among the
/// arguments; false if it is not.
bool printHelp(int argc, const char* const* argv, const std::string& usage,
               const ParamTree& defaults);

/// Starts ROS for a node with these settings. False, with a sentence on stderr, for arguments that
/// ROS cannot read, and for settings without the _ that they begin with: ROS would take these for
/// topics.
bool initNode(int& argc, char** argv, const std::string& name, const ParamTree& settings);

/// What a node adds to the error of its settings: those it does not know which are on the parameter
/// server, though not among its arguments. ROS keeps there what an earlier run was given. The
/// arguments are those of before initNode(), which takes settings out of them.
std::string leftoversText(const std::vector<std::string>& arguments, const std::string& ns,
                          const ParamTree& on_server, const ParamTree& settings);

/// The defaults of a settings struct.
template <class Params>
ParamTree defaultsOf() {
  Params params;
  ParamWriter writer;
  visitParams(params, writer);
  return writer.tree;
}

/// What a namespace holds, flattened; without the keys that ROS itself reads there.
struct ServerParams {
  ParamTree tree;
  std::vector<ParamViolation> violations;  ///< Values that no setting can have, such as lists.
};

ServerParams readParamServer(const ros::NodeHandle& private_nh);

/// Wrong settings in a line each, whose names and values are printable; else one sentence.
inline std::string startErrorText(const std::exception& error) {
  const bool is_list = dynamic_cast<const ParamError*>(&error) != nullptr;
  return is_list ? error.what() : errorText(error);
}

}  // namespace dtsdf
