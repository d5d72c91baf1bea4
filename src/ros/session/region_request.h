/// Regions as service calls give them.
#pragma once

#include <dtsdf_mapping/Box.h>
#include <dtsdf_mapping/Sphere.h>

#include <optional>

#include "dtsdf_mapping/region.h"

namespace dtsdf {

/// Nothing if the size is all zeros. @throws std::runtime_error for a box with a problem, with what
/// it is.
std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& box);

/// The one of both that is given.
/// @throws std::runtime_error if none is, or both are, or it has a problem; the text says what to
/// do.
Region readRegion(const dtsdf_mapping::Box& box, const dtsdf_mapping::Sphere& sphere);

/// A region of frame F in the map frame.
Region inMap(const Region& region, const Eigen::Isometry3d& T_W_F);

}  // namespace dtsdf
