#include "cuda_map.h"

#include <algorithm>

#include "backend/frame_check.h"
#include "backend/fusion_view.h"

namespace dtsdf {
namespace gpu {

CudaMap::CudaMap(const MapperParams& params, const Rules& rules)
    : params_(params),
      rules_(rules),
      fusion_view_(makeFusionView(params)),
      budget_bytes_(static_cast<size_t>(params.map.max_memory_mb) << 20),
      table_(budget_bytes_),
      map_(stream_),
      surfels_(stream_),
      touched_(stream_),
      fusion_(stream_),
      mesher_(rules.mesh, params.map.directional) {
  stream_.setClock(&clock_);
  mesher_.setClock(&clock_);
}

IntegrationResult CudaMap::integrate(const DepthFrame& frame) {
  IntegrationResult result;
  FusionInput input = computeSurfels(frame);
  findTouchedBlocks(input);
  if (counters_.usable_surfels == 0 || counters_.touched == 0) {
    result.status = FrameStatus::kNoMeasurement;
    result.message = noMeasurementMessage(params_);
    return result;
  }
  mesher_.complete();
  const Admission admission = admit();
  result.refused_blocks = admission.refused;
  refused_ += admission.refused;
  fuse(input, admission);
  return result;
}

FusionInput CudaMap::computeSurfels(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  touched_.begin();  // before the upload, which it runs beside
  surfels_.upload(frame, stream_);
  const RawDepth raw{frame.encoding, frame.unit_m};
  uint32_t* count = touched_.usableSurfels();
  if (params_.fusion.mode == FusionMode::kVoxelProjection) {
    surfels_.computePixels(raw, view, params_, count, stream_);
    return {view, fusion_view_, surfels_.surfels(), surfels_.room(), nullptr, nullptr,
            surfels_.noise()};
  }
  surfels_.computeGroups(raw, view, params_, count, stream_);
  return {view, fusion_view_, surfels_.surfels(), surfels_.room(), count, surfels_.freeDepth(),
          surfels_.noise()};
}

void CudaMap::findTouchedBlocks(FusionInput& input) {
  touched_.mark(input);
  recycleEmpty();  // of the frame before, whose last kernels may have run until now
  touched_.compare(input, map_.view());
  counters_ = touched_.waitForCounters();
  while (counters_.table_full || counters_.usable_surfels > input.room) {
    if (counters_.usable_surfels > input.room) {
      touched_.begin();
      surfels_.makeRoom(counters_.usable_surfels, input.frame, params_, touched_.usableSurfels(),
                        stream_);
      input.surfels = surfels_.surfels();
      input.room = surfels_.room();
    } else {
      touched_.grow();
    }
    touched_.mark(input);
    touched_.compare(input, map_.view());
    counters_ = touched_.waitForCounters();
  }
}

MapDemand CudaMap::demandOfFrame() const {
  const auto within = [this](size_t wanted, size_t bytes_each, size_t at_least) {
    return std::max(std::min(wanted, budget_bytes_ / bytes_each), at_least);
  };
  return {counters_.requests, counters_.requested_arrays,
          within(table_.blocksInUse() + counters_.requests, BlockTable::kBlockBytes,
                 table_.slotCount()),
          within(table_.arraysInUse() + counters_.requested_arrays, BlockTable::kArrayBytes,
                 table_.arrayCount())};
}

/// All device memory is taken before the table changes: without it, the frame fails as a whole and
/// the map stays as it was.
Admission CudaMap::admit() {
  const StageTimer timer(clock_.profile(), Stage::kAdmit);
  fusion_.reserve(counters_, params_.fusion.mode);
  if (counters_.requests == 0) return Admission();
  map_.reserve(table_, demandOfFrame());
  Admission admission = table_.admit(touched_.fetchRequests());
  map_.apply(table_, admission);
  if (!admission.changed_slots.empty()) touched_.refresh(map_.view());
  return admission;
}

void CudaMap::fuse(const FusionInput& input, const Admission& admission) {
  countWork(input, admission);
  holdForProfile(stream_);
  const MapView map = map_.view();
  if (params_.fusion.mode == FusionMode::kVoxelProjection) {
    fusion_.projectVoxels(input, map, touched_.view(), counters_);
  } else {
    fusion_.castSurfels(input, map, touched_.view(), counters_);
  }
  dirty_bound_ += counters_.touched;
  fusion_.finish(input, map, touched_, counters_, admission.changed_slots.size());
}

/// Puts off the release of what the last frame left empty until the map is looked at again, so that
/// integrate() need not wait for the frame.
void CudaMap::recycleEmpty() {
  std::vector<SlotUpdate> updates;
  for (const EmptyBlock& empty : fusion_.takeEmptyBlocks()) {
    for (int d = 0; d < kDirectionCount; ++d) {
      if (empty.directions >> d & 1) table_.releaseArray(empty.slot, d);
    }
    SlotUpdate update = makeSlotUpdate(table_.block(empty.slot), empty.slot);
    const auto& arrays = update.entry.array;
    update.in_use = std::any_of(arrays, arrays + kDirectionCount,
                                [](int32_t array) { return array != kNoArray; });
    if (!update.in_use) table_.releaseBlock(empty.slot);
    updates.push_back(update);
  }
  map_.apply(updates);
}

void CudaMap::beginMeshUpdate() {
  if (mesher_.isUnderWay()) mesher_.finish();  // as on the CPU, its changes are lost
  recycleEmpty();
  stream_.record(map_ready_);
  mesher_.begin(map_.view(), map_ready_, dirty_bound_);
  dirty_bound_ = 0;
}

MeshUpdate CudaMap::finishMeshUpdate() {
  MeshUpdate update = mesher_.finish();
  if (clock_.profile() != nullptr) {
    stream_.synchronize();
    clock_.collect();
  }
  return update;
}

void CudaMap::countWork(const FusionInput& input, const Admission& admission) {
  if (clock_.profile() == nullptr) return;
  WorkCounts& work = clock_.profile()->work;
  work.pixels += input.pixels();
  work.raw_bytes += surfels_.rawBytes();
  work.surfels += counters_.usable_surfels;
  work.touched_blocks += counters_.touched;
  work.touched_arrays += counters_.touched_arrays;
  work.new_blocks += admission.changed_slots.size();
  work.new_arrays += admission.new_arrays.size();
}

void CudaMap::profileTo(Profile* profile) {
  stream_.synchronize();
  mesher_.complete();
  clock_.profileTo(profile);
}

std::vector<MemoryPart> CudaMap::memory() {
  recycleEmpty();
  std::vector<MemoryPart> parts;
  map_.addMemory(table_, parts);
  mesher_.addMemory(parts);
  surfels_.addMemory(parts);
  touched_.addMemory(parts);
  fusion_.addMemory(parts);
  parts.push_back({"block table (host)", MemoryKind::kStaging, table_.memoryBytes(),
                   table_.memoryBytes()});
  return parts;
}

MapStats CudaMap::stats() {
  recycleEmpty();
  return {table_.blocksInUse(), table_.arraysInUse(), table_.bytesInUse(), refused_};
}

std::vector<BlockSnapshot> CudaMap::snapshot() {
  recycleEmpty();
  const VoxelPool& pool = map_.voxels();
  PinnedBuffer<Voxel> slab(VoxelPool::kSlabElements);
  std::vector<std::vector<Voxel>> slabs(pool.slabCount());
  for (size_t i = 0; i < slabs.size(); ++i) {
    pool.downloadSlab(i, slab.data(), stream_);
    stream_.synchronize();
    slabs[i].assign(slab.data(), slab.data() + VoxelPool::kSlabElements);
  }
  std::vector<BlockSnapshot> blocks;
  for (const int32_t slot : table_.sortedSlots()) {
    const BlockEntry& entry = table_.block(slot);
    BlockSnapshot copy;
    copy.key = entry.key;
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = entry.array[d];
      if (array == kNoArray) continue;
      const Voxel* voxels = &slabs[array / VoxelPool::kSlabRecords]
                                  [array % VoxelPool::kSlabRecords * kVoxelsPerBlock];
      copy.voxels[d].assign(voxels, voxels + kVoxelsPerBlock);
    }
    blocks.push_back(std::move(copy));
  }
  return blocks;
}

}  // namespace gpu
}  // namespace dtsdf
