/// Options of the programs that read a recording in any of the formats, bags included.
#pragma once

#include <string>

#include "tools/run_options.h"

namespace dtsdf {

/// What is read is RunOptions::recording, whose format may also be "bag" or "log".
struct InputOptions : RunOptions {
  std::string depth_topic, info_topic;  ///< Empty: chosen from the bag.
  std::string mask_topic;               ///< Of a bag; empty: no masks.
  std::string colour_topic;             ///< Empty: chosen from the bag.
  std::string imu_topic;                ///< Empty: chosen from the bag.
};

// Each adds some of the options to a command line.
void addFormatOption(CommandLine& line, InputOptions& options);
void addReadingOptions(CommandLine& line, InputOptions& options);  ///< How it is read.

/// Whether the options are for what is read, once its format is known.
/// @throws UsageError that names the option.
void checkReadingOptions(const InputOptions& options);

}  // namespace dtsdf
