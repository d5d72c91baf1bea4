/// Maps the keys of blocks to the slots that hold the blocks. The hash table has one entry per cube
/// of blocks. Neighbouring keys are thus close in memory, and the table is small enough to grow
/// without delaying a frame.
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
  /// Slot of a key, or -1 if the key is absent.
  int32_t find(PackedKey key) const {
    if (table_.empty()) return -1;
    const int32_t* marks = table_[placeOf(nameOf(key))].marks.get();
    return marks == nullptr ? -1 : marks[numberInCube(key)] - 1;
  }

  /// Prefetches the entry of a key, which in a large map is unlikely to be in the cache.
  void prefetch(PackedKey key) const {
    if (table_.empty()) return;
    const int32_t* marks = table_[placeOf(nameOf(key))].marks.get();
    if (marks != nullptr) __builtin_prefetch(marks + numberInCube(key));
  }

  /// @pre The key is absent. @throws std::bad_alloc without changing anything.
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

  /// Changes the slot of a key. @pre The key is present.
  void assign(PackedKey key, int32_t slot) noexcept {
    table_[placeOf(nameOf(key))].marks[numberInCube(key)] = slot + 1;
  }

  /// @pre The key is present.
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
  /// Binary logarithm of the number of blocks along each edge of a cube. A surface that passes
  /// through a cube intersects about 75 of its blocks.
  static constexpr int kSideLog2 = 3;
  static constexpr size_t kBlocksPerCube = size_t{1} << 3 * kSideLog2;

  struct Cube {
    PackedKey name = 0;  ///< nameOf() of its keys; 0 if never used.
    size_t held = 0;     ///< Number of keys present.
    /// Slot + 1 of each key, or 0 if it is absent; null if all keys are absent.
    std::unique_ptr<int32_t[]> marks;
  };

  static constexpr PackedKey kSide = PackedKey{1} << kSideLog2;
  static constexpr PackedKey kInCube = (kSide - 1) | (kSide - 1) << 21 | (kSide - 1) << 42;

  static PackedKey nameOf(PackedKey key) { return (key & ~kInCube) | 1; }
  static size_t numberInCube(PackedKey key) {
    const PackedKey in_cube = key & kInCube;
    return (in_cube | in_cube >> (21 - kSideLog2) | in_cube >> (42 - 2 * kSideLog2)) &
           (kBlocksPerCube - 1);
  }

  /// Position of a cube in the table, or the empty position where it belongs. @pre The table is not
  /// empty.
  size_t placeOf(PackedKey name) const {
    const size_t last = table_.size() - 1;
    size_t at = static_cast<size_t>(hashKey(name)) & last;
    while (table_[at].name != 0 && table_[at].name != name) at = (at + 1) & last;
    return at;
  }

  /// Rebuilds the table with at least four positions per cube, dropping removed cubes.
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

  std::vector<Cube> table_;  ///< Open addressing; the size is a power of two, or 0.
  size_t used_ = 0;          ///< Occupied positions, including those of removed cubes.
  size_t cubes_ = 0;         ///< Cubes that contain keys.
  size_t size_ = 0;
};

}  // namespace dtsdf
