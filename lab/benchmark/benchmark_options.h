/// Command line of `benchmark`.
#pragma once

#include <string>
#include <vector>

#include "tools/run_options.h"

namespace dtsdf {

struct BenchmarkOptions : RunOptions {
  std::string raw_name;      ///< Path of raw frames (raw_frames.h) without suffix; empty: none.
  bool flight = false;       ///< Whether to simulate a flight instead of reading a recording.
  double grow_to_gib = 1.0;  ///< Size of the map, in GiB, at which the flight ends or turns back.
  double speed_m = 1.0;      ///< Distance flown per frame, in metres.
  bool returns = false;      ///< Whether to fly back along the same path.
};

/// @throws UsageError that names the option, TextRequest for --help.
BenchmarkOptions parseBenchmarkOptions(const std::vector<std::string>& arguments);

}  // namespace dtsdf
