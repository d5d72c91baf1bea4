/// Which cells the triangles of the mesh pass through. Follows the mesh block by block; a cell on
/// the border of blocks stays as long as any of them has a triangle in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "space/cell_table.h"

namespace dtsdf {

/// Cells that the triangles of a block pass through, sorted, each once. A triangle that lies in the
/// face between two cells is in the upper one.
std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, const CellGrid& grid);

class SurfaceCells {
 public:
  SurfaceCells(const CellGrid& grid, int threads) : grid_(grid), threads_(threads) {}

  /// Takes over what a mesh update has changed. @return the cubes whose surfaces changed, by key.
  std::vector<Vec3i> apply(const std::vector<BlockMesh>& blocks, CellTable& cells);

  void clear();
  size_t bytes() const;

 private:
  /// Of a cube.
  struct Counts {
    std::array<uint8_t, kCellsPerCube> blocks{};  ///< By cell: how many have a triangle in it.
    int cells = 0;                                ///< With any.
  };

  const std::vector<Vec3i>& cellsOf(PackedKey block) const;
  void replace(PackedKey block, std::vector<Vec3i> now, CellTable& cells);
  void take(const Vec3i& cell, CellTable& cells);
  void put(const Vec3i& cell, CellTable& cells);

  const CellGrid grid_;
  const int threads_;
  std::unordered_map<PackedKey, std::vector<Vec3i>> cells_of_block_;
  std::unordered_map<PackedKey, Counts> counts_;  ///< By cube; none without surfaces.
  size_t listed_ = 0;                             ///< Cells in all lists.
  std::vector<Vec3i> changed_;                    ///< Cubes, while an update is taken over.
};

}  // namespace dtsdf
