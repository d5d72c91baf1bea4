#include "space/distance_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "space/sector_distances.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

/// Up to this maximum distance in cells, twice a squared distance fits into a signed 16-bit
/// integer. 16-bit integers are faster, because a vector register holds more of them.
constexpr int kMaxReachOf16Bits = 127;

/// Maximum number of sectors (see cell_sector.h) computed at once: their new values take 16 MiB, in
/// addition to the old values. If the maximum distance is large, kMaxPlanesAtOnce allows fewer.
constexpr size_t kMaxSectorsAtOnce = 256;
constexpr int kMaxPlanesAtOnce = 1 << 15;
/// Maximum number of sectors in the box around the sectors computed at once. The box is extended by
/// the maximum distance.
constexpr uint64_t kMaxPlaces = uint64_t{1} << 15;

/// Approximate number of changed cubes that are processed at once, to limit memory.
constexpr int kMaxCubesAtOnce = 1 << 16;

/// Swaps x and z, because packed keys sort by z first.
Vec3i swapXZ(const Vec3i& key) { return {key.z, key.y, key.x}; }

/// The smallest squared distance between a cell of a sector and a cell of a cube.
int32_t minBetween(const Vec3i& sector, const Vec3i& cube) {
  const auto along = [](int32_t sectors, int32_t cubes) {
    const int32_t from = cubes * kCubeSide - sectors * kSectorSide;
    return std::max({0, from - (kSectorSide - 1), -from - (kCubeSide - 1)});
  };
  const int32_t x = along(sector.x, cube.x), y = along(sector.y, cube.y),
                z = along(sector.z, cube.z);
  return x * x + y * y + z * z;
}

/// The largest coordinate that a cell can have.
constexpr double kMaxCell = static_cast<double>(kMaxBlockCoordinate) * kCubeSide;

double between(double low, double high, double share) { return low + share * (high - low); }

/// Squared distances of the cells `low` + (i & 1, i >> 1 & 1, i >> 2), which usually lie in one
/// sector.
void findSquares(const DistanceSectors& sectors, const Vec3i& low, int (&squared)[8]) {
  const PackedKey key = packKey(sectorOfCell(low));
  const auto place = sectors.find(key);
  const auto sector = place == sectors.end() ? nullptr : place->second.get();
  const bool is_in_one = sector != nullptr && packKey(sectorOfCell(low + Vec3i{1, 1, 1})) == key;
  for (int i = 0; i < 8; ++i) {
    const Vec3i cell = low + Vec3i{i & 1, i >> 1 & 1, i >> 2};
    squared[i] = is_in_one ? sector->squaredAt(cell) : squaredAt(sectors, cell);
  }
}

}  // namespace

int squaredAt(const DistanceSectors& sectors, const Vec3i& cell) {
  const auto place = sectors.find(packKey(sectorOfCell(cell)));
  if (place == sectors.end()) return -1;
  const std::shared_ptr<const DistanceSector> sector = place->second.get();
  return sector == nullptr ? 0 : sector->squaredAt(cell);
}

/// The sectors within the maximum distance of the changed cubes before `end`, sorted by x, then y,
/// then z.
std::vector<Vec3i> DistanceField::sectorsNear(CubeSet::const_iterator end) const {
  const int32_t ring = sectorsInReach(reach_), side = windowSide(reach_);
  std::vector<PackedKey> order;  // keys with x and z swapped
  for (auto sector_entry = changed_.begin(); sector_entry != end; ++sector_entry) {
    visitCubes(*sector_entry, [&](const Vec3i& cube, int) {
      for (int32_t i = 0; i < side * side * side; ++i) {
        const Vec3i aside{i % side - ring, i / side % side - ring, i / (side * side) - ring};
        const Vec3i sector = sectorOfCube(cube) + aside;
        if (minBetween(sector, cube) <= reach_ * reach_) order.push_back(packKey(swapXZ(sector)));
      }
    });
  }
  std::sort(order.begin(), order.end());
  order.erase(std::unique(order.begin(), order.end()), order.end());
  std::vector<Vec3i> keys;
  for (const PackedKey key : order) keys.push_back(swapXZ(unpackKey(key)));
  return keys;
}

/// How many sectors, starting at `first`, are computed at once.
size_t DistanceField::batchSize(const std::vector<Vec3i>& keys, size_t first) const {
  const auto max_planes = static_cast<size_t>(kMaxPlanesAtOnce / planesOf(1, reach_));
  const size_t most = std::min({kMaxSectorsAtOnce, max_planes, keys.size() - first});
  BlockExtent box{keys[first], keys[first]};
  const int32_t ring = sectorsInReach(reach_);
  for (size_t count = 1; count < most; ++count) {
    const Vec3i& key = keys[first + count];
    box = around(box, {key, key});
    if (volumeOf(grown(box, ring, ring)) > kMaxPlaces) return count;
  }
  return most;
}

/// Whether a sector is in memory and has no other users.
bool DistanceField::mayOverwrite(const std::shared_ptr<const DistanceSector>& sector) const {
  constexpr int kOwnersIfUnshared = 2;
  return pages_ == nullptr && sector.use_count() == kOwnersIfUnshared;
}

