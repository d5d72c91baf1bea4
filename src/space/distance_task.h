/// Gathers what it takes to work out the distances in sectors: the surfaces around them.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "map/block_extent.h"
#include "space/distance_sector.h"

namespace dtsdf {

/// The buffers are kept from task to task.
class TaskOfDistances {
 public:
  /// Sectors that cannot be read count as if they had surfaces everywhere, to be on the safe side.
  /// @param sectors In the order of x, then y, then z.
  /// The box around them must not be large.
  /// @return valid until the next one is gathered.
  DistanceTask gather(const SurfaceTable& surfaces, const std::vector<Vec3i>& sectors, int reach);

 private:
  void layOut(const std::vector<Vec3i>& sectors, DistanceTask& task);
  void fill(const SurfaceTable& surfaces);
  void add(const SurfaceTable& surfaces, PackedKey key, int32_t& place);
  int32_t placeOf(const Vec3i& sector) const;

  int32_t ring_ = 0;
  BlockExtent box_;  ///< Around the sectors, by their keys.
  std::vector<SectorStack> stacks_;
  std::vector<int32_t> places_;
  std::vector<SurfaceCubes> sectors_;
  std::vector<CellMask> cubes_;
};

}  // namespace dtsdf
