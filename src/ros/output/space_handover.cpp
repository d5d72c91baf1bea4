#include "ros/output/space_handover.h"

#include <limits>

namespace dtsdf {

SpaceChanges changesBetween(const KnownSpace& before, std::vector<SpaceCube> now) {
  std::unordered_map<PackedKey, SpaceCube> gone;
  constexpr int32_t kLowest = std::numeric_limits<int32_t>::min(),
                    kHighest = std::numeric_limits<int32_t>::max();
  for (const SpaceCube& cube : before.cubes(kLowest, kHighest)) {
    gone.emplace(packKey(SpaceCube::cubeOf(cube.first)), cube);
  }
  SpaceChanges changes;
  for (SpaceCube& cube : now) {
    const auto same = gone.find(packKey(SpaceCube::cubeOf(cube.first)));
    const bool is_known = same != gone.end();
    if (!is_known || same->second.free != cube.free || same->second.surface != cube.surface) {
      changes.cubes.push_back(cube);
    }
    if (is_known) gone.erase(same);
  }
  for (const auto& [key, cube] : gone) changes.cubes.push_back({cube.first, {}, {}});
  return changes;
}

void SpaceHandover::add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (changes.begins_anew) {
      begins_anew_ = true;
      cubes_.clear();
    }
    for (const SpaceCube& cube : changes.cubes) {
      cubes_[packKey(SpaceCube::cubeOf(cube.first))] = cube;
    }
    has_changes_ = true;
    cell_size_m_ = cell_size_m;
    stamp_ = stamp;
  }
  on_change_();
}

bool SpaceHandover::isFull() const {
  constexpr size_t kMostWaiting = size_t{1} << 15;  // cubes: some megabytes
  const std::lock_guard<std::mutex> lock(mutex_);
  return cubes_.size() >= kMostWaiting;
}

void SpaceHandover::clear() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (cell_size_m_ == 0.0) return;  // nothing was ever known
    cubes_.clear();
    has_changes_ = begins_anew_ = true;
    stamp_ = ros::Time();
  }
  on_change_();
}

std::optional<SpaceDelivery> SpaceHandover::take() {
  SpaceDelivery delivery;
  decltype(cubes_) cubes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!std::exchange(has_changes_, false)) return std::nullopt;
    delivery.changes.begins_anew = std::exchange(begins_anew_, false);
    delivery.cell_size_m = cell_size_m_;
    delivery.stamp = stamp_;
    cubes.swap(cubes_);
  }
  delivery.changes.cubes.reserve(cubes.size());
  for (const auto& [key, cube] : cubes) delivery.changes.cubes.push_back(cube);
  return delivery;
}

}  // namespace dtsdf
