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
std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, int32_t cell_log2);

/// The cells that blocks of a sector have triangles in, and how many blocks have some in its cells.
struct SurfaceSector {
  std::unordered_map<PackedKey, std::vector<Vec3i>> cells_of_block;
  /// Per cube and cell, how many blocks have a triangle in it; cubes without surfaces are left out.
  std::unordered_map<PackedKey, std::array<uint8_t, kCellsPerCube>> counts;
  size_t listed = 0;  ///< Cells in all lists.

  bool isEmpty() const { return cells_of_block.empty() && counts.empty(); }
  size_t bytes() const;
  void visitRecord(ByteWriter& out) const;
  void visitRecord(ByteReader& in);
};

class SurfaceCells {
 public:
  /// @param pages Null: all stays in memory.
  SurfaceCells(int32_t cell_log2, int threads, SharedPagedValues pages = nullptr)
      : cell_log2_(cell_log2), threads_(threads), sectors_(std::move(pages)) {}

  /// Takes over what a mesh update has changed. @return the cubes whose surfaces changed, by key.
  std::vector<Vec3i> apply(const std::vector<BlockMesh>& blocks, CellTable& cells);

  /// Puts surfaces back into sectors of cells that the disk lost. @return their cubes.
  std::vector<Vec3i> restoreLost(const std::vector<PackedKey>& lost, CellTable& cells) const;

  void clear() { sectors_.clear(); }
  size_t bytes() const { return sectors_.bytes(); }

 private:
  PackedKey sectorOf(const BlockKey& block) const;
  bool isOther(const BlockKey& block, const std::vector<Vec3i>& now) const;
  void replace(const BlockKey& block, std::vector<Vec3i> now, CellTable& cells);
  void take(const Vec3i& cell, CellTable& cells);
  void put(const Vec3i& cell, CellTable& cells);

  const int32_t cell_log2_;  ///< Log2 of the voxels along a cell.
  const int threads_;
  SectorTable<SurfaceSector> sectors_;  ///< A block's list is in the sector of its first cell.
  std::vector<Vec3i> changed_;          ///< Cubes, while an update is taken over.
};

}  // namespace dtsdf