/// After an exception, the next call applies the remaining changes.
void DistanceField::update(const CellSectors& cells) {
  while (!changed_.empty()) {
    auto end = changed_.begin();
    for (int cubes = 0; end != changed_.end() && cubes < kMaxCubesAtOnce; ++end) {
      cubes += __builtin_popcountll(end->second);
    }
    const std::vector<Vec3i> keys = sectorsNear(end);
    for (size_t first = 0, count = 0; first < keys.size(); first += count) {
      count = batchSize(keys, first);
      const auto begin = keys.begin() + static_cast<std::ptrdiff_t>(first);
      updateSome(cells, {begin, begin + static_cast<std::ptrdiff_t>(count)});
    }
    changed_.erase(changed_.begin(), end);
  }
}

template <class Value>
void DistanceField::computeOnHost(const CellSectors& cells, const std::vector<Vec3i>& keys,
                                  std::vector<SectorSquares>& squares) const {
  parallelFor<SectorDistances<Value>>(keys.size(), threads_,
                                      [&](size_t i, SectorDistances<Value>& distances) {
                                        squares[i] = distances.run(cells, keys[i], reach_);
                                      });
}

void DistanceField::updateSome(const CellSectors& cells, const std::vector<Vec3i>& keys) {
  std::vector<std::shared_ptr<const DistanceSector>> before(keys.size());
  std::vector<SectorSquares> squares(keys.size());
  for (size_t i = 0; i < keys.size(); ++i) {
    const auto known = sectors_.find(packKey(keys[i]));
    if (known != sectors_.end()) before[i] = known->second.get();
    if (mayOverwrite(before[i])) squares[i] = before[i]->squared;
  }
  if (!backend_work_ || !backend_work_(task_.gather(cells, keys, reach_), squares)) {
    reach_ <= kMaxReachOf16Bits ? computeOnHost<int16_t>(cells, keys, squares)
                                : computeOnHost<int32_t>(cells, keys, squares);
  }
  for (size_t i = 0; i < keys.size(); ++i) {
    if (squares[i] == nullptr) {
      sectors_.erase(packKey(keys[i]));
    } else if (before[i] == nullptr || before[i]->squared != squares[i]) {
      const auto sector = std::make_shared<DistanceSector>();
      sector->squared = std::move(squares[i]);
      sectors_[packKey(keys[i])] = Paged<DistanceSector>(sector, pages_);
    }
  }
}

void DistanceField::clear() {
  sectors_.clear();
  changed_.clear();
}

size_t DistanceField::bytes() const {
  constexpr size_t kNode = sizeof(DistanceSectors::value_type) + sizeof(void*);
  return sectors_.size() * (kNode + (pages_ ? 0 : kSquaresBytes + sizeof(DistanceSector))) +
         changed_.size() * kCubeSetNodeBytes;
}

SpaceDistance interpolatedDistance(const KnownSpace& space, const DistanceSectors& sectors,
                                   int reach, const Eigen::Vector3d& p_W) {
  const double cell_m = space.cellSize_m(), max_m = reach * cell_m;
  SpaceDistance result;
  result.distance_m = static_cast<float>(-max_m);
  const Eigen::Vector3d in_cells = p_W / cell_m;
  if (!in_cells.allFinite() || in_cells.cwiseAbs().maxCoeff() > kMaxCell - reach - 1.0) {
    return result;
  }
  const Eigen::Vector3d middles = in_cells - Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d floor = middles.array().floor(), share = middles - floor;
  int squared[8];
  findSquares(sectors,
              {static_cast<int32_t>(floor.x()), static_cast<int32_t>(floor.y()),
               static_cast<int32_t>(floor.z())},
              squared);
  double d[2][2][2];
  bool is_limited = true;
  for (int i = 0; i < 8; ++i) {
    const double cells = squared[i] < 0 ? reach : std::sqrt(static_cast<double>(squared[i]));
    const double distance_m = cells * cell_m;
    d[i >> 2][i >> 1 & 1][i & 1] = distance_m;
    is_limited = is_limited && distance_m >= max_m;
  }
  const auto alongX = [&](int z, int y) { return between(d[z][y][0], d[z][y][1], share[0]); };
  const auto slopeX = [&](int z, int y) { return d[z][y][1] - d[z][y][0]; };
  const double y0 = between(alongX(0, 0), alongX(0, 1), share[1]),
               y1 = between(alongX(1, 0), alongX(1, 1), share[1]);
  result.known = space.stateOf(space.cellAt(p_W)) != CellState::kUnknown;
  const double sign = result.known ? 1.0 : -1.0, per_m = is_limited ? 0.0 : sign / cell_m;
  result.distance_m = static_cast<float>(sign * between(y0, y1, share[2]));
  result.gradient = {
      static_cast<float>(per_m * between(between(slopeX(0, 0), slopeX(0, 1), share[1]),
                                         between(slopeX(1, 0), slopeX(1, 1), share[1]), share[2])),
      static_cast<float>(
          per_m * between(alongX(0, 1) - alongX(0, 0), alongX(1, 1) - alongX(1, 0), share[2])),
      static_cast<float>(per_m * (y1 - y0))};
  return result;
}

}  // namespace dtsdf
