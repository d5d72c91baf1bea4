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
  const int32_t known = slots_.find(packKey(key));
  if (known >= 0) {
    noteTouched(known);
    return cubes_[known];
  }
  auto slot = static_cast<int32_t>(cubes_.size());
  if (free_slots_.empty()) {
    cubes_.emplace_back();
    keys_.push_back(kNoCube);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  slots_.insert(packKey(key), slot);
  cubes_[slot] = CellCube{key, {}, {}, cubes_[slot].touched};
  keys_[slot] = packKey(key);
  noteTouched(slot);
  return cubes_[slot];
}

void CellTable::noteTouched(int32_t slot) {
  if (!is_followed_ || cubes_[slot].touched == turn_) return;
  cubes_[slot].touched = turn_;
  touched_.push_back(slot);
}

void CellTable::removeIfEmpty(const Vec3i& key) {
  const int32_t slot = slots_.find(packKey(key));
  if (slot < 0 || !isEmpty(cubes_[slot].free) || !isEmpty(cubes_[slot].surface)) return;
  free_slots_.push_back(slot);
  keys_[slot] = kNoCube;
  slots_.erase(packKey(key));
  if (!is_followed_) return;
  gone_.push_back(key);
  // Who does not ask for so long gets everything anew.
  if (gone_.size() > kMostGone) is_followed_ = false;
}

TouchedCubes CellTable::takeTouched(bool all) {
  TouchedCubes touched;
  touched.begins_anew = all || !is_followed_;
  if (touched.begins_anew) {
    forEach([&](const CellCube& cube) { touched.live.push_back(&cube); });
  } else {
    for (const int32_t slot : touched_) {
      if (keys_[slot] != kNoCube) touched.live.push_back(&cubes_[slot]);
    }
    touched.gone = std::move(gone_);
  }
  touched_.clear();
  gone_.clear();
  is_followed_ = true;
  ++turn_;
  return touched;
}

std::vector<const CellCube*> CellTable::sorted() const {
  std::vector<const CellCube*> cubes;
  cubes.reserve(size());
  for (size_t slot = 0; slot < keys_.size(); ++slot) {
    if (keys_[slot] != kNoCube) cubes.push_back(&cubes_[slot]);
  }
  std::sort(cubes.begin(), cubes.end(),
            [](const CellCube* a, const CellCube* b) { return packKey(a->key) < packKey(b->key); });
  return cubes;
}

}  // namespace dtsdf
