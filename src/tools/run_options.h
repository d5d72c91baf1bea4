/// Options and settings of the programs that fuse frames.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "params/node_params.h"
#include "program/command_line.h"

namespace dtsdf {

/// What the programs have in common.
struct RunOptions {
  std::string tum_folder;
  double units_per_metre = 5000.0;  ///< Of TUM depth images.
  double pose_tolerance_s = 0.02;   ///< For TUM folders.
  FrameSelection frames;
  std::string config_path;
  std::vector<std::string> settings;  ///< Each key=value, in the order given.
  std::optional<std::string> backend;
  std::optional<int> threads;
  std::string report_path;
};

/// FIRST:LAST:STEP; each part, and colons at the end, may be left out.
/// @throws UsageError
FrameSelection parseFrameSelection(const std::string& text);

// Each adds some of the options to a command line. --depth-scale and --pose-tolerance need --tum.
void addTumOptions(CommandLine& line, RunOptions& options);
void addFrameOptions(CommandLine& line, RunOptions& options);
void addMapperOptions(CommandLine& line, RunOptions& options);
void addReportOptions(CommandLine& line, RunOptions& options);

/// Settings for everyone, and the rules' numbers for experiments.
struct RunSettings {
  MappingParams params;
  Rules rules;
};

/// Settings of a command line. Those of the node belong to the same files.
/// @throws ParamError with every violation, std::runtime_error for a file that cannot be read.
RunSettings readSettings(const RunOptions& options);

/// The frames of --tum.
std::unique_ptr<FrameSource> openTumSource(const RunOptions& options);

}  // namespace dtsdf
