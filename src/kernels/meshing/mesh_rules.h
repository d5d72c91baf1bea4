/// The numbers of the rules that make a mesh of voxels.
#pragma once

namespace dtsdf {

/// The measurements are of docs/results/ablation.md: vertex / surface / completeness RMSE in mm on
/// the armadillo's orbit at voxels of 10 mm.
struct MeshRules {
  /// A unit is meshed if each corner has more than this share of the greatest weight in the unit;
  /// in [0, 1). A share, so that the number of frames does not matter. It keeps out corners that
  /// only the far fringe of a measurement reached. (docs/results/ablation_settings.md: vertices of
  /// the dragon at 10 mm 0.46 mm without, 0.44 with.)
  float least_weight_share = 0.003f;

  /// A crossing of an edge is meshed if a direction crosses it on its own whose weights at the two
  /// ends have a geometric mean of more than this share of the greatest weight in the unit; in
  /// [0, 1). Without this rule and the next one vertices are at 0.42 instead of 0.38 mm, and on the
  /// Asian Dragon at 20 mm at 3.6 instead of 2.7 (orbits of 100 images).
  float least_crossing_share = 0.015f;

  /// A crossing that only the vote of several directions tells counts for this share of the weights
  /// at its ends; in [0, 1]. At borders it is off by half a voxel, but inside a surface that noise
  /// scatters over directions it closes what would be a hole.
  float voted_crossing_share = 0.05f;

  /// Distances smaller than this count as equally near in the vote; in voxels, above 0, so that no
  /// distance of 0 outvotes all others. A vote by plain weight, without nearness, puts vertices at
  /// 0.66 instead of 0.57 mm and opens a fifth more boundary edges. The value matters little:
  /// on an orbit of 40 images at voxels of 10 mm, 0.1, 0.2 and 0.4 put vertices at 1.00, 1.01 and
  /// 1.02 mm.
  float nearness_voxels = 0.2f;

  /// A vertex is drawn to the nearest anchor where a corner's foot is farther than this from where
  /// its surface was measured, in voxels; as far as it ever is from twice that on. Pixels are so
  /// far apart: less would move vertices inside a surface. (Orbits of 100 images at 20 mm, vertices
  /// with 0.1, 0.15, 0.25 and without: Asian Dragon 1.96, 2.06, 2.28 and 2.91 mm, bunny 0.45, 0.47,
  /// 0.50 and 0.73 mm.)
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

  /// Vertices keep off the corners by this share of an edge, in (0, 0.5), so that no triangle is
  /// degenerate: triangles that meet at a corner keep sides of 2^-10 voxels, which single precision
  /// still resolves to one in 2000 at the far end of a block (8 voxels, spaced by 2^-21). The
  /// surface moves by a thousandth of a voxel at most.
  float vertex_margin = 1.0f / 1024.0f;
};

}  // namespace dtsdf
