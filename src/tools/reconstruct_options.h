/// The command line of `reconstruct`.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// The command line is wrong; the program ends with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ReconstructOptions {
  std::string tum_folder, bag_path;     ///< Exactly one of them is given.
  std::string depth_topic, info_topic;  ///< Empty: chosen from the bag.
  double units_per_metre = 5000.0;      ///< Of TUM depth images.
  double pose_tolerance_s = 0.02;       ///< For TUM folders.
  std::string config_path;
  std::vector<std::string> settings;  ///< Each key=value, in the order given.
  std::optional<std::string> backend;
  std::optional<int> threads;
  FrameSelection frames;
  size_t mesh_every = 0;  ///< Extract a mesh each so many frames; 0: only at the end.
  std::string mesh_path, report_path;
  bool help = false;
};

/// @throws UsageError that names the option.
ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments);

/// FIRST:LAST:STEP; each part, and colons at the end, may be left out.
/// @throws UsageError
FrameSelection parseFrameSelection(const std::string& text);

std::string reconstructHelp();

}  // namespace dtsdf
