#include "map/slot_index.h"

#include <algorithm>
#include <utility>

namespace dtsdf {
namespace {

constexpr size_t kSmallestTable = 64;

}  // namespace

void SlotIndex::insert(PackedKey key, int32_t slot) {
  if (2 * used_ >= table_.size()) grow();
  Cube& cube = table_[placeOf(nameOf(key))];
  if (cube.marks == nullptr) {
    cube.marks = std::make_unique<int32_t[]>(kBlocksPerCube);
    used_ += cube.name == 0;
    cube.name = nameOf(key);
    ++cubes_;
  }
  cube.marks[numberInCube(key)] = slot + 1;
  ++cube.held;
  ++size_;
}

void SlotIndex::assign(PackedKey key, int32_t slot) noexcept {
  table_[placeOf(nameOf(key))].marks[numberInCube(key)] = slot + 1;
}

void SlotIndex::erase(PackedKey key) noexcept {
  Cube& cube = table_[placeOf(nameOf(key))];
  cube.marks[numberInCube(key)] = 0;
  --size_;
  if (--cube.held > 0) return;
  cube.marks.reset();
  --cubes_;
}

/// A table with room for twice as many cubes.
void SlotIndex::grow() {
  size_t size = kSmallestTable;
  while (size < 4 * cubes_) size *= 2;
  std::vector<Cube> old(size);
  old.swap(table_);
  used_ = cubes_;
  for (Cube& cube : old) {
    if (cube.marks != nullptr) table_[placeOf(cube.name)] = std::move(cube);
  }
}

}  // namespace dtsdf
