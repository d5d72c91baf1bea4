/// One map on the device with all that is needed to fuse frames into it and to mesh it.
#pragma once

#include <optional>
#include <vector>

#include "backend/mapper_probe.h"
#include "align.h"
#include "backend/rules.h"
#include "block_mesher.h"
#include "clear_region.h"
#include "fusion.h"
#include "painter.h"
#include "raw_image.h"
#include "render.h"
#include "runtime/stage_clock.h"
#include "see_free.h"
#include "space/space_map.h"

namespace dtsdf {
namespace gpu {

/// Does the work behind Mapper: the host's table decides what is admitted, the device does the
/// rest.
class CudaMap {
 public:
  /// `space`, which outlives the map, is told what is free and where surfaces are; null where
  /// nobody asks for it.
  CudaMap(const MapperParams& params, const Rules& rules, SpaceMap* space);
  ~CudaMap() { stream_.drain(); }

  /// @pre The frame is valid. @return when the frame's last kernel is enqueued.
  IntegrationResult fuse(const DepthFrame& frame);
  Alignment align(const DepthFrame& frame, const PosePrior& prior);
  IntegrationResult paint(const ColourFrame& frame);
  void render(const FrameView& frame, RenderedView& view);
  ClearedRegion clearRegion(const Region& region);
  void beginMeshUpdate();
  void waitForMeshes() { mesher_.complete(); }
  MeshUpdate finishMeshUpdate();
  MapStats stats();
  MapContents contents();

  /// @pre The map is empty, and the contents were checked.
  void restore(const MapContents& contents);
  void profileTo(Profile* profile);
  std::vector<MemoryPart> memoryParts();
  void restrictTo(const MapExtent& extent);
  const std::vector<BlockRequest>& outsideExtent() const { return outside_; }
  void passOver(const PassedFrames& passed);

  /// Hands what the last frame saw as free over to space, if that has not happened yet: waits for
  /// the frame then.
  void bringSpaceUpToDate();
  bool hasUnfetchedSpace() const { return free_seer_.isKept(); }

 private:
  void upload(const DepthFrame& frame);
  RawDepth rawDepthOf(const DepthFrame& frame) const;
  DeviceSensing sense(const DepthFrame& frame);
  DeviceSurfels makeSurfels(const DeviceSensing& sensing);
  void findBlocks(const DeviceSensing& sensing, DeviceSurfels& surfels);
  void seeFree(const DeviceSensing& sensing);
  Admission admit();
  bool hasRoomFor(const MapDemand& demand);
  ColourAdmission admitColours();
  void castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels);
  void clear(const DeviceSensing& sensing);
  void recycleEmpty();
  std::vector<int32_t> dropBeyond();
  void mirror(std::vector<int32_t> changed, bool dirty);
  int32_t leastEvidenceNow() const;
  void releaseVacant(const std::vector<int32_t>& slots);
  void countWork(const FrameView& frame, const Admission& admission);

  const MapperParams params_;
  const Rules rules_;
  BlockTable table_;
  StageClock clock_;
  Stream stream_;  ///< Of the frames; the mesher has its own.
  Event map_ready_;
  DeviceMap map_;
  RawImage raw_image_;
  PoseAligner aligner_;
  FrameSensor sensor_;
  SurfelMaker surfel_maker_;
  BlockFinder block_finder_;
  Fusion fusion_;
  Painter painter_;
  BlockMesher mesher_;
  Renderer renderer_;
  FrameCounters counters_ = {};  ///< Of the frame being fused.
  RegionClearer region_clearer_;
  FreeSeer free_seer_;
  SpaceMap* const space_;
  std::optional<KeptBall> kept_;  ///< Of the last frame, until what lies beyond is dropped.
  std::vector<BlockRequest> outside_;  ///< Of the last frame.
  uint64_t refused_ = 0, dropped_ = 0;
  uint64_t frames_ = 0;           ///< Fused, those included that only clear.
  uint64_t supporting_frames_ = 0;  ///< Those that touched a block.
  int32_t least_evidence_ = 0;    ///< Of the last extraction.
  std::vector<int32_t> vacant_;   ///< Released when the extraction under way is fetched.
  size_t dirty_bound_ = 0;  ///< Blocks touched since the last extraction, each as often as it was.
  size_t painted_bound_ = 0;  ///< The same for painted ones.
};

}  // namespace gpu
}  // namespace dtsdf
