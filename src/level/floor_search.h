/// Looks for the floor in depth images, a few at a time, until there is one.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"
#include "level/floor_fit.h"

namespace dtsdf {

/// One thread at a time.
class FloorSearch {
 public:
  /// Images that are looked at together.
  static constexpr size_t kViews = 10;

  /// Looks at an image, whose pose is in the frame M; one without measurements or with a pose that
  /// is not finite does not count. True if the look is complete: floor() or problem() is new.
  bool add(const DepthFrame& frame);

  /// Ends a look that has begun, with the images that there were.
  void finish();

  /// In M, once there is one; what comes after that is not looked at.
  const std::optional<FloorPlane>& floor() const { return fit_.floor; }

  /// Why the last look found none; empty before it was complete.
  const std::string& problem() const { return fit_.problem; }

 private:
  std::vector<FloorView> views_;
  FloorFit fit_;
};

}  // namespace dtsdf
