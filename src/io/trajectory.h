/// Poses by time, the rule by which a depth image gets its pose, and their files as the TUM RGB-D
/// benchmark has them: a line `stamp tx ty tz qx qy qz qw` per pose, camera to world, in seconds
/// and metres.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

namespace dtsdf {

struct StampedPose {
  double stamp_s;
  Eigen::Isometry3d T_W_C;  ///< Camera's optical frame to map frame, metres.
};

/// Poses sorted by stamp; of several with the same stamp the first counts.
class Trajectory {
 public:
  explicit Trajectory(std::vector<StampedPose> poses);

  /// The pose at a stamp, if the pose nearest in time is at most `tolerance_s` away. Between two
  /// poses it is interpolated: positions linearly, rotations by slerp. A pose at the very stamp is
  /// taken as it is; before the first and after the last the end itself is taken, as nothing is
  /// extrapolated.
  std::optional<Eigen::Isometry3d> poseAt(double stamp_s, double tolerance_s) const;

  const std::vector<StampedPose>& poses() const { return poses_; }

 private:
  std::vector<StampedPose> poses_;
};

/// The pose of a translation and a quaternion; none where its length is not 1: what rounding to a
/// few decimals leaves is no more than a hundredth.
std::optional<Eigen::Isometry3d> poseOf(const Eigen::Vector3d& t, const Eigen::Quaterniond& q);

/// Why poseAt() has none: "no pose within 20 ms".
std::string noPoseWithin(double tolerance_s);

/// @throws std::runtime_error with file and line, for what is missing (with `advice`) or malformed.
Trajectory readTrajectory(const std::string& path, const std::string& advice);

/// A stamp as lists have it, with six digits after the point, where these say all of it; else with
/// nine.
std::string stampOfList(double stamp_s);

/// Writes poses, in their order, so that they are read back as they are.
/// @throws std::runtime_error as AtomicFile does.
void saveTrajectory(const std::vector<StampedPose>& poses, const std::string& path);

}  // namespace dtsdf
