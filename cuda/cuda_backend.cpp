#include "cuda_backend.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "align.h"
#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "block_mesher.h"
#include "clear.h"
#include "distances.h"
#include "fusion.h"
#include "kernels/fusion/free_space.h"
#include "map/memory_budget.h"
#include "move_records.h"
#include "paint.h"
#include "raw_image.h"
#include "render.h"
#include "runtime/device.h"
#include "see_free.h"
#include "space/space_map.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Holds a map on a device, and runs the stages that fuse frames into it, mesh it and render it.
class CudaBackend : public MapBackend {
 public:
  CudaBackend(const MapperParams& params, const Rules& rules, int device, const BlockTable& table)
      : params_(params),
        fusion_rules_(rules.fusion),
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
        free_cell_finder_(cellLog2Of(params), params.space.max_range_m, stream_),
        distance_maker_(std::make_shared<DistanceComputer>(freeBudgetOf(params))),
        record_mover_(stream_) {}

  ~CudaBackend() override { stream_.drain(); }

  /// The host computes distances if there is not enough memory for them on the device.
  BackendTraits traits() const override {
    BackendTraits traits;
    traits.name = "cuda (" + deviceName() + ")";
    traits.indexes_blocks_itself = true;
    traits.distance_work = [maker = distance_maker_, device = device_](const DistanceTask& task,
                                                                       auto& squares) {
      useDevice(device);
      try {
        return maker->make(task, squares);
      } catch (const BackendError& error) {
        if (!error.isOutOfMemory()) throw;
        return false;
      }
    };
    return traits;
  }

  void enter() override { useDevice(device_); }

  void addMemory(MapperMemory& memory) const override {
    map_.addMemory(table_, memory);
    mesher_.addMemory(memory);
    raw_image_.addMemory(memory);
    aligner_.addMemory(memory);
    sensor_.addMemory(memory);
    surfel_maker_.addMemory(memory);
    block_finder_.addMemory(memory);
    fusion_.addMemory(memory);
    clearing_.addMemory(memory);
    painter_.addMemory(memory);
    renderer_.addMemory(memory);
    record_mover_.addMemory(memory);
    if (params_.space.enabled) {
      free_cell_finder_.addMemory(memory);
      distance_maker_->addMemory(memory);
    }
    memory.on_gpu = true;
    memory.staging += table_.memoryBytes();
  }

  void takePoints(const DepthFrame& frame, const FrameView& view) override {
    raw_image_.upload(frame, stream_);
    aligner_.takePoints(view, rawDepthOf(frame));
  }

  AlignmentSums sumsAt(const FrameView& view, float cutoff) override {
    return aligner_.sumsAt(view, cutoff, map_.view());
  }

  void sense(const DepthFrame& frame, const FrameView& view) override {
    raw_image_.upload(frame, stream_);
    sensing_ = sensor_.sense(view, rawDepthOf(frame));
    block_finder_.begin();
  }

  void makeSurfels() override {
    surfels_ = surfel_maker_.makeSurfels(*sensing_, block_finder_.usableSurfels());
  }

  void findBlocks() override { block_finder_.mark(*sensing_, surfels_); }
  TouchedBlocks lookUpBlocks() override {
    compareBlocks();
    counters_ = block_finder_.waitForCounters();
    while (counters_.table_full || counters_.usable_surfels > surfels_.room) findMore();
    return {counters_.touched, block_finder_.fetchRequests(), counters_.requested_arrays};
  }

  /// Enqueues the search for free cells, which runs while the host adds blocks to its table.
  void seeFree(std::vector<Vec3i> cubes) override {
    free_cell_finder_.find(sensing_->frame(), sensor_.freeDepth(), std::move(cubes));
  }

  void reserveFrame(const std::vector<int32_t>& in_view) override {
    in_view_count_ = in_view.size();
    map_.noteDemand({counters_.requests, counters_.requested_arrays});
    fusion_.reserve(counters_);
    clearing_.reserve(counters_, in_view_count_);
    clearing_.storeInView(*sensing_, in_view);
  }

  void castFoldAndClear(uint64_t frame_number, const std::vector<int32_t>&) override {
    fusion_.castAndFold(*sensing_, surfels_, map_.view(), block_finder_.view(), counters_);
    clearing_.findBlocksToCheck(*sensing_, map_.view(), block_finder_.view(), frame_number);
    max_dirty_ += counters_.touched + (sensing_->hasFreeDepth() ? in_view_count_ : 0);
    clearing_.clear(*sensing_, map_.view(), block_finder_.view(), counters_, fusion_.covered(),
                    frame_number);
    mesher_.prepare();
  }

