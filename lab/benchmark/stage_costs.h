/// What a stage has to do at least: the bytes that must move and the operations to be done, from
/// counts. What an implementation moves beyond that is its own doing.
#pragma once

#include "backend/profile.h"

namespace dtsdf {

struct StageCost {
  double bytes = 0.0;       ///< Read and written in the memory of the device.
  double operations = 0.0;  ///< Arithmetic on numbers, within a factor of two.
  bool over_bus = false;    ///< The bytes go over the bus between host and GPU.
};

/// `arrays_per_block` is the mean over the map.
StageCost costOf(Stage stage, const WorkCounts& work, double arrays_per_block);

/// Share of a multiprocessor of compute capability 7.5 that a kernel of these needs would fill:
/// 1024 threads, 65536 registers, 64 KiB of shared memory.
double occupancyOnTuring(int threads, int registers, size_t shared_bytes);

}  // namespace dtsdf
