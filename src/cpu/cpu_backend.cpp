#include "cpu/cpu_backend.h"

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "backend/frame_check.h"
#include "backend/map_backend.h"
#include "backend/rule_settings.h"
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
#include "kernels/core/direction.h"
#include "kernels/core/region.h"
#include "kernels/fusion/free_space.h"
#include "kernels/fusion/voxel_update.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

constexpr size_t kArraysAtATime = 64;  ///< Number of arrays a thread clears or copies at a time.

/// Empties the voxels of a block that lie in a region, but keeps their colours.
EmptiedBlock emptyBlock(const BlockEntry& entry, const RegionView& region, VoxelStore& voxels) {
  const Vec3i first = firstVoxelOfBlock(entry.key);
  bool inside[kVoxelsPerBlock];
  for (int i = 0; i < kVoxelsPerBlock; ++i) inside[i] = isInside(region, first + voxelOffset(i));
  EmptiedBlock result{0, 0};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* array = voxels.array(entry.array[d]);
    uint32_t emptied = 0;
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      if (!inside[i]) continue;
      emptied += isEmpty(array[i]) ? 0u : 1u;
      array[i] = Voxel{};
    }
    if (emptied == 0) continue;
    result.voxels += emptied;
    const auto holds = [](const Voxel& voxel) { return !isEmpty(voxel); };
    if (std::none_of(array, array + kVoxelsPerBlock, holds)) result.empty_directions |= 1u << d;
  }
  return result;
}

/// A map in host memory, and the stages that fuse, mesh and render it.
class CpuBackend : public MapBackend {
 public:
  CpuBackend(const MapperParams& params, const Rules& rules, const BlockTable& table)
      : params_(params),
        rules_(rules),
        fusion_(makeFusionSettings(params, rules)),
        threads_(cpuThreads(params)),
        map_{table, {}, {}},
        aligner_(makeAlignmentSettings(params, rules), params.map.directional, threads_),
        sensor_(params, rules, threads_),
        surfel_maker_(params, rules.surfels, threads_),
        block_finder_(fusion_, threads_),
        painter_(makePaintSettings(params, rules), threads_),
        mesher_(map_, makeMeshSettings(params, rules), params.map.directional, threads_,
                params.mesh.refine != 0),
        renderer_(map_, mesher_, threads_),
        free_cell_finder_(params, threads_) {}

  BackendTraits traits() const override {
    BackendTraits traits;
    traits.name = "cpu (" + std::to_string(threads_) + (threads_ == 1 ? " thread)" : " threads)");
    traits.meshes_at_once = true;
    return traits;
  }

  void enter() override {}
  void profileTo(Profile* profile) override {
    profile_ = profile;
    mesher_.profileTo(profile);
  }

  void addMemory(MapperMemory& memory) const override {
    memory.spare += map_.table.spareOf(map_.voxels.bytes() + map_.colours.bytes());
    memory.indices += map_.table.memoryBytes() + mesher_.bytes() +
                      last_touched_.capacity() * sizeof(last_touched_[0]);
    memory.scratch += sensor_.bytes() + surfel_maker_.bytes() + block_finder_.bytes() +
                      painter_.bytes() + renderer_.bytes() + free_cell_finder_.bytes();
  }

  void takePoints(const DepthFrame& frame, const FrameView& view) override {
    aligner_.takePoints(frame, view, depthRangeOf(frame, params_));
  }

  AlignmentSums sumsAt(const FrameView& view, float cutoff) override {
    return aligner_.sumsAt(view, cutoff, map_);
  }

  void sense(const DepthFrame& frame, const FrameView&) override {
    const StageTimer timer(profile_, Stage::kSense);
    sensing_ = sensor_.sense(frame);
  }

  void makeSurfels() override {
    const StageTimer timer(profile_, Stage::kMakeSurfels);
    surfel_maker_.makeSurfels(sensing_);
  }

  void findBlocks() override {
    const StageTimer timer(profile_, Stage::kFindBlocks);
    block_finder_.findBlocks(surfel_maker_.lists(), sensing_);
  }

