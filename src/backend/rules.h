/// The numbers of all rules: defaults for users, other values for experiments only.
#pragma once

#include "dtsdf_mapping/params/param_set.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct Rules {
  SurfelRules surfels;
  FusionRules fusion;
  MeshRules mesh;
};

template <class Visitor>
void visitRules(MeshRules& r, Visitor& visit) {
  visit("rules/mesh/least_weight_share", r.least_weight_share, Range{0.0, 0.99});
  visit("rules/mesh/nearness_voxels", r.nearness_voxels, Range{0.001, 16.0});
  visit("rules/mesh/vertex_margin", r.vertex_margin, Range{1e-6, 0.49});
}

/// Visits keys such as "rules/mesh/...", in the manner of visitParams().
template <class Visitor>
void visitRules(Rules& rules, Visitor& visit) {
  visitRules(rules.surfels, visit);
  visitRules(rules.fusion, visit);
  visitRules(rules.mesh, visit);
}

}  // namespace dtsdf
