/// Corrects the poses of all images, given a SLAM system's poses for some of them. Also decides
/// whether the source of the input poses has adopted the correction.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// A correction of a camera's poses. Images before the first corrected image keep their poses
/// relative to it, and images after the last corrected image keep theirs relative to that one. An
/// image between two corrected images has a pose relative to each of them; the two resulting poses
/// are interpolated.
class PoseCorrection {
 public:
  /// Stamps that differ by no more than this belong to the same image.
  static constexpr double kSameStamp_s = 1e-3;
  /// A corrected pose without an image is compared with a pose interpolated between the images
  /// before and after it. It is used only if these images are at most this far apart and have no
  /// corrected poses themselves.
  static constexpr double kMaxGap_s = 0.25;
  /// Larger corrections are rejected as mistakes.
  static constexpr double kFarthest_m = 1000.0;
  /// If every pose rotates by more than this, the correction is rejected, since its poses must be
  /// in another frame.
  static constexpr double kMaxCommonTurn_rad = 1.0;
  /// Changes below this, in metres or radians, are ignored, since they result from rounding in
  /// files.
  static constexpr double kMin = 1e-6;

  /// @param fused Poses at which the camera's images were fused, sorted by stamp.
  /// @throws std::runtime_error if a pose is not a rigid motion, a correction exceeds the limits
  /// above, different poses have the same stamp, or no pose belongs to an image.
  PoseCorrection(std::vector<StampedPose> corrected, const std::vector<StampedPose>& fused);

  /// The corrected pose of an image from this camera, or from a camera rigidly attached to it;
  /// exactly `T_W_C` if the change is below kMin.
  Eigen::Isometry3d correct(double stamp_s, const Eigen::Isometry3d& T_W_C) const;

  /// The corrected poses that have an effect.
  std::vector<StampedPose> used() const;
  /// The largest change of any corrected pose, in metres or radians, whichever number is greater.
  double farthest() const;
  /// Stamp of the last corrected pose.
  double last_s() const { return anchors_.back().stamp_s; }
  /// Correction for images after the last corrected pose: T_W_C becomes lastMotion() * T_W_C.
  Eigen::Isometry3d lastMotion() const {
    return anchors_.back().to * anchors_.back().from.inverse();
  }

 private:
  struct Anchor {
    double stamp_s;
    Eigen::Isometry3d from, to;  ///< T_W_C, as fused and as corrected.
    double distance_m() const { return (to.translation() - from.translation()).norm(); }
    double angle_rad() const;
  };

  void checkFrame() const;
  Eigen::Isometry3d moved(const Anchor& anchor, const Eigen::Isometry3d& T_W_C) const;

  std::vector<Anchor> anchors_;  ///< Sorted by stamp.
};

/// Decides from a camera's newest input poses whether their source has adopted a correction. SLAM
/// systems adopt corrections, odometry never does.
///
/// Answers no when in doubt. A wrong no is put right by the next correction, whereas a wrong yes
/// leaves uncorrected images in the map next to corrected ones.
class GivenMotion {
 public:
  /// A new recording begins if stamps go back by more than this.
  static constexpr double kBegin_s = 0.5;

  void add(const StampedPose& given);

  /// Adds a pose. @return whether its source has adopted the correction `T_W_S`, that is, whether
  /// the pose jumps by `T_W_S` or a new recording begins.
  bool adoptsCorrection(const Eigen::Isometry3d& T_W_S, const StampedPose& given);

  /// Whether `next` continues the motion so far after a jump by `T_W_S`. False if the motion is too
  /// uneven, or the gap before `next` too long, to tell.
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
  double unevenness_ = 0.0;  ///< Largest recent deviation from an expected pose; decays.
};

}  // namespace dtsdf
