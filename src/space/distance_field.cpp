#include "space/distance_field.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

/// Cells along the edge of a tile: large beside a reach of usual length, so that little of the
/// window around it is looked at in vain.
constexpr int kTileSideLog2 = 5;
constexpr int kTileSide = 1 << kTileSideLog2;

constexpr uint16_t kFar = 0xffff;
constexpr uint32_t kVeryFar = 1u << 30;

size_t indexInTile(const Vec3i& cell) {
  const auto along = [](int32_t i) { return static_cast<size_t>(i & (kTileSide - 1)); };
  return along(cell.x) + kTileSide * (along(cell.y) + kTileSide * along(cell.z));
}

/// Works one tile out, in a window that reaches beyond it on all sides. The buffers are kept from
/// tile to tile.
class TileWork {
 public:
  /// Empty if no cell of the tile is within reach of a surface.
  std::vector<uint16_t> run(const CellTable& cells, const Vec3i& tile, int reach) {
    reach_ = reach;
    window_ = kTileSide + 2 * reach;
    first_ = {tile.x * kTileSide - reach, tile.y * kTileSide - reach, tile.z * kTileSide - reach};
    row_of_.assign(static_cast<size_t>(window_) * window_, -1);
    rows_.clear();
    findRows(cells);
    if (rows_.empty()) return {};
    combineRows();
    return combinePlanes();
  }

 private:
  using Line = std::array<uint32_t, kTileSide>;  ///< A value for each x of the tile.

  /// A line along x of the window that has surfaces: squared distances to the nearest of them.
  struct Row {
    int32_t y, z;  ///< In the window.
    Line squared;
  };

  void findRows(const CellTable& cells) {
    const Vec3i low = cubeOfCell(first_);
    const Vec3i high = cubeOfCell(first_ + Vec3i{window_ - 1, window_ - 1, window_ - 1});
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) addSurfaces(cells.find({x, y, z}));
      }
    }
    std::sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
      return a.z != b.z ? a.z < b.z : a.y < b.y;
    });
  }

  void addSurfaces(const CellCube* cube) {
    if (cube == nullptr) return;
    const Vec3i corner = firstCellOfCube(cube->key) - first_;
    for (int z = 0; z < kCubeSide; ++z) {
      for (uint64_t word = cube->surface.word[z]; word != 0; word &= word - 1) {
        const int bit = __builtin_ctzll(word);
        addSurface(corner + Vec3i{bit % kCubeSide, bit / kCubeSide, z});
      }
    }
  }

  void addSurface(const Vec3i& at) {
    const auto isInWindow = [&](int32_t a) { return a >= 0 && a < window_; };
    if (!isInWindow(at.x) || !isInWindow(at.y) || !isInWindow(at.z)) return;
    int32_t& row = row_of_[static_cast<size_t>(at.y) + static_cast<size_t>(at.z) * window_];
    if (row < 0) {
      row = static_cast<int32_t>(rows_.size());
      rows_.push_back({at.y, at.z, {}});
      rows_.back().squared.fill(kVeryFar);
    }
    Line& squared = rows_[row].squared;
    const int32_t from = at.x - reach_;
    for (int32_t x = 0; x < kTileSide; ++x) {
      squared[x] = std::min(squared[x], static_cast<uint32_t>((x - from) * (x - from)));
    }
  }

  /// Minima over y, for each plane of the window that has surfaces.
  void combineRows() {
    planes_.clear();
    for (size_t begin = 0; begin < rows_.size();) {
      size_t end = begin;
      while (end < rows_.size() && rows_[end].z == rows_[begin].z) ++end;
      planes_.push_back({rows_[begin].z, {}});
      for (int32_t y = 0; y < kTileSide; ++y) {
        Line& line = planes_.back().line[y];
        line.fill(kVeryFar);
        for (size_t i = begin; i < end; ++i) lower(line, rows_[i].squared, y + reach_ - rows_[i].y);
      }
      begin = end;
    }
  }

  /// Minima over z.
  std::vector<uint16_t> combinePlanes() const {
    std::vector<uint16_t> squared(static_cast<size_t>(kTileSide) * kTileSide * kTileSide);
    const auto most = static_cast<uint32_t>(reach_ * reach_);
    bool is_any_near = false;
    uint16_t* next = squared.data();
    for (int32_t z = 0; z < kTileSide; ++z) {
      for (int32_t y = 0; y < kTileSide; ++y) {
        Line line;
        line.fill(kVeryFar);
        for (const Plane& plane : planes_) lower(line, plane.line[y], z + reach_ - plane.z);
        for (const uint32_t value : line) {
          is_any_near = is_any_near || value <= most;
          *next++ = value <= most ? static_cast<uint16_t>(value) : kFar;
        }
      }
    }
    return is_any_near ? squared : std::vector<uint16_t>();
  }

  /// Takes another line's values over where they are less, from so many cells aside.
  void lower(Line& line, const Line& other, int32_t aside) const {
    if (std::abs(aside) > reach_) return;
    const auto added = static_cast<uint32_t>(aside * aside);
    for (int32_t x = 0; x < kTileSide; ++x) line[x] = std::min(line[x], other[x] + added);
  }

  struct Plane {
    int32_t z;
    std::array<Line, kTileSide> line;
  };

  int reach_ = 0;
  int32_t window_ = 0;
  Vec3i first_{};
  std::vector<int32_t> row_of_;  ///< By y and z of the window; -1: there is none.
  std::vector<Row> rows_;
  std::vector<Plane> planes_;
};

}  // namespace

std::vector<PackedKey> DistanceField::tilesNear(const CubeSet& cubes) const {
  std::unordered_set<PackedKey> near;
  const Vec3i reach{reach_, reach_, reach_}, side{kCubeSide - 1, kCubeSide - 1, kCubeSide - 1};
  for (const PackedKey key : cubes) {
    const Vec3i cube = unpackKey(key);
    const Vec3i low = shiftDown(firstCellOfCube(cube) - reach, kTileSideLog2);
    const Vec3i high = shiftDown(firstCellOfCube(cube) + side + reach, kTileSideLog2);
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) near.insert(packKey({x, y, z}));
      }
    }
  }
  std::vector<PackedKey> tiles(near.begin(), near.end());
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

void DistanceField::update(const CellTable& cells, const CubeSet& changed) {
  const std::vector<PackedKey> tiles = tilesNear(changed);
  std::vector<Tile> found(tiles.size());
  parallelFor<TileWork>(tiles.size(), threads_, [&](size_t i, TileWork& work) {
    found[i] = work.run(cells, unpackKey(tiles[i]), reach_);
  });
  for (size_t i = 0; i < tiles.size(); ++i) {
    if (found[i].empty()) {
      tiles_.erase(tiles[i]);
    } else {
      tiles_[tiles[i]] = std::move(found[i]);
    }
  }
}

int DistanceField::squaredAt(const Vec3i& cell) const {
  const auto tile = tiles_.find(packKey(shiftDown(cell, kTileSideLog2)));
  if (tile == tiles_.end()) return -1;
  const uint16_t squared = tile->second[indexInTile(cell)];
  return squared == kFar ? -1 : squared;
}

size_t DistanceField::bytes() const {
  return tiles_.size() * (kTileSide * kTileSide * kTileSide * sizeof(uint16_t) + sizeof(Tile));
}

}  // namespace dtsdf
