/// Parameters of the rules that extract a mesh from voxels.
#pragma once

namespace dtsdf {

/// docs/method.md explains the rules in the sections Index and Make, docs/glossary.md the terms.
struct MeshRules {
  /// A sheet is meshed only if, at each corner of the unit, the weights of the directions that vote
  /// on it add up to more than this fraction of the greatest single weight in the unit; in [0, 1).
  /// The search for leaders uses only samples above the same limit, which excludes corners that are
  /// merely in the far fringe of a measurement. In undirected maps, any positive weight suffices.
  float min_weight_share = 0.003f;

  /// A crossing is strong if, in some direction that crosses zero on the edge itself, the geometric
  /// mean of the weights at the two ends exceeds this fraction of the greatest weight in the unit;
  /// in [0, 1). A sheet is dropped if one of its crossings is strong neither by this criterion nor
  /// by voted_crossing_share. (Without this rule, vertices of the armadillo with a Kinect's noise
  /// at 10 mm are 13 % less accurate.)
  float min_crossing_share = 0.015f;

  /// For a second criterion, the weights at each end are summed over all directions used there. A
  /// crossing is also strong if the geometric mean of the two sums, times this factor, exceeds the
  /// limit of min_crossing_share; in [0, 1]. At borders, these crossings are off by half a voxel,
  /// but where noise scatters a surface over several directions, they prevent holes.
  float voted_crossing_share = 0.05f;

  /// Added to each distance in the vote's denominator; in voxels, above 0, so that a distance of 0
  /// does not outvote all other distances.
  float nearness_voxels = 0.2f;

  /// A vertex whose measuredGap(), in voxels, is larger than this is pulled towards its nearest
  /// anchor, with full strength at twice this gap or more. The default is about the spacing of
  /// pixels. With a smaller value, vertices inside a surface move too.
  float measured_gap = 0.15f;
  /// A vertex within this distance of its nearest anchor, in voxels, is not pulled, and no vertex
  /// is pulled nearer to its anchor than this.
  float measured_reach = 0.1f;
  /// Maximum fraction of a vertex's distance beyond measured_reach by which the vertex is pulled;
  /// in [0, 1), so that two vertices with the same anchor do not coincide.
  float measured_pull = 0.875f;
  /// A triangle with a side that anchoring lengthens by more than this, in voxels, spans a gap and
  /// is left out. (In the scene `outlines` at 20 mm, 90 % of a slot 35 mm wide is closed without
  /// this rule, 17 % with 0.5 and 8 % with 0.3.)
  float max_stretch = 0.3f;
};

/// The parameters, and a setting that the meshing rules also use.
struct MeshSettings : MeshRules {
  /// Whether voxels hold point-to-plane distances. False for voxel projection, whose distances are
  /// depth differences along the optical axis and may grow faster than the distance to the surface.
  bool distances_to_planes = true;
};

}  // namespace dtsdf
