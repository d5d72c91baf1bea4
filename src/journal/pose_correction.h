/// Corrected poses from SLAM: poses of some images correct all of them. Also decides whether the
/// source of poses has adopted the correction.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// Corrected poses of a camera, and the poses at which its images were fused. An image keeps its
/// odometry pose relative to corrected images: between two of them, it is interpolated between the
/// poses that these give; before the first and after the last, only that one counts.
class PoseCorrection {
 public:
  /// Stamps closer than this belong to one image.
  static constexpr double kSameStamp_s = 1e-3;
  /// A corrected pose without an image counts only between two images that are at most this far
  /// apart and have no corrected pose themselves: the motion between images is a guess, which must
  /// not move them.
  static constexpr double kWidestGap_s = 0.25;
  /// A larger correction is a mistake.
  static constexpr double kFarthest_m = 1000.0;
  /// If all poses turn by more, they are in another frame.
  static constexpr double kMaxOfAll_rad = 1.0;
  /// A smaller change, in metres and radians, is rounding in a file; the image keeps its pose.
  static constexpr double kMin = 1e-6;

  /// @param fused The camera's images as they are in the map, with rising stamps.
  /// @throws std::runtime_error if a pose is not a rigid motion or is farther from its image than
  /// any drift, if all turn their images by more than a radian, if two differ at one stamp, or if
  /// none belongs to an image.
  PoseCorrection(std::vector<StampedPose> corrected, const std::vector<StampedPose>& fused);

  /// The corrected pose of an image from this camera, or from one fixed to it; exactly `T_W_C` if
  /// nothing changes.
  Eigen::Isometry3d correct(double stamp_s, const Eigen::Isometry3d& T_W_C) const;

  /// The corrected poses that belong to images: these alone give the same correction.
  std::vector<StampedPose> used() const;
  /// The largest motion of a corrected pose, in metres or radians.
  double farthest() const;
  /// Stamp of the last corrected pose.
  double last_s() const { return anchors_.back().stamp_s; }
  /// Moves the images after the last corrected pose: T_W_C becomes lastMotion() * T_W_C.
  Eigen::Isometry3d lastMotion() const {
    return anchors_.back().to * anchors_.back().from.inverse();
  }

 private:
  struct Anchor {
    double stamp_s;
    Eigen::Isometry3d from, to;  ///< T_W_C of the image, as fused and corrected.
    double distance_m() const { return (to.translation() - from.translation()).norm(); }
    double angle_rad() const;
  };

  void checkFrame() const;
  Eigen::Isometry3d moved(const Anchor& anchor, const Eigen::Isometry3d& T_W_C) const;

  std::vector<Anchor> anchors_;  ///< Sorted by stamp.
};

/// Decides, from the newest poses given for a camera's images, whether the source of poses has
/// adopted a correction: SLAM does, odometry never does.
///
/// In doubt, the answer is no: SLAM soon corrects its poses again, but images that are wrongly no
/// longer moved stay in the map next to those that were.
class GivenMotion {
 public:
  /// Stamps that go back by more than this begin a new recording.
  static constexpr double kBegin_s = 0.5;

  void add(const StampedPose& given);

  /// Adds a pose. @return whether its source has adopted the correction `T_W_S`: a new recording
  /// begins, or the pose is moved by it.
  bool adoptsCorrection(const Eigen::Isometry3d& T_W_S, const StampedPose& given);

  /// Whether the next pose continues the motion from the newest pose moved by `T_W_S`. False if the
  /// motion is too uneven, or the gap too long, to tell.
  bool isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const;

  /// Whether a new recording begins with `next`.
  bool isNewRecording(const StampedPose& next) const {
    return newest_ && next.stamp_s < newest_->stamp_s - kBegin_s;
  }

 private:
  double stepsTo(double stamp_s) const;
  Eigen::Isometry3d expectedAt(double stamp_s) const;
  double uncertaintyAt(double stamp_s) const;

  std::optional<StampedPose> before_, newest_;
  double unevenness_ = 0.0;  ///< Deviation of the newest poses from the expected ones.
};

}  // namespace dtsdf
