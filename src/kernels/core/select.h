/// Functions that replace branches. Rules written with them work on single values (defined here)
/// and on vectors with one voxel or mesh unit in each lane (src/cpu/lanes.h).
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/core/vec.h"

namespace dtsdf {

DTSDF_HD float select(bool condition, float yes, float no) { return condition ? yes : no; }
DTSDF_HD int32_t select(bool condition, int32_t yes, int32_t no) { return condition ? yes : no; }
DTSDF_HD bool select(bool condition, bool yes, bool no) { return condition ? yes : no; }
DTSDF_HD bool any(bool condition) { return condition; }
/// Whether to enter a branch that has no effect in lanes where the condition is false. False only
/// if the condition holds in no lane.
DTSDF_HD bool shouldBranch(bool condition) { return condition; }
DTSDF_HD float magnitude(float a) { return fabsf(a); }
DTSDF_HD float squareRoot(float a) { return sqrtf(a); }

/// The value in lane k.
DTSDF_HD float lane(float value, int) { return value; }
DTSDF_HD int32_t lane(int32_t value, int) { return value; }

}  // namespace dtsdf
