/// Slots of blocks by key: a hash table that grows in small steps. A map of millions of blocks then
/// never holds up a frame until all of its entries have moved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "kernels/core/grid.h"

namespace dtsdf {

class SlotIndex {
 public:
  /// Slot of a key, or -1.
  int32_t find(PackedKey key) const;

  /// A hint that the key will be asked for in a moment: its place is far away in a large table.
  void prefetch(PackedKey key) const {
    current_.prefetch(key);
    old_.prefetch(key);
  }

  /// Does some of the work that so many insertions would bring, where nobody waits for it. Without
  /// memory for it they do it themselves.
  void prepare(size_t insertions) noexcept;

  /// @pre The key is not there. @throws std::bad_alloc and nothing has changed then.
  void insert(PackedKey key, int32_t slot);

  /// Gives a key another slot. @pre It is there.
  void assign(PackedKey key, int32_t slot) noexcept;

  /// @pre The key is there.
  void erase(PackedKey key) noexcept;

  void clear() { *this = SlotIndex(); }
  size_t size() const { return size_; }
  size_t memoryBytes() const { return (current_.size + old_.size) * sizeof(Cube); }

 private:
  /// 2 x 2 x 2 blocks: of most that a surface goes through it meets half, and they are looked for
  /// one after the other. All bits zero, as calloc() gives pages when they are first touched: an
  /// empty place.
  struct Cube {
    PackedKey name;    ///< nameOf() its keys; 0 where no cube has been.
    int32_t marks[8];  ///< Slot + 1, or 0 where the key is not there.

    int32_t& markOf(PackedKey key) { return marks[(key & 1) | (key >> 20 & 2) | (key >> 40 & 4)]; }
    bool holdsAny() const;
  };

  static PackedKey nameOf(PackedKey key) {
    constexpr PackedKey kFirst = 1, kInCube = kFirst | kFirst << 21 | kFirst << 42;
    return (key & ~kInCube) | kFirst;
  }

  struct Free {
    void operator()(Cube* cubes) const { std::free(cubes); }
  };

  /// Open addressing, at most half full; three quarters while its cubes move to a larger one.
  struct Table {
    std::unique_ptr<Cube[], Free> cubes;
    size_t size = 0;  ///< A power of two, or 0.
    size_t used = 0;  ///< Places that are not empty, those included of which all keys went.

    /// Where the search for a cube begins. @pre size is not 0.
    size_t homeOf(PackedKey name) const { return static_cast<size_t>(hashKey(name)) & (size - 1); }
    void prefetch(PackedKey key) const {
      if (size == 0) return;
      const Cube& cube = cubes[homeOf(nameOf(key))];  // of two lines of the cache, often
      __builtin_prefetch(&cube.name);
      __builtin_prefetch(&cube.marks[7]);
    }

    /// The place of a cube, or the empty one where it would go. @pre size is not 0.
    Cube& placeOf(PackedKey name) const;
  };

  int32_t* findMark(PackedKey key) const;

  static Table makeTable(size_t size);
  Cube& placeInCurrent(PackedKey name);
  Cube* placeWhereItWillMove(PackedKey name);
  void beginGrowth(size_t cubes);
  void moveSome();

  Table current_;
  Table old_;         ///< While its cubes are on their way to current_; then empty.
  size_t moved_ = 0;  ///< Places of old_ that are done with.
  size_t size_ = 0;
  size_t cubes_ = 0;  ///< That hold keys.
};

}  // namespace dtsdf
