/// `--help` of the programs that are nodes: answered before ROS looks for a master.
#pragma once

#include <string>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Prints `usage`, and a line for each setting with its default, if --help or -h is among the
/// arguments; false if it is not.
bool printHelp(int argc, const char* const* argv, const std::string& usage,
               const ParamTree& defaults);

/// The defaults of a settings struct.
template <class Params>
ParamTree defaultsOf() {
  Params params;
  ParamWriter writer;
  visitParams(params, writer);
  return writer.tree;
}

}  // namespace dtsdf
