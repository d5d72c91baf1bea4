/// A depth image with its camera: what a map is made of.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// One depth image. The pixels are only read during the call it is passed to.
struct DepthFrame {
  const void* data = nullptr;  ///< First row; rows are `row_bytes` apart.
  size_t row_bytes = 0;
  int width = 0, height = 0;  ///< In pixels.
  DepthEncoding encoding = DepthEncoding::kUint16;
  float unit_m = 0.001f;  ///< Metres per unit of the raw value (1 for depth in metres).
  Intrinsics intrinsics{0, 0, 0, 0};
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< Optical frame to map frame, metres.
};

}  // namespace dtsdf
