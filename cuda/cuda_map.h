/// One map on the device with all that is needed to fuse frames into it and to mesh it.
#pragma once

#include <vector>

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "block_mesher.h"
#include "frame_surfels.h"
#include "fusion.h"
#include "runtime/stage_clock.h"
#include "touched_blocks.h"

namespace dtsdf {
namespace gpu {

/// Does the work behind Mapper: the host's table decides what is admitted, the device does the
/// rest.
class CudaMap {
 public:
  CudaMap(const MapperParams& params, const Rules& rules);
  ~CudaMap() { stream_.drain(); }

  /// @pre The frame is valid. @return when the frame's last kernel is enqueued.
  IntegrationResult integrate(const DepthFrame& frame);
  void beginMeshUpdate();
  void waitForMeshes() { mesher_.complete(); }
  MeshUpdate finishMeshUpdate();
  MapStats stats();
  std::vector<BlockSnapshot> snapshot();
  void profileTo(Profile* profile);
  std::vector<MemoryPart> memory();

 private:
  FusionInput computeSurfels(const DepthFrame& frame);
  void findTouchedBlocks(FusionInput& input);
  Admission admit();
  void fuse(const FusionInput& input, const Admission& admission);
  void recycleEmpty();
  MapDemand demandOfFrame() const;
  void countWork(const FusionInput& input, const Admission& admission);

  MapperParams params_;
  Rules rules_;
  FusionView fusion_view_;
  size_t budget_bytes_;
  BlockTable table_;
  StageClock clock_;
  Stream stream_;  ///< Of the frames; the mesher has its own.
  Event map_ready_;
  DeviceMap map_;
  FrameSurfels surfels_;
  TouchedBlocks touched_;
  Fusion fusion_;
  BlockMesher mesher_;
  FrameCounters counters_ = {};  ///< Of the frame being fused.
  uint64_t refused_ = 0;
  size_t dirty_bound_ = 0;  ///< Blocks touched since the last extraction, each as often as it was.
};

}  // namespace gpu
}  // namespace dtsdf
