/// Space as it is known to one who follows its changes, on a thread beside the map's: what planners
/// ask costs the map nothing then, and neither waits for the other.
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

/// Cells and distances as they were at one moment; for any number of threads.
class SpaceSnapshot : public KnownSpace {
 public:
  /// Whether nothing is known anywhere.
  bool isEmpty() const { return cells_.empty(); }

  /// Calls `visit` with cubes of which something is known, some at a time, in no order.
  template <class Visit>
  void visitCubes(const Visit& visit) const {
    for (const auto& of_sector : cells_) visit(cubesOf(of_sector));
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
  int reach_ = 0;  ///< How far distances reach, in cells.
  CellSectors cells_;
  DistanceSectors distances_;
};

/// For one thread.
class SpaceFollower {
 public:
  /// @param max_distance_m See SpaceParams.
  /// @param threads That distances are worked out by.
  /// @param pages Null: all stays in memory.
  SpaceFollower(double max_distance_m, int threads, SharedPagedValues pages = nullptr)
      : max_distance_m_(max_distance_m),
        threads_(threads),
        pages_(std::move(pages)),
        field_(0, threads) {}

  /// Takes changes over, and works out the distances that they change. Cells may be of another size
  /// where all begins again.
  void apply(const SpaceChanges& changes, double cell_size_m);

  /// As it is now. What changes later is copied then, sector by sector.
  std::shared_ptr<const SpaceSnapshot> snapshot() const {
    return std::make_shared<const SpaceSnapshot>(now_);
  }

  size_t bytes() const;
  /// All 0 without pages.
  PagedValues::Stats pageStats() const {
    return pages_ == nullptr ? PagedValues::Stats() : pages_->stats();
  }

 private:
  using CubesOfSectors = std::map<PackedKey, std::vector<const SpaceCube*>>;

  void startOver(double cell_size_m);
  void applyCells(const CubesOfSectors::value_type& of_sector);

  const double max_distance_m_;
  const int threads_;
  const SharedPagedValues pages_;
  DistanceField field_;
  SpaceSnapshot now_;
};

}  // namespace dtsdf
