/// How much of an image an alignment explains.
#pragma once

#include "dtsdf_mapping/alignment.h"

namespace dtsdf {

/// Share of the image's points that lie on surfaces of the map.
inline double explainedBy(const Alignment& alignment) {
  return alignment.status == AlignmentStatus::kAligned
             ? alignment.matched_share * alignment.inlier_share
             : 0.0;
}

}  // namespace dtsdf
