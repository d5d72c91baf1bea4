/// The options for pictures that render_mesh and evaluate_mesh have in common.
#pragma once

#include <set>
#include <string>

#include "evaluation/command_line.h"
#include "evaluation/picture.h"

namespace dtsdf {

/// Names of the options that take a value.
std::set<std::string> pictureOptionNames();

/// How they are explained to the user.
std::string pictureUsage();

/// @throws std::invalid_argument for a value that makes no sense.
PictureOptions readPictureOptions(const CommandLine& arguments, const Eigen::AlignedBox3f& bounds);

}  // namespace dtsdf
