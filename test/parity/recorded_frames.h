/// Recorded depth frames, in the form of lab/benchmark/raw_frames.h.
#pragma once

#include <string>
#include <vector>

#include "parity/test_frames.h"

namespace dtsdf {

/// @throws std::runtime_error if the files cannot be read.
std::vector<TestFrame> readRecordedFrames(const std::string& path_without_suffix);

}  // namespace dtsdf
