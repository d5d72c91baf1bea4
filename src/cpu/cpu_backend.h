/// The backend on the CPU, with all cores.
#pragma once

#include "backend/map_backend.h"
#include "backend/rules.h"
#include "cpu/align.h"
#include "cpu/block_mesher.h"
#include "cpu/block_times.h"
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

class CpuBackend : public MapBackend, private BlockMover {
 public:
  CpuBackend(const MapperParams& params, const Rules& rules, const BlockTable& table);

  std::string name() const override;
  void enter() override {}
  void profileTo(Profile* profile) override;
  void addMemory(std::vector<MemoryPart>& parts) const override;

  void takePoints(const DepthFrame& frame, const FrameView& view) override;
  AlignmentSums sumsAt(const FrameView& view, float cutoff) override;
  void sense(const DepthFrame& frame, const FrameView& view) override;
  void makeSurfels() override;
  void findBlocks() override;
  void lookUpBlocks() override;
  void seeFree(std::vector<Vec3i> cubes) override;
  TouchedCounts touched() override { return touched_counts_; }
  std::vector<BlockRequest> requests() override { return std::move(requests_); }
  void reserveFrame(const FrameTurn&) override {}
  void castFoldAndClear(const FrameTurn& turn) override;
  std::vector<EmptyBlock> takeEmpty() override;
  std::vector<FreeCube> takeFree() override { return std::move(free_cubes_); }

  void takeColours(const ColourFrame& frame) override;
  SeenColours look(const ColourLook& look) override;
  std::vector<ColourRequest> colourRequests() override { return painter_.requests(map()); }
  void paint(const Exposure& exposure) override;

  void render(const ViewRequest& request, RenderedView& view) override;

  void markAllDirty() override { mesher_.markAllDirty(); }
  void keepColours() override { mesher_.keepColours(); }
  void beginMesh(int32_t least_evidence) override;
  bool makesMeshAtOnce() const override { return true; }
  void waitForMeshes() override {}
  MeshUpdate finishMesh() override;

  void reserve(const MapDemand& demand) override;
  void reserveColours(size_t new_bricks) override;
  void reserveChanges(size_t) override {}
  void enterBlocks(const std::vector<int32_t>& slots, const std::vector<int32_t>& arrays) override;
  void enterColours(const std::vector<NewBrick>& bricks) override;
  void follow(const ChangedSlots& changed) override;
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView& region) override;
  void copyOut(const ContentsOrder& order, MapContents& contents) override;
  void copyIn(const ContentsOrder& order, const MapContents& contents) override;
  BlockMover* mover() override { return this; }

 private:
  std::vector<PackedKey> touchedKeys() override;
  std::vector<PackedKey> seenThrough(const std::vector<PackedKey>& keys,
                                     uint64_t frame_number) override;
  std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) override {
    return aligner_.keysAt(view, cutoff);
  }
  std::vector<int32_t> markedSlots() override { return mesher_.marked(); }
  LeavingBlocks takeOut(const std::vector<int32_t>& slots) override;
  void putIn(const std::vector<int32_t>& slots, const std::vector<ArrivingBlock>& blocks) override;
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) override;
  void setMarks(const std::vector<int32_t>& slots, const std::vector<MeshMarks>& marks) override;
  bool isInTurnToBeSeenThrough(const BlockKey& key, uint64_t frame_number) const;
  PaintedMap map() { return {table_, voxels_, colours_}; }
  uint32_t fuseBlock(const TouchedBlock& block, const BlockEntry& entry, const FrameTurn& turn,
                     BlockSums& sums, BlockTimes::Lap& lap);
  ClearedBlock clear(const BlockLook& look, const BlockEntry& entry);
  void lookAround(const FrameTurn& turn);
  std::vector<int32_t> blocksInTurn(const FrameTurn& turn) const;

  const MapperParams params_;
  const Rules rules_;
  const FusionSettings fusion_;
  const int threads_;
  const BlockTable& table_;
  VoxelStore voxels_;
  ColourStore colours_;
  PoseAligner aligner_;
  FrameSensor sensor_;
  SurfelMaker surfel_maker_;
  BlockFinder block_finder_;
  Painter painter_;
  BlockMesher mesher_;
  Renderer renderer_;
  FreeCellFinder free_cell_finder_;
  FrameSensing sensing_ = {};  ///< Of the last depth image.
  TouchedCounts touched_counts_ = {};
  std::vector<BlockRequest> requests_;
  std::vector<uint64_t> last_touched_;  ///< Number of the last frame that did, by slot; 0: none.
  std::vector<EmptyBlock> empty_;
  std::vector<FreeCube> free_cubes_;
  MeshUpdate meshes_;
  Profile* profile_ = nullptr;
};

}  // namespace dtsdf
