/// Depth image to surfels on the CPU.
#pragma once

#include <vector>

#include "dtsdf_mapping/kernels/surfel.h"
#include "dtsdf_mapping/mapper/mapper.h"

namespace dtsdf {

/// Computes one surfel per pixel; the buffers are kept from frame to frame.
class FrameSurfels {
 public:
  /// @return number of surfels with a weight.
  size_t compute(const DepthFrame& frame, const FrameView& view, const MapperParams& params,
                 int threads);

  const std::vector<Surfel>& surfels() const { return surfels_; }

 private:
  std::vector<float> inverse_depth_, row_value_, row_slope_;
  std::vector<Surfel> surfels_;
};

}  // namespace dtsdf
