/// Poses over time, their interpolation, and files in the format of the TUM RGB-D benchmark: one
/// line `stamp tx ty tz qx qy qz qw` per pose, camera to world, in seconds and metres.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/alignment.h"

namespace dtsdf {

/// Poses sorted by stamp; if several have the same stamp, only the first is kept.
class Trajectory {
 public:
  explicit Trajectory(std::vector<StampedPose> poses);

  /// The pose at a stamp, if the nearest pose in time is at most `tolerance_s` away. Between two
  /// poses it is interpolated: positions linearly, rotations by slerp. A pose with exactly this
  /// stamp is returned unchanged. Poses are not extrapolated: before the first pose and after the
  /// last, that pose itself is returned.
  std::optional<Eigen::Isometry3d> poseAt(double stamp_s, double tolerance_s) const;

  const std::vector<StampedPose>& poses() const { return poses_; }

 private:
  std::vector<StampedPose> poses_;
};

/// The pose with this translation and rotation; std::nullopt if the quaternion's length differs
/// from 1 by more than 0.01, a tolerance for values rounded to a few decimals.
std::optional<Eigen::Isometry3d> poseOf(const Eigen::Vector3d& t, const Eigen::Quaterniond& q);

/// The reason why poseAt() found no pose: "no pose within 20 ms".
std::string noPoseWithin(double tolerance_s);

/// @throws std::runtime_error with `advice` if the file is missing, or with file and line if it is
/// malformed.
Trajectory readTrajectory(const std::string& path, const std::string& advice);

/// A stamp as text: with six decimals if they represent it exactly, otherwise with nine.
std::string stampOfList(double stamp_s);

/// Writes poses in the given order. @throws std::runtime_error like AtomicFile.
void saveTrajectory(const std::vector<StampedPose>& poses, const std::string& path);

}  // namespace dtsdf
