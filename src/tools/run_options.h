/// Options and settings of the programs that fuse frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/io/recording.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "params/node_params.h"
#include "program/command_line.h"

namespace dtsdf {

/// What the programs have in common.
struct RunOptions {
  RecordingOptions recording;
  std::string config_path;
  std::vector<std::string> settings;  ///< Each key=value, in the order given.
  std::optional<std::string> backend;
  std::optional<int> threads;
  std::optional<std::string> poses_mode;
  std::string report_path;
};

/// FIRST:LAST:STEP; each part, and colons at the end, may be left out.
/// @throws UsageError
FrameSelection parseFrameSelection(const std::string& text);

// Each adds some of the options to a command line.
void addTumOption(CommandLine& line, RunOptions& options);
void addFolderOptions(CommandLine& line, RunOptions& options);  ///< How a folder is read.
void addFrameOptions(CommandLine& line, RunOptions& options);
void addMapperOptions(CommandLine& line, RunOptions& options);
void addReportOptions(CommandLine& line, RunOptions& options);

/// Settings for everyone, and the rules' numbers for experiments.
struct RunSettings {
  ParamTree given;  ///< What files and command line say; all else is a default.
  MappingParams params;
  Rules rules;
};

/// Settings of a command line. Those of the node belong to the same files.
/// @throws ParamError with every violation, std::runtime_error for a file that cannot be read.
RunSettings readSettings(const RunOptions& options);

/// The same with settings of what is read, where neither files nor command line say otherwise.
RunSettings readSettings(const RunOptions& options, ParamTree defaults);

/// The same of settings as files and command lines say them. @throws ParamError
RunSettings readSettings(ParamTree tree);

}  // namespace dtsdf
