/// Settings in the form that the rules take, shared by both backends.
#pragma once

#include <string>

#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/fusion/free_space.h"
#include "kernels/fusion/fusion.h"

namespace dtsdf {

inline FusionView makeFusionView(const MapperParams& params) {
  return {params.fusion.mode == FusionMode::kNormalRayCasting, params.map.directional,
          params.map.truncation_voxels, params.fusion.max_weight, 0.0f};
}

/// Projecting voxels into an undirected map takes no normals: pixels without one count there too.
inline bool needsNormals(const MapperParams& params) {
  return params.map.directional || params.fusion.mode != FusionMode::kVoxelProjection;
}

/// `noise`: standard deviation of the frame's inverse depth, in 1/m.
inline NormalFitSettings makeNormalFitSettings(const MapperParams& params, const FrameView& view,
                                               float noise) {
  return {needsNormals(params) ? params.fusion.normal_radius_px : 0, params.fusion.depth_jump,
          view.intrinsics.fx * view.voxel_size_m, view.intrinsics.fx, noise};
}

inline FreeSpaceSettings makeFreeSpaceSettings(const MapperParams& params, float noise) {
  return {params.fusion.depth_jump, params.map.truncation_voxels, noise};
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
