/// The stage "sense" on the CPU: prepares a depth image for computing surfels.
#pragma once

#include <vector>

#include "backend/rules.h"
#include "cpu/measured_span.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/depth.h"
#include "kernels/surfels/noise.h"

namespace dtsdf {

/// Reuses its buffers, so the result of sense() is valid until the next call.
class FrameSensor {
 public:
  FrameSensor(const MapperParams& params, const Rules& rules, int threads);

  FrameSensing sense(const DepthFrame& frame);

  size_t bytes() const;

 private:
  void invertDepths(const DepthFrame& frame);
  DepthNoise estimateNoise(const FrameView& view) const;
  void fillGaps(const FrameView& view, const DepthRange& range, const DepthNoise& noise);
  void linkAndFitRows(const FrameView& view, const DepthNoise& noise);
  void findFreeDepths(const FrameSensing& sensing);

  const MapperParams params_;
  const SurfelSettings surfel_settings_;
  const FusionSettings fusion_settings_;
  const int threads_;
  SpanImage<float> measured_, inverse_depth_, row_value_, row_slope_, free_depth_;
  SpanImage<PixelLinks> links_;
  std::vector<float> max_free_;
};

}  // namespace dtsdf
