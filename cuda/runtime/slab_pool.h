/// A pool of records of equal size, in slabs that never move, so that it grows without copying its
/// contents.
#pragma once

#include <algorithm>
#include <vector>

#include "runtime/buffer.h"
#include "runtime/device.h"

namespace dtsdf {
namespace gpu {

/// Gives kernels access to the records of a pool. T is the type of a record's elements.
template <class T, int kRecordSize, int kRecordsPerSlabLog2>
struct SlabView {
  T* const* slabs;

#ifdef __CUDACC__
  __device__ __forceinline__ T* record(int32_t i) const {
    constexpr int kMask = (1 << kRecordsPerSlabLog2) - 1;
    return slabs[i >> kRecordsPerSlabLog2] + static_cast<size_t>(i & kMask) * kRecordSize;
  }
#endif
};

template <class T, int kRecordSize, int kRecordsPerSlabLog2>
class SlabPool {
 public:
  using View = SlabView<T, kRecordSize, kRecordsPerSlabLog2>;

  /// Makes room for `count` records, and zeroes new memory. Waits for the stream only if the pool
  /// has to grow. @throws BackendError if memory runs out; the pool then keeps its size.
  void reserve(size_t count, const Stream& stream) {
    const size_t wanted = slabsFor(count);
    if (wanted <= slabs_.size()) return;
    // Grows by at least an eighth, if the device has enough memory.
    const size_t chunk = std::max(wanted - slabs_.size(), slabs_.size() / 8);
    DeviceBuffer<T> memory = allocateChunk(chunk, wanted - slabs_.size());
    memory.zero(stream);
    std::vector<T*> slabs = slabs_;
    for (size_t at = 0; at < memory.capacity(); at += kSlabElements) {
      slabs.push_back(memory.data() + at);
    }
    stream.synchronize();  // a previous upload may still read the pinned table
    pinned_table_.reserve(std::max(slabs.size(), kFirstTable));
    if (slabs.size() > table_.capacity()) uploaded_ = 0;
    table_.reserve(std::max(slabs.size(), kFirstTable), stream);  // last, as it loses its contents
    std::copy(slabs.begin(), slabs.end(), pinned_table_.data());
    table_.uploadPart(pinned_table_.data(), uploaded_, slabs.size(), stream);
    uploaded_ = slabs.size();
    chunks_.push_back(std::move(memory));
    slabs_ = std::move(slabs);
  }

  /// Makes room before it is needed; kernels may be reading the pool. If there is no room for
  /// `count` records, makes room for up to `most`, as even a small allocation takes half as long
  /// as a frame. Does nothing if that would take much of the device's free memory or if the table
  /// would have to grow.
  void reserveAhead(size_t count, size_t most, const Stream& stream) {
    constexpr size_t kMinLeft = 8;  // free memory must be at least this many times the allocation
    const size_t there = slabs_.size(), least = slabsFor(count);
    if (least <= there) return;
    const size_t few = std::max(least, there + there / 8);
    const size_t affordable = there + freeDeviceMemory() / (kMinLeft * kSlabElements * sizeof(T));
    const size_t limit = std::min(affordable, table_.capacity());
    if (few > limit) return;
    reserve(std::clamp(std::min(slabsFor(most), there + there / 2), few, limit) * kSlabRecords,
            stream);
  }

  View view() const { return {table_.data()}; }

  size_t bytes() const { return slabs_.size() * kSlabElements * sizeof(T); }

  static constexpr size_t kSlabRecords = size_t(1) << kRecordsPerSlabLog2;
  static constexpr size_t kSlabElements = kSlabRecords * kRecordSize;
  static constexpr size_t kRecordBytes = kRecordSize * sizeof(T);

 private:
  static constexpr size_t kFirstTable = 2048;  ///< Small compared with the slabs.

  static size_t slabsFor(size_t count) { return (count + kSlabRecords - 1) / kSlabRecords; }

  static DeviceBuffer<T> allocateChunk(size_t slabs, size_t least) {
    try {
      return DeviceBuffer<T>(slabs * kSlabElements);
    } catch (const BackendError& error) {
      if (!error.isOutOfMemory() || slabs == least) throw;
    }
    return DeviceBuffer<T>(least * kSlabElements);
  }

  std::vector<DeviceBuffer<T>> chunks_;
  std::vector<T*> slabs_;
  DeviceBuffer<T*> table_;
  PinnedBuffer<T*> pinned_table_;
  size_t uploaded_ = 0;  ///< Number of entries in the device's table, which kernels may be reading.
};

}  // namespace gpu
}  // namespace dtsdf
