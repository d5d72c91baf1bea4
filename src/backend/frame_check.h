/// Validates frames and converts them to the types used in src/kernels; shared by both backends.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/rendered_view.h"
#include "kernels/colour/colour_image.h"
#include "kernels/surfels/depth.h"
#include "map/block_table.h"

namespace dtsdf {

/// Returns the result with which to reject a frame; nullopt if the frame is valid.
std::optional<IntegrationResult> findProblem(const DepthFrame& frame, const MapperParams& params);
std::optional<IntegrationResult> findProblem(const ColourFrame& frame, const MapperParams& params);

/// Converts a frame for src/kernels. The local frame L has its origin at the camera's block.
/// @pre findProblem() found nothing.
FrameView makeFrameView(const DepthFrame& frame, float voxel_size_m);
FrameView makeFrameView(const ColourFrame& frame, float voxel_size_m);

/// Converts the camera of a view for src/kernels. @throws std::invalid_argument for an invalid
/// camera or pose, with the message of findProblem().
FrameView checkedFrameView(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                           const MapperParams& params);

/// Resizes a view's images, with or without colours.
void resizeView(const FrameView& frame, bool has_colours, RenderedView& view);

DepthRange depthRangeOf(const DepthFrame& frame, const MapperParams& params);

/// The sphere with radius map/keep_radius_m, in voxels. After a frame, blocks entirely outside it
/// are dropped. @pre map/keep_radius_m is not 0.
RegionView keptBallOf(const DepthFrame& frame, const MapParams& params);

/// Converts a region to units of voxels.
/// @throws std::invalid_argument if findProblem() finds a problem.
RegionView checkedRegionView(const Region& region, const MapParams& params);

/// Depth of a pixel, in the frame's unit.
float rawDepth(const DepthFrame& frame, int u, int v);

PixelLayout layoutOf(ColourEncoding encoding);

/// Bytes of an image row without padding.
size_t packedRowBytes(const DepthFrame& frame);
size_t packedRowBytes(const ColourFrame& frame);

/// Whether a frame that touches no block can still clear voxels. It can if a pixel measures
/// something beyond the fused range, as the space in front of that is free.
bool clearsBeyondRange(const DepthFrame& frame, const MapperParams& params);

IntegrationResult refuse(FrameStatus status, const std::string& message);

IntegrationResult noMeasurement(const DepthFrame& frame, const MapperParams& params);

/// Result for a colour frame with which no surface of the map can be painted.
IntegrationResult nothingToPaint();

}  // namespace dtsdf
