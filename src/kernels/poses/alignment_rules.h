/// Constants of the rules that align an image to the map. Chosen by judgement unless stated:
/// results on real recordings hardly change with any of them (docs/results/poses.md).
#pragma once

#include <cstdint>

namespace dtsdf {

struct AlignmentRules {
  /// Minimum number of points per image; with more, the map's own error dominates.
  int32_t points = 4800;
  /// Half width of the window that a point's plane is fitted in, in pixels.
  int32_t window_px = 3;
  /// Distance from a point, along its normal, within which its surface is searched for at first, in
  /// voxels. (A corner 2 m away, voxels of 20 mm, poses off by 10 cm and 8 degrees at once: 78 of
  /// 96 are found within 8, 89 within 10, all within 12.)
  float reach = 12.0f;
  /// Residual from which on a point does not count in the last iterations, in voxels.
  float cutoff = 1.0f;
  /// This many points carry as much information as one with an independent error, as points of a
  /// surface share the errors of the map there and of the sensor.
  float points_per_witness = 100.0f;
  /// If a smaller share of points meets a surface, too little of the map is there to align to.
  float min_matched = 0.15f;
  /// If the share of inliers among these is smaller, the image does not fit.
  float min_inliers = 0.5f;
  /// If the share of inliers is smaller, the image may have slipped: plain surfaces still fit while
  /// a camera slides along them. (A phone that turned fast: 0.74 to 0.84 while it slipped by 5
  /// degrees, 0.90 to 1 otherwise; a Kinect: never below 0.95.)
  float held_inliers = 0.85f;
  /// A pose whose surfaces are off the map by less than this, in voxels along their normals (root
  /// mean square), is as good as the map can determine. The map's own error was up to 0.17 with
  /// exact poses, and 0.4 to 0.6 in the median with those of real recordings.
  float min_misplacement = 0.2f;
};

/// The settings of other stages that the rules of alignment need.
struct AlignmentSettings {
  /// FusionRules::full_weight_depth_m: the weight of farther points falls as z^-2.
  float full_weight_depth_m;
  /// Pixels whose depths differ by a larger share are on different surfaces.
  float depth_jump;
  AlignmentRules rules;
};

}  // namespace dtsdf
