/// Recorded depth frames in one raw file each, for machines without the package's image libraries.
///
/// NAME.raw holds the 16-bit images; NAME.txt a line `width height fx fy cx cy unit_m`, and then a
/// line per frame with the first three rows of T_W_C.
#pragma once

#include <string>
#include <vector>

#include "parity/test_frames.h"

namespace dtsdf {

/// @throws std::runtime_error if the files cannot be read.
std::vector<TestFrame> readRecordedFrames(const std::string& path_without_suffix);

}  // namespace dtsdf
