/// What a stage has to do at least: the bytes that must move, from counts. What an implementation
/// moves beyond that is its own doing.
#pragma once

#include "backend/profile.h"

namespace dtsdf {

struct StageCost {
  double bytes = 0.0;     ///< Read and written in the memory of the device.
  bool over_bus = false;  ///< The bytes go over the bus between host and GPU.
};

/// `arrays_per_block` is the mean over the map.
StageCost costOf(Stage stage, const WorkCounts& work, double arrays_per_block);

}  // namespace dtsdf
