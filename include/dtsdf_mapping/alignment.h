/// Types for aligning a depth image to the map: the prior for its pose, and the result.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// A camera pose with a time stamp.
struct StampedPose {
  double stamp_s;           ///< Time, in seconds.
  Eigen::Isometry3d T_W_C;  ///< Optical frame to map frame, in metres.
};

/// Expected error of a pose, as standard deviations per axis. In directions that the image does not
/// constrain, such as along a plain corridor, the pose is not corrected.
struct PosePrior {
  double sigma_m = 0.05;     ///< For the position, in metres.
  double sigma_rad = 0.035;  ///< For the orientation, in radians.
  /// Pose at which the optimisation starts; the frame's pose if not set.
  std::optional<Eigen::Isometry3d> start_T_W_C = std::nullopt;
  /// Pose for which to compute Alignment::compared_share, if any.
  std::optional<Eigen::Isometry3d> compared_T_W_C = std::nullopt;
};

/// Whether an image was aligned.
enum class AlignmentStatus {
  kAligned,   ///< The image fits the map at `T_W_C`.
  kUnmapped,  ///< The map contains too little of the scene visible in the image.
  kMisfit,  ///< The image does not fit the map: it shows another place, or its pose is too far off.
  kAmbiguous,  ///< Several places in the map match the image (place_search.h).
  kUnsure,  ///< The image fits, but too few consecutive images have fitted since tracking was lost.
};

/// Short description for messages ("does not fit the map").
const char* toString(AlignmentStatus status);

/// Result of aligning an image to the map.
struct Alignment {
  AlignmentStatus status = AlignmentStatus::kUnmapped;  ///< Whether T_W_C was found.
  /// Optical frame to map frame, in metres. If no pose was found, this is the expected pose.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  /// Fraction of the image's points that lie near a surface of the map.
  double matched_share = 0.0;
  double inlier_share = 0.0;  ///< Fraction of the matched points that fit.
  /// Fraction of the image's points that fit at PosePrior::compared_T_W_C; 0 if that pose is not
  /// set or the image was not aligned.
  double compared_share = 0.0;
  /// Whether enough matched points fit (inliers) for PoseTracker and findPlace() to accept the
  /// pose.
  bool is_held = false;
  /// Maximum distance between a point and the surface it is matched to, in metres.
  double reach_m = 0.0;
  double witnesses = 0.0;   ///< Effective number of points with independent errors.
  double residual_m = 0.0;  ///< Weighted RMS distance to the surface, in metres, at least 0.05
                            ///< voxels; 0 if kUnmapped.
  double shift_m = 0.0;     ///< Distance of the best fit from the frame's pose, in metres.
  double turn_rad = 0.0;    ///< Angle between the frame's pose and the best fit, in radians.
  /// RMS distance along the normals, in metres, between the points at the frame's pose and at the
  /// best fit. It is small if the frame's pose is only off parallel to a wall.
  double misplacement_m = 0.0;
  /// Whether misplacement_m exceeds the expected error of the map itself.
  bool is_significant = false;
  /// Covariance of T_W_C: position along the axes of the map frame in m^2, then small rotations
  /// about these axes in rad^2. Directions that the image does not constrain have the variance of
  /// the prior. If T_W_C is not the best fit, the squared offset from the best fit is added.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

}  // namespace dtsdf
