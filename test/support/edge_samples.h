/// An edge as the rules of kernels/meshing/edge_vertex.h take it, with samples that a test sets.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/meshing/vote.h"

namespace dtsdf {

struct EdgeSamples {
  Sample lower[kDirectionCount], upper[kDirectionCount];
  Sample below[kDirectionCount], above[kDirectionCount];
};

}  // namespace dtsdf
