/// Equal-sized records in slabs that never move: a pool that grows without copying what it holds.
#pragma once

#include <algorithm>
#include <vector>

#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// Where kernels find record i of a pool; T is the element type.
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
  using Element = T;

  /// Makes room for `count` records, new memory zeroed. Waits for the stream only if it has to
  /// grow. @throws CudaError without memory; the pool is then as large as it was.
  void reserve(size_t count, const Stream& stream) {
    const size_t wanted = (count + kSlabRecords - 1) / kSlabRecords;
    if (wanted <= slabs_.size()) return;
    // Few large allocations for a large map, small steps for a small one.
    const size_t chunk = std::max(wanted - slabs_.size(), slabs_.size() / 8);
    DeviceBuffer<T> memory = allocateChunk(chunk, wanted - slabs_.size());
    memory.zero(stream);
    std::vector<T*> slabs = slabs_;
    for (size_t at = 0; at < memory.capacity(); at += kSlabElements) {
      slabs.push_back(memory.data() + at);
    }
    table_.reserve(slabs.size(), stream);
    stream.synchronize();  // an upload under way may still read the pinned table
    pinned_table_.reserve(slabs.size());
    std::copy(slabs.begin(), slabs.end(), pinned_table_.data());
    table_.upload(pinned_table_.data(), slabs.size(), stream);
    chunks_.push_back(std::move(memory));
    slabs_ = std::move(slabs);
  }

  View view() const { return {table_.data()}; }

  size_t slabCount() const { return slabs_.size(); }
  size_t bytes() const { return slabs_.size() * kSlabElements * sizeof(T); }

  /// Enqueues the copy of a slab, kSlabElements, to pinned memory.
  void downloadSlab(size_t slab, T* pinned, const Stream& stream) const {
    DTSDF_CHECK_CUDA(cudaMemcpyAsync(pinned, slabs_[slab], kSlabElements * sizeof(T),
                                     cudaMemcpyDeviceToHost, stream.get()));
  }
  /// And back.
  void uploadSlab(size_t slab, const T* pinned, const Stream& stream) {
    DTSDF_CHECK_CUDA(cudaMemcpyAsync(slabs_[slab], pinned, kSlabElements * sizeof(T),
                                     cudaMemcpyHostToDevice, stream.get()));
  }
  static constexpr size_t kSlabRecords = size_t(1) << kRecordsPerSlabLog2;
  static constexpr size_t kSlabElements = kSlabRecords * kRecordSize;

 private:
  static DeviceBuffer<T> allocateChunk(size_t slabs, size_t least) {
    try {
      return DeviceBuffer<T>(slabs * kSlabElements);
    } catch (const CudaError& error) {
      if (error.code() != cudaErrorMemoryAllocation || slabs == least) throw;
    }
    return DeviceBuffer<T>(least * kSlabElements);
  }

  std::vector<DeviceBuffer<T>> chunks_;
  std::vector<T*> slabs_;
  DeviceBuffer<T*> table_;
  PinnedBuffer<T*> pinned_table_;
};

}  // namespace gpu
}  // namespace dtsdf
