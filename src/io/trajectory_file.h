/// Trajectories in the format of the TUM RGB-D benchmark: a line `stamp tx ty tz qx qy qz qw` per
/// pose, camera to world, in seconds and metres.
#pragma once

#include <string>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// @throws std::runtime_error with file and line, for what is missing (with `advice`) or malformed.
Trajectory readTrajectory(const std::string& path, const std::string& advice);

/// Writes poses, in their order, so that they are read back as they are.
/// @throws std::runtime_error as AtomicFile does.
void saveTrajectory(const std::vector<StampedPose>& poses, const std::string& path);

}  // namespace dtsdf
