/// Copies records of the map's pools between the device and pageable host memory, in an order of
/// their own: kernels gather them into pinned memory, or scatter them from there, turn by turn.
#pragma once

#include <vector>

#include "device_map.h"
#include "dtsdf_mapping/mapper.h"

namespace dtsdf {
namespace gpu {

/// The pinned memory is kept from call to call.
class RecordMover {
 public:
  explicit RecordMover(const Stream& stream) : stream_(stream) {}

  /// Takes all the memory that copies need. @throws BackendError without it.
  void reserve();

  /// Record `records[i]` of the pool comes to place i of the host's memory, which is filled when
  /// this returns.
  template <class Pool>
  void download(const Pool& pool, const std::vector<int32_t>& records, void* host);

  /// The way back. `host` may be changed when this returns; the device has everything once the
  /// stream has come that far.
  template <class Pool>
  void upload(const Pool& pool, const std::vector<int32_t>& records, const void* host);

  void addMemory(MapperMemory& memory) const;

 private:
  struct Turn {
    PinnedBuffer<char> bytes;
    PinnedBuffer<int32_t> records;
    Event done;  ///< With both.
  };

  template <bool kToHost, class Pool>
  void move(const Pool& pool, Turn& turn, size_t count);
  Turn& begin(size_t turn, const std::vector<int32_t>& records, size_t first, size_t end,
              size_t record_bytes);

  const Stream& stream_;
  Turn turns_[2];
};

}  // namespace gpu
}  // namespace dtsdf
