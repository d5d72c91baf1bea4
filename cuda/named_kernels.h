/// The kernels of each stage by name, so that their registers and occupancy can be reported.
#pragma once

#include <cstddef>
#include <vector>

#include "launch.h"

namespace dtsdf {
namespace gpu {

struct NamedKernel {
  const char* name;
  const void* function;
  size_t dynamic_shared_bytes;  ///< Of a launch.
  int threads = kThreads;       ///< Of a block of threads.
};

/// The kernel, its dynamic shared memory, and its threads where they are not kThreads.
#define DTSDF_NAMED_KERNEL(kernel, ...) \
  ::dtsdf::gpu::NamedKernel { #kernel, reinterpret_cast < const void*>(&kernel), __VA_ARGS__ }

std::vector<NamedKernel> alignKernels();
std::vector<NamedKernel> senseKernels();
std::vector<NamedKernel> surfelKernels();
std::vector<NamedKernel> blockKernels();
std::vector<NamedKernel> mapKernels();
std::vector<NamedKernel> moveKernels();
std::vector<NamedKernel> carryKernels();
std::vector<NamedKernel> markKernels();
std::vector<NamedKernel> fusionKernels();
std::vector<NamedKernel> clearKernels();
std::vector<NamedKernel> regionKernels();
std::vector<NamedKernel> freeSpaceKernels();
std::vector<NamedKernel> distanceKernels();
std::vector<NamedKernel> paintKernels();
std::vector<NamedKernel> renderKernels();
std::vector<NamedKernel> mesherKernels(bool directional);

}  // namespace gpu
}  // namespace dtsdf
