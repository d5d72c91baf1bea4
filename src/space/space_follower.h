/// A copy of a map's free-space grid that is kept up to date. The caller updates it on a separate
/// thread, so that planners' queries and the map do not wait for each other.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/space.h"
#include "space/distance_field.h"

namespace dtsdf {

/// Snapshot of the cells and distances. Thread-safe.
class SpaceSnapshot : public KnownSpace {
 public:
  /// Whether no cell is known.
  bool isEmpty() const { return cells_.empty(); }

  /// Calls `visit` with lists of the known cubes, one per sector, in no particular order.
  template <class Visit>
  void visitCubes(const Visit& visit) const {
    for (const auto& sector_entry : cells_) visit(cubesOf(sector_entry));
  }

  double cellSize_m() const override { return cell_size_m_; }
  CellState stateOf(const Vec3i& cell) const override { return stateIn(cells_, cell); }
  std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const override {
    return cubesIn(cells_, first_z, last_z);
  }
  int squaredDistance(const Vec3i& cell) const override { return squaredAt(distances_, cell); }
  SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const override {
    return interpolatedDistance(*this, distances_, reach_, p_W);
  }

 private:
  friend class SpaceFollower;
  friend SpaceSnapshot clearedIn(const BoxRegion& box, const std::vector<Region>& cleared,
                                 const SpaceSnapshot& space);

  double cell_size_m_ = 0.0;
  int reach_ = 0;  ///< Maximum distance, in cells.
  CellSectors cells_;
  DistanceSectors distances_;
};

/// Applies changes in a map's free-space grid to a copy of it. Not thread-safe.
class SpaceFollower {
 public:
  /// @param max_distance_m See SpaceParams.
  /// @param threads Number of threads that compute distances.
  /// @param pages Null to keep everything in memory.
  SpaceFollower(double max_distance_m, int threads, SharedPagedValues pages = nullptr)
      : max_distance_m_(max_distance_m),
        threads_(threads),
        pages_(std::move(pages)),
        field_(0, threads) {}

  /// Applies changes, and updates the distances that they affect. The cell size may change only if
  /// changes.begins_anew is set.
  void apply(const SpaceChanges& changes, double cell_size_m);

  /// The current state. Cheap, because sectors are shared until they change.
  std::shared_ptr<const SpaceSnapshot> snapshot() const {
    return std::make_shared<const SpaceSnapshot>(now_);
  }

  size_t bytes() const;
  /// All 0 if `pages` is null.
  PagedValues::Stats pageStats() const {
    return pages_ == nullptr ? PagedValues::Stats() : pages_->stats();
  }

 private:
  using CubesOfSectors = std::map<PackedKey, std::vector<const SpaceCube*>>;

  void startOver(double cell_size_m);
  void applyCells(const CubesOfSectors::value_type& sector_entry);

  const double max_distance_m_;
  const int threads_;
  const SharedPagedValues pages_;
  DistanceField field_;
  SpaceSnapshot now_;
};

}  // namespace dtsdf