  FrameOutcome takeOutcome() override {
    if (!clearing_.hasOutcome()) return {};
    return {clearing_.takeEmptyBlocks(), free_cell_finder_.take()};
  }

  void takeColours(const ColourFrame& frame) override { painter_.takeImage(frame); }
  SeenColours findColours(const FrameView& view, int32_t min_evidence,
                          const std::vector<int32_t>& in_view) override {
    painter_.findColours(view, min_evidence, in_view, table_.paintedExtent(), map_.view());
    const PaintCounters& seen = painter_.counters();
    if (seen.seen == 0) return {};
    return {true, seen.sums, painter_.fetchRequests()};
  }

  void paint(const Exposure& exposure) override {
    painter_.paint(exposure, map_.view());
    max_painted_ += std::min(painter_.counters().seen, painter_.counters().blocks);
  }

  void render(const ViewRequest& request, RenderedView& view) override {
    waitForMeshes();  // rendering updates labels, which an extraction may be reading
    const bool is_labelled = max_dirty_ == 0 && mesher_.hasLabelsFor(request.min_evidence);
    renderer_.render(request, map_.view(), is_labelled, view);
  }

  void markAll(const MeshMarks& marks) override {
    if (marks.dirty) map_.markAllDirty();
    if (marks.painted) map_.keepColours();
    max_dirty_ += marks.dirty ? table_.slotCount() : 0;
    max_painted_ += marks.painted ? table_.slotCount() : 0;
  }

  void beginMesh(int32_t min_evidence) override {
    stream_.record(map_ready_);
    mesher_.begin(map_.view(), map_ready_, max_dirty_, max_painted_, min_evidence);
    max_dirty_ = max_painted_ = 0;
    block_finder_.prepare();
    map_.reserveAhead(table_);
  }

  void waitForMeshes() override {
    mesher_.complete();
    map_.sendChanges();
  }

  MeshUpdate finishMesh() override {
    waitForMeshes();
    return mesher_.finish();
  }

  void reserve(const MemoryDemand& demand) override {
    if (demand.new_blocks > 0) map_.reserve(table_, demand.new_blocks, demand.new_arrays);
    if (demand.has_colours) map_.reserveColours(table_, demand.new_bricks);
    if (demand.changed == 0) return;
    map_.reserveChanges(demand.changed);
    if (params_.map.page_folder.empty()) return;
    record_mover_.reserve();
    map_.reserveMarks(demand.changed);
  }

