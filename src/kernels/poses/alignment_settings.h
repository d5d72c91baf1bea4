/// What the rules of alignment need to know of other rules.
#pragma once

#include "kernels/poses/alignment_rules.h"

namespace dtsdf {

struct AlignmentSettings {
  /// That of fusion: points farther than this count less, by the square.
  float full_weight_depth_m;
  AlignmentRules rules;
};

}  // namespace dtsdf
