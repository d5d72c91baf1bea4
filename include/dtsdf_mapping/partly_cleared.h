/// Exception for a region that could be cleared only in part.
#pragma once

#include <stdexcept>

namespace dtsdf {

/// Thrown by Mapper::clearRegion() if blocks on disk cannot be read back. Those blocks are
/// unchanged; the rest of the region is cleared. The mapper stays usable, and the region can be
/// cleared again.
class PartlyCleared : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace dtsdf
