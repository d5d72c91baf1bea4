/// The kernels of each stage by name, so that their registers and occupancy can be reported.
#pragma once

#include <cstddef>
#include <vector>

namespace dtsdf {
namespace gpu {

struct NamedKernel {
  const char* name;
  const void* function;
  size_t dynamic_shared_bytes;  ///< Of a launch.
};

#define DTSDF_NAMED_KERNEL(kernel, dynamic_shared_bytes) \
  ::dtsdf::gpu::NamedKernel{#kernel, reinterpret_cast<const void*>(&kernel), dynamic_shared_bytes}

std::vector<NamedKernel> surfelKernels();
std::vector<NamedKernel> touchKernels();
std::vector<NamedKernel> mapKernels();
std::vector<NamedKernel> fusionKernels();
std::vector<NamedKernel> mesherKernels(bool directional);

}  // namespace gpu
}  // namespace dtsdf
