#include "backend/frame_check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "backend/rule_settings.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"
#include "map/region_view.h"
#include "params/intrinsics_check.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// Reads the u-th element of a row, which may be unaligned.
template <class Raw>
Raw elementOf(const char* row, int u) {
  Raw raw;
  std::memcpy(&raw, row + static_cast<size_t>(u) * sizeof(Raw), sizeof(Raw));
  return raw;
}

/// Checks the properties common to depth and colour images; `kind` names the image in messages.
template <class Frame>
std::optional<IntegrationResult> findImageProblem(const Frame& frame, const char* kind) {
  if (frame.data == nullptr || frame.width <= 0 || frame.height <= 0) {
    return refuse(FrameStatus::kBadImage, formatted("the %s image is empty", kind));
  }
  if (static_cast<int64_t>(frame.width) * frame.height > kMaxPixels) {
    return refuse(FrameStatus::kBadImage,
                  formatted("the %s image has %d x %d pixels; at most %lld are supported", kind,
                            frame.width, frame.height, static_cast<long long>(kMaxPixels)));
  }
  const size_t row = packedRowBytes(frame);
  if (frame.row_bytes < row) {
    return refuse(FrameStatus::kBadImage,
                  formatted("rows of %zu bytes are too short for %d pixels, which need %zu",
                            frame.row_bytes, frame.width, row));
  }
  return std::nullopt;
}

std::optional<IntegrationResult> findIntrinsicsProblem(const Intrinsics& K, int width, int height) {
  const std::string text = findProblem(K, width, height);
  if (text.empty()) return std::nullopt;
  return refuse(FrameStatus::kBadIntrinsics, text);
}

/// Checks the pose. All blocks within `reach_m` of the camera must have representable coordinates.
std::optional<IntegrationResult> findPoseProblem(const Eigen::Isometry3d& T_W_C, double reach_m,
                                                 const MapperParams& params) {
  if (!T_W_C.matrix().allFinite()) {
    return refuse(FrameStatus::kBadPose, "the camera pose is not finite");
  }
  const Eigen::Matrix3d R = T_W_C.linear();
  constexpr double kRotationTolerance = 1e-3;
  if (!(R * R.transpose()).isIdentity(kRotationTolerance) || R.determinant() < 0.0) {
    return refuse(FrameStatus::kBadPose, "the 3 x 3 part of the camera pose is not a rotation");
  }
  const double limit_m =
      static_cast<double>(kMaxBlockCoordinate - 2) * kBlockSide * params.map.voxel_size_m;
  if (T_W_C.translation().cwiseAbs().maxCoeff() + reach_m > limit_m) {
    return refuse(
        FrameStatus::kBadPose,
        formatted("the camera is farther than %g m from the map frame's origin, the limit for "
                  "voxels of %g m; subtract a local origin from UTM coordinates",
                  limit_m, static_cast<double>(params.map.voxel_size_m)));
  }
  return std::nullopt;
}

/// Maximum distance from the camera, in metres, at which a depth frame may change the map.
double reachOf(const DepthFrame& frame, const MapperParams& params) {
  const Intrinsics& K = frame.intrinsics;
  const double tangent_u = (frame.width + std::abs(static_cast<double>(K.cx))) / K.fx;
  const double tangent_v = (frame.height + std::abs(static_cast<double>(K.cy))) / K.fy;
  return params.fusion.max_depth_m * (1.0 + tangent_u + tangent_v) +
         2.0 * params.map.truncation_voxels * params.map.voxel_size_m;
}

