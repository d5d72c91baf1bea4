/// Regions in the form that the rules take.
#pragma once

#include "dtsdf_mapping/region.h"
#include "kernels/core/region.h"

namespace dtsdf {

/// `unit_m`: what the rules count in; a voxel's edge, or 1 for metres.
/// @pre findProblem() found nothing.
RegionView makeRegionView(const Region& region, double unit_m);

}  // namespace dtsdf
