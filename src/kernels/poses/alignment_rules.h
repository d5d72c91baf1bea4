/// Parameters of the rules that align an image to the map. Values were chosen by judgement unless
/// stated otherwise.
#pragma once

#include <cstdint>

namespace dtsdf {

struct AlignmentRules {
  /// Minimum number of points taken from an image, if it has that many pixels. With more points,
  /// the map's own error dominates.
  int32_t points = 4800;
  /// Half width of the window in which a point's plane is fitted, in pixels.
  int32_t window_px = 3;
  /// Initial distance, in voxels, within which a point's surface is searched for along the point's
  /// normal. (In front of a corner 2 m away, at 20 mm, with poses off by 10 cm and 8 degrees at
  /// once, 78 out of 96 poses are found with 8, 89 with 10, and all with 12.)
  float reach = 12.0f;
  /// Residual, in voxels, at or above which a point is ignored in the last iterations.
  float cutoff = 1.0f;
  /// Number of points that together count as one independent measurement, since nearby points on a
  /// surface share the errors of the map and the sensor.
  float points_per_witness = 100.0f;
  /// Minimum fraction of points for which a surface is found; below it, alignment fails.
  float min_matched = 0.15f;
  /// Minimum fraction of inliers among the points for which a surface is found; below it, alignment
  /// fails.
  float min_inliers = 0.5f;
  /// Minimum fraction of inliers. Below it, the pose is assumed to have slipped: along featureless
  /// surfaces, a pose can slide while most points still fit. (For a phone that turned fast, the
  /// fraction was 0.74 to 0.84 while the pose slipped by 5 degrees, and 0.90 to 1 otherwise; for a
  /// Kinect it was never below 0.95.)
  float held_inliers = 0.85f;
  /// Root mean square distance of an image from the map, in voxels along the image's normals, up to
  /// which the distance is attributed to the map's own error. That error was up to 0.17 with exact
  /// poses; its median was 0.4 to 0.6 with the poses of real recordings.
  float min_misplacement = 0.2f;
};

/// Settings for alignment, some of which are shared with other stages.
struct AlignmentSettings {
  /// FusionRules::full_weight_depth_m: the weight of farther points falls as z^-2.
  float full_weight_depth_m;
  /// Relative depth difference above which pixels belong to different surfaces.
  float depth_jump;
  AlignmentRules rules;
};

}  // namespace dtsdf
