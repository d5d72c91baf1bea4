/// What is known of one depth image before its surfels are made: the views that the rules work on.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

/// Which of a pixel's neighbours lie on one surface with it, as bits.
using PixelLinks = uint8_t;
constexpr PixelLinks kLinkRight = 1, kLinkDown = 2;

/// A depth image, its row fits and its links, row by row without gaps.
struct ImageView {
  FrameView frame;
  const float* inverse_depth;  ///< In 1/m, by filledInverseDepth(); only above 0 is a surface.
  const float* row_value;      ///< Inverse depth by the row fits, 0 where there is none.
  const float* row_slope;
  const PixelLinks* links;  ///< Which neighbours lie on one surface.
};

/// The noise of an image. A sensor that triangulates has the same everywhere in inverse depth, one
/// that measures the time of flight in depth.
struct DepthNoise {
  float sigma;       ///< Standard deviation at 1 m, of inverse depth in 1/m and of depth in m.
  int32_t in_depth;  ///< 1: uniform in depth, 0: uniform in inverse depth.
};

/// Standard deviation of an inverse depth, in 1/m.
DTSDF_HD float noiseAt(const DepthNoise& noise, float inverse_depth) {
  const auto in_depth = static_cast<float>(noise.in_depth);  // no branch, for vector instructions
  return noise.sigma * (in_depth * (inverse_depth * inverse_depth) + (1.0f - in_depth));
}

/// Largest difference between two inverse depths, in 1/m, that noise explains: the variance of a
/// difference is twice that of a sample.
DTSDF_HD float noiseOfStep(const DepthNoise& noise, float nearer, float noise_level) {
  constexpr float kSqrt2 = 1.41421356f;
  return kSqrt2 * noise_level * noiseAt(noise, nearer);
}

/// All that is known of a frame; passed by value to the stages that follow.
struct FrameSensing {
  ImageView image;
  DepthNoise noise;
  const float* free_depth;           ///< freeDepth() per pixel; null where nothing asks for it.
  const float* most_free = nullptr;  ///< The greatest of them in patches (fusion/free_patches.h).
};

/// What the rules that make surfels need to know of the settings.
struct SurfelSettings {
  int32_t normal_radius_px;  ///< Largest half width of a window; 0 where no normals are needed.
  float depth_jump;  ///< Largest share by which neighbouring depths on one surface may differ.
  SurfelRules rules;
  int32_t noise_in_depth;  ///< As in DepthNoise.
};

}  // namespace dtsdf
