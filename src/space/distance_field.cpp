#include "space/distance_field.h"

#include <algorithm>
#include <cstdlib>

#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

/// Tiles are large beside a reach of usual length, so that little of the window around one is
/// looked at in vain.
constexpr int kTileSideLog2 = 5;
constexpr int kTileSide = 1 << kTileSideLog2;
constexpr int kPartsAlong = kTileSide / kCubeSide;
static_assert(kPartsAlong * kPartsAlong * kPartsAlong == DistanceField::kPartsPerTile, "cubes");

/// With more to do than this the whole tile is worked out again, which takes less time then. By
/// measurement; what comes out is the same.
constexpr int kMostPartsAnew = 16;
constexpr size_t kMostAdded = 192;

constexpr uint16_t kFar = 0xffff;

/// Up to here twice a squared distance fits into 16 bits with a sign, of which there are more to a
/// vector register.
constexpr int kMostReachOf16Bits = 127;

int partOfTile(const Vec3i& cube) {
  constexpr int32_t kMask = kPartsAlong - 1;
  return (cube.x & kMask) + kPartsAlong * ((cube.y & kMask) + kPartsAlong * (cube.z & kMask));
}

Vec3i cubeOfPart(const Vec3i& tile, int part) {
  return {tile.x * kPartsAlong + part % kPartsAlong,
          tile.y * kPartsAlong + part / kPartsAlong % kPartsAlong,
          tile.z * kPartsAlong + part / (kPartsAlong * kPartsAlong)};
}

template <class Visit>
void visitCells(const CellMask& mask, const Visit& visit) {
  for (int z = 0; z < kWordsPerCube; ++z) {
    for (uint64_t word = mask.word[z]; word != 0; word &= word - 1) {
      const int bit = __builtin_ctzll(word);
      visit(Vec3i{bit % kCubeSide, bit / kCubeSide, z});
    }
  }
}

size_t countCells(const CellMask& mask) {
  size_t count = 0;
  for (const uint64_t word : mask.word) count += static_cast<size_t>(__builtin_popcountll(word));
  return count;
}

/// Works the distances in a box of cells out from the surfaces around. The buffers are kept from
/// box to box.
template <int kSide, class Value>
class BoxWork {
 public:
  /// @return whether any cell of the box is within reach of a surface.
  bool run(const CellTable& cells, const Vec3i& first, int reach) {
    begin(first, reach);
    findRows(cells);
    if (rows_.empty()) {
      squared_.fill(kFar);
      return false;
    }
    combineRows();
    return combinePlanes();
  }

  /// Squared distances, x fastest.
  const uint16_t* squared() const { return squared_.data(); }

 private:
  using Line = std::array<Value, kSide>;  ///< A value for each x of the box.

  struct Plane {
    int32_t z;  ///< In the window.
    std::array<Line, kSide> line;
  };

  void begin(const Vec3i& first, int reach) {
    first_ = first - Vec3i{reach, reach, reach};
    if (reach != reach_) {
      reach_ = reach;
      far_ = static_cast<Value>(reach * reach + 1);
      window_ = kSide + 2 * reach;
      squares_.resize(static_cast<size_t>(2 * (kSide + reach)));
      for (int i = 0; i < static_cast<int>(squares_.size()); ++i) {
        const int aside = i - (kSide + reach);
        squares_[static_cast<size_t>(i)] = static_cast<Value>(aside * aside);
      }
    }
    row_of_.assign(static_cast<size_t>(window_) * static_cast<size_t>(window_), -1);
    rows_.clear();
  }

