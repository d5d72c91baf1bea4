/// Options and settings of programs that fuse frames or read a recording in any format, bags
/// included.
#pragma once

#include <string>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/io/recording.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "io/bag_frames.h"
#include "params/node_params.h"
#include "program/command_line.h"

namespace dtsdf {

/// The text of --list-settings: every setting of the mapper and the node with its default, unit and
/// range, by key.
std::string listSettings();

/// The text of --list-rules: every rule parameter with its default and range.
std::string listRules();

/// Options that the programs share.
struct RunOptions {
  BagOptions recording;  ///< Its format may also be "bag" or "journal".
  std::string config_path;
  std::vector<std::string> settings;  ///< Each key=value, in the order given.
  std::string report_path;
};

/// Parses FIRST:LAST:STEP; each part, and the second colon, may be left out.
/// @throws UsageError if the text is malformed.
FrameSelection parseFrameSelection(const std::string& text);

// Each of these functions adds options to a command line.
void addTumOption(CommandLine& line, RunOptions& options);
void addFolderOptions(CommandLine& line, RunOptions& options);  ///< How to read a folder.
void addFrameOptions(CommandLine& line, RunOptions& options);
void addMapperOptions(CommandLine& line, RunOptions& options);
void addReportOptions(CommandLine& line, RunOptions& options);

/// Adds an option for a single setting, which overrides --set.
void addSettingOption(CommandLine& line, ProgramOption option, const std::string& key,
                      RunOptions& options);

/// Adds --save-map, with the program's help text.
void addSaveMapOption(CommandLine& line, const std::string& help, std::string& path);

/// The settings and rule parameters of a run.
struct RunSettings {
  ParamTree given;  ///< Settings from file, command line and program; all others are defaults.
  NodeParams params;
  Rules rules;
};

/// Reads the settings of a command line. Files may also contain settings that only the node uses.
/// @throws ParamError that lists every violation, std::runtime_error if the file cannot be read.
RunSettings readSettings(const RunOptions& options);

/// Reads the settings of a command line, which override `defaults`.
RunSettings readSettings(const RunOptions& options, ParamTree defaults);

/// Reads settings from a tree. @throws ParamError that lists every violation.
RunSettings readSettings(ParamTree tree);

// Each of these functions adds options to a command line.
void addFormatOption(CommandLine& line, RunOptions& options);
void addReadingOptions(CommandLine& line, RunOptions& options);  ///< How to read a recording.

/// Checks that the options apply to the format of the input. @pre The format is set.
/// @throws UsageError that names the option.
void checkReadingOptions(const RunOptions& options);

}  // namespace dtsdf
