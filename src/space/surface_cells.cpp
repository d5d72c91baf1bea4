#include "space/surface_cells.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>
#include <utility>

#include "kernels/core/vec.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

bool isBefore(const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); }

/// A corner of a triangle.
struct Corner {
  Vec3f at;    ///< In cells, relative to the first cell of the block.
  Vec3i low;   ///< The cell that contains it; on a face between two cells, the upper cell.
  Vec3i high;  ///< The cell that contains it; on a face between two cells, the lower cell.
};

Corner cornerAt(const Vec3f& at) {
  return {at,
          {floorToInt(at.x), floorToInt(at.y), floorToInt(at.z)},
          {ceilToInt(at.x) - 1, ceilToInt(at.y) - 1, ceilToInt(at.z) - 1}};
}

/// Whether a triangle intersects the interior of the unit cube centred at `middle`. Tests as
/// separating axes the triangle's normal and the cross products of edges of the triangle and the
/// cube. The caller tests the cube's own axes with the triangle's bounds.
bool reachesInto(const Vec3f& middle, const Vec3f& first, const Vec3f& second, const Vec3f& third) {
  const Vec3f a = first - middle, b = second - middle, c = third - middle;
  const auto separates = [&](const Vec3f& axis) {
    constexpr float kHalf = 0.5f;
    const float reach = kHalf * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    const float at_a = dot(axis, a), at_b = dot(axis, b), at_c = dot(axis, c);
    return minimum(minimum(at_a, at_b), at_c) > reach ||
           maximum(maximum(at_a, at_b), at_c) < -reach;
  };
  const Vec3f edges[] = {second - first, third - second, first - third};
  if (separates(cross(edges[0], edges[1]))) return false;
  return std::none_of(std::begin(edges), std::end(edges), [&](const Vec3f& e) {
    return separates({0.0f, -e.z, e.y}) || separates({e.z, 0.0f, -e.x}) ||
           separates({-e.y, e.x, 0.0f});
  });
}

/// Calls visit(cell) for each cell that a triangle passes through. A triangle in the face between
/// two cells belongs to the upper cell.
template <class Visit>
void visitCells(const Corner& a, const Corner& b, const Corner& c, const Visit& visit) {
  const Vec3i first = minOf(minOf(a.low, b.low), c.low);
  const Vec3i last = maxOf(first, maxOf(maxOf(a.high, b.high), c.high));
  const Vec3i steps = last - first;
  if (steps == Vec3i{0, 0, 0}) return visit(first);  // the usual case
  // If the cells form a single row, the triangle passes through all of them.
  const bool is_in_all = (steps.x > 0) + (steps.y > 0) + (steps.z > 0) <= 1;
  for (int32_t z = first.z; z <= last.z; ++z) {
    for (int32_t y = first.y; y <= last.y; ++y) {
      for (int32_t x = first.x; x <= last.x; ++x) {
        const Vec3i cell{x, y, z};
        const Vec3f middle = toFloat(cell) + Vec3f{0.5f, 0.5f, 0.5f};
        if (is_in_all || reachesInto(middle, a.at, b.at, c.at)) visit(cell);
      }
    }
  }
}

/// The cells of a sorted list that are not in another sorted list.
std::vector<Vec3i> without(const std::vector<Vec3i>& list, const std::vector<Vec3i>& removed) {
  std::vector<Vec3i> cells;
  std::set_difference(list.begin(), list.end(), removed.begin(), removed.end(),
                      std::back_inserter(cells), isBefore);
  return cells;
}

/// A block and its first cell start at the same voxel, since cells are 1, 2, 4 or 8 voxels wide.
Vec3i firstCellOfBlock(const BlockKey& block, int32_t cell_log2) {
  return shiftDown(firstVoxelOfBlock(block), cell_log2);
}

}  // namespace

std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, int32_t cell_log2) {
  const Vec3i first = firstCellOfBlock(mesh.key, cell_log2);
  const float per_voxel = 1.0f / static_cast<float>(cellSide(cell_log2));
  std::vector<Corner> corners;
  corners.reserve(mesh.vertices.size());
  for (const BlockVertex& vertex : mesh.vertices) {
    corners.push_back(cornerAt(per_voxel * vertex.position));
  }
  // One bit per cell in and around the block. The block is at most 8 cells wide, and its triangles
  // lie within this range.
  constexpr int32_t kSide = 16;
  constexpr Vec3i kFirst{-4, -4, -4};
  std::bitset<kSide * kSide * kSide> is_in;
  const auto& triangles = mesh.triangles;
  for (size_t i = 0; i + 2 < triangles.size(); i += 3) {
    visitCells(corners[triangles[i]], corners[triangles[i + 1]], corners[triangles[i + 2]],
               [&](const Vec3i& cell) {
                 const Vec3i at = cell - kFirst;
                 if (((at.x | at.y | at.z) & ~(kSide - 1)) != 0) return;
                 const int number = at.x + kSide * (at.y + kSide * at.z);
                 is_in.set(static_cast<size_t>(number));
               });
  }
  std::vector<Vec3i> cells;
  for (size_t i = is_in._Find_first(); i < is_in.size(); i = is_in._Find_next(i)) {
    const auto at = static_cast<int32_t>(i);
    cells.push_back(first + kFirst + Vec3i{at % kSide, at / kSide % kSide, at / (kSide * kSide)});
  }
  return cells;  // already sorted by z, then y, then x
}

