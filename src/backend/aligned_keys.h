/// Which blocks of the map the points of an image are compared with.
#pragma once

#include <cstddef>
#include <vector>

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/poses/alignment_sums.h"

namespace dtsdf {

/// Blocks that addPoint() may look at for these points at a pose, by key, each once.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count);

}  // namespace dtsdf
