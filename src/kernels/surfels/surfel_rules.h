/// The numbers of the rules that turn an image into surfels.
#pragma once

namespace dtsdf {

struct SurfelRules {};

template <class Visitor>
void visitRules(SurfelRules&, Visitor&) {}

}  // namespace dtsdf
