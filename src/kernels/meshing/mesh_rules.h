/// The numbers of the rules that make a mesh of voxels.
#pragma once

namespace dtsdf {

struct MeshRules {};

template <class Visitor>
void visitRules(MeshRules&, Visitor&) {}

}  // namespace dtsdf
