/// The command line of `benchmark`.
#pragma once

#include <string>
#include <vector>

#include "tools/run_options.h"

namespace dtsdf {

struct BenchmarkOptions : RunOptions {
  std::string raw_name;      ///< Path of raw frames without suffix, as in raw_frames.h; or empty.
  bool flight = false;       ///< Whether to map a synthetic flight instead of recorded frames.
  double grow_to_gib = 1.0;  ///< Mapped size at which the flight ends or turns back.
  double speed_m = 1.0;      ///< Distance flown per frame.
  bool returns = false;      ///< Whether the camera also flies back the same way.
};

/// @throws UsageError that names the option, TextRequest for --help.
BenchmarkOptions parseBenchmarkOptions(const std::vector<std::string>& arguments);

}  // namespace dtsdf
