/// Corrects the poses of depth images, one after the other, so that they fit the map.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "dtsdf_mapping/alignment_gain.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Keeps the correction between the frame O that poses are given in and the frame W of the map, by
/// a Kalman filter: it drifts with the way, and each pose that was aligned measures it, with the
/// noise of the given pose. So drift is followed and noise is not. A pose that is as good as the
/// map can say stays as it is, and where alignments are the noisier ones, poses follow them on
/// average only. Not thread safe.
class PoseRefiner {
 public:
  /// @param params How far off poses are, and what becomes of frames that do not fit.
  explicit PoseRefiner(const PoseParams& params) : params_(params) { forget(); }

  /// Finds the pose of a frame, whose T_W_C is read as T_O_C, and keeps the correction if it was
  /// aligned. `T_W_C` of the result is where the frame is to be fused.
  /// @throws std::exception when the backend fails.
  Alignment refine(Mapper& mapper, const DepthFrame& frame);

  /// Whether a frame with this outcome is to be fused.
  bool isToBeFused(const Alignment& alignment) const {
    return alignment.status != AlignmentStatus::kMisfit || params_.on_misfit == OnMisfit::kPrior;
  }

  /// From O to W, by the frames that were aligned; identity at first.
  const Eigen::Isometry3d& T_W_O() const { return T_W_O_; }

 private:
  /// The correction is as unknown as a given pose.
  void forget();
  void drift(const Eigen::Isometry3d& T_O_C);
  void correct(const Eigen::Isometry3d& T_W_C, const Eigen::Isometry3d& expected_T_W_C);

  PoseParams params_;
  Eigen::Isometry3d T_W_O_ = Eigen::Isometry3d::Identity();
  double variance_m2_ = 0.0, variance_rad2_ = 0.0;  ///< Of T_W_O, at the camera.
  std::optional<Eigen::Isometry3d> last_T_O_C_;
  AlignmentGain gain_;
  bool has_aligned_ = false;
};

}  // namespace dtsdf
