/// The steps of the node, in the order of their work.
#pragma once

#include "ros/steps/files.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// @param files The one that loads map/load_file.
/// @throws std::runtime_error where a folder cannot be written.
Steps makeSteps(const Host& host, FilesStep*& files);

}  // namespace dtsdf
