#include "runtime/check.h"

#include <cstring>

namespace dtsdf {
namespace gpu {

void checkCall(cudaError_t code, const char* call, const char* file, int line) {
  if (code == cudaSuccess) return;
  cudaGetLastError();  // an error that can be survived must not surface at the next launch again
  const char* slash = std::strrchr(file, '/');
  throw CudaError(code, std::string("CUDA error in ") + call + " (" +
                            (slash == nullptr ? file : slash + 1) + ":" + std::to_string(line) +
                            "): " + cudaGetErrorName(code) + ", " + cudaGetErrorString(code));
}

}  // namespace gpu
}  // namespace dtsdf
