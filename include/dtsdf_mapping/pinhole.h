/// Pinhole camera and depth encodings.
#pragma once

#include <cstdint>

namespace dtsdf {

/// Pinhole intrinsics in pixels; pixel centres have integer coordinates.
struct Intrinsics {
  float fx;  ///< Focal length along u (to the right); > 0.
  float fy;  ///< Focal length along v (downwards); > 0.
  float cx;  ///< Principal point, u.
  float cy;  ///< Principal point, v.
};

/// Pixel type of a depth image.
enum class DepthEncoding : int32_t {
  kUint16,   ///< Integer multiples of `unit_m`; 0 means no measurement.
  kFloat32,  ///< Multiples of `unit_m`; NaN, infinity and values <= 0 mean no measurement.
};

/// Value that many drivers write into 16-bit depth images where nothing was measured; it is treated
/// like 0.
constexpr uint16_t kNoDepth16 = 65535;

}  // namespace dtsdf
