/// Marks for the next extraction, as blocks come and go.
#pragma once

#include <vector>

#include "backend/block_mover.h"
#include "device_map.h"

namespace dtsdf {
namespace gpu {

/// Waits for the stream wherever it tells something. @pre No extraction is under way.
class MarkMover {
 public:
  explicit MarkMover(const Stream& stream) : stream_(stream) {}

  /// Makes room for so many slots in take() and set().
  void reserve(size_t slots);

  /// Slots with marks.
  std::vector<int32_t> marked(const MapView& map);

  /// Takes the marks of slots.
  std::vector<MeshMarks> take(const MapView& map, const std::vector<int32_t>& slots);

  /// Sets them; others stay.
  void set(const MapView& map, const std::vector<int32_t>& slots,
           const std::vector<MeshMarks>& marks);

 private:
  void begin(const std::vector<int32_t>& slots);

  const Stream& stream_;
  Event done_;                    ///< With the lists.
  PinnedBuffer<int32_t> slots_;   ///< Kernels read them in place,
  PinnedBuffer<uint32_t> marks_;  ///< and read and write these.
};

}  // namespace gpu
}  // namespace dtsdf
