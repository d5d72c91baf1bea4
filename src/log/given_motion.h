/// Whether who gives the poses of images has taken a correction over: a SLAM does, odometry never.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "io/trajectory.h"

namespace dtsdf {

/// The newest poses that a camera's images were given, one after the other.
///
/// Where it is not clear whether they have jumped, they have not: a SLAM, which jumps, corrects its
/// poses again soon, but what is wrongly no longer moved stays in the map beside what was.
class GivenMotion {
 public:
  /// Stamps that go back by more than this begin a recording anew.
  static constexpr double kBegin_s = 0.5;

  void add(const StampedPose& given);

  /// Adds a pose. @return whether the source of poses has taken over with it what `T_W_S` moves: a
  /// recording begins anew, or it is moved.
  bool takesOver(const Eigen::Isometry3d& T_W_S, const StampedPose& given);

  /// Whether the next pose continues the motion from where `T_W_S` moves the newest one to: as far
  /// as the motion so far is even enough, and the time between them short enough, to see that.
  bool isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const;

  /// Whether a recording begins anew with it.
  bool beginsAnew(const StampedPose& next) const {
    return newest_ && next.stamp_s < newest_->stamp_s - kBegin_s;
  }

 private:
  double stepsTo(double stamp_s) const;
  Eigen::Isometry3d expectedAt(double stamp_s) const;
  double doubtAt(double stamp_s) const;

  std::optional<StampedPose> before_, newest_;
  double unevenness_ = 0.0;  ///< How far the newest poses were from where they were expected.
};

}  // namespace dtsdf
