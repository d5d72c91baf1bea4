/// Exact Euclidean distances to the nearest surface cell, up to a maximum distance (the reach),
/// updated where surfaces change. Squared distances are integers, so the result does not depend on
/// the order of computation.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "space/distance_task.h"

namespace dtsdf {

/// The reach in cells, given the maximum distance in metres.
inline int reachInCells(double max_distance_m, double cell_size_m) {
  constexpr double kRounding = 1e-6;  // so that rounding does not turn 2 m / 80 mm into 26 cells
  return static_cast<int>(std::ceil(max_distance_m / cell_size_m * (1.0 - kRounding)));
}

/// Sectors (see cell_sector.h) that are not listed have no surface within reach.
using DistanceSectors = Sectors<DistanceSector>;

/// @return the squared distance, in cells, to the nearest cell with a surface; -1 if none is within
/// reach; 0 if the sector cannot be read, so that unreadable cells do not appear free.
int squaredAt(const DistanceSectors& sectors, const Vec3i& cell);

/// Implements KnownSpace::distanceAt(): interpolates between the centres of the cells around a
/// point.
/// @param reach Maximum distance, in cells.
SpaceDistance interpolatedDistance(const KnownSpace& space, const DistanceSectors& sectors,
                                   int reach, const Eigen::Vector3d& p_W);

/// Computes the distances of a task's sectors.
/// @param squares For each sector, in: its old values if they may be overwritten, otherwise null;
/// out: its new values, or null if no surface is within reach.
/// @return false if the host has to compute them.
using DistanceWork =
    std::function<bool(const DistanceTask& task, std::vector<SectorSquares>& squares)>;

class DistanceField {
 public:
  /// @param reach Largest distance in cells, at most 255: squares are stored in 16 bits.
  /// @param pages Null to keep everything in memory.
  DistanceField(int reach, int threads, const SharedPagedValues& pages = nullptr)
      : reach_(reach), threads_(threads), pages_(pages) {}

  /// Sets the function that computes distances on the backend. If it returns false, the host
  /// computes them.
  void setBackend(DistanceWork work_out) { backend_work_ = std::move(work_out); }

  /// Marks a cube whose surfaces may have changed.
  void noteChange(const Vec3i& cube) { insert(changed_, cube); }

  /// Recomputes the distances affected by changes since the last update.
  void update(const CellSectors& cells);

  const DistanceSectors& sectors() const { return sectors_; }
  int reach() const { return reach_; }

  void clear();
  size_t bytes() const;

 private:
  std::vector<Vec3i> sectorsNear(CubeSet::const_iterator end) const;
  size_t batchSize(const std::vector<Vec3i>& keys, size_t first) const;
  bool mayOverwrite(const std::shared_ptr<const DistanceSector>& sector) const;
  template <class Value>
  void computeOnHost(const CellSectors& cells, const std::vector<Vec3i>& keys,
                     std::vector<SectorSquares>& squares) const;
  void updateSome(const CellSectors& cells, const std::vector<Vec3i>& keys);

  int reach_;
  int threads_;
  SharedPagedValues pages_;
  DistanceWork backend_work_;
  DistanceTaskBuilder task_;
  DistanceSectors sectors_;
  CubeSet changed_;  ///< Cubes whose surfaces have changed since sectors_ was updated.
};

}  // namespace dtsdf
