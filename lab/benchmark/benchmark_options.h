/// The command line of `benchmark`.
#pragma once

#include <string>
#include <vector>

#include "tools/run_options.h"

namespace dtsdf {

struct BenchmarkOptions : RunOptions {
  std::string raw_name;      ///< Raw frames, as raw_frames.h has them.
  bool flight = false;       ///< A synthetic flight instead of recorded frames.
  double grow_to_gib = 1.0;  ///< Size of the map at which the flight ends.
  double speed_m = 1.0;      ///< Way of the flight from frame to frame.
  bool returns = false;      ///< The flight goes back as well.
};

/// @throws UsageError that names the option, TextRequest for --help.
BenchmarkOptions parseBenchmarkOptions(const std::vector<std::string>& arguments);

}  // namespace dtsdf
