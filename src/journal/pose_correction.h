/// Where images were, once it is known better: what a SLAM says of some of them moves all; and
/// whether it has taken that over.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "io/trajectory.h"

namespace dtsdf {

/// Corrected poses of a camera, and the poses that its images were fused at. An image between two
/// corrected poses keeps its place relative to both, as the odometry has it, and is interpolated
/// between the two places that this gives; before the first and after the last one it keeps its
/// place relative to that one.
class PoseCorrection {
 public:
  /// Stamps closer than this are those of one image.
  static constexpr double kSameStamp_s = 1e-3;
  /// A corrected pose without an image counts only between two that are no further apart, and have
  /// none themselves: how the camera moved between them is a guess, which must not move images.
  static constexpr double kWidestGap_s = 0.25;
  /// More is a mistake.
  static constexpr double kFarthest_m = 1000.0;
  /// Where all turn by more, the poses are of another frame.
  static constexpr double kMostOfAll_rad = 1.0;
  /// Less, of metres and of radians, is the rounding of a file: the image stays as it is.
  static constexpr double kLeast = 1e-6;

  /// `fused` are the camera's images with rising stamps, as they are in the map.
  /// @throws std::runtime_error for poses that are no rigid motions, that are farther from those of
  /// their images than any drift is, that all turn their images by more than a radian, of which two
  /// have one stamp, or none belongs to an image.
  PoseCorrection(std::vector<StampedPose> corrected, const std::vector<StampedPose>& fused);

  /// Where an image at this stamp and place was, of this camera or of one that moves with it; the
  /// very pose given where that does not change.
  Eigen::Isometry3d correct(double stamp_s, const Eigen::Isometry3d& T_W_C) const;

  /// The corrected poses that belong to images: these alone give the same correction.
  std::vector<StampedPose> used() const;
  /// How far the farthest of them moves, in metres or radians.
  double farthest() const;
  /// Stamp of the last one.
  double last_s() const { return anchors_.back().stamp_s; }
  /// What moves the images after the last one: T_W_C becomes lastMotion() * T_W_C.
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

/// Whether who gives the poses of images has taken a correction over: a SLAM does, odometry never.
/// The newest poses that a camera's images were given, one after the other.
///
/// Where it is not clear whether they have jumped, they have not: a SLAM, which jumps, corrects its
/// poses again soon, but what is wrongly no longer moved stays in the map beside what was.
class GivenMotion {
 public:
  /// Stamps that go back by more than this begin a new recording.
  static constexpr double kBegin_s = 0.5;

  void add(const StampedPose& given);

  /// Adds a pose. @return whether the source of poses has taken over with it what `T_W_S` moves: a
  /// new recording begins, or it is moved.
  bool takesOver(const Eigen::Isometry3d& T_W_S, const StampedPose& given);

  /// Whether the next pose continues the motion from where `T_W_S` moves the newest one to: as far
  /// as the motion so far is even enough, and the time between them short enough, to see that.
  bool isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const;

  /// Whether a new recording begins with it.
  bool isNewRecording(const StampedPose& next) const {
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
