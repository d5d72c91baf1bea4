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

/// Projecting voxels into an undirected map takes no normals: pixels without one count there too.
inline bool needsNormals(const MapperParams& params) {
  return params.map.directional || params.fusion.mode != FusionMode::kVoxelProjection;
}

inline NormalFitSettings makeNormalFitSettings(const MapperParams& params, const FrameView& view) {
  return {needsNormals(params) ? params.fusion.normal_radius_px : 0, params.fusion.depth_jump,
          view.intrinsics.fx * view.voxel_size_m};
}

inline GroupSettings makeGroupSettings(const MapperParams& params, const FrameView& view) {
  return makeGroupSettings(params.fusion.depth_jump, view.intrinsics.fx, view.voxel_size_m);
}

inline std::string noMeasurementMessage(const MapperParams& params) {
  return "no pixel has a usable depth: all are empty, isolated, or outside [" +
         std::to_string(params.fusion.min_depth_m) + ", " +
         std::to_string(params.fusion.max_depth_m) + "] m";
}

}  // namespace dtsdf