template <class Frame>
FrameView frameViewOf(const Frame& frame, float voxel_size_m) {
  const Eigen::Vector3d t_voxels = frame.T_W_C.translation() / static_cast<double>(voxel_size_m);
  FrameView view;
  view.width = frame.width;
  view.height = frame.height;
  view.intrinsics = frame.intrinsics;
  view.voxel_size_m = voxel_size_m;
  const auto origin = [&](int axis) {
    return static_cast<int32_t>(std::floor(t_voxels[axis] / kBlockSide)) * kBlockSide;
  };
  view.origin_voxel = {origin(0), origin(1), origin(2)};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      view.T_L_C.R[3 * row + column] = static_cast<float>(frame.T_W_C.linear()(row, column));
    }
  }
  view.T_L_C.t = {static_cast<float>(t_voxels[0] - view.origin_voxel.x),
                  static_cast<float>(t_voxels[1] - view.origin_voxel.y),
                  static_cast<float>(t_voxels[2] - view.origin_voxel.z)};
  return view;
}

}  // namespace

const char* toString(FrameStatus status) {
  switch (status) {
    case FrameStatus::kFused: return "fused";
    case FrameStatus::kBadImage: return "bad image";
    case FrameStatus::kBadIntrinsics: return "bad intrinsics";
    case FrameStatus::kBadPose: return "bad pose";
    case FrameStatus::kNoMeasurement: return "no measurement";
    case FrameStatus::kNoMemory: return "no memory";
  }
  return "unknown";
}

std::optional<IntegrationResult> findProblem(const DepthFrame& frame, const MapperParams& params) {
  if (auto image_problem = findImageProblem(frame, "depth")) return image_problem;
  if (!(frame.unit_m > 0.0f) || !std::isfinite(frame.unit_m)) {
    return refuse(FrameStatus::kBadImage, "the depth unit is not a positive number");
  }
  if (auto found = findIntrinsicsProblem(frame.intrinsics, frame.width, frame.height)) return found;
  if (frame.keep_center_W && !frame.keep_center_W->allFinite()) {
    return refuse(FrameStatus::kBadPose, "the centre of map/keep_radius_m is not finite");
  }
  return findPoseProblem(frame.T_W_C, reachOf(frame, params), params);
}

std::optional<IntegrationResult> findProblem(const ColourFrame& frame, const MapperParams& params) {
  if (auto image_problem = findImageProblem(frame, "colour")) return image_problem;
  if (auto found = findIntrinsicsProblem(frame.intrinsics, frame.width, frame.height)) return found;
  return findPoseProblem(frame.T_W_C, 0.0, params);
}

FrameView makeFrameView(const DepthFrame& frame, float voxel_size_m) {
  return frameViewOf(frame, voxel_size_m);
}

FrameView makeFrameView(const ColourFrame& frame, float voxel_size_m) {
  return frameViewOf(frame, voxel_size_m);
}

FrameView checkedFrameView(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                           const MapperParams& params) {
  // The checks need an image; its pixels are never read.
  ColourFrame frame;
  frame.data = &camera;
  frame.width = camera.width;
  frame.height = camera.height;
  frame.encoding = ColourEncoding::kMono8;
  frame.row_bytes = static_cast<size_t>(std::max(0, camera.width));
  frame.intrinsics = camera.intrinsics;
  frame.T_W_C = T_W_C;
  auto found = findImageProblem(frame, "rendered");
  if (!found) found = findIntrinsicsProblem(frame.intrinsics, frame.width, frame.height);
  if (!found) found = findPoseProblem(T_W_C, 0.0, params);
  if (found) throw std::invalid_argument(found->message);
  return frameViewOf(frame, params.map.voxel_size_m);
}

void resizeView(const FrameView& frame, bool has_colours, RenderedView& view) {
  const size_t pixels = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  view.width = frame.width;
  view.height = frame.height;
  view.depth_m.resize(pixels);
  view.normals_C.resize(pixels);
  view.colours.resize(has_colours ? pixels : 0);
}

/// Larger depths count neither as measurements nor as free space. No camera measures this far, but
/// depths in millimetres that are mistaken for metres usually exceed this limit.
constexpr float kFarthest_m = 300.0f;

