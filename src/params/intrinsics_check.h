/// Checks whether intrinsics are plausible for the size of the images.
#pragma once

#include <string>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// Formats intrinsics: "fx = 525, fy = 525, cx = 319.5, cy = 239.5".
std::string inWords(const Intrinsics& K);

/// Why images of this size cannot have these intrinsics; empty if they can.
std::string findProblem(const Intrinsics& K, int width, int height);

/// Why images of this size are unlikely to have these intrinsics; empty if they are plausible.
/// @pre findProblem() is empty.
std::string doubtAbout(const Intrinsics& K, int width, int height);

}  // namespace dtsdf
