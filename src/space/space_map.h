/// What a map knows of space: the cells, and the distances that are made from them when asked for.
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

/// Settings in units of cells and voxels.
int32_t cellLog2Of(const MapperParams& params);
/// @return cells that distances reach.
int reachInCells(const MapperParams& params);

/// Where cells and distances lie beyond so much memory; null without map/page_folder.
/// @throws std::runtime_error where it cannot be written.
SharedPagedValues makePages(const MapperParams& params, size_t most_bytes);

class SpaceMap : public Space {
 public:
  /// @throws std::runtime_error where map/page_folder cannot be written.
  SpaceMap(const MapperParams& params, int threads);

  /// From now on only these cubes are known: it is a part of a larger map. Outlasts clear().
  void restrictTo(const BlockExtent& cubes) { extent_ = cubes; }

  /// From now on distances are worked out by this.
  void setDistanceBackend(DistanceWork work_out) { distances_.setBackend(std::move(work_out)); }

  /// Cubes that may be in view of an image, in the order of keys; what is not, is not seen free.
  std::vector<Vec3i> cubesInView(const FrameView& frame) const;

  /// Takes over what an image saw through. Cubes come in the order of their keys; those beyond the
  /// budget are refused.
  void addFree(const std::vector<CubeMask>& cubes);

  /// Takes over what a mesh update has changed.
  void addSurfaces(const std::vector<BlockMesh>& blocks);

  /// Forgets what is free where cells have their middles in a region in units of voxels. Surfaces
  /// go with the mesh.
  void clearRegion(const RegionView& region);

  /// Forgets what is free in cubes that lie wholly outside.
  void dropBeyond(const RegionView& kept);

  void clear();

  /// Adds what is free to contents. Surfaces are found again in the mesh.
  /// @throws std::runtime_error where the disk does not give it now.
  void copyTo(MapContents& contents) const;
  /// @pre Nothing is known, the cells are as large as those of the contents, and the budget is not
  /// below what is free there.
  void restore(const MapContents& contents);

  size_t freeBytes() const;                                 ///< That count towards the budget.
  uint64_t refusedCubes() const { return refused_cubes_; }  ///< Since the start, or clear().
  /// Adds what became of cells on disk.
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
  void recountAfterLoss();
  Vec3d middleOf(const Vec3i& cell) const;

  const int32_t cell_log2_;  ///< Log2 of the voxels along a cell.
  const double voxel_size_m_;
  const float max_range_m_;
  const size_t free_budget_;
  const SharedPagedValues pages_;  ///< Null without map/page_folder.
  BlockExtent extent_;             ///< Where cubes may be.
  size_t free_cubes_ = 0;          ///< Cubes of which something is free.
  uint64_t refused_cubes_ = 0;
  uint64_t lost_ = 0;  ///< Records of the disk, when cubes were counted last.
  CellTable table_;
  SurfaceCells surfaces_;
  DistanceField distances_;
};

}  // namespace dtsdf