DepthRange depthRangeOf(const DepthFrame& frame, const MapperParams& params) {
  const bool is_whole = frame.encoding == DepthEncoding::kUint16;
  const float overflow =
      std::min(kFarthest_m / frame.unit_m,
               is_whole ? static_cast<float>(kNoDepth16) : std::numeric_limits<float>::max());
  return {frame.unit_m, params.fusion.min_depth_m, params.fusion.max_depth_m, overflow,
          is_whole ? frame.unit_m : 0.0f};
}

RegionView keptBallOf(const DepthFrame& frame, const MapParams& params) {
  const Eigen::Vector3d center_W = frame.keep_center_W.value_or(frame.T_W_C.translation());
  return makeRegionView(SphereRegion{center_W, params.keep_radius_m}, params.voxel_size_m);
}

RegionView checkedRegionView(const Region& region, const MapParams& params) {
  const std::string problem = findProblem(region);
  if (!problem.empty()) throw std::invalid_argument(problem);
  return makeRegionView(region, params.voxel_size_m);
}

float rawDepth(const DepthFrame& frame, int u, int v) {
  const char* row = static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
  if (frame.encoding == DepthEncoding::kUint16) {
    return static_cast<float>(elementOf<uint16_t>(row, u));
  }
  return elementOf<float>(row, u);
}

PixelLayout layoutOf(ColourEncoding encoding) {
  switch (encoding) {
    case ColourEncoding::kMono8: return {1, 0, 0, 0};
    case ColourEncoding::kRgb8: return {3, 0, 1, 2};
    case ColourEncoding::kBgr8: return {3, 2, 1, 0};
    case ColourEncoding::kRgba8: return {4, 0, 1, 2};
    case ColourEncoding::kBgra8: break;
  }
  return {4, 2, 1, 0};
}

size_t packedRowBytes(const DepthFrame& frame) {
  const bool is_whole = frame.encoding == DepthEncoding::kUint16;
  return static_cast<size_t>(frame.width) * (is_whole ? sizeof(uint16_t) : sizeof(float));
}

size_t packedRowBytes(const ColourFrame& frame) {
  return static_cast<size_t>(frame.width) * static_cast<size_t>(layoutOf(frame.encoding).bytes);
}

bool clearsBeyondRange(const DepthFrame& frame, const MapperParams& params) {
  if (!clearsFreeSpace(params)) return false;
  const DepthRange range = depthRangeOf(frame, params);
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      if (inverseDepth(rawDepth(frame, u, v), range) < 0.0f) return true;
    }
  }
  return false;
}

IntegrationResult refuse(FrameStatus status, const std::string& message) {
  IntegrationResult result;
  result.status = status;
  result.message = message;
  return result;
}

IntegrationResult noMeasurement(const DepthFrame& frame, const MapperParams& params) {
  size_t measured = 0, too_far = 0;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const float raw = rawDepth(frame, u, v);
      if (!(raw > 0.0f) || !std::isfinite(raw)) continue;
      ++measured;
      if (raw * frame.unit_m > kFarthest_m) ++too_far;
    }
  }
  if (2 * too_far > measured) {
    return refuse(FrameStatus::kNoMeasurement,
                  formatted("most depths are more than %g m, which no camera measures: are they in "
                            "millimetres? Their unit is %g m (input/unit_32fc1_m or "
                            "input/unit_16uc1_m, --depth-scale, or unit_m of the frame)",
                            static_cast<double>(kFarthest_m), static_cast<double>(frame.unit_m)));
  }
  return refuse(
      FrameStatus::kNoMeasurement,
      formatted("no pixel has a usable depth: all are empty, isolated, or outside [%g, %g] m",
                static_cast<double>(params.fusion.min_depth_m),
                static_cast<double>(params.fusion.max_depth_m)));
}

IntegrationResult nothingToPaint() {
  return refuse(FrameStatus::kNoMeasurement,
                "no surface of the map can be painted: all surfaces are outside the image, hidden, "
                "beyond colour/max_depth_m, or viewed at a grazing angle");
}

}  // namespace dtsdf
