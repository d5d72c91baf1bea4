/// Corrects the poses of depth images, one after the other, so that they fit the map.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment_gain.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// A Kalman filter estimates the correction from the frame O that poses are given in to the frame W
/// of the map. Its variance grows with the distance travelled, and each aligned pose measures it,
/// with the noise of a given pose: so drift is corrected, and noise is averaged. A pose within the
/// map's own error is not moved, and if alignments are noisier than given poses, poses follow them
/// on average only. Images that slip are aligned from where the one before was as well. Not thread
/// safe.
class PoseRefiner {
 public:
  /// @param params Errors of given poses, and what to do with frames that do not fit.
  explicit PoseRefiner(const PoseParams& params) : params_(params) { forget(); }

  /// Finds the pose of a frame, whose T_W_C is taken as T_O_C, and updates the correction if it was
  /// aligned. Fuse the frame at `T_W_C` of the result.
  /// @throws std::exception when the backend fails.
  Alignment refine(Mapper& mapper, const DepthFrame& frame);

  /// Whether a frame with this outcome is to be fused.
  bool isToBeFused(const Alignment& alignment) const {
    return alignment.status != AlignmentStatus::kMisfit || !params_.drop_misfits;
  }

  /// The correction, O to W; identity at first.
  const Eigen::Isometry3d& T_W_O() const { return T_W_O_; }

 private:
  /// The correction is as unknown as a given pose.
  void forget();
  void drift(const Eigen::Isometry3d& T_O_C);
  Alignment align(Mapper& mapper, const DepthFrame& expected, PosePrior prior);
  void correct(const Eigen::Isometry3d& T_W_C, const Eigen::Isometry3d& expected_T_W_C);

  PoseParams params_;
  Eigen::Isometry3d T_W_O_ = Eigen::Isometry3d::Identity();
  double variance_m2_ = 0.0, variance_rad2_ = 0.0;  ///< Variances of T_W_O, at the camera.
  std::optional<Eigen::Isometry3d> last_T_O_C_;
  std::optional<Eigen::Isometry3d> last_T_W_C_;  ///< Pose of the newest image that was aligned.
  double last_share_ = 0.0;                      ///< Share of its points that lay on surfaces.
  AlignmentGain gain_;
  bool has_aligned_ = false;
};

}  // namespace dtsdf
