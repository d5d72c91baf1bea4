/// Gathers what it takes to work out the distances in sectors: the surfaces around them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "space/distance_sector.h"

namespace dtsdf {

/// The smallest box around sectors.
struct SectorBox {
  Vec3i low, high;

  Vec3i size() const { return high - low + Vec3i{1, 1, 1}; }
  int64_t volume() const { return int64_t{1} * size().x * size().y * size().z; }
  bool contains(const Vec3i& sector) const {
    return sector.x >= low.x && sector.y >= low.y && sector.z >= low.z && sector.x <= high.x &&
           sector.y <= high.y && sector.z <= high.z;
  }
  SectorBox with(const Vec3i& sector) const {
    return {leastOf(low, sector), greatestOf(high, sector)};
  }
  SectorBox grownBy(int32_t by) const {
    return {low - Vec3i{by, by, by}, high + Vec3i{by, by, by}};
  }
};

/// The buffers are kept from task to task.
class TaskOfDistances {
 public:
  /// Sectors that cannot be read count as if they had surfaces everywhere, to be on the safe side.
  /// @param sectors In the order of x, then y, then z.
  /// The box around them must not be large.
  /// @return valid until the next one is gathered.
  DistanceTask gather(const SurfaceTable& surfaces, const std::vector<Vec3i>& sectors, int reach);

  /// Whether some sector around one could not be read, but may be later.
  bool isGuess(const Vec3i& sector) const;

 private:
  void layOut(const std::vector<Vec3i>& sectors, DistanceTask& task);
  void fill(const SurfaceTable& surfaces);
  void add(const SurfaceTable& surfaces, PackedKey key, int32_t& place);
  int32_t placeOf(const Vec3i& sector) const;

  int32_t ring_ = 0;
  SectorBox box_{};
  std::vector<SectorStack> stacks_;
  std::vector<int32_t> places_;
  std::vector<SurfaceCubes> sectors_;
  std::vector<CellMask> cubes_;
  std::vector<Vec3i> unread_;  ///< Sectors that may be read later.
};

}  // namespace dtsdf