  TouchedBlocks lookUpBlocks() override {
    const StageTimer timer(profile_, Stage::kFindBlocks);
    TouchedBlocks touched;
    touched.blocks = block_finder_.touched().size();
    for (const TouchedBlock& block : block_finder_.touched()) {
      const int32_t slot = map_.table.find(block.key);
      uint32_t missing = block.directions;
      if (slot >= 0) missing &= ~directionsWithArrays(map_.table.block(slot));
      if (missing != 0) touched.requests.push_back({block.key, block.directions});
    }
    touched.new_arrays = map_.table.countNew(touched.requests).arrays;
    return touched;
  }

  void seeFree(std::vector<Vec3i> cubes) override {
    const StageTimer timer(profile_, Stage::kSeeFree);
    free_cubes_ = free_cell_finder_.find(sensing_, cubes);
  }

  void reserveFrame(const std::vector<int32_t>&) override {}

  /// Casts (or projects), folds and clears in one loop over the touched blocks, so that the sums of
  /// a block stay in the cache. The profile counts this loop as "cast".
  void castFoldAndClear(uint64_t frame_number, const std::vector<int32_t>& in_view) override {
    const std::vector<TouchedBlock>& blocks = block_finder_.touched();
    std::vector<EmptyBlock> outcome(blocks.size(), EmptyBlock{-1, 0});
    last_touched_.resize(map_.table.slotCount(), 0);
    std::optional<StageTimer> timer(std::in_place, profile_, Stage::kCast);
    parallelFor<BlockSums>(blocks.size(), threads_, [&](size_t i, BlockSums& sums) {
      const int32_t slot = map_.table.find(blocks[i].key);
      if (slot < 0) return;
      outcome[i] = {slot, fuseBlock(blocks[i], map_.table.block(slot), frame_number, sums)};
      last_touched_[slot] = frame_number;
    });
    timer.emplace(profile_, Stage::kClear);
    for (const EmptyBlock& block : outcome) {
      if (block.slot < 0) continue;
      mesher_.markDirty(block.slot);
      if (block.directions != 0) outcome_.empty.push_back(block);
    }
    if (!free_cubes_.empty()) outcome_.free = std::exchange(free_cubes_, {});
    if (clearsFreeSpace(params_)) clearUntouched(frame_number, in_view);
  }

  FrameOutcome takeOutcome() override { return std::exchange(outcome_, FrameOutcome()); }

  void takeColours(const ColourFrame& frame) override {
    const StageTimer timer(profile_, Stage::kPaint);
    painter_.takeImage(frame);
  }

  SeenColours findColours(const FrameView& view, int32_t min_evidence,
                          const std::vector<int32_t>& in_view) override {
    const StageTimer timer(profile_, Stage::kPaint);
    SeenColours seen = painter_.findColours(view, min_evidence, in_view, map_);
    seen.requests = painter_.requests(map_);
    return seen;
  }

  void paint(const Exposure& exposure) override {
    const StageTimer timer(profile_, Stage::kPaint);
    for (const int32_t slot : painter_.paint(exposure, map_)) mesher_.markPainted(slot);
  }

  void render(const ViewRequest& request, RenderedView& view) override {
    const StageTimer timer(profile_, Stage::kRender);
    renderer_.render(request.frame, request.min_evidence, request.has_colours, view);
  }

  void markAll(const MeshMarks& marks) override {
    if (marks.dirty) mesher_.markAllDirty();
    if (marks.painted) mesher_.keepColours();
  }

  void beginMesh(int32_t min_evidence) override {
    const auto start = std::chrono::steady_clock::now();
    meshes_ = mesher_.update(min_evidence);
    meshes_.duration_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }

  void waitForMeshes() override {}
  MeshUpdate finishMesh() override { return std::exchange(meshes_, MeshUpdate()); }

  void reserve(const MemoryDemand& demand) override {
    const PoolSizes after = map_.table.sizesAfter(demand.new_blocks, demand.new_arrays);
    map_.voxels.resize(after.arrays);
    mesher_.resize(after.slots);
    map_.colours.resize(map_.table.colourCount() + demand.new_bricks);
  }

