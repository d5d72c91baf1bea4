/// Options and settings of the programs that fuse frames, and of those that read a recording in any
/// of the formats, bags included.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/io/recording.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "io/bag_frames.h"
#include "params/node_params.h"
#include "program/command_line.h"

namespace dtsdf {

// What settings there are, and what numbers the rules have.

/// The text of --list-settings: every setting of the mapper and the node with its default, unit and
/// what it may be, by key.
std::string listSettings();

/// The text of --list-rules: every number with its default and range.
std::string listRules();

/// What the programs have in common.
struct RunOptions {
  BagOptions recording;  ///< Whose format may also be "bag" or "journal".
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

// Each adds one option, with the help that the program has for it.
void addBackendOption(CommandLine& line, const std::string& help,
                      std::optional<std::string>& backend);
void addThreadsOption(CommandLine& line, const std::string& help, std::optional<int>& threads);
void addSaveMapOption(CommandLine& line, const std::string& help, std::string& path);

/// Settings for everyone, and the rules' numbers for experiments.
struct RunSettings {
  ParamTree given;  ///< What files and command line say; all else is a default.
  NodeParams params;
  Rules rules;
};

/// Settings of a command line. Those of the node belong to the same files.
/// @throws ParamError with every violation, std::runtime_error for a file that cannot be read.
RunSettings readSettings(const RunOptions& options);

/// Settings of a command line, over `defaults` that come from what is read.
RunSettings readSettings(const RunOptions& options, ParamTree defaults);

/// Settings from a tree, as files and command lines give them. @throws ParamError
RunSettings readSettings(ParamTree tree);

// Each adds some of the options to a command line.
void addFormatOption(CommandLine& line, RunOptions& options);
void addReadingOptions(CommandLine& line, RunOptions& options);  ///< How it is read.

/// Whether the options are for what is read, once its format is known.
/// @throws UsageError that names the option.
void checkReadingOptions(const RunOptions& options);

}  // namespace dtsdf
