/// A region that could be cleared in part only.
#pragma once

#include <stdexcept>

namespace dtsdf {

/// Thrown by Mapper::clearRegion() where blocks on disk cannot come back to be cleared: these stay
/// as they were, and all else is cleared. The mapper stays usable, and the region can be cleared
/// again.
class PartlyCleared : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace dtsdf
