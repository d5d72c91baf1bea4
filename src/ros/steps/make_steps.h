/// Creates the steps of the node, in the order in which they run.
#pragma once

#include <atomic>
#include <memory>

#include "ros/steps/step.h"

namespace dtsdf {

class SpaceStep;

/// @throws std::runtime_error if a folder cannot be written.
Steps makeSteps(const Host& host);

// Each of these steps is defined in its own file, such as mesh_topics.cpp.
std::unique_ptr<Step> makeMeshTopicsStep(const NodeParams& params,
                                         const std::atomic<double>& rate_hz);
std::unique_ptr<Step> makePointsStep(const Host& host);
std::unique_ptr<Step> makeOctomapStep(const Host& host,
                                      const SpaceStep& space);  ///< Only with octomap_msgs.
std::unique_ptr<Step> makeViewStep(const Host& host);
std::unique_ptr<Step> makeFilesStep(const Host& host);

}  // namespace dtsdf
