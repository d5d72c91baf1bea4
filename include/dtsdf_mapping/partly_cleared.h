/// A region that could be cleared in part only.
#pragma once

#include <stdexcept>

namespace dtsdf {

/// Thrown by Mapper::clearRegion() if blocks on disk cannot be read back to be cleared: these stay
/// as they were, and everything else is cleared. The mapper stays usable, and the region can be
/// cleared again.
class PartlyCleared : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace dtsdf
