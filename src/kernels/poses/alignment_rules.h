/// Constants of the rules that align an image to the map, chosen by judgement unless stated
/// otherwise.
#pragma once

#include <cstdint>

namespace dtsdf {

struct AlignmentRules {
  /// Minimum number of pixels in the grid of points, if the image has that many; with more, the
  /// map's own error dominates.
  int32_t points = 4800;
  /// Half width of the window in which a point's plane is fitted, in pixels.
  int32_t window_px = 3;
  /// Distance from a point, along its normal, within which its surface is searched for at first, in
  /// voxels. (In front of a corner 2 m away, at 20 mm, with poses off by 10 cm and 8 degrees at
  /// once, a reach of 8 finds 78 out of 96 poses, 10 finds 89, and 12 finds all.)
  float reach = 12.0f;
  /// Residual, in voxels, at or above which a point is ignored in the last iterations.
  float cutoff = 1.0f;
  /// Number of points that together count as one with an independent error, since points on a
  /// surface share the errors of the map and of the sensor there.
  float points_per_witness = 100.0f;
  /// Minimum share of points that meet a surface; below it, alignment fails.
  float min_matched = 0.15f;
  /// Minimum share of inliers among the points that meet a surface; below it, alignment fails.
  float min_inliers = 0.5f;
  /// Minimum share of inliers; below it, the pose is assumed to have slipped: along featureless
  /// surfaces it can slide while most points still fit. (A phone that turned fast had 0.74 to 0.84
  /// while its pose slipped by 5 degrees, and 0.90 to 1 otherwise; a Kinect never had less than
  /// 0.95.)
  float held_inliers = 0.85f;
  /// Largest root mean square distance of an image from the map, in voxels along its normals, that
  /// is within the map's own error. That error was up to 0.17 with exact poses; its median was 0.4
  /// to 0.6 with the poses of real recordings.
  float min_misplacement = 0.2f;
};

/// Settings of the alignment rules, some of them from other stages.
struct AlignmentSettings {
  /// FusionRules::full_weight_depth_m: the weight of farther points falls as z^-2.
  float full_weight_depth_m;
  /// Pixels whose depths differ by a larger share are on different surfaces.
  float depth_jump;
  AlignmentRules rules;
};

}  // namespace dtsdf
