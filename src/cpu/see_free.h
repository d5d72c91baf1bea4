/// The stage "see free" on the CPU: which cells of space a depth image sees through.
#pragma once

#include <vector>

#include "kernels/space/see_free.h"
#include "kernels/surfels/sensing.h"
#include "space/space_map.h"

namespace dtsdf {

/// The buffers are kept from frame to frame.
class FreeCellFinder {
 public:
  explicit FreeCellFinder(const MapperParams& params, int threads);

  /// Of those cubes, the ones of which something is seen free. @pre The frame has free depths.
  std::vector<FreeCube> find(const FrameSensing& sensing, const std::vector<Vec3i>& cubes);

  size_t bytes() const;

 private:
  FreePyramid makePyramid(const FrameSensing& sensing);

  const CellGrid grid_;
  const float max_range_m_;
  const int threads_;
  std::vector<std::vector<float>> levels_;  ///< From the second one on.
};

}  // namespace dtsdf