  void findRows(const CellTable& cells) {
    const Vec3i low = cubeOfCell(first_);
    const Vec3i high = cubeOfCell(first_ + Vec3i{window_ - 1, window_ - 1, window_ - 1});
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) addSurfaces(cells.find({x, y, z}));
      }
    }
  }

  void addSurfaces(const CellCube* cube) {
    if (cube == nullptr) return;
    constexpr uint64_t kRow = (1u << kCubeSide) - 1;
    const Vec3i corner = firstCellOfCube(cube->key) - first_;
    for (int z = 0; z < kCubeSide; ++z) {
      if (cube->surface.word[z] == 0 || !isInWindow(corner.z + z)) continue;
      for (int y = 0; y < kCubeSide; ++y) {
        const uint64_t row = cube->surface.word[z] >> (kCubeSide * y) & kRow;
        if (row != 0 && isInWindow(corner.y + y)) addRow(row, corner + Vec3i{0, y, z});
      }
    }
  }

  bool isInWindow(int32_t at) const { return at >= 0 && at < window_; }

  /// Takes the surfaces in a row of a cube over into the row of the window.
  void addRow(uint64_t surfaces, const Vec3i& at) {
    int32_t& number = row_of_[static_cast<size_t>(at.y) + static_cast<size_t>(at.z) *
                                                              static_cast<size_t>(window_)];
    if (number < 0) {
      number = static_cast<int32_t>(rows_.size());
      rows_.emplace_back();
      rows_.back().fill(far_);
    }
    Line& line = rows_[static_cast<size_t>(number)];
    for (; surfaces != 0; surfaces &= surfaces - 1) {
      const int32_t x = at.x + __builtin_ctzll(surfaces);
      if (!isInWindow(x)) continue;
      const Value* const squares = squares_.data() + (kSide + reach_) - (x - reach_);
      for (int i = 0; i < kSide; ++i) line[i] = std::min(line[i], squares[i]);
    }
  }

  /// Minima over y, for each plane of the window that has surfaces.
  void combineRows() {
    planes_.clear();
    for (int32_t z = 0; z < window_; ++z) {
      const int32_t* const rows = row_of_.data() + static_cast<size_t>(z) *
                                                       static_cast<size_t>(window_);
      bool is_any = false;
      for (int32_t y = 0; y < window_; ++y) {
        if (rows[y] < 0) continue;
        if (!is_any) beginPlane(z);
        is_any = true;
        const Line& row = rows_[static_cast<size_t>(rows[y])];
        for (int i = 0; i < kSide; ++i) lower(planes_.back().line[i], row, i + reach_ - y);
      }
    }
  }

  void beginPlane(int32_t z) {
    planes_.emplace_back();
    planes_.back().z = z;
    for (Line& line : planes_.back().line) line.fill(far_);
  }

  /// Minima over z.
  bool combinePlanes() {
    bool is_any_near = false;
    uint16_t* next = squared_.data();
    for (int32_t z = 0; z < kSide; ++z) {
      for (int32_t y = 0; y < kSide; ++y) {
        Line line;
        line.fill(far_);
        for (const Plane& plane : planes_) lower(line, plane.line[y], z + reach_ - plane.z);
        for (const Value value : line) {
          is_any_near = is_any_near || value < far_;
          *next++ = value < far_ ? static_cast<uint16_t>(value) : kFar;
        }
      }
    }
    return is_any_near;
  }

  /// Takes another line's values over where they are less, from so many cells aside.
  void lower(Line& line, const Line& other, int32_t aside) const {
    if (std::abs(aside) > reach_) return;
    const auto added = static_cast<Value>(aside * aside);
    for (int i = 0; i < kSide; ++i) {
      line[i] = std::min(line[i], static_cast<Value>(other[i] + added));
    }
  }

  int reach_ = 0;
  Value far_ = 0;  ///< Beyond all that is within reach.
  int32_t window_ = 0;
  Vec3i first_{};              ///< Of the window, which reaches beyond the box on all sides.
  std::vector<Value> squares_;
  std::vector<int32_t> row_of_;  ///< By y and z of the window; -1: there is none.
  std::vector<Line> rows_;       ///< Lines along x that have surfaces: squared distances to them.
  std::vector<Plane> planes_;
  std::array<uint16_t, kSide * kSide * kSide> squared_;
};

/// A part of a tile, while single surfaces come and go.
class PartWork {
 public:
  PartWork(uint16_t* squared, uint16_t most, int reach)
      : squared_(squared), bound_(std::min<int32_t>(most, reach * reach + 1)) {}

  /// Whether some cell has no surface nearer than that one; `at` counts from the part's first cell.
  bool isNearestTo(const Vec3i& at) const {
    bool is_any = false;
    visitRows(at, bound_ + 1, [&](const uint16_t* row, int32_t aside, const int32_t* along) {
      for (int x = 0; x < kCubeSide; ++x) is_any |= row[x] == aside + along[x];
      return !is_any;
    });
    return is_any;
  }

  /// Takes a surface over.
  void lower(const Vec3i& at) const {
    const int32_t bound = bound_;
    visitRows(at, bound, [&](uint16_t* row, int32_t aside, const int32_t* along) {
      for (int x = 0; x < kCubeSide; ++x) {
        const int32_t squared = aside + along[x], known = row[x];
        row[x] = static_cast<uint16_t>(squared < bound && squared < known ? squared : known);
      }
      return true;
    });
  }

 private:
  static int32_t beyond(int32_t at) {
    return at < 0 ? -at : at < kCubeSide ? 0 : at - (kCubeSide - 1);
  }

  /// Those that are nearer to a surface than a bound, until `visit` returns false.
  template <class Visit>
  void visitRows(const Vec3i& at, int32_t bound, const Visit& visit) const {
    const int32_t x_beyond = beyond(at.x), y_beyond = beyond(at.y), z_beyond = beyond(at.z);
    if (x_beyond * x_beyond + y_beyond * y_beyond + z_beyond * z_beyond >= bound) return;
    int32_t along[kCubeSide];
    for (int x = 0; x < kCubeSide; ++x) along[x] = (x - at.x) * (x - at.x);
    for (int z = 0; z < kCubeSide; ++z) {
      for (int y = 0; y < kCubeSide; ++y) {
        const int32_t aside = (y - at.y) * (y - at.y) + (z - at.z) * (z - at.z);
        if (aside + x_beyond * x_beyond >= bound) continue;
        if (!visit(squared_ + cellIndex(0, y, z), aside, along)) return;
      }
    }
  }

