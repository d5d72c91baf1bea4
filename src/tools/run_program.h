/// What the programs that fuse frames share around their work: settings, input, and how they end.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"
#include "params/node_params.h"
#include "tools/option_list.h"

namespace dtsdf {

/// Settings of a command line. The node's settings belong to the same files.
/// @throws ParamError with every violation, std::runtime_error for a file that cannot be read.
MappingParams readSettings(const RunOptions& options);

/// The frames of --tum.
std::unique_ptr<FrameSource> openTumSource(const RunOptions& options);

/// Runs a program and turns what it throws into one line on standard error. @return exit code: 0, 1
/// for an error, 2 for a wrong command line.
int runProgram(const std::string& name, int argc, const char* const* argv,
               const std::function<void(const std::vector<std::string>&)>& program);

}  // namespace dtsdf
