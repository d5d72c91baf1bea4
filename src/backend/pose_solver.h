/// Aligns an image with the map by Gauss-Newton, with sums computed by a backend. Both backends
/// give the same result.
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/depth_frame.h"
#include "kernels/core/grid.h"
#include "kernels/poses/alignment_sums.h"

namespace dtsdf {

/// Returns the sums over all points of the image at a pose.
using SumsAtPose = std::function<AlignmentSums(const FrameView& view, float cutoff)>;

/// Result for a frame that was not aligned: its input pose with the covariance of the prior.
Alignment unalignedPose(const DepthFrame& frame, const PosePrior& prior,
                        const AlignmentRules& rules, float voxel_size_m);

/// Aligns a frame with the map. @param frame Its pose is the mean of the prior.
Alignment findPose(const DepthFrame& frame, const PosePrior& prior, const AlignmentRules& rules,
                   float voxel_size_m, const SumsAtPose& sums_at);

/// Keys of the blocks that addPoint() may read for `points` at a pose: sorted, without duplicates.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count);

}  // namespace dtsdf
