#include "space/distance_field.h"

#include <utility>

#include "space/sector_update.h"
#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

/// Up to here twice a squared distance fits into 16 bits with a sign, of which there are more to a
/// vector register.
constexpr int kMostReachOf16Bits = 127;

}  // namespace

/// A sector as it was, and what changed within reach of it; then as it is.
struct DistanceField::SectorChange {
  PackedKey key;
  std::vector<const SurfaceChange*> changes;
  std::shared_ptr<const DistanceSector> sector;
};

int squaredAt(const DistanceSectors& sectors, const Vec3i& cell) {
  const auto place = sectors.find(packKey(sectorOfCell(cell)));
  return place == sectors.end() ? -1 : place->second->squaredAt(cell);
}

/// What is another surface than the sectors know of. They know of it from then on.
std::vector<SurfaceChange> DistanceField::takeOver(const std::vector<SurfaceCube>& changed) {
  std::vector<SurfaceChange> changes;
  for (const SurfaceCube& now : changed) {
    const auto known = surfaces_.find(packKey(now.cube));
    const CellMask before = known == surfaces_.end() ? CellMask{} : known->second;
    SurfaceChange change{now.cube, {}, {}};
    for (int i = 0; i < kWordsPerCube; ++i) {
      change.added.word[i] = now.surface.word[i] & ~before.word[i];
      change.removed.word[i] = before.word[i] & ~now.surface.word[i];
    }
    if (isEmpty(change.added) && isEmpty(change.removed)) continue;
    changes.push_back(change);
    if (isEmpty(now.surface)) {
      surfaces_.erase(known);
    } else {
      surfaces_[packKey(now.cube)] = now.surface;
    }
  }
  return changes;
}

std::vector<DistanceField::SectorChange> DistanceField::sectorsNear(
    const std::vector<SurfaceChange>& changes) const {
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
  std::vector<SectorChange> sectors;
  sectors.reserve(near.size());
  for (auto& [key, changes_near] : near) {
    const auto known = sectors_.find(key);
    sectors.push_back(
        {key, std::move(changes_near), known == sectors_.end() ? nullptr : known->second});
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
    update.run(surfaces_, unpackKey(change.key), reach_, change.changes, *sector);
    change.sector = std::move(sector);
  });
}

void DistanceField::update(const std::vector<SurfaceCube>& changed) {
  const std::vector<SurfaceChange> changes = takeOver(changed);
  std::vector<SectorChange> sectors = sectorsNear(changes);
  if (reach_ <= kMostReachOf16Bits) {
    updateSectors<int16_t>(sectors);
  } else {
    updateSectors<int32_t>(sectors);
  }
  for (SectorChange& change : sectors) {
    if (change.sector->squared.empty()) {
      sectors_.erase(change.key);
    } else {
      sectors_[change.key] = std::move(change.sector);
    }
  }
}

void DistanceField::clear() {
  sectors_.clear();
  surfaces_.clear();
}

size_t DistanceField::bytes() const {
  constexpr size_t kSector =
      static_cast<size_t>(kCubesPerSector) * kCellsPerCube * sizeof(uint16_t);
  return sectors_.size() * (kSector + sizeof(PackedKey) + sizeof(DistanceSector)) +
         surfaces_.size() * (sizeof(PackedKey) + sizeof(CellMask));
}

}  // namespace dtsdf
