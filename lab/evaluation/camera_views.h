/// Camera trajectories around an object, and the views in a TUM folder.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// A pinhole camera and its image size.
struct ViewCamera {
  Intrinsics intrinsics{525.0f, 525.0f, 319.5f, 239.5f};
  int width = 640;
  int height = 480;

  /// Number of pixels, and index of a pixel in row-major order.
  size_t pixelCount() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  size_t pixelAt(int u, int v) const {
    return static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
  }
};

/// A camera whose principal point is the image centre.
ViewCamera centredCamera(int width, int height, double focal_px);

/// Direction of the ray through a pixel, in the optical frame, with z = 1.
Eigen::Vector3f rayOf(const Intrinsics& K, float u_px, float v_px);

enum class OrbitShape {
  kCircle,  ///< In the plane y = 0 (the set-up in the paper).
  kHelix,   ///< Five turns from 60 degrees below the plane y = 0 to 60 above it.
  kSphere,  ///< A spiral from pole to pole, with views distributed evenly over the sphere.
  kHand,    ///< Hand-held, along the circle (hand_path.h).
};

/// @throws std::invalid_argument for an unknown name.
OrbitShape orbitShapeFromName(const std::string& name);

/// Poses of the optical frame (x right, y down, z forward) along the trajectory; for kHand, along
/// the circle. All cameras are `radius_m` away from the origin and face it; y is up in W.
std::vector<Eigen::Isometry3d> orbitPoses(OrbitShape shape, size_t count, double radius_m);

/// The views of a recording.
struct Views {
  ViewCamera camera;
  std::vector<Eigen::Isometry3d> poses_W_C;
  std::vector<std::string> depth_paths;  ///< One per view; empty if there are no depth images.
};

/// Reads the intrinsics and poses of the depth images in a TUM folder.
/// @throws std::runtime_error if a file cannot be read, or if no image has a pose.
Views readViews(const std::string& tum_folder);

/// Reads a depth image with 5000 units per metre. @return Depths in metres, row-major; 0: no
/// measurement.
/// @throws std::runtime_error if the file is not a 16-bit image of the camera's size.
std::vector<float> readTumDepth(const std::string& path, const ViewCamera& camera);

}  // namespace dtsdf
