/// Constants of the rules that make a mesh from voxels.
#pragma once

namespace dtsdf {

/// docs/results/ablation.md measures the effect of each.
struct MeshRules {
  /// A unit is meshed if the weight at each corner exceeds this share of the greatest weight in the
  /// unit; in [0, 1). As a share, it does not depend on the number of frames. It excludes corners
  /// that only the far fringe of a measurement reached.
  float min_weight_share = 0.003f;

  /// A crossing is meshed if some direction crosses the edge itself, with weights at the two ends
  /// whose geometric mean exceeds this share of the greatest weight in the unit; in [0, 1).
  /// (Without it, vertices of the armadillo with a Kinect's noise at 10 mm are 13 % farther off.)
  float min_crossing_share = 0.015f;

  /// A crossing found only by the vote of several directions counts with this share of the weights
  /// at its ends; in [0, 1]. At borders such crossings are off by half a voxel, but inside a
  /// surface that noise scatters over directions they prevent holes.
  float voted_crossing_share = 0.05f;

  /// Distances smaller than this count as equally near in the vote; in voxels, above 0, so that a
  /// distance of 0 does not outvote all others. The value matters little: half and twice as much
  /// change no figure by more than 1.5 %.
  float nearness_voxels = 0.2f;

  /// Gap between a vertex and what was measured, in voxels, from which on the vertex is pulled to
  /// its nearest anchor; at twice this, the pull has its full strength. (It is about the spacing of
  /// pixels. Less moves vertices inside a surface: 0.1 puts those of a tilted plane .004 instead of
  /// .003 off. 100 images on two thirds of an orbit, vertices with 0.1, 0.15, 0.25 and without:
  /// Asian Dragon at 20 mm 1.75, 1.83, 2.02 and 3.26 mm, bunny 0.46, 0.48, 0.53 and 0.77 mm.)
  float measured_gap = 0.15f;
  /// Distance from its anchor, in voxels, within which a vertex is not pulled.
  float measured_reach = 0.1f;
  /// Largest share of the remaining way that a vertex is pulled; in [0, 1), so that two vertices
  /// with the same anchor do not coincide.
  float measured_pull = 0.875f;
  /// A triangle with a side that anchoring lengthens by more than this, in voxels, spans a gap and
  /// is left out. (The slot of the scene `outlines`, 35 mm wide, at 20 mm: closed by 90 % without,
  /// 79 % with 0.55, 17 % with 0.5, 10 % with 0.35, 8 % with 0.3.)
  float max_stretch = 0.3f;
};

/// The constants, and the other settings that the mesh depends on.
struct MeshSettings : MeshRules {
  /// Whether voxels hold distances to planes: true except for voxel projection, whose distances are
  /// along rays and may grow faster than the distance to the surface.
  bool distances_to_planes = true;
  /// Longest loose piece that is left out, in units, at most kMaxLooseUnits; 0 keeps all.
  int max_loose_units = 0;
};

}  // namespace dtsdf
