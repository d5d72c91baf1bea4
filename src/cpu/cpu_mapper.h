/// The mapper on the CPU, with all cores.
#pragma once

#include <memory>

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "cpu/align.h"
#include "cpu/block_mesher.h"
#include "cpu/clear.h"
#include "cpu/clear_region.h"
#include "cpu/find_blocks.h"
#include "cpu/make_surfels.h"
#include "cpu/paint.h"
#include "cpu/render.h"
#include "cpu/see_free.h"
#include "cpu/sense.h"
#include "cpu/voxel_store.h"
#include "map/block_table.h"
#include "space/space_map.h"

namespace dtsdf {

class CpuMapper : public ProbedMapper {
 public:
  CpuMapper(const MapperParams& params, const Rules& rules);

  IntegrationResult integrate(const DepthFrame& frame) override;
  Alignment align(const DepthFrame& frame, const PosePrior& prior) override;
  IntegrationResult paint(const ColourFrame& frame) override;
  void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
              RenderedView& view) override;
  void beginMeshUpdate() override;
  void waitForMeshes() override {}
  MeshUpdate finishMeshUpdate() override;
  ClearedRegion clearRegion(const Region& region) override;
  void clear() override;
  MapContents contents() override;
  void restore(const MapContents& contents) override;
  Space* space() override { return space_.get(); }
  MapStats stats() const override;
  void profileTo(Profile* profile) override;
  std::vector<MemoryPart> memoryParts() const override;
  std::string backendName() const override;
  void restrictTo(const MapExtent& extent) override;
  const std::vector<BlockRequest>& outsideExtent() const override { return outside_; }
  void passOver(const PassedFrames& passed) override;

 private:
  IntegrationResult fuse(const DepthFrame& frame);
  IntegrationResult paintSurfaces(const ColourFrame& frame);
  ColourAdmission admitColours(std::vector<ColourRequest> requests);
  FrameSensing sense(const DepthFrame& frame);
  const std::vector<Surfel>& makeSurfels(const FrameSensing& sensing);
  const std::vector<TouchedBlock>& findBlocks(const std::vector<Surfel>& surfels,
                                              const FrameSensing& sensing);
  Admission admit(const std::vector<TouchedBlock>& blocks);
  void castFoldAndClear(const std::vector<TouchedBlock>& blocks,
                        const std::vector<Surfel>& surfels, const FrameSensing& sensing);
  ClearedBlock clear(const BlockLook& look, const BlockEntry& entry, const FrameSensing& sensing);
  void lookAround(const FrameSensing& sensing);
  void dropBeyond(const DepthFrame& frame);
  void seeFree(const DepthFrame& frame, const FrameSensing& sensing);
  void releaseVacant(const std::vector<int32_t>& slots);
  std::vector<int32_t> blocksInTurn(const FrameView& frame) const;
  int32_t leastEvidenceNow() const;

  const MapperParams params_;
  const Rules rules_;
  const FusionSettings fusion_;
  const int threads_;
  BlockTable table_;
  VoxelStore voxels_;
  ColourStore colours_;
  PoseAligner aligner_;
  FrameSensor sensor_;
  SurfelMaker surfel_maker_;
  BlockFinder block_finder_;
  Painter painter_;
  BlockMesher mesher_;
  Renderer renderer_;
  FreeSeer free_seer_;
  std::unique_ptr<SpaceMap> space_;  ///< Null where nobody asks for it.
  MeshUpdate mesh_update_;
  std::vector<BlockRequest> outside_;  ///< Of the last frame.
  uint64_t refused_ = 0, dropped_ = 0;
  uint64_t frames_ = 0;                 ///< Fused, those included that only clear.
  uint64_t supporting_frames_ = 0;      ///< Those that touched a block.
  std::vector<uint64_t> last_touched_;  ///< Frame, by slot; 0: none.
  std::vector<int32_t> vacant_;         ///< Released when the mesh update under way is fetched.
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
