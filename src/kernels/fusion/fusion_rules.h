/// The numbers of the rules that fuse surfels into voxels.
#pragma once

namespace dtsdf {

struct FusionRules {};

template <class Visitor>
void visitRules(FusionRules&, Visitor&) {}

}  // namespace dtsdf
