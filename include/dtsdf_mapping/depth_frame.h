/// A depth image and its camera.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// One depth image. Each pixel holds the distance along the optical axis, i.e. z in the camera
/// frame C (x right, y down, z forward). The pixels need to stay valid only during the call to
/// which they are passed.
struct DepthFrame {
  const void* data = nullptr;                       ///< First row; rows are `row_bytes` apart.
  size_t row_bytes = 0;                             ///< From row to row; at least `width` pixels.
  int width = 0;                                    ///< In pixels.
  int height = 0;                                   ///< In pixels.
  DepthEncoding encoding = DepthEncoding::kUint16;  ///< Type of the raw values.
  float unit_m = 0.001f;              ///< Metres per unit of the raw value (1 for depth in metres).
  Intrinsics intrinsics{0, 0, 0, 0};  ///< Intrinsics of the rectified image.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< Optical frame to map frame, metres.
  /// Point in the map frame, in metres, around which blocks within map/keep_radius_m are kept; the
  /// camera's position if not set.
  std::optional<Eigen::Vector3d> keep_center_W;
};

}  // namespace dtsdf
