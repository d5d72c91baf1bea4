/// Copies the records of a pool between the device and pageable host memory, in an order of their
/// own: slab by slab through pinned memory, which host and device take turns with.
#pragma once

#include <cstring>
#include <vector>

#include "runtime/slab_pool.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace gpu {

template <class Pool>
class PoolTransfer {
  using Element = typename Pool::Element;

 public:
  /// Record `records[i]` of the pool belongs to place i of the host's memory.
  PoolTransfer(Pool& pool, const std::vector<int32_t>& records, const Stream& stream)
      : pool_(pool), stream_(stream), place_of_(pool.slabCount() * Pool::kSlabRecords, kNoPlace) {
    for (size_t i = 0; i < records.size(); ++i) place_of_[records[i]] = i;
    if (records.empty()) return;
    for (Turn& turn : turns_) {
      turn.pinned = PinnedBuffer<Element>(turnSlabs() * Pool::kSlabElements);
    }
  }

  /// All places of `host` are filled when this returns.
  void download(void* host) {
    const size_t turns = turnCount();
    for (size_t i = 0; i <= turns; ++i) {
      if (i < turns) {
        forSlabs(i, [&](size_t slab, Element* pinned) {
          pool_.downloadSlab(slab, pinned, stream_);
        });
        stream_.record(turns_[i % 2].copied);
      }
      if (i == 0) continue;
      turns_[(i - 1) % 2].copied.wait();
      copyOnHost(i - 1, [host](size_t place, Element* pinned) {
        std::memcpy(static_cast<char*>(host) + place * kRecordBytes, pinned, kRecordBytes);
      });
    }
  }

  /// Slabs are sent whole: records without a place lose what they held. `host` may be changed when
  /// this returns; the device has everything once the stream has come that far.
  void upload(const void* host) {
    for (size_t i = 0; i < turnCount(); ++i) {
      turns_[i % 2].copied.wait();
      copyOnHost(i, [host](size_t place, Element* pinned) {
        std::memcpy(pinned, static_cast<const char*>(host) + place * kRecordBytes, kRecordBytes);
      });
      forSlabs(i, [&](size_t slab, const Element* pinned) {
        pool_.uploadSlab(slab, pinned, stream_);
      });
      stream_.record(turns_[i % 2].copied);
    }
    for (Turn& turn : turns_) turn.copied.wait();  // the pinned memory goes now
  }

 private:
  static constexpr size_t kNoPlace = ~size_t{0};
  static constexpr size_t kMostSlabs = 16;  // of one turn: 16 MiB of colours, 32 of voxels
  static constexpr size_t kRecordBytes =
      Pool::kSlabElements / Pool::kSlabRecords * sizeof(Element);

  struct Turn {
    PinnedBuffer<Element> pinned;
    Event copied;
  };

  size_t turnSlabs() const { return std::min(kMostSlabs, pool_.slabCount()); }
  size_t turnCount() const {
    return turns_[0].pinned.data() == nullptr
               ? 0
               : (pool_.slabCount() + kMostSlabs - 1) / kMostSlabs;
  }

  /// Calls visit(slab, its place in pinned memory) for the slabs of a turn.
  template <class Visit>
  void forSlabs(size_t turn, const Visit& visit) {
    const size_t first = turn * kMostSlabs;
    for (size_t slab = first; slab < std::min(first + kMostSlabs, pool_.slabCount()); ++slab) {
      visit(slab, turns_[turn % 2].pinned.data() + (slab - first) * Pool::kSlabElements);
    }
  }

  /// Calls copy(place, record in pinned memory) for the records of a turn, on several threads.
  template <class Copy>
  void copyOnHost(size_t turn, const Copy& copy) {
    const size_t first = turn * kMostSlabs;
    const size_t slabs = std::min(kMostSlabs, pool_.slabCount() - first);
    forEachInParallel(slabs, 0, [&](size_t s) {
      for (size_t i = 0; i < Pool::kSlabRecords; ++i) {
        const size_t place = place_of_[(first + s) * Pool::kSlabRecords + i];
        if (place == kNoPlace) continue;
        copy(place, turns_[turn % 2].pinned.data() + s * Pool::kSlabElements +
                        i * (kRecordBytes / sizeof(Element)));
      }
    });
  }

  Pool& pool_;
  const Stream& stream_;
  std::vector<size_t> place_of_;
  Turn turns_[2];
};

}  // namespace gpu
}  // namespace dtsdf