  uint16_t* const squared_;
  const int32_t bound_;  ///< A surface tells nothing where it is not nearer than this.
};

/// Brings tiles up to date, one at a time.
template <class Value>
class TileWork {
 public:
  void run(const CellTable& cells, const Vec3i& key, int reach,
           const std::vector<const DistanceField::CubeChange*>& changes,
           DistanceField::Tile& tile) {
    reach_ = reach;
    if (tile.squared.empty() || countAdded(changes) > kMostAdded) {
      return workOut(cells, key, tile);
    }
    uint64_t anew = 0;
    for (int part = 0; part < DistanceField::kPartsPerTile; ++part) {
      if (hasLostNearest(key, part, changes, tile)) anew |= uint64_t{1} << part;
    }
    if (__builtin_popcountll(anew) > kMostPartsAnew) return workOut(cells, key, tile);
    for (int part = 0; part < DistanceField::kPartsPerTile; ++part) {
      if ((anew >> part & 1u) != 0) {
        part_.run(cells, firstCellOfCube(cubeOfPart(key, part)), reach_);
        std::copy_n(part_.squared(), kCellsPerCube, cellsOf(tile, part));
        noteMost(part, tile);
      } else {
        takeAdded(key, part, changes, tile);
      }
    }
    const auto is_far = [](uint16_t least) { return least == kFar; };
    if (std::all_of(tile.squared.begin(), tile.squared.end(), is_far)) tile.squared.clear();
  }

 private:
  using Changes = std::vector<const DistanceField::CubeChange*>;

  static size_t countAdded(const Changes& changes) {
    size_t count = 0;
    for (const auto* const change : changes) count += countCells(change->added);
    return count;
  }

  static uint16_t* cellsOf(DistanceField::Tile& tile, int part) {
    return tile.squared.data() + static_cast<size_t>(part) * kCellsPerCube;
  }

  static void noteMost(int part, DistanceField::Tile& tile) {
    const uint16_t* const cells = cellsOf(tile, part);
    tile.most[static_cast<size_t>(part)] = *std::max_element(cells, cells + kCellsPerCube);
  }

  /// From a cell of one cube to one of another, squared, at least.
  static int32_t leastBetween(const Vec3i& a, const Vec3i& b) {
    const auto along = [](int32_t cubes) {
      return cubes == 0 ? 0 : std::abs(cubes) * kCubeSide - (kCubeSide - 1);
    };
    const int32_t x = along(a.x - b.x), y = along(a.y - b.y), z = along(a.z - b.z);
    return x * x + y * y + z * z;
  }

  /// Calls visit(work, mask) with the changes that may matter to a part.
  template <class Visit>
  void visitNear(const Vec3i& key, int part, const Changes& changes, DistanceField::Tile& tile,
                 const Visit& visit) const {
    const Vec3i cube = cubeOfPart(key, part);
    const uint16_t most = tile.most[static_cast<size_t>(part)];
    const PartWork work(cellsOf(tile, part), most, reach_);
    for (const auto* const change : changes) {
      if (leastBetween(cube, change->cube) > std::min<int32_t>(most, reach_ * reach_)) continue;
      visit(work, *change, firstCellOfCube(change->cube) - firstCellOfCube(cube));
    }
  }

  bool hasLostNearest(const Vec3i& key, int part, const Changes& changes,
                      DistanceField::Tile& tile) const {
    bool has_lost = false;
    visitNear(key, part, changes, tile, [&](const PartWork& work, const auto& change, Vec3i from) {
      visitCells(change.removed, [&](const Vec3i& cell) {
        has_lost = has_lost || work.isNearestTo(from + cell);
      });
    });
    return has_lost;
  }

  void takeAdded(const Vec3i& key, int part, const Changes& changes, DistanceField::Tile& tile) {
    bool is_any = false;
    visitNear(key, part, changes, tile, [&](const PartWork& work, const auto& change, Vec3i from) {
      visitCells(change.added, [&](const Vec3i& cell) {
        work.lower(from + cell);
        is_any = true;
      });
    });
    if (is_any) noteMost(part, tile);
  }

