#include "space/cell_table.h"

#include <algorithm>
#include <utility>

namespace dtsdf {
namespace {

/// A few megabytes.
constexpr size_t kMostGone = 1 << 18;

}  // namespace

const CellCube* CellTable::find(const Vec3i& key) const {
  const int32_t slot = slots_.find(packKey(key));
  return slot < 0 ? nullptr : &cubes_[slot];
}

CellCube* CellTable::find(const Vec3i& key) {
  const int32_t slot = slots_.find(packKey(key));
  return slot < 0 ? nullptr : &cubes_[slot];
}

CellCube& CellTable::at(const Vec3i& key) {
  if (CellCube* const cube = find(key)) {
    cube->touched = turn_;
    return *cube;
  }
  auto slot = static_cast<int32_t>(cubes_.size());
  if (free_slots_.empty()) {
    cubes_.emplace_back();
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  slots_.insert(packKey(key), slot);
  cubes_[slot] = CellCube{key, {}, {}, turn_};
  return cubes_[slot];
}

void CellTable::removeIfEmpty(const Vec3i& key) {
  const int32_t slot = slots_.find(packKey(key));
  if (slot < 0 || !isEmpty(cubes_[slot].free) || !isEmpty(cubes_[slot].surface)) return;
  free_slots_.push_back(slot);
  slots_.erase(packKey(key));
  if (!is_followed_) return;
  gone_.push_back(key);
  // Who does not ask for so long gets everything anew.
  if (gone_.size() > kMostGone) is_followed_ = false;
}

TouchedCubes CellTable::takeTouched(bool all) {
  TouchedCubes touched;
  touched.begins_anew = all || !is_followed_;
  forEach([&](const CellCube& cube) {
    if (touched.begins_anew || cube.touched == turn_) touched.live.push_back(&cube);
  });
  if (!touched.begins_anew) touched.gone = std::move(gone_);
  gone_.clear();
  is_followed_ = true;
  ++turn_;
  return touched;
}

std::vector<Vec3i> CellTable::sortedKeys() const {
  std::vector<Vec3i> keys;
  for (const CellCube& cube : cubes_) {
    const CellCube* const live = find(cube.key);
    if (live == &cube) keys.push_back(cube.key);
  }
  std::sort(keys.begin(), keys.end(),
            [](const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); });
  return keys;
}

}  // namespace dtsdf
