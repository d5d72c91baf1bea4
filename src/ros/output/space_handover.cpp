#include "ros/output/space_handover.h"

#include <utility>

#include "kernels/core/grid.h"

namespace dtsdf {

SpaceHandover::SpaceHandover(std::function<void()> on_delivery)
    : on_delivery_(std::move(on_delivery)) {}

void SpaceHandover::want(bool cells, bool slice) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (wish_.cells == cells && wish_.slice == slice) return;
  if (!cells) {
    has_changes_ = begins_anew_ = false;
    cubes_.clear();
  }
  if (!slice) slice_.reset();
  wish_.all_cells = cells && (wish_.all_cells || !wish_.cells);
  wish_.first_slice = slice && (wish_.first_slice || !wish_.slice);
  wish_.cells = cells;
  wish_.slice = slice;
}

SpaceWish SpaceHandover::wish() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return wish_;
}

void SpaceHandover::tell(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!wish_.cells) return;
    // What came of an earlier wish is no beginning.
    if (wish_.all_cells && !changes.begins_anew) return;
    wish_.all_cells = false;
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
  on_delivery_();
}

void SpaceHandover::tell(SpaceSlice slice) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!wish_.slice) return;
    wish_.first_slice = false;
    slice_ = std::move(slice);
  }
  on_delivery_();
}

void SpaceHandover::clear() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cubes_.clear();
    slice_.reset();
    // Who was told nothing has nothing to forget, and no size of cells to forget it by.
    if (wish_.cells && !wish_.all_cells) {
      has_changes_ = begins_anew_ = true;
      stamp_ = ros::Time();
    }
    if (wish_.slice && !wish_.first_slice) slice_.emplace();
  }
  on_delivery_();
}

SpaceDelivery SpaceHandover::take() {
  SpaceDelivery delivery;
  decltype(cubes_) cubes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    delivery.slice = std::exchange(slice_, std::nullopt);
    if (!std::exchange(has_changes_, false)) return delivery;
    delivery.changes.emplace();
    delivery.changes->begins_anew = std::exchange(begins_anew_, false);
    delivery.cell_size_m = cell_size_m_;
    delivery.stamp = stamp_;
    cubes.swap(cubes_);
  }
  for (const auto& [key, cube] : cubes) delivery.changes->cubes.push_back(cube);
  return delivery;
}

}  // namespace dtsdf
