#include "backend/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "backend/frame_check.h"
#include "map/block_extent.h"

namespace dtsdf {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Unknowns of the normal equations: a rotation vector about the camera, then a translation in
// voxels, both along the axes of the map.

/// Lower limit for the RMS residual. The map is no more accurate than this, and with a residual
/// near zero the image would outweigh any prior.
constexpr double kMinResidual_voxels = 0.05;

constexpr double kUnit = 1.0 / kAlignmentScale;

Matrix6d informationOf(const AlignmentSums& sums) {
  Matrix6d information;
  int term = 0;
  for (int i = 0; i < 6; ++i) {
    for (int k = i; k < 6; ++k) {
      information(i, k) = information(k, i) = kUnit * static_cast<double>(sums.normal[term++]);
    }
  }
  return information;
}

Vector6d rightSideOf(const AlignmentSums& sums) {
  Vector6d right;
  for (int i = 0; i < 6; ++i) right(i) = kUnit * static_cast<double>(sums.right[i]);
  return right;
}

/// Variance of a point's residual, in voxels^2.
double varianceOf(const AlignmentSums& sums) {
  const double weight = std::max(1.0, static_cast<double>(sums.weight));
  return std::max(kMinResidual_voxels * kMinResidual_voxels,
                  static_cast<double>(sums.squares) / weight);
}

/// Offset of a pose from the prior, in the units of the normal equations.
Vector6d offsetFrom(const Eigen::Isometry3d& prior, const Eigen::Isometry3d& pose,
                    double voxel_size_m) {
  const Eigen::AngleAxisd turn(pose.linear() * prior.linear().transpose());
  Vector6d offset;
  offset << turn.angle() * turn.axis(), (pose.translation() - prior.translation()) / voxel_size_m;
  return offset;
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vector6d& step, double voxel_size_m) {
  Eigen::Isometry3d result = pose;
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  if (angle > 0.0) {
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, turn / angle) *
                                      Eigen::Quaterniond(pose.linear()));
    result.linear() = rotation.normalized().toRotationMatrix();
  }
  result.translation() += voxel_size_m * step.tail<3>();
  return result;
}

Matrix6d informationOf(const PosePrior& prior, double voxel_size_m) {
  Vector6d diagonal;
  const double per_rad = 1.0 / (prior.sigma_rad * prior.sigma_rad);
  const double per_voxel = voxel_size_m * voxel_size_m / (prior.sigma_m * prior.sigma_m);
  diagonal << per_rad, per_rad, per_rad, per_voxel, per_voxel, per_voxel;
  return diagonal.asDiagonal();
}

/// Inverts the information, and converts (rotation, voxels) to (position in metres, rotation).
Matrix6d covarianceOf(const Matrix6d& information, double voxel_size_m) {
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  Matrix6d covariance;
  covariance.topLeftCorner<3, 3>() =
      voxel_size_m * voxel_size_m * inverse.bottomRightCorner<3, 3>();
  covariance.bottomRightCorner<3, 3>() = inverse.topLeftCorner<3, 3>();
  covariance.topRightCorner<3, 3>() = voxel_size_m * inverse.bottomLeftCorner<3, 3>();
  covariance.bottomLeftCorner<3, 3>() = covariance.topRightCorner<3, 3>().transpose();
  return covariance;
}

/// Number of Gauss-Newton steps. The cutoff falls during the first kFallingSteps steps; after
/// these, the iteration ends on convergence.
constexpr int kFallingSteps = 6, kMaxSteps = 12;

/// Cutoff of a step. It starts at rules.reach, and its excess over the final cutoff is halved in
/// each step.
float cutoffAt(int step, const AlignmentRules& rules) {
  if (step >= kFallingSteps || rules.reach < rules.cutoff) return rules.cutoff;
  return rules.cutoff + std::ldexp(rules.reach - rules.cutoff, -step);
}

/// Whether a step is negligible: points a few metres away move by far less than the map's error.
bool hasConverged(const Vector6d& change) {
  constexpr double kStill_voxels = 1e-2, kStill_rad = 1e-4;
  return change.tail<3>().norm() < kStill_voxels && change.head<3>().norm() < kStill_rad;
}

/// RMS distance, in voxels, by which an offset of the pose moves the points along their normals.
double movedAlongNormals(const AlignmentSums& sums, const Vector6d& offset) {
  const double weight = std::max(1.0, static_cast<double>(sums.weight)) / kAlignmentScale;
  const double squares = offset.dot(informationOf(sums) * offset);
  return std::sqrt(std::max(0.0, squares) / weight);
}

