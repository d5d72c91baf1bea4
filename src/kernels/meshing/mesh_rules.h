/// The numbers of the rules that make a mesh of voxels.
#pragma once

namespace dtsdf {

/// What each number brings is in docs/results/ablation.md.
struct MeshRules {
  /// A unit is meshed if each corner has more than this share of the greatest weight in the unit;
  /// in [0, 1). A share, so that the number of frames does not matter. It keeps out corners that
  /// only the far fringe of a measurement reached.
  float least_weight_share = 0.003f;

  /// A crossing of an edge is meshed if a direction crosses it on its own whose weights at the two
  /// ends have a geometric mean of more than this share of the greatest weight in the unit; in
  /// [0, 1). (Without: vertices of the armadillo with a Kinect's noise at 10 mm 13 % farther off.)
  float least_crossing_share = 0.015f;

  /// A crossing that only the vote of several directions tells counts for this share of the weights
  /// at its ends; in [0, 1]. At borders it is off by half a voxel, but inside a surface that noise
  /// scatters over directions it closes what would be a hole.
  float voted_crossing_share = 0.05f;

  /// Distances smaller than this count as equally near in the vote; in voxels, above 0, so that no
  /// distance of 0 outvotes all others. The value matters little: half and twice as much move no
  /// figure by more than 1.5 %.
  float nearness_voxels = 0.2f;

  /// A vertex is drawn to the nearest anchor where a corner's foot is farther than this from where
  /// its surface was measured, or the vertex from its plane, in voxels; as far as it ever is from
  /// twice that on. Pixels are so far apart: less moves vertices inside a surface (0.1 puts those
  /// of a tilted plane .004 instead of .003 off). (100 images on two thirds of an orbit, vertices
  /// with 0.1, 0.15, 0.25 and without: Asian Dragon at 20 mm 1.75, 1.83, 2.02 and 3.26 mm, bunny
  /// 0.46, 0.48, 0.53 and 0.77 mm.)
  float measured_gap = 0.15f;
  /// So near it may be to the anchor anyway, in voxels.
  float measured_reach = 0.1f;
  /// The share of the way until there that it is drawn at most; in [0, 1), so that no two vertices
  /// of one anchor come to one place.
  float measured_pull = 0.875f;
  /// A triangle with a side that this makes longer by more, in voxels, stands in a gap, and is left
  /// out. (The slot of the scene `outlines`, 35 mm wide, at 20 mm: closed by 90 % without, 79 %
  /// with 0.55, 17 % with 0.5, 10 % with 0.35, 8 % with 0.3.)
  float most_stretch = 0.3f;
};

/// The numbers, and what of the other settings the mesh depends on.
struct MeshSettings : MeshRules {
  /// Whether distances are those to planes, as in all modes but voxel projection, whose distances
  /// run along rays and may grow faster than the way to them.
  bool distances_to_planes = true;
  /// Loose pieces of up to so many units are left out, at most kMostLooseUnits; 0: none.
  int most_loose_units = 0;
};

}  // namespace dtsdf
