/// Gathers what it takes to work out the distances in sectors: the surfaces around them.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "space/distance_sector.h"

namespace dtsdf {

/// The buffers are kept from task to task.
class TaskOfDistances {
 public:
  /// Sectors that cannot be read count as if they had surfaces everywhere, to be on the safe side.
  /// @param sectors In the order of x, then y, then z.
  /// @return valid until the next one is gathered.
  DistanceTask gather(const SurfaceTable& surfaces, const std::vector<Vec3i>& sectors, int reach);

  /// Whether some sector around one could not be read, but may be later.
  bool isGuess(size_t sector) const { return is_guess_[sector] != 0; }

 private:
  void addStack(const SurfaceTable& surfaces, const Vec3i& first, int count, int reach);
  int32_t placeOf(const SurfaceTable& surfaces, const Vec3i& sector);
  int32_t add(const SurfaceTable& surfaces, PackedKey key);

  std::vector<SectorStack> stacks_;
  std::vector<int32_t> places_;
  std::vector<SurfaceCubes> sectors_;
  std::vector<CellMask> cubes_;
  std::vector<char> is_guess_;  ///< By wanted sector.
  std::unordered_map<PackedKey, int32_t> place_of_;
  std::vector<char> is_unread_;  ///< By place.
};

}  // namespace dtsdf
