#include "space/distance_field.h"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "space/sector_update.h"
#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

/// Up to here twice a squared distance fits into 16 bits with a sign, of which there are more to a
/// vector register.
constexpr int kMostReachOf16Bits = 127;

/// 16 MiB of them, beside what stays in memory; and fewer where they reach far.
constexpr size_t kMostSectorsAtOnce = 256;
constexpr int kMostPlanesAtOnce = 1 << 15;

bool isInOrderOfStacks(PackedKey a, PackedKey b) {
  const Vec3i p = unpackKey(a), q = unpackKey(b);
  return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
}

}  // namespace

/// A sector as it was, and what changed within reach of it; then as it is.
struct DistanceField::SectorChange {
  PackedKey key;
  std::vector<const SurfaceChange*> changes;
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

std::vector<DistanceField::SectorChange> DistanceField::sectorsNear(
    const std::vector<SurfaceChange>& changes) {
  std::unordered_map<PackedKey, std::vector<const SurfaceChange*>> near;
  const Vec3i reach{reach_, reach_, reach_}, side{kCubeSide - 1, kCubeSide - 1, kCubeSide - 1};
  for (const SurfaceChange& change : changes) {
    const Vec3i low = sectorOfCell(firstCellOfCube(change.cube) - reach);
    const Vec3i high = sectorOfCell(firstCellOfCube(change.cube) + side + reach);
    for (int32_t z = low.z; z <= high.z; ++z) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t x = low.x; x <= high.x; ++x) near[packKey({x, y, z})].push_back(&change);
      }
    }
  }
  for (const PackedKey key : guessed_) near[key];
  std::vector<SectorChange> sectors;
  sectors.reserve(near.size());
  for (auto& [key, changes_near] : near) {
    sectors.push_back({key, std::move(changes_near), nullptr, guessed_.count(key) > 0});
  }
  return sectors;
}

template <class Value>
void DistanceField::updateSectors(std::vector<SectorChange>& sectors) const {
  using Update = SectorUpdate<Value>;
  parallelFor<Update>(sectors.size(), threads_, [&](size_t i, Update& update) {
    SectorChange& change = sectors[i];
    auto sector = change.sector == nullptr ? std::make_shared<DistanceSector>()
                                           : std::make_shared<DistanceSector>(*change.sector);
    if (!sector->isEmpty()) sector->ownSquares();
    update.run(surfaces_, unpackKey(change.key), reach_, change.changes, *sector);
    change.sector = std::move(sector);
    change.is_guess = update.isGuess();
    for (const auto* const near : change.changes) change.is_guess |= near->is_guess;
  });
}

void DistanceField::update(const std::vector<SurfaceCube>& changed) {
  const std::vector<SurfaceChange> changes =
      takeOver(waiting_.empty() ? changed : withWaiting(changed));
  std::vector<SectorChange> sectors = sectorsNear(changes);
  std::sort(sectors.begin(), sectors.end(), [](const SectorChange& a, const SectorChange& b) {
    return isInOrderOfStacks(a.key, b.key);
  });
  const size_t most = std::min(kMostSectorsAtOnce,
                               static_cast<size_t>(kMostPlanesAtOnce / planesOf(1, reach_)));
  for (size_t first = 0; first < sectors.size(); first += most) {
    const auto begin = sectors.begin() + static_cast<std::ptrdiff_t>(first);
    const size_t count = std::min(most, sectors.size() - first);
    updateSome({std::make_move_iterator(begin),
                std::make_move_iterator(begin + static_cast<std::ptrdiff_t>(count))});
  }
}

/// All of them by other means than the host's threads.
bool DistanceField::workOut(std::vector<SectorChange>& sectors) {
  if (!work_out_) return false;
  for (const SectorChange& sector : sectors) {
    for (const auto* const near : sector.changes) {
      if (near->is_guess) return false;  // only the host sees what is not in the table yet
    }
  }
  std::vector<Vec3i> wanted;
  wanted.reserve(sectors.size());
  for (const SectorChange& change : sectors) wanted.push_back(unpackKey(change.key));
  const std::vector<SectorSquares> squares = work_out_(task_.gather(surfaces_, wanted, reach_));
  if (squares.empty()) return false;
  for (size_t i = 0; i < sectors.size(); ++i) {
    auto sector = std::make_shared<DistanceSector>();
    sector->squared = squares[i];
    sector->most.fill(kSquaredFar);
    sectors[i].sector = std::move(sector);
    sectors[i].is_guess = task_.isGuess(i);
  }
  return true;
}

void DistanceField::updateOnHost(std::vector<SectorChange>& sectors) {
  for (SectorChange& change : sectors) {
    const auto known = sectors_.find(change.key);
    if (known != sectors_.end() && !change.is_anew) change.sector = known->second.get();
  }
  if (reach_ <= kMostReachOf16Bits) {
    updateSectors<int16_t>(sectors);
  } else {
    updateSectors<int32_t>(sectors);
  }
}

void DistanceField::updateSome(std::vector<SectorChange> sectors) {
  if (!workOut(sectors)) updateOnHost(sectors);
  for (SectorChange& change : sectors) {
    if (change.is_guess) {
      guessed_.insert(change.key);
    } else {
      guessed_.erase(change.key);
    }
    if (change.sector->isEmpty()) {
      sectors_.erase(change.key);
    } else {
      sectors_[change.key] = Paged<DistanceSector>(std::move(change.sector), pages_);
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
