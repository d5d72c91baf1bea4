#include "space/distance_field.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "space/sector_update.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

/// Up to here twice a squared distance fits into 16 bits with a sign, of which there are more to a
/// vector register.
constexpr int kMostReachOf16Bits = 127;

/// 16 MiB of them, beside what stays in memory; and fewer where they reach far.
constexpr size_t kMostSectorsAtOnce = 256;
constexpr int kMostPlanesAtOnce = 1 << 15;
constexpr uint64_t kMostPlaces = uint64_t{1} << 15;  ///< In the box around them.

/// Packed keys are in the order of z first.
Vec3i turned(const Vec3i& key) { return {key.z, key.y, key.x}; }

/// From a cell of a sector to one of a cube, squared, at least.
int32_t leastBetween(const Vec3i& sector, const Vec3i& cube) {
  const auto along = [](int32_t sectors, int32_t cubes) {
    const int32_t from = cubes * kCubeSide - sectors * kSectorSide;
    return std::max({0, from - (kSectorSide - 1), -from - (kCubeSide - 1)});
  };
  const int32_t x = along(sector.x, cube.x), y = along(sector.y, cube.y),
                z = along(sector.z, cube.z);
  return x * x + y * y + z * z;
}

}  // namespace

/// A sector as it was, and what changed within reach of it; then as it is.
struct DistanceField::SectorChange {
  Vec3i key;
  SurfaceChanges near;
  std::shared_ptr<const DistanceSector> sector;
  bool is_anew = false;   ///< What it was is no help.
  bool is_guess = false;  ///< Surfaces could not be read, but may be later.
};

int squaredAt(const DistanceSectors& sectors, const Vec3i& cell) {
  const auto place = sectors.find(packKey(sectorOfCell(cell)));
  if (place == sectors.end()) return -1;
  const std::shared_ptr<const DistanceSector> sector = place->second.get();
  return sector == nullptr ? 0 : sector->squaredAt(cell);
}

/// And those that could not be taken over before, but for what has changed again.
std::vector<SurfaceCube> DistanceField::withWaiting(const std::vector<SurfaceCube>& changed) {
  std::vector<SurfaceCube> all = changed;
  for (const SurfaceCube& now : changed) waiting_.erase(packKey(now.cube));
  for (const auto& [key, surface] : waiting_) all.push_back({unpackKey(key), surface});
  waiting_.clear();
  return all;
}

/// From now on a sector that the disk lost has surfaces everywhere.
void DistanceField::fillLost(PackedKey sector, std::vector<SurfaceChange>& changes) {
  CellSector& cells = surfaces_.open(sector);
  for (int i = 0; i < kCubesPerSector; ++i) {
    cells.make(i).surface = kAllCells;
    changes.push_back({cubeOfSector(unpackKey(sector), i), kAllCells, {}});
  }
  surfaces_.forgetLost();
}

/// What is another surface than the sectors know of. They know of it from then on.
std::vector<SurfaceChange> DistanceField::takeOver(const std::vector<SurfaceCube>& changed) {
  std::vector<SurfaceChange> changes;
  for (const SurfaceCube& now : changed) {
    const PackedKey sector = packKey(sectorOfCube(now.cube));
    const int number = cubeInSector(now.cube);
    std::shared_ptr<const CellSector> known = surfaces_.find(sector);
    if (known == nullptr && surfaces_.has(sector)) {
      if (!surfaces_.isLost(sector)) {
        waiting_[packKey(now.cube)] = now.surface;
        changes.push_back({now.cube, now.surface, {}, true});
        continue;
      }
      fillLost(sector, changes);
      known = surfaces_.find(sector);
    }
    const CellMask before = known == nullptr ? CellMask{} : known->at(number).surface;
    SurfaceChange change{now.cube, {}, {}};
    for (int i = 0; i < kWordsPerCube; ++i) {
      change.added.word[i] = now.surface.word[i] & ~before.word[i];
      change.removed.word[i] = before.word[i] & ~now.surface.word[i];
    }
    if (isEmpty(change.added) && isEmpty(change.removed)) continue;
    changes.push_back(change);
    surfaces_.open(sector);
    if (!surfaces_.lost().empty()) fillLost(sector, changes);
    if (isEmpty(now.surface)) {
      surfaces_.open(sector).erase(number);
    } else {
      surfaces_.open(sector).make(number).surface = now.surface;
    }
  }
  surfaces_.close();
  return changes;
}

/// In the order of x, then y, then z.
std::vector<DistanceField::SectorChange> DistanceField::sectorsNear(
    const std::vector<SurfaceChange>& changes) const {
  struct Near {
    PackedKey order;    ///< Of a sector, by x first.
    size_t first, end;  ///< Changes that may be within reach.
  };
  std::vector<Near> all;
  const int32_t ring = ringOf(reach_), side = windowSide(reach_);
  for (size_t first = 0, end = 0; first < changes.size(); first = end) {
    const Vec3i sector = sectorOfCube(changes[first].cube);
    while (end < changes.size() && sectorOfCube(changes[end].cube) == sector) ++end;
    for (int32_t i = 0; i < side * side * side; ++i) {
      const Vec3i aside{i % side - ring, i / side % side - ring, i / (side * side) - ring};
      all.push_back({packKey(turned(sector + aside)), first, end});
    }
  }
  for (const PackedKey key : guessed_) all.push_back({packKey(turned(unpackKey(key))), 0, 0});
  std::sort(all.begin(), all.end(), [](const Near& a, const Near& b) { return a.order < b.order; });
  std::vector<SectorChange> sectors;
  for (auto next = all.begin(); next != all.end();) {
    const PackedKey order = next->order;
    SectorChange change;
    change.key = turned(unpackKey(order));
    change.is_anew = guessed_.count(packKey(change.key)) > 0;
    for (; next != all.end() && next->order == order; ++next) {
      for (size_t i = next->first; i < next->end; ++i) {
        const bool is_near = leastBetween(change.key, changes[i].cube) <= reach_ * reach_;
        if (is_near) change.near.push_back(&changes[i]);
      }
    }
    if (change.is_anew || !change.near.empty()) sectors.push_back(std::move(change));
  }
  return sectors;
}

