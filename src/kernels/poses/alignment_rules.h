/// The numbers of the rules that align an image to the map. By judgement where nothing is said:
/// results on real recordings hardly change with any of them (docs/results/poses.md).
#pragma once

#include <cstdint>

namespace dtsdf {

struct AlignmentRules {
  /// Points of an image, at least: with more the error is that of the map.
  int32_t points = 4800;
  /// Half width of the window that a point's plane is fitted in, in pixels.
  int32_t window_px = 3;
  /// How far from a point, along its normal, its surface is looked for at first, in voxels. (A
  /// corner 2 m away, voxels of 20 mm, poses off by 10 cm and 8 degrees at once: 78 of 96 are found
  /// within 8, 89 within 10, all within 12.)
  float reach = 12.0f;
  /// Residuals from which on a point counts nothing at last, in voxels.
  float cutoff = 1.0f;
  /// So many points say as much as one would whose error is independent: those of a surface share
  /// the error of the map there, and of the sensor.
  float points_per_witness = 100.0f;
  /// Below this share of points that meet a surface there is too little of the map to align to.
  float least_matched = 0.15f;
  /// Below this share of inliers among them, the image does not fit.
  float least_inliers = 0.5f;
  /// Below this share it may have slipped, though it fits: plain surfaces still fit while a camera
  /// slides along them. (A phone that turned fast: 0.74 to 0.84 while it slipped by 5 degrees, 0.90
  /// to 1 otherwise; a Kinect: never below 0.95.)
  float held_inliers = 0.85f;
  /// A pose that puts the surfaces off the map by less than this, in voxels along their normals,
  /// root mean square, is as good as the map can say: with exact poses the map's own error has been
  /// seen to ask for up to 0.17, with those of real recordings for 0.4 to 0.6 in the median.
  float least_misplacement = 0.2f;
};

/// What the rules of alignment need to know of other rules.
struct AlignmentSettings {
  /// Fusion's setting: points farther than this count less, by the square.
  float full_weight_depth_m;
  /// Pixels whose depths differ by a larger share are not of one surface.
  float depth_jump;
  AlignmentRules rules;
};

}  // namespace dtsdf
