/// Copies records, in any order, between the map's pools on the device and pageable host memory.
/// Kernels gather them into pinned memory, or scatter them from it, in batches.
#pragma once

#include <vector>

#include "device_map.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {
namespace gpu {

class RecordMover {
 public:
  explicit RecordMover(const Stream& stream) : stream_(stream) {}

  /// Allocates all the memory that copying needs. @throws BackendError if memory runs out.
  void reserve();

  /// Copies record `records[i]` of the pool to record i of `host`. Waits until all are copied.
  template <class Pool>
  void download(const Pool& pool, const std::vector<int32_t>& records, void* host);

  /// Copies record i of `host` to record `records[i]` of the pool. `host` may be overwritten on
  /// return; work enqueued on the stream afterwards uses the new records.
  template <class Pool>
  void upload(const Pool& pool, const std::vector<int32_t>& records, const void* host);

  void addMemory(MapperMemory& memory) const;

 private:
  struct StagingBuffer {
    PinnedBuffer<char> bytes;
    PinnedBuffer<int32_t> records;
    Event done;  ///< Recorded after the kernel that uses both buffers.
  };

  template <bool kToHost, class Pool>
  void move(const Pool& pool, StagingBuffer& buffer, size_t count);
  StagingBuffer& begin(size_t batch, const std::vector<int32_t>& records, size_t first, size_t end,
                       size_t record_bytes);

  const Stream& stream_;
  StagingBuffer staging_[2];
};

}  // namespace gpu
}  // namespace dtsdf