  void follow(const TableChanges& changes) override {
    if (changes.new_arrays != nullptr) map_.enterBlocks(table_, changes.slots, *changes.new_arrays);
    if (changes.new_bricks != nullptr) map_.enterColours(*changes.new_bricks);
    if (changes.new_arrays != nullptr || changes.new_bricks != nullptr) return;
    for (const int32_t slot : changes.slots) {
      map_.note(makeSlotUpdate(table_.block(slot), slot, changes.dirty));
    }
    if (changes.dirty) max_dirty_ += changes.slots.size();
    if (!mesher_.isUnderWay()) map_.sendChanges();
  }

  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView& region) override {
    return gpu::emptyRegion(slots, region, map_.view(), stream_);
  }

  /// Always copies labels (marching cubes cases), since the host does not know whether there are
  /// any. Removes marks for the next extraction last, so that marks are kept if an allocation
  /// fails.
  void copyOut(const ContentsOrder& order, MapContents& contents, MeshStates* taken) override {
    record_mover_.download(map_.voxels(), order.arrays, contents.voxels.data());
    record_mover_.download(map_.colours(), order.bricks, contents.colours.data());
    if (taken == nullptr) return;
    const std::vector<int32_t>& slots = order.slots;
    taken->labels = PlainArray<UnitLabels>(slots.size() * kVoxelsPerBlock);
    taken->states.resize(slots.size());
    record_mover_.download(map_.labels(), slots, taken->labels.data());
    const std::vector<MeshMarks> marks = takeMarks(slots);
    for (size_t i = 0; i < slots.size(); ++i) {
      taken->states[i] = {marks[i], mesher_.takeHasMesh(slots[i]), true};
    }
  }

  void copyIn(const ContentsOrder& order, const MapContents& contents,
              const MeshStates* given) override {
    record_mover_.upload(map_.voxels(), order.arrays, contents.voxels.data());
    record_mover_.upload(map_.colours(), order.bricks, contents.colours.data());
    if (given != nullptr) setStates(order.slots, *given);
  }

  /// Does not test whether the frame looks through a block, so the result may contain blocks that
  /// the frame will not change.
  std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                    uint64_t frame_number) override {
    std::vector<PackedKey> keys = block_finder_.fetchTouched();
    if (!sensing_->hasFreeDepth()) return keys;
    const FrameView& frame = sensing_->frame();
    const BlockKey origin = blockOfVoxel(frame.origin_voxel);
    for (const PackedKey key : others) {
      const bool is_in_turn = isInTurn(key, frame_number, fusion_rules_);
      if (is_in_turn && mayBeInView(frame, unpackKey(key) - origin)) keys.push_back(key);
    }
    return keys;
  }

  std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) override {
    return aligner_.keysAt(view, cutoff);
  }

  std::vector<MarkedSlot> marked(bool taken) override {
    if (!hasMarks()) return {};
    const std::vector<MarkedSlot> marked = map_.marked();
    if (!taken) return marked;
    std::vector<int32_t> slots;
    for (const MarkedSlot& one : marked) slots.push_back(one.slot);
    takeMarks(slots);
    return marked;
  }

  void setMarks(const std::vector<MarkedSlot>& marked) override {
    map_.setMarks(marked);
    max_dirty_ += marked.size();
    max_painted_ += marked.size();
  }

 private:
  /// The device adds surfels to sums, and finds how far rays are free, while the host adds blocks.
  void compareBlocks() {
    block_finder_.compare(*sensing_, map_.view());
    fusion_.castAhead(*sensing_, surfels_, block_finder_.view());
    sensor_.findFreeDepths(*sensing_);
  }

  bool hasMarks() const { return max_dirty_ + max_painted_ > 0; }
  /// Reads marks from the device only if some block may be marked.
  std::vector<MeshMarks> takeMarks(const std::vector<int32_t>& slots) {
    return hasMarks() ? map_.takeMarks(slots) : std::vector<MeshMarks>(slots.size());
  }

  /// Sets the labels and marks of slots. Marks of blocks that used these slots before are removed.
  void setStates(const std::vector<int32_t>& slots, const MeshStates& given) {
    record_mover_.upload(map_.labels(), slots, given.labels.data());
    takeMarks(slots);
    std::vector<MarkedSlot> marked;
    for (size_t i = 0; i < slots.size(); ++i) {
      const MeshState& state = given.states[i];
      mesher_.setHasMesh(slots[i], state.has_mesh);
      if (state.marks.any()) marked.push_back({slots[i], state.marks});
    }
    setMarks(marked);
  }

  RawDepth rawDepthOf(const DepthFrame& frame) const {
    return {raw_image_.data(), frame.width, frame.height, frame.encoding == DepthEncoding::kUint16,
            depthRangeOf(frame, params_)};
  }

  /// Repeats the search for touched blocks with larger buffers, if not all surfels or blocks
  /// fitted.
  void findMore() {
    if (counters_.usable_surfels > surfels_.room) {
      block_finder_.begin();
      surfels_ = surfel_maker_.remakeSurfels(*sensing_, counters_.usable_surfels,
                                             block_finder_.usableSurfels());
    } else {
      block_finder_.grow();
    }
    findBlocks();
    compareBlocks();
    counters_ = block_finder_.waitForCounters();
  }

  const MapperParams params_;
  const FusionRules fusion_rules_;
  const int device_;
  const BlockTable& table_;
  Stream stream_;  ///< For all work except extractions, distances and colour uploads.
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
  FreeCellFinder free_cell_finder_;
  std::shared_ptr<DistanceComputer> distance_maker_;
  RecordMover record_mover_;
  size_t in_view_count_ = 0;              ///< Number of blocks that may be in view.
  std::optional<DeviceSensing> sensing_;  ///< From the last depth image.
  DeviceSurfels surfels_ = {};
  FrameCounters counters_ = {};
  size_t max_dirty_ = 0, max_painted_ = 0;  ///< Upper bounds on the numbers of marked blocks.
};

}  // namespace
}  // namespace gpu

std::string findCudaProblem() { return gpu::findDeviceProblem(gpu::anyKernel()); }

size_t cudaMemoryTaken() {
  size_t free = 0, total = 0;
  DTSDF_CHECK_CUDA(cudaMemGetInfo(&free, &total));
  return total - free;
}

BackendMaker cudaBackends(const MapperParams& params, const Rules& rules) {
  const int device = gpu::currentDevice();
  return [=](const BlockTable& table) -> std::unique_ptr<MapBackend> {
    gpu::useDevice(device);
    return std::make_unique<gpu::CudaBackend>(params, rules, device, table);
  };
}

}  // namespace dtsdf
