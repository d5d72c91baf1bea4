/// The cells that the triangles of the mesh pass through, updated block by block. A cell shared by
/// several blocks is a surface cell as long as it contains a triangle of any block.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "space/cell_table.h"

namespace dtsdf {

/// The cells that the triangles of a block pass through, sorted and without duplicates. A triangle
/// in the face between two cells belongs to the upper cell.
std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, int32_t cell_log2);

/// The surface cells of the blocks in a sector (see cell_sector.h).
struct SurfaceSector {
  std::unordered_map<PackedKey, std::vector<Vec3i>> cells_of_block;  ///< See cellsOfMesh().
  size_t listed = 0;     ///< Number of cells in all lists.
  bool is_lost = false;  ///< Whether lists were lost, so that any cell may be a surface cell.

  static SurfaceSector lost() { return {{}, 0, true}; }
  bool isEmpty() const { return cells_of_block.empty() && !is_lost; }
  size_t bytes() const;
  void visitRecord(ByteWriter& out) const;
  void visitRecord(ByteReader& in);
};

class SurfaceCells {
 public:
  /// @param pages Null to keep everything in memory.
  SurfaceCells(int32_t cell_log2, int threads, SharedPagedValues pages = nullptr)
      : cell_log2_(cell_log2), threads_(threads), sectors_(std::move(pages)) {}

  /// Applies a mesh update to `cells`. @return the cubes whose surfaces changed, sorted by key.
  std::vector<Vec3i> apply(const std::vector<BlockMesh>& blocks, CellTable& cells);

  void clear() { sectors_.clear(); }
  size_t bytes() const { return sectors_.bytes(); }

 private:
  PackedKey sectorOf(const BlockKey& block) const;
  std::shared_ptr<const std::vector<Vec3i>> cellsOf(const BlockKey& block) const;
  bool hasTriangles(const Vec3i& cell) const;
  void replace(const BlockKey& block, const std::vector<Vec3i>& now, CellTable& cells);

  const int32_t cell_log2_;  ///< Log2 of a cell's edge in voxels.
  const int threads_;
  SectorTable<SurfaceSector> sectors_;  ///< A block's list is in the sector of its first cell.
  std::vector<Vec3i> changed_;          ///< Cubes changed by the current update.
};

}  // namespace dtsdf