  /// The whole tile.
  void workOut(const CellTable& cells, const Vec3i& key, DistanceField::Tile& tile) {
    tile.squared.clear();
    if (!whole_.run(cells, firstCellOfCube(cubeOfPart(key, 0)), reach_)) return;
    tile.squared.resize(static_cast<size_t>(DistanceField::kPartsPerTile) * kCellsPerCube);
    const uint16_t* row = whole_.squared();
    for (int32_t z = 0; z < kTileSide; ++z) {
      for (int32_t y = 0; y < kTileSide; ++y) {
        for (int32_t x = 0; x < kTileSide; x += kCubeSide, row += kCubeSide) {
          const Vec3i at{x, y, z};
          std::copy_n(row, kCubeSide, cellsOf(tile, partOfTile(cubeOfCell(at))) + indexInCube(at));
        }
      }
    }
    for (int part = 0; part < DistanceField::kPartsPerTile; ++part) noteMost(part, tile);
  }

  int reach_ = 0;
  BoxWork<kTileSide, Value> whole_;
  BoxWork<kCubeSide, Value> part_;
};

}  // namespace

/// A tile, and what changed within reach of it.
struct DistanceField::TileChange {
  PackedKey key;
  Tile* tile;
  std::vector<const CubeChange*> changes;
};

/// What is another surface than the tiles know of. They know of it from then on.
std::vector<DistanceField::CubeChange> DistanceField::takeChanges(const CellTable& cells,
                                                                  const CubeSet& changed) {
  std::vector<CubeChange> changes;
  for (const PackedKey key : changed) {
    const CellCube* const cube = cells.find(unpackKey(key));
    const CellMask now = cube == nullptr ? CellMask{} : cube->surface;
    const auto known = surfaces_.find(key);
    const CellMask before = known == surfaces_.end() ? CellMask{} : known->second;
    CubeChange change{unpackKey(key), {}, {}};
    for (int i = 0; i < kWordsPerCube; ++i) {
      change.added.word[i] = now.word[i] & ~before.word[i];
      change.removed.word[i] = before.word[i] & ~now.word[i];
    }
    if (isEmpty(change.added) && isEmpty(change.removed)) continue;
    changes.push_back(change);
    if (isEmpty(now)) {
      surfaces_.erase(known);
    } else {
      surfaces_[key] = now;
    }
  }
  return changes;
}

std::vector<DistanceField::TileChange> DistanceField::tilesNear(
    const std::vector<CubeChange>& changes) {
  std::unordered_map<PackedKey, std::vector<const CubeChange*>> near;
  const Vec3i reach{reach_, reach_, reach_}, side{kCubeSide - 1, kCubeSide - 1, kCubeSide - 1};
  for (const CubeChange& change : changes) {
    const Vec3i low = shiftDown(firstCellOfCube(change.cube) - reach, kTileSideLog2);
    const Vec3i high = shiftDown(firstCellOfCube(change.cube) + side + reach, kTileSideLog2);
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) near[packKey({x, y, z})].push_back(&change);
      }
    }
  }
  std::vector<TileChange> tiles;
  tiles.reserve(near.size());
  for (auto& [key, changes_near] : near) {
    tiles.push_back({key, &tiles_[key], std::move(changes_near)});
  }
  return tiles;
}

template <class Value>
void DistanceField::updateTiles(const CellTable& cells, const std::vector<TileChange>& tiles) {
  parallelFor<TileWork<Value>>(tiles.size(), threads_, [&](size_t i, TileWork<Value>& work) {
    work.run(cells, unpackKey(tiles[i].key), reach_, tiles[i].changes, *tiles[i].tile);
  });
}

void DistanceField::update(const CellTable& cells, const CubeSet& changed) {
  const std::vector<CubeChange> changes = takeChanges(cells, changed);
  const std::vector<TileChange> tiles = tilesNear(changes);
  if (reach_ <= kMostReachOf16Bits) {
    updateTiles<int16_t>(cells, tiles);
  } else {
    updateTiles<int32_t>(cells, tiles);
  }
  for (const TileChange& change : tiles) {
    if (change.tile->squared.empty()) tiles_.erase(change.key);
  }
}

int DistanceField::squaredAt(const Vec3i& cell) const {
  const auto place = tiles_.find(packKey(shiftDown(cell, kTileSideLog2)));
  if (place == tiles_.end()) return -1;
  const auto part = static_cast<size_t>(partOfTile(cubeOfCell(cell)));
  const uint16_t squared = place->second.squared[part * kCellsPerCube +
                                                 static_cast<size_t>(indexInCube(cell))];
  return squared == kFar ? -1 : squared;
}

void DistanceField::clear() {
  tiles_.clear();
  surfaces_.clear();
}

size_t DistanceField::bytes() const {
  constexpr size_t kTile = static_cast<size_t>(kPartsPerTile) * kCellsPerCube * sizeof(uint16_t);
  return tiles_.size() * (kTile + sizeof(PackedKey) + sizeof(Tile)) +
         surfaces_.size() * (sizeof(PackedKey) + sizeof(CellMask));
}

}  // namespace dtsdf
