/// A colour image and its camera, for painting the surfaces of a map.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// The bytes of a pixel, in their order in memory.
enum class ColourEncoding : int32_t {
  kRgb8,   ///< Red, green, blue.
  kBgr8,   ///< Blue, green, red.
  kRgba8,  ///< kRgb8 and a fourth byte, which is ignored.
  kBgra8,  ///< kBgr8 and a fourth byte, which is ignored.
  kMono8,  ///< One byte of grey.
};

/// One colour image and its camera. Pose, size, lens and time may differ from those of the depth
/// images. The pixels need to stay valid only during the call to which they are passed.
struct ColourFrame {
  const void* data = nullptr;                       ///< First row; rows are `row_bytes` apart.
  size_t row_bytes = 0;                             ///< Bytes from one row to the next.
  int width = 0;                                    ///< In pixels.
  int height = 0;                                   ///< In pixels.
  ColourEncoding encoding = ColourEncoding::kRgb8;  ///< Layout of a pixel.
  Intrinsics intrinsics{0, 0, 0, 0};                ///< Intrinsics of the rectified image.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< Optical frame to map frame, metres.
};

}  // namespace dtsdf
