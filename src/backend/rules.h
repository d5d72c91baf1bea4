/// The numbers of all rules: defaults for users, other values for experiments only.
#pragma once

#include "kernels/fusion/fusion_rules.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct Rules {
  SurfelRules surfels;
  FusionRules fusion;
  MeshRules mesh;
};

/// Visits keys such as "rules/mesh/...", in the manner of visitParams().
template <class Visitor>
void visitRules(Rules& rules, Visitor& visit) {
  visitRules(rules.surfels, visit);
  visitRules(rules.fusion, visit);
  visitRules(rules.mesh, visit);
}

}  // namespace dtsdf
