/// Reads depth frames from raw files, for machines that lack the image libraries.
///
/// NAME.raw contains the 16-bit images. NAME.txt starts with a line `width height fx fy cx cy
/// unit_m`, followed by one line per frame with the first three rows of T_W_C. The test program
/// pack_frames writes both files.
#pragma once

#include <memory>
#include <string>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// @throws std::runtime_error if the files cannot be read. next() throws std::runtime_error if
/// NAME.raw is too short or a line is not a pose.
std::unique_ptr<FrameSource> openRawFrames(const std::string& path_without_suffix,
                                           const FrameSelection& selection);

}  // namespace dtsdf
