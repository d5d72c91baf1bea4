/// Aligning a depth image to the map: the prior of its pose, and the result.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// How far a pose may be off: standard deviations of a normal distribution around it, per axis.
/// Directions that the image does not constrain, as along a plain corridor, stay at the prior.
struct PosePrior {
  double sigma_m = 0.05;     ///< Deviation of the position, in metres.
  double sigma_rad = 0.035;  ///< Deviation of the orientation, in radians.
  /// Where to start from, if not there: an image may fit at more poses than one.
  std::optional<Eigen::Isometry3d> start_T_W_C = std::nullopt;
  /// A pose to compare the aligned one with, if any.
  std::optional<Eigen::Isometry3d> compared_T_W_C = std::nullopt;
};

/// Whether an image was aligned.
enum class AlignmentStatus {
  kAligned,    ///< `T_W_C` is where the image fits the map best.
  kUnmapped,   ///< The map holds too little of what the image shows.
  kMisfit,     ///< The map does not fit there: another place, or a pose too far off.
  kAmbiguous,  ///< Several places of the map look like it (place_search.h).
  kUnsure,     ///< Fits again after tracking was lost, but not for enough images yet.
};

/// A short text for messages ("does not fit the map").
const char* toString(AlignmentStatus status);

/// Result of aligning an image to the map.
struct Alignment {
  AlignmentStatus status = AlignmentStatus::kUnmapped;  ///< Whether T_W_C was found.
  /// Optical frame to map frame, in metres. That of the frame unless it was aligned.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  double matched_share = 0.0;  ///< Share of the image's points that lie near a surface of the map.
  double inlier_share = 0.0;   ///< Share of the matched points that fit.
  /// Share of the image's points that fit at the pose to compare with; 0 if there is none.
  double compared_share = 0.0;
  /// So many fit that it has not slid along plain surfaces, which fit all along.
  bool is_held = false;
  double reach_m = 0.0;     ///< How far off the map surfaces were looked for, in metres.
  double witnesses = 0.0;   ///< Points with independent errors that would say as much as all.
  double residual_m = 0.0;  ///< Root mean square of their distances to the surface, in metres.
  double shift_m = 0.0;     ///< From the frame's pose, in metres.
  double turn_rad = 0.0;    ///< Turn from the frame's pose, in radians.
  /// How far the image's points lie off the map at the frame's pose, along their normals, root mean
  /// square, in metres: small if the pose is off along a wall only.
  double misplacement_m = 0.0;
  bool is_significant = false;  ///< misplacement_m is more than the map's own error explains.
  /// Covariance of T_W_C: of the position along the axes of the map frame in m^2, then of small
  /// rotations about these in rad^2. The prior's where the image constrains nothing. If the image
  /// was put at another pose than where it fits best, with the square of the way between.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

}  // namespace dtsdf
