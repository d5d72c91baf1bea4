/// What paging asks of the backend on the GPU.
#pragma once

#include <optional>
#include <vector>

#include "align.h"
#include "backend/block_mover.h"
#include "backend/rules.h"
#include "block_mesher.h"
#include "carry_records.h"
#include "find_blocks.h"
#include "move_marks.h"

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
    const BlockTable& table;
    DeviceMap& map;
    BlockFinder& finder;
    PoseAligner& aligner;
    BlockMesher& mesher;
    RecordCarrier& carrier;
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
  void reserve(const MapSize& size) override;
  RecordsMaker recordsMaker() override { return parts_.carrier.maker(); }
  LeavingBlocks takeOut(const std::vector<int32_t>& slots) override;
  void putIn(const std::vector<int32_t>& slots, const std::vector<ArrivingBlock>& blocks) override;
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) override;
  void setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) override;

 private:
  bool hasMarks() const { return parts_.bounds.dirty + parts_.bounds.painted > 0; }
  uintptr_t addPieces(int32_t slot, uintptr_t at, RecordPieces& pieces) const;

  const Parts parts_;
  const FusionRules fusion_rules_;
  MarkMover marks_;
};

}  // namespace gpu
}  // namespace dtsdf
