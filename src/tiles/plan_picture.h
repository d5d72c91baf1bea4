/// A plan to look at: a table, and a picture from above.
#pragma once

#include <string>

#include "tiles/plan.h"

namespace dtsdf {

/// A line for each tile, and what all of them come to.
std::string planTable(const Plan& plan, double voxel_size_m);

/// The tiles from above, as an SVG: the darker, the longer one takes. Tiles above one another are
/// one rectangle, with the numbers of all.
std::string planPicture(const Plan& plan, double voxel_size_m);

}  // namespace dtsdf
