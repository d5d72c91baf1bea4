/// Settings for camera poses: where they come from, and how they are aligned to the map.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// Where the pose of a depth image comes from.
enum class PoseMode {
  kTf,      ///< The input pose is used as it is.
  kRefine,  ///< The input pose is corrected so that the image fits the map.
  kTrack,   ///< The camera is tracked against the map, from image to image. Only the first image
            ///< may have an input pose.
};

/// How poses are determined.
struct PoseParams {
  PoseMode mode = PoseMode::kTf;  ///< Where poses come from.
  /// Standard deviation in metres of the input positions or, when tracking, of those predicted from
  /// the motion in the last images.
  double sigma_m = 0.05;
  double sigma_rad = 0.035;  ///< Standard deviation of the orientations, in radians.
  /// Drift of input poses, in metres and radians per metre travelled; 0: none. Drift persists from
  /// image to image, whereas the sigmas describe independent errors in each image.
  double drift = 0.05;
  /// Whether images that do not fit the map are dropped; otherwise they are fused at the input
  /// pose, with the current correction applied.
  bool drop_misfits = false;
};

/// Visits each member with its key and the rule for its value.
/// @relates PoseParams
template <class Visitor>
void visitParams(PoseParams& p, Visitor& visit) {
  visit("poses/mode", p.mode,
        EnumNames<PoseMode>{
            {"tf", PoseMode::kTf}, {"refine", PoseMode::kRefine}, {"track", PoseMode::kTrack}});
  visit("poses/sigma_m", p.sigma_m, Range{1e-6, 100.0});
  visit("poses/sigma_rad", p.sigma_rad, Range{1e-6, 3.2});
  visit("poses/drift", p.drift, Range{0.0, 10.0});
  visit("poses/on_misfit", p.drop_misfits, EnumNames<bool>{{"prior", false}, {"drop", true}});
}

}  // namespace dtsdf
