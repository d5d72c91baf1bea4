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
  size_t memoryBytes() const { return (current_.size + old_.size) * sizeof(Place); }

 private:
  /// All bits zero, as calloc() gives pages when they are first touched: an empty place.
  struct Place {
    PackedKey key;
    int32_t mark;  ///< Slot + 1, or kEmpty, or kErased.
  };
  static constexpr int32_t kEmpty = 0, kErased = -1;

  struct Free {
    void operator()(Place* places) const { std::free(places); }
  };

  /// Open addressing, at most half full; three quarters while its keys move to a larger one.
  struct Table {
    std::unique_ptr<Place[], Free> places;
    size_t size = 0;  ///< A power of two, or 0.
    size_t used = 0;  ///< Places that are not empty, erased ones included.

    /// Where the search for a key begins: blocks that lie in a row share a line of the cache, as
    /// they are looked for one after the other. @pre size is not 0.
    size_t homeOf(PackedKey key) const {
      constexpr int kRowLog2 = 2;
      constexpr PackedKey kInRow = (PackedKey{1} << kRowLog2) - 1;
      return static_cast<size_t>(hashKey(key >> kRowLog2) << kRowLog2 | (key & kInRow)) &
             (size - 1);
    }
    void prefetch(PackedKey key) const {
      if (size != 0) __builtin_prefetch(&places[homeOf(key)]);
    }

    /// The key's place, or the empty one where it would go. @pre size is not 0.
    Place& placeOf(PackedKey key) const;
    Place* findLive(PackedKey key) const;
  };

  Place* findLive(PackedKey key) const;

  static Table makeTable(size_t size);
  void put(PackedKey key, int32_t mark);
  bool putWhereItWillMove(PackedKey key, int32_t mark);
  void beginGrowth(size_t keys);
  void moveSome();

  Table current_;
  Table old_;         ///< While its entries are on their way to current_; then empty.
  size_t moved_ = 0;  ///< Places of old_ that are done with.
  size_t size_ = 0;
};

}  // namespace dtsdf
