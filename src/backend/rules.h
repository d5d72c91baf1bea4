/// The numbers of all rules: defaults for users, other values for experiments only.
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

template <class Visitor>
void visitRules(MeshRules& rules, Visitor& visit) {
  const std::string section = "rules/mesh/";
  visit(section + "least_weight_share", rules.least_weight_share, Range{0.0, 0.99});
  visit(section + "least_crossing_share", rules.least_crossing_share, Range{0.0, 0.99});
  visit(section + "voted_crossing_share", rules.voted_crossing_share, Range{0.0, 1.0});
  visit(section + "nearness_voxels", rules.nearness_voxels, Range{0.001, 16.0});
  visit(section + "measured_gap", rules.measured_gap, Range{0.001, 100.0});
  visit(section + "measured_reach", rules.measured_reach, Range{0.0, 100.0});
  visit(section + "measured_pull", rules.measured_pull, Range{0.0, 0.999});
  visit(section + "most_stretch", rules.most_stretch, Range{0.0, 100.0});
}

template <class Visitor>
void visitRules(SurfelRules& rules, Visitor& visit) {
  const std::string section = "rules/surfels/";
  visit(section + "noise_level", rules.noise_level, Range{0.0, 100.0});
  visit(section + "same_voxels", rules.same_voxels, Range{0.0, 100.0});
  visit(section + "linked_turn", rules.linked_turn, Range{0.0, 10.0});
  visit(section + "linked_rim_share", rules.linked_rim_share, Range{0.0, 1.0});
  visit(section + "largest_shared_noise", rules.largest_shared_noise, Range{1.0, 100.0});
  visit(section + "window_voxels", rules.window_voxels, Range{0.0, 100.0});
  visit(section + "largest_noise_turn", rules.largest_noise_turn, Range{0.001, 10.0});
  visit(section + "strip_weight", rules.strip_weight, Range{0.0, 1.0});
  visit(section + "merged_width", rules.merged_width, Range{0.0, 100.0});
  visit(section + "merged_turn", rules.merged_turn, Range{0.0, 100.0});
}

template <class Visitor>
void visitRules(FusionRules& rules, Visitor& visit) {
  const std::string section = "rules/fusion/";
  visit(section + "sample_reach", rules.sample_reach, Range{0.5, 100.0});
  visit(section + "noise_reach", rules.noise_reach, Range{0.0, 100.0});
  visit(section + "full_weight_depth_m", rules.full_weight_depth_m, Range{0.01, 1000.0});
  visit(section + "support_share", rules.support_share, Range{0.0, 1.0});
  visit(section + "support_gain", rules.support_gain, Range{1, 100});
  visit(section + "contradiction_cost", rules.contradiction_cost, Range{0, 100});
  visit(section + "free_margin", rules.free_margin, Range{0.0, 100.0});
  visit(section + "look_turns", rules.look_turns, Range{1, 1000});
}

template <class Visitor>
void visitRules(ColourRules& rules, Visitor& visit) {
  const std::string section = "rules/colour/";
  visit(section + "surface_distance", rules.surface_distance, Range{0.0, 16.0});
  visit(section + "hidden_depth", rules.hidden_depth, Range{0.0, 100.0});
  visit(section + "sample_width", rules.sample_width, Range{0.0, 16.0});
  visit(section + "most_views", rules.most_views, Range{1, 15});
  visit(section + "least_overlap", rules.least_overlap, Range{1, 1e9});
}

template <class Visitor>
void visitRules(AlignmentRules& rules, Visitor& visit) {
  const std::string section = "rules/poses/";
  visit(section + "points", rules.points, Range{100, 1e6});
  visit(section + "window_px", rules.window_px, Range{1, 20});
  visit(section + "reach", rules.reach, Range{0.0, 16.0});
  visit(section + "cutoff", rules.cutoff, Range{0.01, 16.0});
  visit(section + "points_per_witness", rules.points_per_witness, Range{1.0, 1e6});
  visit(section + "least_matched", rules.least_matched, Range{0.0, 1.0});
  visit(section + "least_inliers", rules.least_inliers, Range{0.0, 1.0});
  visit(section + "held_inliers", rules.held_inliers, Range{0.0, 1.0});
  visit(section + "least_misplacement", rules.least_misplacement, Range{0.0, 16.0});
}

/// Visits keys such as "rules/mesh/...", in the manner of visitParams().
template <class Visitor>
void visitRules(Rules& rules, Visitor& visit) {
  visitRules(rules.surfels, visit);
  visitRules(rules.fusion, visit);
  visitRules(rules.colour, visit);
  visitRules(rules.mesh, visit);
  visitRules(rules.poses, visit);
}

}  // namespace dtsdf
