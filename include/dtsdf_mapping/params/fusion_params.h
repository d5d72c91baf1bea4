/// Settings for fusion: which voxels a pixel updates, and with what weight.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// The fusion modes of the Directional TSDF paper (Sec. IV), each for directional and undirected
/// maps.
enum class FusionMode {
  kVoxelProjection,   ///< Each voxel takes the projective distance to the pixel it projects to.
  kRayCasting,        ///< Voxels along the view ray are updated with point-to-plane distances.
  kNormalRayCasting,  ///< Like kRayCasting, but along the normal, turned towards the ray if depth
                      ///< is noisy.
};

/// Maximum of FusionParams::normal_radius_px.
constexpr int kMaxNormalRadius_px = 16;

/// Settings for fusing a frame.
struct FusionParams {
  FusionMode mode = FusionMode::kNormalRayCasting;  ///< Fusion mode.
  float min_depth_m = 0.1f;                         ///< Nearer measurements are ignored.
  float max_depth_m = 10.0f;  ///< Farther measurements only clear surfaces in front of them.
  int normal_radius_px = 5;   ///< Maximum half width of the window in which a normal is fitted.
  float depth_jump = 0.03f;   ///< Relative difference in depth above which neighbouring pixels
                              ///< belong to different surfaces.
  float max_weight = 64.0f;   ///< Maximum weight of a voxel. Each frame adds at most 1.
  bool clearing = true;  ///< Whether surfaces that images look through are removed; no effect with
                         ///< kVoxelProjection.
  /// Maximum number of images that count for or against a surface in a voxel. 0 selects 8, or 19 if
  /// the node or a program aligns poses, since aligned images remain consistent for longer.
  int memory_frames = 0;
};

/// Visits each member with its key and the rule for its value.
/// @relates FusionParams
template <class Visitor>
void visitParams(FusionParams& p, Visitor& visit) {
  visit("fusion/mode", p.mode,
        EnumNames<FusionMode>{{"voxel_projection", FusionMode::kVoxelProjection},
                              {"ray_casting", FusionMode::kRayCasting},
                              {"normal_ray_casting", FusionMode::kNormalRayCasting}});
  visit("fusion/min_depth_m", p.min_depth_m, Range{0.01, 100.0});
  visit("fusion/max_depth_m", p.max_depth_m, Range{0.01, 100.0});
  visit("fusion/normal_radius_px", p.normal_radius_px, Range{1, kMaxNormalRadius_px});
  visit("fusion/depth_jump", p.depth_jump, Range{0.001, 1.0});
  visit("fusion/max_weight", p.max_weight, Range{1.0, 255.0});
  visit("fusion/clearing", p.clearing);
  visit("fusion/memory_frames", p.memory_frames, Range{0, 42});
}

}  // namespace dtsdf
