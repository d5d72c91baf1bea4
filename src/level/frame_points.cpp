#include "level/frame_points.h"

#include <cmath>
#include <cstring>

namespace dtsdf {

double depthAt(const DepthFrame& frame, int u, int v) {
  const char* row = static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
  if (frame.encoding == DepthEncoding::kUint16) {
    uint16_t raw;
    std::memcpy(&raw, row + static_cast<size_t>(u) * sizeof(raw), sizeof(raw));
    return raw == kNoDepth16 ? 0.0 : static_cast<double>(raw) * frame.unit_m;
  }
  float raw;
  std::memcpy(&raw, row + static_cast<size_t>(u) * sizeof(raw), sizeof(raw));
  return std::isfinite(raw) && raw > 0.0f ? static_cast<double>(raw) * frame.unit_m : 0.0;
}

std::vector<Eigen::Vector3d> thinnedPoints(const DepthFrame& frame, int columns, int rows) {
  const Intrinsics& K = frame.intrinsics;
  std::vector<Eigen::Vector3d> points;
  if (frame.data == nullptr || frame.width <= 0 || frame.height <= 0) return points;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int u = (2 * i + 1) * frame.width / (2 * columns);
      const int v = (2 * j + 1) * frame.height / (2 * rows);
      const double z = depthAt(frame, u, v);
      if (z > 0.0) points.emplace_back(z * (u - K.cx) / K.fx, z * (v - K.cy) / K.fy, z);
    }
  }
  return points;
}

void rayToAxialDepth(DepthFrame& frame, float* pixels) {
  const Intrinsics& K = frame.intrinsics;
  float* pixel = pixels;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const double ray = std::hypot((u - K.cx) / K.fx, (v - K.cy) / K.fy, 1.0f);
      *pixel++ = static_cast<float>(depthAt(frame, u, v) / ray);
    }
  }
  frame.data = pixels;
  frame.encoding = DepthEncoding::kFloat32;
  frame.row_bytes = static_cast<size_t>(frame.width) * sizeof(float);
  frame.unit_m = 1.0f;
}

}  // namespace dtsdf
