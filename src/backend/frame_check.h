/// Validates a frame and turns it into what the rules work on; shared by both backends.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "kernels/core/camera.h"

namespace dtsdf {

/// What is wrong with a frame, or nothing.
struct FrameProblem {
  FrameStatus status;
  std::string message;
};

/// The result of a frame with a problem.
IntegrationResult refuse(const FrameProblem& problem);

std::optional<FrameProblem> findProblem(const DepthFrame& frame, const MapperParams& params);

/// The frame for the rules. The local frame's origin is the block that the camera is in.
/// @pre findProblem() found nothing.
FrameView makeFrameView(const DepthFrame& frame, float voxel_size_m);

}  // namespace dtsdf
