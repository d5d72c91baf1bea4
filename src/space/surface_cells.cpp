#include "space/surface_cells.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

bool isBefore(const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); }

void sortEachOnce(std::vector<Vec3i>& all) {
  std::sort(all.begin(), all.end(), isBefore);
  all.erase(std::unique(all.begin(), all.end()), all.end());
}

struct Triangle {
  std::array<Vec3f, 3> corner;  ///< In cells, from the cell that the block begins in.
};

/// Whether a triangle reaches into a unit cube around a middle, by the axes that separate convex
/// bodies: the triangle's normal and the products of its edges with the cube's. The cube's own axes
/// are left to who asks, by the triangle's bounds.
bool reachesInto(const Triangle& triangle, const Vec3f& middle) {
  constexpr float kHalf = 0.5f;
  const Vec3f a = triangle.corner[0] - middle, b = triangle.corner[1] - middle,
              c = triangle.corner[2] - middle;
  const auto separates = [&](const Vec3f& axis) {
    const float reach =
        kHalf * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    const float at_a = dot(axis, a), at_b = dot(axis, b), at_c = dot(axis, c);
    return minimum(minimum(at_a, at_b), at_c) > reach ||
           maximum(maximum(at_a, at_b), at_c) < -reach;
  };
  const std::array<Vec3f, 3> edges = {b - a, c - b, a - c};
  if (separates(cross(edges[0], edges[1]))) return false;
  for (const Vec3f& e : edges) {
    if (separates({0.0f, -e.z, e.y}) || separates({e.z, 0.0f, -e.x}) ||
        separates({-e.y, e.x, 0.0f})) {
      return false;
    }
  }
  return true;
}

/// First and last cell along an axis; of a triangle within a face, the one above.
std::array<int32_t, 2> cellsAlong(float a, float b, float c) {
  const int32_t first = floorToInt(minimum(minimum(a, b), c));
  return {first, std::max(first, ceilToInt(maximum(maximum(a, b), c)) - 1)};
}

template <class Visit>
void visitCells(const Triangle& t, const Visit& visit) {
  const auto& [a, b, c] = t.corner;
  const auto x = cellsAlong(a.x, b.x, c.x), y = cellsAlong(a.y, b.y, c.y),
             z = cellsAlong(a.z, b.z, c.z);
  for (int32_t k = z[0]; k <= z[1]; ++k) {
    for (int32_t j = y[0]; j <= y[1]; ++j) {
      for (int32_t i = x[0]; i <= x[1]; ++i) {
        const Vec3i cell{i, j, k};
        if (reachesInto(t, toFloat(cell) + Vec3f{0.5f, 0.5f, 0.5f})) visit(cell);
      }
    }
  }
}

}  // namespace

std::vector<Vec3i> cellsOfMesh(const BlockMesh& mesh, const CellGrid& grid) {
  // A block begins with a cell, since neither is larger than the other's multiples.
  const Vec3i first = shiftDown(firstVoxelOfBlock(mesh.key), grid.side_log2);
  const float per_voxel = 1.0f / static_cast<float>(cellSide(grid));
  std::vector<Vec3i> cells;
  for (size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    Triangle triangle;
    for (size_t corner = 0; corner < 3; ++corner) {
      triangle.corner[corner] = per_voxel * mesh.vertices[mesh.triangles[i + corner]].position;
    }
    visitCells(triangle, [&](const Vec3i& cell) { cells.push_back(first + cell); });
  }
  sortEachOnce(cells);
  return cells;
}

std::vector<Vec3i> SurfaceCells::apply(const std::vector<BlockMesh>& blocks, CellTable& cells) {
  changed_.clear();
  for (const BlockMesh& mesh : blocks) {
    const PackedKey key = packKey(mesh.key);
    std::vector<Vec3i> now = cellsOfMesh(mesh, grid_);
    const auto place = cells_of_block_.find(key);
    const std::vector<Vec3i> before =
        place == cells_of_block_.end() ? std::vector<Vec3i>() : std::move(place->second);
    // New ones first: what both have never goes.
    for (const Vec3i& cell : now) put(cell, cells);
    for (const Vec3i& cell : before) take(cell, cells);
    listed_ += now.size();
    listed_ -= before.size();
    if (!now.empty()) {
      cells_of_block_[key] = std::move(now);
    } else if (place != cells_of_block_.end()) {
      cells_of_block_.erase(place);
    }
  }
  sortEachOnce(changed_);
  for (const Vec3i& cube : changed_) cells.removeIfEmpty(cube);
  return std::move(changed_);
}

void SurfaceCells::put(const Vec3i& cell, CellTable& cells) {
  const Vec3i cube = cubeOfCell(cell);
  Counts& counts = counts_[packKey(cube)];
  if (counts.empty()) counts.assign(kCellsPerCube, 0);
  const int index = indexInCube(cell);
  if (counts[index]++ > 0) return;
  add(cells.at(cube).surface, index);
  changed_.push_back(cube);
}

void SurfaceCells::take(const Vec3i& cell, CellTable& cells) {
  const Vec3i cube = cubeOfCell(cell);
  const int index = indexInCube(cell);
  const auto counts = counts_.find(packKey(cube));
  if (--counts->second[index] > 0) return;
  remove(cells.at(cube).surface, index);
  changed_.push_back(cube);
  const auto is_zero = [](uint8_t count) { return count == 0; };
  if (std::all_of(counts->second.begin(), counts->second.end(), is_zero)) counts_.erase(counts);
}

void SurfaceCells::clear() {
  cells_of_block_.clear();
  counts_.clear();
  listed_ = 0;
}

size_t SurfaceCells::bytes() const {
  constexpr size_t kBlock = sizeof(PackedKey) + sizeof(std::vector<Vec3i>);
  return counts_.size() * (kCellsPerCube + sizeof(Counts)) + cells_of_block_.size() * kBlock +
         listed_ * sizeof(Vec3i);
}

}  // namespace dtsdf
