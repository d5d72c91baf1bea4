#include "cuda_backend.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "align.h"
#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "block_mesher.h"
#include "carry_records.h"
#include "clear.h"
#include "clear_region.h"
#include "distances.h"
#include "fusion.h"
#include "map/memory_budget.h"
#include "move_blocks.h"
#include "move_records.h"
#include "painter.h"
#include "raw_image.h"
#include "render.h"
#include "runtime/device.h"
#include "runtime/stage_clock.h"
#include "see_free.h"
#include "space/space_map.h"

namespace dtsdf {
namespace gpu {
namespace {

/// One map on a device, with all that is needed to fuse images into it and to mesh it.
class CudaBackend : public MapBackend {
 public:
  CudaBackend(const MapperParams& params, const Rules& rules, int device, const BlockTable& table);
  ~CudaBackend() override { stream_.drain(); }

  std::string name() const override { return "cuda (" + deviceName() + ")"; }
  void enter() override { useDevice(device_); }
  void profileTo(Profile* profile) override;
  void addMemory(std::vector<MemoryPart>& parts) const override;

  void takePoints(const DepthFrame& frame, const FrameView& view) override;
  AlignmentSums sumsAt(const FrameView& view, float cutoff) override {
    return aligner_.sumsAt(view, cutoff, map_.view());
  }
  void sense(const DepthFrame& frame, const FrameView& view) override;
  void makeSurfels() override {
    surfels_ = surfel_maker_.makeSurfels(*sensing_, block_finder_.usableSurfels());
  }
  void findBlocks() override { block_finder_.mark(*sensing_, surfels_); }
  void lookUpBlocks() override;
  void seeFree(std::vector<Vec3i> cubes) override;
  TouchedCounts touched() override;
  std::vector<BlockRequest> requests() override { return block_finder_.fetchRequests(); }
  void reserveFrame(const FrameTurn& turn) override;
  void castFoldAndClear(const FrameTurn& turn) override;
  std::vector<EmptyBlock> takeEmpty() override { return clearing_.takeEmptyBlocks(); }
  bool hasMirror() const override { return true; }
  std::vector<FreeCube> takeFree() override { return free_cell_finder_.take(); }
  bool makesDistances() const override { return true; }
  bool makeDistances(const DistanceTask& task,
                     std::vector<std::shared_ptr<uint16_t[]>>& squares) override {
    return distance_maker_.make(task, squares);
  }

  void takeColours(const ColourFrame& frame) override { painter_.takeImage(frame); }
  SeenColours look(const ColourLook& look) override;
  std::vector<ColourRequest> colourRequests() override { return painter_.fetchRequests(); }
  void paint(const Exposure& exposure) override;

  void render(const ViewRequest& request, RenderedView& view) override {
    waitForMeshes();  // they read labels, which a view brings up to date
    const bool is_labelled = bounds_.dirty == 0 && mesher_.hasLabelled(request.least_evidence);
    renderer_.render(request, map_.view(), is_labelled, view);
  }

  void markAllDirty() override;
  void keepColours() override;
  void beginMesh(int32_t least_evidence) override;
  void waitForMeshes() override;
  MeshUpdate finishMesh() override;

  void reserve(const MapDemand& demand) override { map_.reserve(table_, demand); }
  void reserveColours(size_t new_bricks) override { map_.reserveColours(table_, new_bricks); }
  void reserveChanges(size_t slots) override { map_.reserveChanges(slots); }
  void enterBlocks(const std::vector<int32_t>& slots, const std::vector<int32_t>& arrays) override {
    map_.enterBlocks(table_, slots, arrays);
  }
  void enterColours(const std::vector<NewBrick>& bricks) override { map_.enterColours(bricks); }
  void follow(const ChangedSlots& changed) override;
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView& region) override {
    return region_clearer_.clear(slots, region, map_.view());
  }
  void copyOut(const ContentsOrder& order, MapContents& contents) override;
  void copyIn(const ContentsOrder& order, const MapContents& contents) override;
  BlockMover* mover() override { return &block_mover_; }

 private:
  RawDepth rawDepthOf(const DepthFrame& frame) const;
  void findMore();
  FusionTarget target() const { return {map_.view(), block_finder_.view()}; }

