/// Exact Euclidean distances between cells, up to a reach, kept up to date where surfaces change.
/// All squared distances are whole numbers, so that any order of work gives the same.
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

/// Cells that distances of so many metres reach.
inline int reachInCells(double max_distance_m, double cell_size_m) {
  constexpr double kRounding = 1e-6;  // of floats in metres: 2 m are 25 cells of 80 mm, not 26
  return static_cast<int>(std::ceil(max_distance_m / cell_size_m * (1.0 - kRounding)));
}

/// All others are far from surfaces.
using DistanceSectors = Sectors<DistanceSector>;

/// @return the squared distance, in cells, to the nearest cell with a surface; -1: none in reach; 0
/// where it cannot be read, so that nobody runs into something.
int squaredAt(const DistanceSectors& sectors, const Vec3i& cell);

/// As KnownSpace::distanceAt() says, between the middles of cells, by the squared distances of
/// those around a point.
/// @param reach How far distances reach, in cells.
SpaceDistance interpolatedDistance(const KnownSpace& space, const DistanceSectors& sectors,
                                   int reach, const Eigen::Vector3d& p_W);

/// Works out the distances of a task's sectors. @param squares What each of them had, if it may be
/// overwritten; null after it where all are far. @return false: the host is to do it.
using DistanceWork =
    std::function<bool(const DistanceTask& task, std::vector<SectorSquares>& squares)>;

class DistanceField {
 public:
  /// Distances are known up to `reach` cells, 255 at most: their squares are kept in 16 bits.
  /// @param pages Null: all stays in memory.
  DistanceField(int reach, int threads, const SharedPagedValues& pages = nullptr)
      : reach_(reach), threads_(threads), pages_(pages) {}

  /// From now on it has whole sectors worked out by this.
  void setBackend(DistanceWork work_out) { work_out_ = std::move(work_out); }

  /// Surfaces in this cube may be other ones than before.
  void noteChange(const Vec3i& cube) { insert(changed_, cube); }

  /// Works out the distances that changes since the last update have made other ones.
  void update(const CellSectors& cells);

  const DistanceSectors& sectors() const { return sectors_; }
  int reach() const { return reach_; }

  void clear();
  size_t bytes() const;

 private:
  /// Sectors as they were, null where there was none, and then as they are.
  using Sectors = std::vector<std::shared_ptr<const DistanceSector>>;

  std::vector<Vec3i> sectorsNear(CubeSet::const_iterator end) const;
  size_t countAtOnce(const std::vector<Vec3i>& keys, size_t first) const;
  bool mayOverwrite(const std::shared_ptr<const DistanceSector>& sector) const;
  bool workOut(const CellSectors& cells, const std::vector<Vec3i>& keys, Sectors& sectors);
  template <class Value>
  void workOutOnHost(const CellSectors& cells, const std::vector<Vec3i>& keys,
                     Sectors& sectors) const;
  void updateSome(const CellSectors& cells, const std::vector<Vec3i>& keys);

  int reach_;
  int threads_;
  SharedPagedValues pages_;
  DistanceWork work_out_;
  TaskOfDistances task_;
  DistanceSectors sectors_;
  CubeSet changed_;  ///< Cubes with surfaces that the sectors do not know yet.
};

}  // namespace dtsdf
