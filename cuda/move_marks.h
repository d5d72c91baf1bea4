/// Marks for the next extraction, as blocks come and go.
#pragma once

#include <vector>

#include "backend/mesh_state.h"
#include "device_map.h"

namespace dtsdf {
namespace gpu {

/// Waits for the stream wherever it tells something. @pre No extraction is under way.
class MarkMover {
 public:
  explicit MarkMover(const Stream& stream) : stream_(stream) {}

  /// Makes room for so many slots in take() and set().
  void reserve(size_t slots);

  /// All that is marked.
  std::vector<MarkedSlot> marked(const MapView& map);

  /// Takes the marks of slots.
  std::vector<MeshMarks> take(const MapView& map, const std::vector<int32_t>& slots);

  /// Sets them; others stay.
  void set(const MapView& map, const std::vector<MarkedSlot>& marked);

 private:
  const Stream& stream_;
  Event done_;                    ///< With the lists.
  PinnedBuffer<int32_t> slots_;   ///< Kernels read them in place,
  PinnedBuffer<uint32_t> marks_;  ///< and read and write these.
};

}  // namespace gpu
}  // namespace dtsdf
