/// Alignment of a depth image to the map: the prior of its pose, and the result.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// The pose of a camera at one time.
struct StampedPose {
  double stamp_s;           ///< Time, in seconds.
  Eigen::Isometry3d T_W_C;  ///< Optical frame to map frame, in metres.
};

/// Expected error of a pose: standard deviations per axis. In directions that the image does not
/// constrain, such as along a plain corridor, the pose stays at the prior.
struct PosePrior {
  double sigma_m = 0.05;     ///< For the position, in metres.
  double sigma_rad = 0.035;  ///< For the orientation, in radians.
  /// Start of the optimisation, if not the frame's pose: an image may fit at several poses.
  std::optional<Eigen::Isometry3d> start_T_W_C = std::nullopt;
  /// Pose for which Alignment::compared_share is computed, if any.
  std::optional<Eigen::Isometry3d> compared_T_W_C = std::nullopt;
};

/// Whether an image was aligned.
enum class AlignmentStatus {
  kAligned,    ///< The image fits the map at `T_W_C`.
  kUnmapped,   ///< The map contains too little of what the image shows.
  kMisfit,     ///< The image does not fit the map: wrong place, or a pose too far off.
  kAmbiguous,  ///< Several places in the map match the image (place_search.h).
  kUnsure,     ///< The image fits, but too few in a row have fitted since tracking was lost.
};

/// Short description for messages ("does not fit the map").
const char* toString(AlignmentStatus status);

/// Result of aligning an image to the map.
struct Alignment {
  AlignmentStatus status = AlignmentStatus::kUnmapped;  ///< Whether T_W_C was found.
  /// Optical frame to map frame, in metres. If no pose was found, the expected one.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  double matched_share = 0.0;  ///< Share of the image's points that lie near a surface of the map.
  double inlier_share = 0.0;   ///< Share of the matched points that fit.
  /// Share of the image's points that fit at PosePrior::compared_T_W_C; 0 if there is no such pose
  /// or the image was not aligned.
  double compared_share = 0.0;
  /// Whether enough of the matched points fit for PoseTracker and findPlace() to trust the pose.
  bool is_held = false;
  double reach_m = 0.0;     ///< Largest distance to the map at which a point counts, in metres.
  double witnesses = 0.0;   ///< Effective number of points with independent errors.
  double residual_m = 0.0;  ///< Weighted RMS distance to the surface, in metres, at least 0.05
                            ///< voxels; 0 if kUnmapped.
  double shift_m = 0.0;     ///< Distance of the best fit from the frame's pose, in metres.
  double turn_rad = 0.0;    ///< Rotation from the frame's pose to the best fit, in radians.
  /// Root mean square distance along the normals, in metres, between the points at the frame's pose
  /// and at the best fit: small if the frame's pose is only off along a wall.
  double misplacement_m = 0.0;
  bool is_significant = false;  ///< misplacement_m exceeds what the map's own error explains.
  /// Covariance of T_W_C: position along the axes of the map frame in m^2, then small rotations
  /// about these axes in rad^2. Directions that the image does not constrain have the variance of
  /// the prior. If T_W_C is not the best fit, the squared offset from the best fit is added.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

}  // namespace dtsdf
