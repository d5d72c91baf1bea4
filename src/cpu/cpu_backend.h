/// The backend on the CPU, with all cores.
#pragma once

#include <utility>

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "cpu/align.h"
#include "cpu/block_mesher.h"
#include "cpu/clear.h"
#include "cpu/find_blocks.h"
#include "cpu/make_surfels.h"
#include "cpu/paint.h"
#include "cpu/render.h"
#include "cpu/see_free.h"
#include "cpu/sense.h"
#include "cpu/voxel_store.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// How many threads a mapper on the CPU has.
int cpuThreads(const MapperParams& params);

class CpuBackend : public MapBackend {
 public:
  CpuBackend(const MapperParams& params, const Rules& rules, const BlockTable& table);

  BackendTraits traits() const override;
  void enter() override {}
  void profileTo(Profile* profile) override;
  void addMemory(std::vector<MemoryPart>& parts) const override;

  void takePoints(const DepthFrame& frame, const FrameView& view) override;
  AlignmentSums sumsAt(const FrameView& view, float cutoff) override;
  void sense(const DepthFrame& frame, const FrameView& view) override;
  void makeSurfels() override;
  void findBlocks() override;
  TouchedBlocks lookUpBlocks() override;
  void seeFree(std::vector<Vec3i> cubes) override;
  void reserveFrame(const FusionPass&) override {}
  void castFoldAndClear(const FusionPass& pass) override;
  FrameOutcome takeOutcome() override { return std::exchange(outcome_, FrameOutcome()); }

  void takeColours(const ColourFrame& frame) override;
  SeenColours look(const PaintView& look) override;
  void paint(const Exposure& exposure) override;

  void render(const ViewRequest& request, RenderedView& view) override;

  void markAll(const MeshMarks& marks) override;
  void beginMesh(int32_t least_evidence) override;
  void waitForMeshes() override {}
  MeshUpdate finishMesh() override { return std::exchange(meshes_, MeshUpdate()); }

  void reserve(const MemoryDemand& demand) override;
  void follow(const TableChanges& changes) override;
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView& region) override;
  void copyOut(const ContentsOrder& order, MapContents& contents, MeshStates* taken) override;
  void copyIn(const ContentsOrder& order, const MapContents& contents,
              const MeshStates* given) override;

  std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                    uint64_t frame_number) override;
  std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) override {
    return aligner_.keysAt(view, cutoff);
  }
  std::vector<MarkedSlot> marked(bool taken) override;
  void setMarks(const std::vector<MarkedSlot>& marked) override;

 private:
  bool isInTurnToBeSeenThrough(const BlockKey& key, uint64_t frame_number) const;
  uint32_t fuseBlock(const TouchedBlock& block, const BlockEntry& entry, const FusionPass& pass,
                     BlockSums& sums);
  ClearedBlock clear(const BlockLook& look, const BlockEntry& entry);
  void lookAround(const FusionPass& pass);
  std::vector<int32_t> blocksInTurn(const FusionPass& pass) const;

  const MapperParams params_;
  const Rules rules_;
  const FusionSettings fusion_;
  const int threads_;
  CpuMap map_;
  PoseAligner aligner_;
  FrameSensor sensor_;
  SurfelMaker surfel_maker_;
  BlockFinder block_finder_;
  Painter painter_;
  BlockMesher mesher_;
  Renderer renderer_;
  FreeCellFinder free_cell_finder_;
  FrameSensing sensing_ = {};           ///< Of the last depth image.
  std::vector<uint64_t> last_touched_;  ///< Number of the last frame that did, by slot; 0: none.
  std::vector<FreeCube> free_cubes_;    ///< Of an image that is not fused yet.
  FrameOutcome outcome_;
  MeshUpdate meshes_;
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