  const MapperParams params_;
  const int device_;
  const BlockTable& table_;
  StageClock clock_;
  Stream stream_;  ///< Of the images; the mesher has its own.
  Event map_ready_;
  DeviceMap map_;
  RawImage raw_image_;
  PoseAligner aligner_;
  FrameSensor sensor_;
  SurfelMaker surfel_maker_;
  BlockFinder block_finder_;
  Fusion fusion_;
  Clearing clearing_;
  Painter painter_;
  BlockMesher mesher_;
  Renderer renderer_;
  RegionClearer region_clearer_;
  FreeCellFinder free_cell_finder_;
  DistanceMaker distance_maker_;
  RecordMover record_mover_;
  RecordCarrier record_carrier_;
  size_t in_view_count_ = 0;              ///< Of the part of a frame that is fused.
  std::optional<DeviceSensing> sensing_;  ///< Of the last depth image.
  DeviceSurfels surfels_ = {};
  FrameCounters counters_ = {};
  MarkBounds bounds_;
  CudaBlockMover block_mover_;
};

CudaBackend::CudaBackend(const MapperParams& params, const Rules& rules, int device,
                         const BlockTable& table)
    : params_(params),
      device_(device),
      table_(table),
      map_(stream_),
      aligner_(makeAlignmentSettings(params, rules), params.map.directional, stream_),
      sensor_(params, rules, stream_),
      surfel_maker_(params, rules.surfels, stream_),
      block_finder_(makeFusionSettings(params, rules), stream_),
      fusion_(params, rules, stream_),
      clearing_(params, rules, stream_),
      painter_(makePaintSettings(params, rules), stream_),
      mesher_(makeMeshSettings(params, rules), params.map.directional, params.mesh.refine != 0),
      renderer_(makeMeshSettings(params, rules), params.map.directional, stream_),
      region_clearer_(stream_),
      free_cell_finder_(cellGridOf(params), params.space.max_range_m, stream_),
      distance_maker_(budgetOf(params).free_bytes),
      record_mover_(stream_),
      record_carrier_(stream_, device),
      block_mover_(
          {table, map_, block_finder_, aligner_, mesher_, record_carrier_, sensing_, bounds_},
          rules.fusion, stream_) {
  stream_.setClock(&clock_);
  mesher_.setClock(&clock_);
  painter_.setClock(&clock_);
}

void CudaBackend::profileTo(Profile* profile) {
  stream_.synchronize();
  painter_.finishImage();
  mesher_.complete();
  clock_.profileTo(profile);
}

void CudaBackend::takePoints(const DepthFrame& frame, const FrameView& view) {
  raw_image_.upload(rowsOf(frame), stream_);
  aligner_.takePoints(view, rawDepthOf(frame));
}

RawDepth CudaBackend::rawDepthOf(const DepthFrame& frame) const {
  return {raw_image_.data(), frame.encoding == DepthEncoding::kUint16,
          depthRangeOf(frame, params_)};
}

void CudaBackend::sense(const DepthFrame& frame, const FrameView& view) {
  raw_image_.upload(rowsOf(frame), stream_);
  sensing_ = sensor_.sense(view, rawDepthOf(frame));
  block_finder_.begin();
}

/// Surfels are cast while the host admits blocks: nothing before needs them, nor free depths.
void CudaBackend::lookUpBlocks() {
  block_finder_.compare(*sensing_, map_.view());
  fusion_.castAhead(*sensing_, surfels_, block_finder_.view());
  sensor_.findFreeDepths(*sensing_);
}

/// The device works that off while the host admits blocks.
void CudaBackend::seeFree(std::vector<Vec3i> cubes) {
  free_cell_finder_.find(sensing_->frame(), sensor_.freeDepth(), std::move(cubes));
}

TouchedCounts CudaBackend::touched() {
  counters_ = block_finder_.waitForCounters();
  while (counters_.table_full || counters_.usable_surfels > surfels_.room) findMore();
  return {counters_.usable_surfels, counters_.touched, counters_.requests,
          counters_.requested_arrays};
}

/// Once more with larger buffers: there were more surfels or blocks than expected.
void CudaBackend::findMore() {
  if (counters_.usable_surfels > surfels_.room) {
    block_finder_.begin();
    surfels_ = surfel_maker_.makeMoreSurfels(*sensing_, counters_.usable_surfels,
                                             block_finder_.usableSurfels());
  } else {
    block_finder_.grow();
  }
  findBlocks();
  lookUpBlocks();
  counters_ = block_finder_.waitForCounters();
}

void CudaBackend::reserveFrame(const FrameTurn& turn) {
  if (turn.part != nullptr) block_finder_.takePart(*turn.part, map_.view());
  in_view_count_ = turn.in_view.size();
  map_.noteDemand({counters_.requests, counters_.requested_arrays});
  fusion_.reserve(counters_);
  clearing_.reserve(counters_, in_view_count_);
  clearing_.noteInView(*sensing_, turn.in_view);
}

void CudaBackend::castFoldAndClear(const FrameTurn& turn) {
  holdForProfile(stream_);
  fusion_.castAndFold(*sensing_, surfels_, target(), counters_);
  clearing_.findLooks(*sensing_, target(), turn.number);
  bounds_.dirty += counters_.touched + (sensing_->hasFreeDepth() ? in_view_count_ : 0);
  clearing_.clear(*sensing_, target(), counters_, fusion_.covered(), turn.number);
  mesher_.prepare();
}

SeenColours CudaBackend::look(const ColourLook& look) {
  painter_.look(look, table_.paintedExtent(), map_.view());
  const LookCounters& seen = painter_.counters();
  return {seen.seen > 0, seen.sums};
}

void CudaBackend::paint(const Exposure& exposure) {
  painter_.paint(exposure, map_.view());
  bounds_.painted += std::min(painter_.counters().seen, painter_.counters().blocks);
}

void CudaBackend::markAllDirty() {
  map_.markAllDirty();
  bounds_.dirty += table_.slotCount();
}

void CudaBackend::keepColours() {
  map_.keepColours();
  bounds_.painted += table_.slotCount();
}

void CudaBackend::beginMesh(int32_t least_evidence) {
  stream_.record(map_ready_);
  mesher_.begin(map_.view(), map_ready_, {bounds_.dirty, bounds_.painted, least_evidence});
  bounds_ = MarkBounds();
  block_finder_.prepare();
  map_.reserveAhead(table_);
}

void CudaBackend::waitForMeshes() {
  mesher_.complete();
  map_.sendChanges();
}

MeshUpdate CudaBackend::finishMesh() {
  waitForMeshes();
  MeshUpdate made = mesher_.finish();
  if (clock_.profile() != nullptr) {
    stream_.synchronize();
    painter_.finishImage();
    clock_.collect();
  }
  return made;
}

void CudaBackend::follow(const ChangedSlots& changed) {
  for (const int32_t slot : changed.slots) {
    map_.note(makeSlotUpdate(table_.block(slot), slot, changed.dirty));
  }
  if (changed.dirty) bounds_.dirty += changed.slots.size();
  if (!mesher_.isUnderWay()) map_.sendChanges();
}

void CudaBackend::copyOut(const ContentsOrder& order, MapContents& contents) {
  record_mover_.download(map_.voxels(), order.arrays, contents.voxels.data());
  record_mover_.download(map_.colours(), order.bricks, contents.colours.data());
}

void CudaBackend::copyIn(const ContentsOrder& order, const MapContents& contents) {
  record_mover_.upload(map_.voxels(), order.arrays, contents.voxels.data());
  record_mover_.upload(map_.colours(), order.bricks, contents.colours.data());
}

void CudaBackend::addMemory(std::vector<MemoryPart>& parts) const {
  map_.addMemory(table_, parts);
  mesher_.addMemory(parts);
  raw_image_.addMemory("raw image", parts);
  aligner_.addMemory(parts);
  sensor_.addMemory(parts);
  surfel_maker_.addMemory(parts);
  block_finder_.addMemory(parts);
  fusion_.addMemory(parts);
  clearing_.addMemory(parts);
  painter_.addMemory(parts);
  renderer_.addMemory(parts);
  region_clearer_.addMemory(parts);
  record_mover_.addMemory(parts);
  record_carrier_.addMemory(parts);
  if (params_.space.enabled) {
    free_cell_finder_.addMemory(parts);
    distance_maker_.addMemory(parts);
  }
  parts.push_back(
      {"block table (host)", MemoryKind::kStaging, table_.memoryBytes(), table_.memoryBytes()});
}

}  // namespace
}  // namespace gpu

std::string findCudaProblem() { return gpu::findDeviceProblem(gpu::anyKernel()); }

BackendMaker cudaBackends(const MapperParams& params, const Rules& rules) {
  const int device = gpu::currentDevice();
  return [=](const BlockTable& table) -> std::unique_ptr<MapBackend> {
    gpu::useDevice(device);
    return std::make_unique<gpu::CudaBackend>(params, rules, device, table);
  };
}

}  // namespace dtsdf
