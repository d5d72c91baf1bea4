/// What paging asks of the backend on the GPU.
#pragma once

#include <optional>
#include <vector>

#include "align.h"
#include "backend/block_mover.h"
#include "backend/rules.h"
#include "block_mesher.h"
#include "find_blocks.h"
#include "move_marks.h"
#include "move_records.h"

namespace dtsdf {
namespace gpu {

/// Lengths, at most, of the lists of dirty and of painted blocks, which are on the device.
struct MarkBounds {
  size_t dirty = 0, painted = 0;
};

class CudaBlockMover : public BlockMover {
 public:
  /// What it works with; all of it outlives it.
  struct Parts {
    DeviceMap& map;
    BlockFinder& finder;
    PoseAligner& aligner;
    BlockMesher& mesher;
    RecordMover& records;
    const std::optional<DeviceSensing>& sensing;  ///< Of the last depth image.
    MarkBounds& bounds;
  };

  CudaBlockMover(const Parts& parts, const FusionRules& rules, const Stream& stream)
      : parts_(parts), fusion_rules_(rules), marks_(stream) {}

  std::vector<PackedKey> touchedKeys() override { return parts_.finder.fetchTouched(); }
  std::vector<PackedKey> seenThrough(const std::vector<PackedKey>& keys,
                                     uint64_t frame_number) override;
  std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) override {
    return parts_.aligner.keysAt(view, cutoff);
  }
  std::vector<int32_t> markedSlots() override { return marks_.marked(parts_.map.view()); }
  void reserve(size_t slots) override {
    parts_.records.reserve();
    marks_.reserve(slots);
  }
  std::vector<MeshState> takeMeshStates(const std::vector<int32_t>& slots) override;
  void enterMeshStates(const std::vector<int32_t>& slots,
                       const std::vector<MeshState>& states) override;
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) override {
    return marks_.take(parts_.map.view(), slots);
  }
  void setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) override;

 private:
  const Parts parts_;
  const FusionRules fusion_rules_;
  MarkMover marks_;
};

}  // namespace gpu
}  // namespace dtsdf
