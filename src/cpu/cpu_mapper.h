/// The mapper on the CPU, with all cores.
#pragma once

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "cpu/block_bins.h"
#include "cpu/block_mesher.h"
#include "cpu/frame_surfels.h"
#include "cpu/voxel_store.h"
#include "map/block_table.h"

namespace dtsdf {

class CpuMapper : public ProbedMapper {
 public:
  CpuMapper(const MapperParams& params, const Rules& rules);

  IntegrationResult integrate(const DepthFrame& frame) override;
  void beginMeshUpdate() override;
  void waitForMeshes() override {}
  MeshUpdate finishMeshUpdate() override;
  void clear() override;
  MapStats stats() const override;
  std::vector<BlockSnapshot> snapshot() override;
  void profileTo(Profile* profile) override;
  std::vector<MemoryPart> memory() const override;
  std::string backendName() const override;

 private:
  size_t computeSurfels(const DepthFrame& frame, const FrameView& view);
  const std::vector<TouchedBlock>& findTouchedBlocks(const FrameView& view);
  void admit(const std::vector<TouchedBlock>& touched, IntegrationResult& result);
  void fuse(const std::vector<TouchedBlock>& touched, const FrameView& view);
  void recycleEmpty(const std::vector<TouchedBlock>& touched,
                    const std::vector<uint32_t>& empty_directions);

  MapperParams params_;
  Rules rules_;
  FusionView fusion_;
  int threads_;
  BlockTable table_;
  VoxelStore voxels_;
  FrameSurfels surfels_;
  BlockBins bins_;
  BlockMesher mesher_;
  MeshUpdate mesh_update_;
  uint64_t refused_ = 0;
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