/// How many sectors, from this one on, are worked on at once.
size_t DistanceField::countAtOnce(const std::vector<SectorChange>& sectors, size_t first) const {
  const auto most_planes = static_cast<size_t>(kMostPlanesAtOnce / planesOf(1, reach_));
  const size_t most = std::min({kMostSectorsAtOnce, most_planes, sectors.size() - first});
  BlockExtent box{sectors[first].key, sectors[first].key};
  const int32_t ring = ringOf(reach_);
  for (size_t count = 1; count < most; ++count) {
    const Vec3i& key = sectors[first + count].key;
    box = around(box, {key, key});
    if (volumeOf(grown(box, ring, ring)) > kMostPlaces) return count;
  }
  return most;
}

bool DistanceField::hasGuess(const SectorChange& change) {
  return std::any_of(change.near.begin(), change.near.end(),
                     [](const SurfaceChange* near) { return near->is_guess; });
}

/// Nobody else has its sector, and it lies in memory.
bool DistanceField::mayOverwrite(const SectorChange& change) const {
  constexpr int kHereAndInTheTable = 2;
  return pages_ == nullptr && change.sector.use_count() == kHereAndInTheTable;
}

template <class Value>
void DistanceField::updateSectors(std::vector<SectorChange>& sectors) const {
  using Update = SectorUpdate<Value>;
  parallelFor<Update>(sectors.size(), threads_, [&](size_t i, Update& update) {
    SectorChange& change = sectors[i];
    auto sector = std::make_shared<DistanceSector>();
    if (change.sector != nullptr) *sector = *change.sector;
    if (!sector->isEmpty() && (work_out_ || !mayOverwrite(change))) sector->ownSquares();
    update.run(surfaces_, change.key, reach_, change.near, *sector);
    change.sector = std::move(sector);
    change.is_guess = update.isGuess() || hasGuess(change);
  });
}

void DistanceField::update(const std::vector<SurfaceCube>& changed) {
  const std::vector<SurfaceChange> changes =
      takeOver(waiting_.empty() ? changed : withWaiting(changed));
  std::vector<SectorChange> sectors = sectorsNear(changes);
  size_t first = 0;
  try {
    for (size_t count = 0; first < sectors.size(); first += count) {
      count = countAtOnce(sectors, first);
      const auto begin = sectors.begin() + static_cast<std::ptrdiff_t>(first);
      updateSome({std::make_move_iterator(begin),
                  std::make_move_iterator(begin + static_cast<std::ptrdiff_t>(count))});
    }
  } catch (...) {  // the surfaces are taken over, so the next update has to know
    for (; first < sectors.size(); ++first) guessed_.insert(packKey(sectors[first].key));
    throw;
  }
}

/// All of them by other means than the host's threads.
bool DistanceField::workOut(std::vector<SectorChange>& sectors) {
  if (!work_out_) return false;
  std::vector<Vec3i> wanted(sectors.size());
  std::vector<SectorSquares> squares(sectors.size());
  for (size_t i = 0; i < sectors.size(); ++i) {
    if (hasGuess(sectors[i])) return false;  // the table does not have it yet
    wanted[i] = sectors[i].key;
    if (mayOverwrite(sectors[i])) squares[i] = sectors[i].sector->squared;
  }
  if (!work_out_(task_.gather(surfaces_, wanted, reach_), squares)) return false;
  for (size_t i = 0; i < sectors.size(); ++i) {
    sectors[i].is_guess = task_.isGuess(wanted[i]);
    if (sectors[i].sector != nullptr && squares[i] == sectors[i].sector->squared) continue;
    auto sector = std::make_shared<DistanceSector>();
    sector->squared = std::move(squares[i]);
    sector->most.fill(kSquaredFar);
    sectors[i].sector = std::move(sector);
  }
  return true;
}

void DistanceField::updateOnHost(std::vector<SectorChange>& sectors) {
  if (reach_ <= kMostReachOf16Bits) {
    updateSectors<int16_t>(sectors);
  } else {
    updateSectors<int32_t>(sectors);
  }
}

void DistanceField::updateSome(std::vector<SectorChange> sectors) {
  for (SectorChange& change : sectors) {
    const auto known = sectors_.find(packKey(change.key));
    if (known != sectors_.end() && !change.is_anew) change.sector = known->second.get();
  }
  if (!workOut(sectors)) updateOnHost(sectors);
  for (SectorChange& change : sectors) {
    const PackedKey key = packKey(change.key);
    if (change.is_guess) {
      guessed_.insert(key);
    } else {
      guessed_.erase(key);
    }
    if (change.sector->isEmpty()) {
      sectors_.erase(key);
    } else {
      sectors_[key] = Paged<DistanceSector>(std::move(change.sector), pages_);
    }
  }
}

void DistanceField::clear() {
  sectors_.clear();
  surfaces_.clear();
  waiting_.clear();
  guessed_.clear();
}

size_t DistanceField::bytes() const {
  constexpr size_t kNode = sizeof(DistanceSectors::value_type) + sizeof(void*);
  return sectors_.size() * (kNode + (pages_ ? 0 : kSquaresBytes + sizeof(DistanceSector))) +
         surfaces_.bytes();
}

}  // namespace dtsdf
