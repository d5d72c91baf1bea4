#include "ros/output/space_handover.h"

namespace dtsdf {

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