double shareOf(int64_t part, int64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

BlockExtent blocksAround(const FrameView& view, const Vec3f& p_L, float reach) {
  const auto blockAt = [&](float side) {
    return blockOfVoxel(view.origin_voxel + Vec3i{floorToInt(p_L.x + side * reach),
                                                  floorToInt(p_L.y + side * reach),
                                                  floorToInt(p_L.z + side * reach)});
  };
  return {blockAt(-1.0f), blockAt(1.0f)};
}

void addBlocks(const BlockExtent& box, std::vector<PackedKey>& keys) {
  for (int32_t z = box.first.z; z <= box.last.z; ++z) {
    for (int32_t y = box.first.y; y <= box.last.y; ++y) {
      for (int32_t x = box.first.x; x <= box.last.x; ++x) {
        if (isRepresentable({x, y, z})) keys.push_back(packKey({x, y, z}));
      }
    }
  }
}

}  // namespace

Alignment unalignedPose(const DepthFrame& frame, const PosePrior& prior,
                        const AlignmentRules& rules, float voxel_size_m) {
  Alignment unaligned;
  unaligned.reach_m = voxel_size_m * rules.reach;
  unaligned.T_W_C = frame.T_W_C;
  unaligned.covariance = covarianceOf(informationOf(prior, voxel_size_m), voxel_size_m);
  return unaligned;
}

Alignment findPose(const DepthFrame& frame, const PosePrior& prior, const AlignmentRules& rules,
                   float voxel_size_m, const SumsAtPose& sums_at) {
  const Matrix6d prior_information = informationOf(prior, voxel_size_m);
  Alignment unaligned = unalignedPose(frame, prior, rules, voxel_size_m);
  DepthFrame at = frame;
  if (prior.start_T_W_C) at.T_W_C = *prior.start_T_W_C;
  Matrix6d information = prior_information;
  AlignmentSums sums{};
  for (int step = 0; step < kMaxSteps; ++step) {
    sums = sums_at(makeFrameView(at, voxel_size_m), cutoffAt(step, rules));
    if (shareOf(sums.matched, sums.points) < rules.min_matched) break;
    const double scale = 1.0 / (varianceOf(sums) * rules.points_per_witness);
    information = scale * informationOf(sums) + prior_information;
    const Vector6d right = scale * rightSideOf(sums) +
                           prior_information * offsetFrom(frame.T_W_C, at.T_W_C, voxel_size_m);
    const Vector6d change = information.ldlt().solve(-right);
    if (!change.allFinite()) return unaligned;
    at.T_W_C = moved(at.T_W_C, change, voxel_size_m);
    if (step >= kFallingSteps && hasConverged(change)) break;
  }
  Alignment result = unaligned;
  result.matched_share = shareOf(sums.matched, sums.points);
  result.witnesses = static_cast<double>(sums.points) / rules.points_per_witness;
  result.inlier_share = shareOf(sums.inliers, sums.matched);
  if (result.matched_share < rules.min_matched) return result;
  result.residual_m = voxel_size_m * std::sqrt(varianceOf(sums));
  const Vector6d offset = offsetFrom(frame.T_W_C, at.T_W_C, voxel_size_m);
  result.shift_m = voxel_size_m * offset.tail<3>().norm();
  result.turn_rad = offset.head<3>().norm();
  const double misplacement = movedAlongNormals(sums, offset);
  result.misplacement_m = voxel_size_m * misplacement;
  result.is_significant = misplacement > rules.min_misplacement;
  result.status = AlignmentStatus::kMisfit;
  if (result.inlier_share < rules.min_inliers) return result;
  result.status = AlignmentStatus::kAligned;
  result.is_held = result.inlier_share >= rules.held_inliers;
  result.T_W_C = at.T_W_C;
  result.covariance = covarianceOf(information, voxel_size_m);
  if (prior.compared_T_W_C) {
    at.T_W_C = *prior.compared_T_W_C;
    sums = sums_at(makeFrameView(at, voxel_size_m), rules.cutoff);
    result.compared_share = shareOf(sums.inliers, sums.points);
  }
  return result;
}

/// Points are in row-major order, so most of them need the same blocks as the previous point.
std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff, const AlignedPoint* points,
                                   size_t count) {
  constexpr float kAround = 2.0f;  // samples interpolate between the surrounding voxels
  std::vector<PackedKey> keys;
  BlockExtent before = noBlocks();
  for (size_t i = 0; i < count; ++i) {
    if (!(points[i].weight > 0.0f)) continue;
    const Vec3f lever = rotate(view.T_L_C, points[i].p_C);
    if (!(norm(lever) < kLongestLever)) continue;
    const BlockExtent box = blocksAround(view, lever + view.T_L_C.t, cutoff + kAround);
    if (box.first == before.first && box.last == before.last) continue;
    addBlocks(box, keys);
    before = box;
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

const char* toString(AlignmentStatus status) {
  switch (status) {
    case AlignmentStatus::kAligned: return "aligned";
    case AlignmentStatus::kUnmapped: return "too little of the map in view";
    case AlignmentStatus::kMisfit: return "does not fit the map";
    case AlignmentStatus::kAmbiguous: return "the image matches several places in the map";
    case AlignmentStatus::kUnsure: return "aligned again, but in too few images so far";
  }
  return "unknown";
}

}  // namespace dtsdf
