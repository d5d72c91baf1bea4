/// Finds the pose at which an image fits the map, by Gauss-Newton over sums that a backend makes:
/// the same steps, and so the same pose, on both.
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/depth_frame.h"
#include "kernels/core/grid.h"
#include "kernels/poses/alignment_sums.h"

namespace dtsdf {

/// Sums of all points of the image at a pose.
using SumsAtPose = std::function<AlignmentSums(const FrameView& view, float cutoff)>;

/// A frame that was not aligned: at its own pose, as uncertain as the prior.
Alignment unalignedPose(const DepthFrame& frame, const PosePrior& prior,
                        const AlignmentRules& rules, float voxel_size_m);

/// @param frame With the pose around which the prior lies.
Alignment findPose(const DepthFrame& frame, const PosePrior& prior, const AlignmentRules& rules,
                   float voxel_size_m, const SumsAtPose& sums_at);

/// Blocks that addPoint() may look at for these points at a pose, by key, each once.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count);

}  // namespace dtsdf