std::vector<Vec3i> SurfaceCells::apply(const std::vector<BlockMesh>& blocks, CellTable& cells) {
  // Surfaces keep moving slightly, but rarely enter or leave a cell. So changes are detected in
  // parallel, and only blocks with changes are processed one by one.
  std::vector<std::vector<Vec3i>> found(blocks.size());
  std::vector<uint8_t> is_other(blocks.size());
  parallelFor(blocks.size(), threads_, [&](size_t i) {
    found[i] = cellsOfMesh(blocks[i], cell_log2_);
    const auto before = cellsOf(blocks[i].key);
    is_other[i] = before == nullptr ? !found[i].empty() : *before != found[i];
  });
  changed_.clear();
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (is_other[i]) replace(blocks[i].key, found[i], cells);
  }
  sectors_.close();
  std::sort(changed_.begin(), changed_.end(), isBefore);
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  for (const Vec3i& cube : changed_) cells.removeIfEmpty(cube);
  cells.close();
  return std::move(changed_);
}

PackedKey SurfaceCells::sectorOf(const BlockKey& block) const {
  return packKey(sectorOfCell(firstCellOfBlock(block, cell_log2_)));
}

/// The surface cells of a block; null if there are none.
std::shared_ptr<const std::vector<Vec3i>> SurfaceCells::cellsOf(const BlockKey& block) const {
  const std::shared_ptr<const SurfaceSector> sector = sectors_.find(sectorOf(block));
  if (sector == nullptr) return nullptr;
  const auto cells = sector->cells_of_block.find(packKey(block));
  if (cells == sector->cells_of_block.end()) return nullptr;
  return {sector, &cells->second};
}

void SurfaceCells::replace(const BlockKey& block, const std::vector<Vec3i>& now, CellTable& cells) {
  SurfaceSector& sector = sectors_.open(sectorOf(block));
  const std::vector<Vec3i> before = std::exchange(sector.cells_of_block[packKey(block)], now);
  sector.listed += now.size();
  sector.listed -= before.size();
  if (now.empty()) sector.cells_of_block.erase(packKey(block));
  for (const Vec3i& cell : without(now, before)) {
    const Vec3i cube = cubeOfCell(cell);
    if (isIn(cells.find(cube).surface, indexInCube(cell))) continue;
    add(cells.at(cube).surface, indexInCube(cell));
    changed_.push_back(cube);
  }
  for (const Vec3i& cell : without(before, now)) {
    const Vec3i cube = cubeOfCell(cell);
    if (!isIn(cells.find(cube).surface, indexInCube(cell)) || hasTriangles(cell)) continue;
    remove(cells.at(cube).surface, indexInCube(cell));
    changed_.push_back(cube);
  }
}

/// Whether a cell contains triangles of any block, or may contain them because a sector was lost or
/// cannot be read. Checks only the cell's block and its neighbours, because no mesh of a block
/// extends beyond adjacent blocks.
bool SurfaceCells::hasTriangles(const Vec3i& cell) const {
  const int32_t side = cellSide(cell_log2_);
  const BlockKey block = blockOfVoxel({side * cell.x, side * cell.y, side * cell.z});
  for (int i = 0; i < 27; ++i) {
    const BlockKey beside = block + Vec3i{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    const PackedKey key = sectorOf(beside);
    const std::shared_ptr<const SurfaceSector> sector = sectors_.find(key);
    if (sector == nullptr ? sectors_.all().count(key) > 0 : sector->is_lost) return true;
    if (sector == nullptr) continue;
    const auto cells = sector->cells_of_block.find(packKey(beside));
    if (cells != sector->cells_of_block.end() &&
        std::binary_search(cells->second.begin(), cells->second.end(), cell, isBefore)) {
      return true;
    }
  }
  return false;
}

size_t SurfaceSector::bytes() const {
  constexpr size_t kNode = sizeof(PackedKey) + 3 * sizeof(void*), kHeap = 2 * sizeof(void*);
  return sizeof(*this) + listed * sizeof(Vec3i) +
         cells_of_block.size() * (kNode + kHeap + sizeof(std::vector<Vec3i>));
}

void SurfaceSector::visitRecord(ByteWriter& out) const {
  out(is_lost, cells_of_block.size());
  for (const auto& [block, cells] : cells_of_block) {
    out(block, cells.size());
    out.array(cells, cells.size());
  }
}

void SurfaceSector::visitRecord(ByteReader& in) {
  is_lost = in.take<bool>();
  for (auto blocks = in.take<size_t>(); blocks > 0; --blocks) {
    std::vector<Vec3i>& cells = cells_of_block[in.take<PackedKey>()];
    in.array(cells, in.take<size_t>());
    listed += cells.size();
  }
}

}  // namespace dtsdf
