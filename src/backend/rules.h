/// The parameters of the rules in src/kernels. Other values than the defaults are for experiments.
#pragma once

#include "dtsdf_mapping/params/param_set.h"
#include "kernels/colour/colour_rules.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/poses/alignment_rules.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct Rules {
  SurfelRules surfels;
  FusionRules fusion;
  ColourRules colour;
  MeshRules mesh;
  AlignmentRules poses;
};

/// Visits the rule parameters with keys such as "rules/mesh/...", like visitParams().
template <class Visitor>
void visitRules(Rules& rules, Visitor& visit) {
  std::string section = "rules/surfels/";
  visit(section + "noise_level", rules.surfels.noise_level, Range{0.0, 100.0});
  visit(section + "linked_turn", rules.surfels.linked_turn, Range{0.0, 10.0});
  visit(section + "linked_rim_share", rules.surfels.linked_rim_share, Range{0.0, 1.0});
  visit(section + "largest_shared_noise", rules.surfels.largest_shared_noise, Range{1.0, 100.0});
  visit(section + "window_voxels", rules.surfels.window_voxels, Range{0.0, 100.0});
  visit(section + "largest_noise_turn", rules.surfels.largest_noise_turn, Range{0.001, 10.0});
  visit(section + "strip_weight", rules.surfels.strip_weight, Range{0.0, 1.0});
  visit(section + "merged_width", rules.surfels.merged_width, Range{0.0, 100.0});
  visit(section + "merged_turn", rules.surfels.merged_turn, Range{0.0, 100.0});
  section = "rules/fusion/";
  visit(section + "sample_reach", rules.fusion.sample_reach, Range{0.5, 100.0});
  visit(section + "noise_reach", rules.fusion.noise_reach, Range{0.0, 100.0});
  visit(section + "full_weight_depth_m", rules.fusion.full_weight_depth_m, Range{0.01, 1000.0});
  visit(section + "support_share", rules.fusion.support_share, Range{0.0, 1.0});
  visit(section + "support_gain", rules.fusion.support_gain, Range{1, 100});
  visit(section + "contradiction_cost", rules.fusion.contradiction_cost, Range{0, 100});
  visit(section + "free_margin", rules.fusion.free_margin, Range{0.0, 100.0});
  visit(section + "look_turns", rules.fusion.look_turns, Range{1, 1000});
  section = "rules/colour/";
  visit(section + "surface_distance", rules.colour.surface_distance, Range{0.0, 16.0});
  visit(section + "hidden_depth", rules.colour.hidden_depth, Range{0.0, 100.0});
  visit(section + "sample_width", rules.colour.sample_width, Range{0.0, 16.0});
  visit(section + "max_views", rules.colour.max_views, Range{1, 15});
  visit(section + "min_overlap", rules.colour.min_overlap, Range{1, 1e9});
  section = "rules/mesh/";
  visit(section + "min_weight_share", rules.mesh.min_weight_share, Range{0.0, 0.99});
  visit(section + "min_crossing_share", rules.mesh.min_crossing_share, Range{0.0, 0.99});
  visit(section + "voted_crossing_share", rules.mesh.voted_crossing_share, Range{0.0, 1.0});
  visit(section + "nearness_voxels", rules.mesh.nearness_voxels, Range{0.001, 16.0});
  visit(section + "measured_gap", rules.mesh.measured_gap, Range{0.001, 100.0});
  visit(section + "measured_reach", rules.mesh.measured_reach, Range{0.0, 100.0});
  visit(section + "measured_pull", rules.mesh.measured_pull, Range{0.0, 0.999});
  visit(section + "max_stretch", rules.mesh.max_stretch, Range{0.0, 100.0});
  section = "rules/poses/";
  visit(section + "points", rules.poses.points, Range{100, 1e6});
  visit(section + "window_px", rules.poses.window_px, Range{1, 20});
  visit(section + "reach", rules.poses.reach, Range{0.0, 16.0});
  visit(section + "cutoff", rules.poses.cutoff, Range{0.01, 16.0});
  visit(section + "points_per_witness", rules.poses.points_per_witness, Range{1.0, 1e6});
  visit(section + "min_matched", rules.poses.min_matched, Range{0.0, 1.0});
  visit(section + "min_inliers", rules.poses.min_inliers, Range{0.0, 1.0});
  visit(section + "held_inliers", rules.poses.held_inliers, Range{0.0, 1.0});
  visit(section + "min_misplacement", rules.poses.min_misplacement, Range{0.0, 16.0});
}

}  // namespace dtsdf
