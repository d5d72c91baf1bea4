/// Slots of blocks by key: cubes of blocks in a hash table. What is asked for in the order of keys
/// lies side by side, and the table stays so small that no frame notices when it grows.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"

namespace dtsdf {

class SlotIndex {
 public:
  /// Slot of a key, or -1.
  int32_t find(PackedKey key) const {
    if (table_.empty()) return -1;
    const int32_t* marks = table_[placeOf(nameOf(key))].marks.get();
    return marks == nullptr ? -1 : marks[numberInCube(key)] - 1;
  }

  /// A hint that the key will be asked for in a moment: its mark is far away in a large map.
  void prefetch(PackedKey key) const {
    if (table_.empty()) return;
    const int32_t* marks = table_[placeOf(nameOf(key))].marks.get();
    if (marks != nullptr) __builtin_prefetch(marks + numberInCube(key));
  }

  /// @pre The key is not there. @throws std::bad_alloc and nothing has changed then.
  void insert(PackedKey key, int32_t slot) {
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

  /// Gives a key another slot. @pre It is there.
  void assign(PackedKey key, int32_t slot) noexcept {
    table_[placeOf(nameOf(key))].marks[numberInCube(key)] = slot + 1;
  }

  /// @pre The key is there.
  void erase(PackedKey key) noexcept {
    Cube& cube = table_[placeOf(nameOf(key))];
    cube.marks[numberInCube(key)] = 0;
    --size_;
    if (--cube.held > 0) return;
    cube.marks.reset();
    --cubes_;
  }

  void clear() { *this = SlotIndex(); }
  size_t size() const { return size_; }
  size_t memoryBytes() const {
    return table_.size() * sizeof(Cube) + cubes_ * kBlocksPerCube * sizeof(int32_t);
  }

 private:
  /// So many blocks along each side of a cube. Surfaces meet 75 of its blocks, about.
  static constexpr int kSideLog2 = 3;
  static constexpr size_t kBlocksPerCube = size_t{1} << 3 * kSideLog2;

  struct Cube {
    PackedKey name = 0;                ///< nameOf() its keys; 0 where no cube has been.
    size_t held = 0;                   ///< Keys that are there.
    std::unique_ptr<int32_t[]> marks;  ///< Slot + 1, or 0 where a key is not there; null: all.
  };

  static constexpr PackedKey kSide = PackedKey{1} << kSideLog2;
  static constexpr PackedKey kInCube = (kSide - 1) | (kSide - 1) << 21 | (kSide - 1) << 42;

  static PackedKey nameOf(PackedKey key) { return (key & ~kInCube) | 1; }
  static size_t numberInCube(PackedKey key) {
    const PackedKey in_cube = key & kInCube;
    return (in_cube | in_cube >> (21 - kSideLog2) | in_cube >> (42 - 2 * kSideLog2)) &
           (kBlocksPerCube - 1);
  }

  /// The place of a cube, or the empty one where it would go. @pre There is a table.
  size_t placeOf(PackedKey name) const {
    const size_t last = table_.size() - 1;
    size_t at = static_cast<size_t>(hashKey(name)) & last;
    while (table_[at].name != 0 && table_[at].name != name) at = (at + 1) & last;
    return at;
  }

  /// A table with room for twice as many cubes.
  void grow() {
    size_t size = 64;  // the smallest table
    while (size < 4 * cubes_) size *= 2;
    std::vector<Cube> old(size);
    old.swap(table_);
    used_ = cubes_;
    for (Cube& cube : old) {
      if (cube.marks != nullptr) table_[placeOf(cube.name)] = std::move(cube);
    }
  }

  std::vector<Cube> table_;  ///< Open addressing, of a size that is a power of two, or 0.
  size_t used_ = 0;          ///< Places with a name, those included of which all keys went.
  size_t cubes_ = 0;         ///< That hold keys.
  size_t size_ = 0;
};

}  // namespace dtsdf
