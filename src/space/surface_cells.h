/// Which cells the triangles of the mesh pass through. Follows the mesh block by block; a cell on
/// the border of blocks stays as long as any of them has a triangle in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "space/cell_table.h"

namespace dtsdf {

/// Cells that the triangles of a block pass through, sorted, each once. A triangle that lies in the
/// face between two cells is in the upper one.
std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, int32_t cell_log2);

/// The cells that blocks of a sector have triangles in.
struct SurfaceSector {
  std::unordered_map<PackedKey, std::vector<Vec3i>> cells_of_block;  ///< Sorted, as above.
  size_t listed = 0;                                                 ///< Cells in all lists.
  bool is_lost = false;  ///< Some lists cannot be read: there may be surfaces in any cell.

  static SurfaceSector lost() { return {{}, 0, true}; }
  bool isEmpty() const { return cells_of_block.empty() && !is_lost; }
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

  void clear() { sectors_.clear(); }
  size_t bytes() const { return sectors_.bytes(); }

 private:
  PackedKey sectorOf(const BlockKey& block) const;
  std::shared_ptr<const std::vector<Vec3i>> cellsOf(const BlockKey& block) const;
  bool isListed(const Vec3i& cell) const;
  void replace(const BlockKey& block, std::vector<Vec3i> now, CellTable& cells);

  const int32_t cell_log2_;  ///< Log2 of the voxels along a cell.
  const int threads_;
  SectorTable<SurfaceSector> sectors_;  ///< A block's list is in the sector of its first cell.
  std::vector<Vec3i> changed_;          ///< Cubes, while an update is taken over.
};

}  // namespace dtsdf