  void follow(const TableChanges& changes) override {
    for (const int32_t slot : changes.slots) {
      if (!map_.table.block(slot).in_use) {
        mesher_.forget(slot);
        if (static_cast<size_t>(slot) < last_touched_.size()) last_touched_[slot] = 0;
      } else if (changes.dirty) {
        mesher_.markDirty(slot);
      }
    }
    if (changes.new_arrays != nullptr) {
      const std::vector<int32_t>& arrays = *changes.new_arrays;
      parallelFor<kArraysAtATime>(arrays.size(), threads_, [&](size_t i) {
        std::memset(map_.voxels.array(arrays[i]), 0, BlockTable::kArrayBytes);
      });
    }
    if (changes.new_bricks == nullptr) return;
    for (const NewBrick& brick : *changes.new_bricks) {
      std::memset(map_.colours.array(brick.colours), 0, BlockTable::kColourBytes);
    }
  }

  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView& region) override {
    std::vector<EmptiedBlock> emptied(slots.size());
    parallelFor(slots.size(), threads_, [&](size_t i) {
      const BlockEntry& entry = map_.table.block(slots[i]);
      emptied[i] = emptyBlock(entry, region, map_.voxels);
      if (emptied[i].voxels > 0 && map_.table.coloursInUse() > 0) {
        forgetColours(entry, kAllDirections, map_);
      }
    });
    return emptied;
  }

  void copyOut(const ContentsOrder& order, MapContents& contents, MeshStates* taken) override {
    parallelFor<kArraysAtATime>(order.arrays.size(), threads_, [&](size_t i) {
      std::memcpy(contents.voxels.data() + i * kVoxelsPerBlock, map_.voxels.array(order.arrays[i]),
                  BlockTable::kArrayBytes);
    });
    parallelFor<kArraysAtATime>(order.bricks.size(), threads_, [&](size_t i) {
      std::memcpy(contents.colours.data() + i * kVoxelsPerBrick,
                  map_.colours.array(order.bricks[i]), BlockTable::kColourBytes);
    });
    if (taken != nullptr) *taken = mesher_.takeStates(order.slots);
  }

  void copyIn(const ContentsOrder& order, const MapContents& contents,
              const MeshStates* given) override {
    parallelFor<kArraysAtATime>(order.arrays.size(), threads_, [&](size_t i) {
      std::memcpy(map_.voxels.array(order.arrays[i]), contents.voxels.data() + i * kVoxelsPerBlock,
                  BlockTable::kArrayBytes);
    });
    parallelFor<kArraysAtATime>(order.bricks.size(), threads_, [&](size_t i) {
      std::memcpy(map_.colours.array(order.bricks[i]),
                  contents.colours.data() + i * kVoxelsPerBrick, BlockTable::kColourBytes);
    });
    if (given != nullptr) mesher_.restoreStates(order.slots, *given);
  }

  std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                    uint64_t frame_number) override {
    std::vector<PackedKey> keys;
    for (const TouchedBlock& block : block_finder_.touched()) keys.push_back(block.key);
    for (const PackedKey key : others) {
      if (isDueForClearing(unpackKey(key), frame_number)) keys.push_back(key);
    }
    return keys;
  }

  std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) override {
    return aligner_.keysAt(view, cutoff);
  }

  std::vector<MarkedSlot> marked(bool taken) override {
    std::vector<MarkedSlot> marked;
    for (const int32_t slot : mesher_.marked()) {
      marked.push_back({slot, taken ? mesher_.takeMarks(slot) : mesher_.marksOf(slot)});
    }
    return marked;
  }

  void setMarks(const std::vector<MarkedSlot>& marked) override {
    for (const MarkedSlot& one : marked) mesher_.setMarks(one.slot, one.marks);
  }

 private:
  bool isDueForClearing(const BlockKey& key, uint64_t frame_number) const {
    if (!isInTurn(packKey(key), frame_number, rules_.fusion)) return false;
    const FrameView& frame = sensing_.image.frame;
    const Vec3i block_L = key - blockOfVoxel(frame.origin_voxel);
    return mayBeInView(frame, block_L) &&
           maySeeThroughBlock(sensing_, toFloat(firstVoxelOfBlock(block_L)),
                              fusion_.truncation_voxels);
  }

  /// Casts (or projects), folds and clears a touched block. Thread-safe for different blocks.
  /// @return the directions whose arrays are empty afterwards, one bit each.
  uint32_t fuseBlock(const TouchedBlock& block, const BlockEntry& entry, uint64_t frame_number,
                     BlockSums& sums) {
    const FrameView& frame = sensing_.image.frame;
    const bool casts = castsSurfels(params_);
    // With voxel projection, a voxel may take a surfel that does not touch the voxel's block.
    const uint32_t directions = casts ? block.directions : kAllDirections;
    prefetchBlock(entry, map_, directions);
    if (casts) {
      cast(block, block_finder_, fusion_, sums);
    } else {
      project(block, surfel_maker_.lists().front(), frame, fusion_, sums);
    }
    const float depth_weight = blockDepthWeight(frame, block.block_L, rules_.fusion);
    uint32_t empty = fold(sums, directions, entry, depth_weight, fusion_, map_.voxels);
    if (clearsFreeSpace(params_)) {
      const BlockCheck check{block.block_L, isInTurn(block.key, frame_number, rules_.fusion), &sums,
                             directions, params_.map.directional};
      empty |= clear(check, entry).empty_directions;
    }
    return empty;
  }

  /// Clears a block, and removes the colours of voxels that lose their distance. Thread-safe for
  /// different blocks.
  ClearedBlock clear(const BlockCheck& check, const BlockEntry& entry) {
    const ClearedBlock cleared = clearBlock(check, entry, sensing_, rules_.fusion, map_.voxels);
    if (cleared.emptied_directions != 0 && map_.table.coloursInUse() > 0) {
      forgetColours(entry, cleared.emptied_directions, map_);
    }
    return cleared;
  }

  /// Clears the untouched blocks whose turn it is in this frame (isInTurn()).
  void clearUntouched(uint64_t frame_number, const std::vector<int32_t>& in_view) {
    std::vector<int32_t> slots;
    for (const int32_t slot : in_view) {
      if (last_touched_[slot] == frame_number) continue;
      const BlockEntry& entry = map_.table.block(slot);
      if (!entry.in_use || !isDueForClearing(entry.key, frame_number)) continue;
      slots.push_back(slot);
    }
    std::vector<ClearedBlock> cleared(slots.size());
    const BlockKey origin = blockOfVoxel(sensing_.image.frame.origin_voxel);
    parallelFor(slots.size(), threads_, [&](size_t i) {
      const BlockEntry& entry = map_.table.block(slots[i]);
      const BlockCheck check{entry.key - origin, true, nullptr, 0, params_.map.directional};
      cleared[i] = clear(check, entry);
    });
    for (size_t i = 0; i < slots.size(); ++i) {
      if (cleared[i].changed) mesher_.markDirty(slots[i]);
      if (cleared[i].empty_directions == 0) continue;
      outcome_.empty.push_back({slots[i], cleared[i].empty_directions});
    }
  }

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
  FrameSensing sensing_ = {};           ///< From the last depth image.
  std::vector<uint64_t> last_touched_;  ///< Per slot, the last frame that touched it; 0: none.
  std::vector<CubeMask> free_cubes_;    ///< Free cells found in an image that is not yet fused.
  FrameOutcome outcome_;
  MeshUpdate meshes_;
  Profile* profile_ = nullptr;
};

}  // namespace

int cpuThreads(const MapperParams& params) {
  cpu_set_t cores;
  const bool asks = params.threads == 0 && sched_getaffinity(0, sizeof(cores), &cores) == 0;
  return asks ? CPU_COUNT(&cores) : threadCount(params.threads);
}

BackendMaker cpuBackends(const MapperParams& params, const Rules& rules) {
  return
      [=](const BlockTable& table) { return std::make_unique<CpuBackend>(params, rules, table); };
}

}  // namespace dtsdf
