/// Settings in the form that the rules take, shared by both backends.
#pragma once

#include <string>

#include "dtsdf_mapping/kernels/fusion.h"
#include "dtsdf_mapping/mapper/mapper_params.h"

namespace dtsdf {

inline FusionView makeFusionView(const MapperParams& params) {
  return {params.fusion.mode == FusionMode::kNormalRayCasting, params.map.directional,
          params.map.truncation_voxels, params.fusion.max_weight};
}

inline NormalFitSettings makeNormalFitSettings(const FusionParams& params, const FrameView& view) {
  return {params.normal_radius_px, params.depth_jump, view.intrinsics.fx * view.voxel_size_m};
}

inline GroupSettings makeGroupSettings(const FusionParams& params, const FrameView& view) {
  return makeGroupSettings(params.depth_jump, view.intrinsics.fx, view.voxel_size_m);
}

inline std::string noMeasurementMessage(const MapperParams& params) {
  return "no pixel has a usable depth: all are empty, isolated, or outside [" +
         std::to_string(params.fusion.min_depth_m) + ", " +
         std::to_string(params.fusion.max_depth_m) + "] m";
}

}  // namespace dtsdf
