/// Validates a frame and turns it into what the rules work on, or into a refusal; shared by both
/// backends.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/colour/colour_image.h"
#include "kernels/surfels/depth.h"
#include "map/block_table.h"

namespace dtsdf {

/// The result of a frame with a problem; none: it has none.
std::optional<IntegrationResult> findProblem(const DepthFrame& frame, const MapperParams& params);
std::optional<IntegrationResult> findProblem(const ColourFrame& frame, const MapperParams& params);

/// The frame for the rules. The local frame's origin is the block that the camera is in.
/// @pre findProblem() found nothing.
FrameView makeFrameView(const DepthFrame& frame, float voxel_size_m);
FrameView makeFrameView(const ColourFrame& frame, float voxel_size_m);

/// The camera of a view for the rules. @throws std::invalid_argument for one that no map can be
/// seen with, in the words of findProblem().
FrameView checkedFrameView(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                           const MapperParams& params);

/// Makes room for a view's images, with or without colours.
void resizeView(const FrameView& frame, bool has_colours, RenderedView& view);

DepthRange depthRangeOf(const DepthFrame& frame, const MapperParams& params);

/// Blocks beyond it that a frame drops at most, so that none takes long.
constexpr size_t kMostDroppedBlocks = 4096;

/// The ball, in units of voxels, that keeps the blocks that reach into it, once a frame is in the
/// map. @pre map/keep_radius_m is not 0.
RegionView keptBallOf(const DepthFrame& frame, const MapParams& params);

/// A region in units of voxels.
/// @throws std::invalid_argument if it has a problem.
RegionView checkedRegionView(const Region& region, const MapParams& params);

/// A pixel's value, in units of the frame.
float rawDepth(const DepthFrame& frame, int u, int v);

/// Where the pixels of an encoding have their bytes.
PixelLayout layoutOf(ColourEncoding encoding);

/// Length of an image's row in bytes, without what may follow its last pixel.
size_t packedRowBytes(const DepthFrame& frame);
size_t packedRowBytes(const ColourFrame& frame);

/// Whether a frame that touches no block clears: it measures something beyond the range that is
/// fused, which shows what is free before it.
bool clearsFromAfar(const DepthFrame& frame, const MapperParams& params);

/// The result of a frame that is refused.
IntegrationResult refuse(FrameStatus status, const std::string& message);

/// The result of a frame that shows nothing to fuse.
IntegrationResult noMeasurement(const DepthFrame& frame, const MapperParams& params);

/// The result of a colour frame that sees no surface of the map.
IntegrationResult nothingToPaint();

}  // namespace dtsdf
