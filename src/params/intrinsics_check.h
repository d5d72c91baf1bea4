/// Whether intrinsics can be those of the images that come with them; for every door.
#pragma once

#include <string>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// Why no image of this size can have these intrinsics; empty if one can.
std::string findProblem(const Intrinsics& K, int width, int height);

/// Why images of this size hardly have these intrinsics, which are without a problem; empty if
/// nothing speaks against it.
std::string doubtAbout(const Intrinsics& K, int width, int height);

}  // namespace dtsdf
