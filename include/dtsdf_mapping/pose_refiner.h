/// Corrects the input poses of depth images, one after another, so that the images fit the map.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment_gain.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// A Kalman filter estimates the correction, a transform from the frame O of the input poses to the
/// map frame W. Its variance grows with the distance travelled. Each aligned pose is a measurement
/// of the correction, with the noise of an input pose, so drift is corrected and noise is averaged
/// out. If the corrected input pose agrees with the aligned pose to within the error of the map, it
/// is used unchanged. If alignments are noisier than input poses, a refined pose moves only part of
/// the way to its aligned pose (AlignmentGain). An alignment that may have converged to a wrong
/// pose is repeated, starting from the previous image's pose. Not thread safe.
class PoseRefiner {
 public:
  /// @param params Expected errors of input poses, and whether to fuse frames that do not fit.
  explicit PoseRefiner(const PoseParams& params) : params_(params) { forget(); }

  /// Finds the pose of a frame and updates the correction if the frame could be aligned. The
  /// frame's `T_W_C` is interpreted as T_O_C. Fuse the frame at the `T_W_C` of the result.
  /// @throws std::exception when the backend fails.
  Alignment refine(Mapper& mapper, const DepthFrame& frame);

  /// Whether to fuse a frame for which refine() returned this result.
  bool shouldFuse(const Alignment& alignment) const {
    return alignment.status != AlignmentStatus::kMisfit || !params_.drop_misfits;
  }

  /// The correction, O to W; initially the identity.
  const Eigen::Isometry3d& T_W_O() const { return T_W_O_; }

 private:
  /// Resets the correction's variance to that of an input pose.
  void forget();
  void drift(const Eigen::Isometry3d& T_O_C);
  Alignment align(Mapper& mapper, const DepthFrame& expected, PosePrior prior);
  void correct(const Eigen::Isometry3d& T_W_C, const Eigen::Isometry3d& expected_T_W_C);

  PoseParams params_;
  Eigen::Isometry3d T_W_O_ = Eigen::Isometry3d::Identity();
  double variance_m2_ = 0.0, variance_rad2_ = 0.0;  ///< Variances of T_W_O, at the camera.
  std::optional<Eigen::Isometry3d> last_T_O_C_;
  /// Best-fit pose of the last image, if it was aligned.
  std::optional<Eigen::Isometry3d> last_T_W_C_;
  double last_share_ = 0.0;  ///< Fraction of the last image's points that fit the map.
  AlignmentGain gain_;
  bool has_aligned_ = false;
};

}  // namespace dtsdf
