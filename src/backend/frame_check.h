/// Validates a frame and turns it into what the rules work on, or into a refusal; shared by both
/// backends.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "kernels/colour/colour_image.h"
#include "kernels/surfels/depth.h"

namespace dtsdf {

/// What is wrong with a frame, or nothing.
struct FrameProblem {
  FrameStatus status;
  std::string message;
};

std::optional<FrameProblem> findProblem(const DepthFrame& frame, const MapperParams& params);
std::optional<FrameProblem> findProblem(const ColourFrame& frame, const MapperParams& params);

/// The frame for the rules. The local frame's origin is the block that the camera is in.
/// @pre findProblem() found nothing.
FrameView makeFrameView(const DepthFrame& frame, float voxel_size_m);
FrameView makeFrameView(const ColourFrame& frame, float voxel_size_m);

DepthRange depthRangeOf(const DepthFrame& frame, const MapperParams& params);

/// A pixel's value, in units of the frame.
float rawDepth(const DepthFrame& frame, int u, int v);

/// Copies some rows of a colour image, packed.
void copyPixels(const ColourFrame& frame, int first_row, int end_row, ColourPixel* pixels);

/// Whether a frame that touches no block clears: it measures something beyond the range that is
/// fused, which tells what is free before it.
bool clearsFromAfar(const DepthFrame& frame, const MapperParams& params);

/// The result of a frame with a problem.
IntegrationResult refuse(const FrameProblem& problem);

/// The result of a frame that shows nothing to fuse.
IntegrationResult noMeasurement(const MapperParams& params);

/// The result of a colour frame that sees no surface of the map.
IntegrationResult nothingToPaint();

}  // namespace dtsdf
