/// The free-space grid of a map: free cells and surface cells, in cubes of 8 x 8 x 8, and distances
/// computed from them on request.
#pragma once

#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/space.h"
#include "kernels/core/camera.h"
#include "kernels/core/region.h"
#include "map/block_table.h"
#include "page/paged_values.h"
#include "space/cell_table.h"
#include "space/distance_field.h"
#include "space/surface_cells.h"

namespace dtsdf {

/// Log2 of a cell's edge in voxels.
int32_t cellLog2Of(const MapperParams& params);
/// The maximum distance, in cells.
int reachInCells(const MapperParams& params);

/// Creates the store that moves cells and distances to disk and keeps at most `max_bytes` of them
/// in memory; null if map/page_folder is empty.
/// @throws std::runtime_error if the folder is not writable.
SharedPagedValues makePages(const MapperParams& params, size_t max_bytes);

class SpaceMap : public Space {
 public:
  /// @throws std::runtime_error if map/page_folder is not writable.
  SpaceMap(const MapperParams& params, int threads);

  /// Limits cubesInView() to `cubes`, for one part of a larger map. clear() does not lift the
  /// limit.
  void restrictTo(const BlockExtent& cubes) { extent_ = cubes; }

  /// Sets the function that computes distances. If it returns false, the host computes them.
  void setDistanceBackend(DistanceWork work_out) { distances_.setBackend(std::move(work_out)); }

  /// The cubes that may be in the camera's view, sorted by key. Only their cells can become free.
  std::vector<Vec3i> cubesInView(const FrameView& frame) const;

  /// Adds free cells. Cubes must be sorted by key. A cube that had no free cells is refused if the
  /// budget is used up or the disk is full.
  void addFree(const std::vector<CubeMask>& cubes);

  /// Applies the surface changes of a mesh update.
  void addSurfaces(const std::vector<BlockMesh>& blocks);

  /// Resets the free cells whose centres lie in a region, given in voxels, to unknown. Surface
  /// cells change with the next mesh update.
  void clearRegion(const RegionView& region);

  /// Resets free cells in cubes whose bounding spheres lie outside the sphere `kept` to unknown.
  void dropBeyond(const RegionView& kept);

  void clear();

  /// Adds the free cells to `contents`. Surface cells are omitted, because they can be recomputed
  /// from the mesh.
  /// @throws std::runtime_error if the disk does not respond.
  void copyTo(MapContents& contents) const;
  /// Adds the free cells of `contents`. @pre No cell is known, the contents have the same cell
  /// size, and their free cells are within the budget.
  void restore(const MapContents& contents);

  size_t freeBytes() const;                                 ///< Memory counted towards the budget.
  uint64_t refusedCubes() const { return refused_cubes_; }  ///< Since the start or clear().
  /// Adds the statistics of this map's page file to `pages`, and sets pages.space_bytes.
  void addTo(PageStats& pages) const;

  double cellSize_m() const override;
  CellState stateOf(const Vec3i& cell) const override { return stateIn(table_.all(), cell); }
  std::vector<SpaceCell> cells() const override;
  std::vector<SpaceCube> cubes(int32_t first_z, int32_t last_z) const override {
    return cubesIn(table_.all(), first_z, last_z);
  }
  SpaceChanges takeChanges(bool all) override;
  void updateDistances() override { distances_.update(table_.all()); }
  int squaredDistance(const Vec3i& cell) const override {
    return squaredAt(distances_.sectors(), cell);
  }
  SpaceDistance distanceAt(const Eigen::Vector3d& p_W) const override;
  size_t bytes() const override;

 private:
  BlockExtent boundsOfView(const FrameView& frame) const;
  void forgetFree(const Vec3i& key, const CubeCells& known, const CellMask& cells);

  const int32_t cell_log2_;  ///< Log2 of a cell's edge in voxels.
  const double voxel_size_m_;
  const float max_range_m_;
  const size_t free_budget_;
  const SharedPagedValues pages_;  ///< Null if map/page_folder is empty.
  BlockExtent extent_;             ///< The limit of cubesInView().
  size_t free_cubes_ = 0;          ///< Cubes with free cells, including any that were lost on disk.
  uint64_t refused_cubes_ = 0;
  CellTable table_;
  SurfaceCells surfaces_;
  DistanceField distances_;
};

}  // namespace dtsdf
