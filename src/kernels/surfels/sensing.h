/// What is known of one depth image before its surfels are made: the views that the rules work on.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

/// A depth image and its row fits, row by row without gaps.
struct ImageView {
  FrameView frame;
  const float* inverse_depth;  ///< In 1/m, 0 where nothing is measured.
  const float* row_value;      ///< Inverse depth by the row fits, 0 where there is none.
  const float* row_slope;
};

/// All that is known of a frame; passed by value to the stages that follow.
struct FrameSensing {
  ImageView image;
  float sigma;              ///< Noise: standard deviation of inverse depth, in 1/m.
  const float* free_depth;  ///< freeDepth() per pixel; null where voxels are projected.
};

/// What the rules that make surfels need to know of the settings.
struct SurfelSettings {
  int32_t normal_radius_px;  ///< Largest half width of a window; 0 where no normals are needed.
  float depth_jump;  ///< Largest share by which neighbouring depths on one surface may differ.
  SurfelRules rules;
};

}  // namespace dtsdf
