/// Inputs of the rules that compute surfels from a depth image.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

/// A pixel's links to its neighbours to the right and below, one bit each.
using PixelLinks = uint8_t;
constexpr PixelLinks kLinkRight = 1, kLinkDown = 2;

/// A depth image, its row fits and its links, in row-major order without padding.
struct ImageView {
  FrameView frame;
  const float* inverse_depth;  ///< In 1/m, from filledInverseDepth(); positive on a surface.
  const float* row_value;      ///< Inverse depth from the row fits; 0 if there is no fit.
  const float* row_slope;      ///< Per pixel.
  const PixelLinks* links;
};

/// The noise of an image. It is uniform in inverse depth for sensors that triangulate, and in depth
/// for time of flight.
struct DepthNoise {
  float sigma;       ///< Standard deviation at 1 m: of depth in m, or of inverse depth in 1/m.
  int32_t in_depth;  ///< 1 if uniform in depth, 0 if uniform in inverse depth.
};

/// Standard deviation of an inverse depth, in 1/m.
DTSDF_HD float noiseAt(const DepthNoise& noise, float inverse_depth) {
  const auto in_depth = static_cast<float>(noise.in_depth);  // branch-free, for vectorisation
  return noise.sigma * (in_depth * (inverse_depth * inverse_depth) + (1.0f - in_depth));
}

/// Largest difference between two inverse depths, in 1/m, that noise can explain. `nearer` is the
/// larger of the two. The variance of a difference is twice that of a sample.
DTSDF_HD float noiseOfStep(const DepthNoise& noise, float nearer, float noise_level) {
  constexpr float kSqrt2 = 1.41421356f;
  return kSqrt2 * noise_level * noiseAt(noise, nearer);
}

/// The data of a frame, passed by value to subsequent stages.
struct FrameSensing {
  ImageView image;
  DepthNoise noise;
  const float* free_depth;          ///< freeDepth() per pixel; null if not needed.
  const float* max_free = nullptr;  ///< Largest free depth per patch (free_patches.h); CPU only.
};

/// Settings for computing surfels.
struct SurfelSettings {
  int32_t normal_radius_px;  ///< Maximum half width of a window; 0 if no normals are needed.
  float depth_jump;          ///< Largest relative difference of neighbouring depths on one surface.
  SurfelRules rules;
  int32_t noise_in_depth;  ///< See DepthNoise::in_depth.
};

}  // namespace dtsdf
