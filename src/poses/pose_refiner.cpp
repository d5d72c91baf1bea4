#include "dtsdf_mapping/pose_refiner.h"

#include <cmath>

#include "poses/between.h"

namespace dtsdf {
namespace {

double square(double a) { return a * a; }

/// Moves an alignment from its best pose to another pose, and adds the outer product of the step
/// between them to its covariance.
void put(Alignment& alignment, const Eigen::Isometry3d& T_W_C) {
  const Eigen::Matrix<double, 6, 1> way = stepBetween(alignment.T_W_C, T_W_C);
  alignment.covariance += way * way.transpose();
  alignment.T_W_C = T_W_C;
}

/// Whether a fraction of `witnesses` independent points is lower than another fraction by more than
/// its standard deviation.
bool isSignificantlyLower(double share, double other, double witnesses) {
  const double gap = other - share;
  return gap > 0.0 && gap * gap * witnesses > share * (1.0 - share);
}

/// Whether an alignment is within kMaxDeviations of the prior.
bool isLikely(const Alignment& alignment, const PosePrior& prior) {
  return alignment.shift_m <= kMaxDeviations * prior.sigma_m &&
         alignment.turn_rad <= kMaxDeviations * prior.sigma_rad;
}

Eigen::Quaterniond shareOf(const Eigen::Quaterniond& rotation, double share) {
  return Eigen::Quaterniond::Identity().slerp(share, rotation);
}

}  // namespace

Alignment PoseRefiner::refine(Mapper& mapper, const DepthFrame& frame) {
  if (!frame.T_W_C.matrix().allFinite()) {  // align() rejects it
    return mapper.align(frame, {params_.sigma_m, params_.sigma_rad});
  }
  drift(frame.T_W_C);
  gain_.addGiven(frame.T_W_C);
  DepthFrame expected = frame;
  expected.T_W_C = T_W_O_ * frame.T_W_C;
  PosePrior prior{std::sqrt(square(params_.sigma_m) + variance_m2_),
                  std::sqrt(square(params_.sigma_rad) + variance_rad2_)};
  prior.compared_T_W_C = expected.T_W_C;
  Alignment alignment = align(mapper, expected, prior);
  if (alignment.status != AlignmentStatus::kAligned) {
    // The first image of a map defines W, so its correction is exact.
    const bool begins_map = alignment.status == AlignmentStatus::kUnmapped && !has_aligned_;
    if (begins_map) variance_m2_ = variance_rad2_ = 0.0;
    return alignment;
  }
  has_aligned_ = true;
  if (gain_.addAligned(alignment.T_W_C)) forget();
  if (!alignment.is_significant) put(alignment, expected.T_W_C);
  correct(alignment.T_W_C, expected.T_W_C);
  if (!alignment.is_significant) return alignment;
  const double share = gain_.share(expected.T_W_C, alignment.T_W_C);
  if (share < 1.0) put(alignment, between(expected.T_W_C, alignment.T_W_C, share));
  return alignment;
}

/// Alignment may converge to a wrong pose that fits most of the image. If fewer of its points lie
/// on surfaces than in the previous image, the image is also aligned starting from the previous
/// image's pose. The better result is used, unless the prior makes it unlikely, since different
/// places may look alike.
Alignment PoseRefiner::align(Mapper& mapper, const DepthFrame& expected, PosePrior prior) {
  Alignment found = mapper.align(expected, prior);
  if (found.status != AlignmentStatus::kAligned) {
    last_T_W_C_.reset();
    return found;
  }
  if (last_T_W_C_ && isSignificantlyLower(explainedBy(found), last_share_, found.witnesses)) {
    prior.start_T_W_C = last_T_W_C_;
    const Alignment other = mapper.align(expected, prior);
    if (isLikely(other, prior) &&
        isSignificantlyLower(explainedBy(found), explainedBy(other), found.witnesses)) {
      found = other;
    }
  }
  last_T_W_C_ = found.T_W_C;
  last_share_ = explainedBy(found);
  return found;
}

void PoseRefiner::forget() {
  variance_m2_ = square(params_.sigma_m);
  variance_rad2_ = square(params_.sigma_rad);
}

void PoseRefiner::drift(const Eigen::Isometry3d& T_O_C) {
  if (last_T_O_C_) {
    const double way_m = (T_O_C.translation() - last_T_O_C_->translation()).norm();
    variance_m2_ += square(params_.drift * way_m);
    variance_rad2_ += square(params_.drift * way_m);
  }
  last_T_O_C_ = T_O_C;
}

/// Kalman filter update. An aligned pose is a measurement of the correction, with the noise of an
/// input pose (sigma). The error of the alignment itself is neglected.
void PoseRefiner::correct(const Eigen::Isometry3d& T_W_C, const Eigen::Isometry3d& expected_T_W_C) {
  const double gain_m = variance_m2_ / (variance_m2_ + square(params_.sigma_m));
  const double gain_rad = variance_rad2_ / (variance_rad2_ + square(params_.sigma_rad));
  variance_m2_ *= 1.0 - gain_m;
  variance_rad2_ *= 1.0 - gain_rad;
  // If nothing changes, T_W_O_ must stay bit-identical.
  if (T_W_C.matrix() == expected_T_W_C.matrix()) return;
  const Eigen::Quaterniond turn(T_W_C.linear() * expected_T_W_C.linear().transpose());
  // Rotates about the camera, so that the rotation does not move the expected position.
  Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();
  correction.linear() = shareOf(turn.normalized(), gain_rad).toRotationMatrix();
  correction.translation() = expected_T_W_C.translation() -
                             correction.linear() * expected_T_W_C.translation() +
                             gain_m * (T_W_C.translation() - expected_T_W_C.translation());
  T_W_O_ = correction * T_W_O_;
  T_W_O_.linear() = Eigen::Quaterniond(T_W_O_.linear()).normalized().toRotationMatrix();
}

}  // namespace dtsdf
