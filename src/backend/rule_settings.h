/// Converts settings to the types used in src/kernels; shared by both backends.
#pragma once

#include "backend/rules.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/colour/colour_rules.h"
#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/poses/alignment_rules.h"
#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// Whether surfels are cast into the grid. True for all fusion modes except voxel projection.
inline bool castsSurfels(const MapperParams& params) {
  return params.fusion.mode != FusionMode::kVoxelProjection;
}

/// Whether there is a clearing stage; voxel projection needs none.
inline bool clearsFreeSpace(const MapperParams& params) {
  return params.fusion.clearing && castsSurfels(params);
}

/// Whether the free depth of each pixel is needed.
inline bool needsFreeDepth(const MapperParams& params) {
  return clearsFreeSpace(params) || params.space.enabled;
}

/// Whether pixels without a normal are ignored. Voxel projection into an undirected map needs no
/// normals.
inline bool needsNormals(const MapperParams& params) {
  return params.map.directional || castsSurfels(params);
}

inline SurfelSettings makeSurfelSettings(const MapperParams& params, const SurfelRules& rules) {
  return {needsNormals(params) ? params.fusion.normal_radius_px : 0, params.fusion.depth_jump,
          rules, params.sensor == Sensor::kTimeOfFlight ? 1 : 0};
}

/// The rule parameters, with the maximum evidence that follows from fusion/memory_frames.
inline Rules withMemory(Rules rules, const MapperParams& params) {
  constexpr int kFrames = 8;  // the default, which suits poses that drift
  const int frames = params.fusion.memory_frames > 0 ? params.fusion.memory_frames : kFrames;
  const int most = frames * rules.fusion.support_gain;
  rules.fusion.max_evidence = most < kMaxEvidence ? most : kMaxEvidence;
  return rules;
}

inline FusionSettings makeFusionSettings(const MapperParams& params, const Rules& rules) {
  return {params.fusion.mode == FusionMode::kNormalRayCasting, params.map.directional,
          params.map.truncation_voxels, params.fusion.max_weight, rules.fusion,
          rules.surfels.noise_level,
          // Voxel projection uses depth differences, which exceed distances at grazing angles.
          castsSurfels(params) ? rules.fusion.sample_reach : params.map.truncation_voxels};
}

inline MeshSettings makeMeshSettings(const MapperParams& params, const Rules& rules) {
  return {rules.mesh, castsSurfels(params)};
}

inline AlignmentSettings makeAlignmentSettings(const MapperParams& params, const Rules& rules) {
  return {rules.fusion.full_weight_depth_m, params.fusion.depth_jump, rules.poses};
}

inline PaintSettings makePaintSettings(const MapperParams& params, const Rules& rules) {
  constexpr float kAnyDepth_m = 1e30f;
  const float max_depth_m = params.max_paint_depth_m;
  return {params.map.directional, !params.adapt_exposure,
          max_depth_m > 0.0f ? max_depth_m : kAnyDepth_m, rules.fusion.full_weight_depth_m,
          rules.colour};
}

}  // namespace dtsdf
