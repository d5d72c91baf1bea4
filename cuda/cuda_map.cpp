#include "cuda_map.h"

#include "backend/frame_check.h"
#include "backend/gather_colours.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/evidence.h"

namespace dtsdf {
namespace gpu {
namespace {

/// A pool of arrays, in host memory.
template <class T>
class HostCopy {
 public:
  template <class Pool>
  HostCopy(const Pool& pool, const Stream& stream)
      : record_elements_(Pool::kSlabElements / Pool::kSlabRecords) {
    PinnedBuffer<T> slab(Pool::kSlabElements);
    for (size_t i = 0; i < pool.slabCount(); ++i) {
      pool.downloadSlab(i, slab.data(), stream);
      stream.synchronize();
      elements_.insert(elements_.end(), slab.data(), slab.data() + Pool::kSlabElements);
    }
  }

  const T* record(int32_t i) const {
    return elements_.data() + static_cast<size_t>(i) * record_elements_;
  }

 private:
  size_t record_elements_;
  std::vector<T> elements_;
};

}  // namespace

CudaMap::CudaMap(const MapperParams& params, const Rules& rules)
    : params_(params),
      rules_(rules),
      table_(static_cast<size_t>(params.map.max_memory_mb) << 20),
      map_(stream_),
      sensor_(params, rules, stream_),
      surfel_maker_(params, rules.surfels, stream_),
      block_finder_(makeFusionSettings(params, rules.fusion), stream_),
      fusion_(params, rules, stream_),
      painter_(rules.colour, params.map.directional, stream_),
      mesher_(rules.mesh, params.map.directional, params.mesh.refine != 0) {
  stream_.setClock(&clock_);
  mesher_.setClock(&clock_);
}

/// The way of a frame; CpuMapper::fuse() is the same on the CPU.
IntegrationResult CudaMap::fuse(const DepthFrame& frame) {
  upload(frame);
  const DeviceSensing sensing = sense(frame);
  DeviceSurfels surfels = makeSurfels(sensing);
  findBlocks(sensing, surfels);
  if (counters_.touched == 0 && !clearsFromAfar(frame, params_)) return noMeasurement(params_);
  const Admission admission = admit();
  countWork(sensing.frame(), admission);
  castAndFold(sensing, surfels);
  clear(sensing);
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

void CudaMap::upload(const DepthFrame& frame) {
  block_finder_.begin();  // before the upload, which it runs beside
  raw_image_.upload(frame, stream_);
}

DeviceSensing CudaMap::sense(const DepthFrame& frame) {
  return sensor_.sense(makeFrameView(frame, params_.map.voxel_size_m),
                       {raw_image_.data(), frame.encoding == DepthEncoding::kUint16,
                        depthRangeOf(frame, params_)});
}

DeviceSurfels CudaMap::makeSurfels(const DeviceSensing& sensing) {
  return surfel_maker_.makeSurfels(sensing, block_finder_.usableSurfels());
}

/// Once more with larger buffers, if there were more surfels or blocks than expected.
void CudaMap::findBlocks(const DeviceSensing& sensing, DeviceSurfels& surfels) {
  block_finder_.mark(sensing, surfels);
  recycleEmpty();  // of the frame before, whose last kernels may have run until now
  block_finder_.compare(sensing, map_.view());
  counters_ = block_finder_.waitForCounters();
  while (counters_.table_full || counters_.usable_surfels > surfels.room) {
    if (counters_.usable_surfels > surfels.room) {
      block_finder_.begin();
      surfels = surfel_maker_.makeMoreSurfels(sensing, counters_.usable_surfels,
                                              block_finder_.usableSurfels());
    } else {
      block_finder_.grow();
    }
    block_finder_.mark(sensing, surfels);
    block_finder_.compare(sensing, map_.view());
    counters_ = block_finder_.waitForCounters();
  }
}

/// All device memory is taken before the table changes: without it, the frame fails as a whole and
/// the map stays as it was.
Admission CudaMap::admit() {
  mesher_.complete();
  const StageTimer timer(clock_.profile(), Stage::kAdmit);
  const PoolSizes after =
      table_.sizesAfter(counters_.requests, counters_.requested_arrays);
  fusion_.reserve(counters_, after.slots);
  if (counters_.requests == 0) return Admission();
  map_.reserve(table_, {counters_.requests, counters_.requested_arrays, after});
  Admission admission = table_.admit(block_finder_.fetchRequests());
  map_.apply(table_, admission);
  if (!admission.changed_slots.empty()) block_finder_.refresh(map_.view());
  refused_ += admission.refused;
  return admission;
}

void CudaMap::castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels) {
  holdForProfile(stream_);
  fusion_.castAndFold(sensing, surfels, {map_.view(), block_finder_.view()}, counters_);
}

void CudaMap::clear(const DeviceSensing& sensing) {
  ++frames_;
  if (counters_.touched > 0) ++supporting_frames_;
  dirty_bound_ += sensing.hasFreeDepth() ? table_.slotCount() : counters_.touched;
  fusion_.clear(sensing, {map_.view(), block_finder_.view()}, counters_, frames_);
}

/// The way of a colour image; CpuMapper::paint() is the same on the CPU.
IntegrationResult CudaMap::paint(const ColourFrame& frame) {
  recycleEmpty();
  painter_.look(frame, makeFrameView(frame, params_.map.voxel_size_m), leastEvidenceNow(),
                map_.view());
  const LookCounters& seen = painter_.counters();
  if (seen.seen == 0) return nothingToPaint();
  const ColourAdmission admission = admitColours();
  if (map_.hasColours()) painter_.paint(map_.view());
  painted_bound_ += seen.seen;
  if (clock_.profile() != nullptr) {
    clock_.profile()->work.colour_pixels += static_cast<uint64_t>(frame.width) * frame.height;
    clock_.profile()->work.painted_voxels += seen.samples;
  }
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

/// As admit(): all memory is taken before the table changes.
ColourAdmission CudaMap::admitColours() {
  mesher_.complete();
  std::vector<ColourRequest> requests = painter_.fetchRequests();
  const bool had_colours = map_.hasColours();
  map_.reserveColours(table_, table_.countNewColours(requests));
  ColourAdmission admission = table_.admitColours(std::move(requests));
  map_.apply(admission);
  if (map_.hasColours() && !had_colours) {  // what was meshed without colours gets them
    map_.markAllPainted();
    painted_bound_ += table_.slotCount();
  }
  refused_ += admission.refused;
  return admission;
}

int32_t CudaMap::leastEvidenceNow() const {
  return leastEvidence(params_.mesh.min_support, supporting_frames_, rules_.fusion);
}

/// Puts off the release of what the last frame left empty until the map is looked at again, so that
/// integrate() need not wait for the frame.
void CudaMap::recycleEmpty() {
  const std::vector<EmptyBlock> empty_blocks = fusion_.takeEmptyBlocks();
  for (const EmptyBlock& empty : empty_blocks) table_.vacate(empty.slot, empty.directions);
  if (!is_meshed_) table_.releaseVacant(table_.takeVacant());
  // One update for all: the buffer that they are sent from is not free before the next frame.
  std::vector<SlotUpdate> updates;
  for (const EmptyBlock& empty : empty_blocks) {
    updates.push_back(makeSlotUpdate(table_.block(empty.slot), empty.slot));
  }
  map_.apply(updates);
}

void CudaMap::beginMeshUpdate() {
  if (mesher_.isUnderWay()) mesher_.finish();  // as on the CPU, its changes are lost
  recycleEmpty();
  is_meshed_ = true;
  const std::vector<int32_t> vacant = table_.takeVacant();
  vacant_.insert(vacant_.end(), vacant.begin(), vacant.end());
  const int32_t least = leastEvidenceNow();
  if (least != least_evidence_) {
    map_.markAllDirty();
    dirty_bound_ += table_.slotCount();
    least_evidence_ = least;
  }
  stream_.record(map_ready_);
  mesher_.begin(map_.view(), map_ready_, {dirty_bound_, painted_bound_, least});
  dirty_bound_ = painted_bound_ = 0;
}

/// As CpuMapper::releaseVacant().
void CudaMap::releaseVacant(const std::vector<int32_t>& slots) {
  std::vector<SlotUpdate> updates;
  for (const int32_t slot : table_.releaseVacant(slots)) {
    updates.push_back(makeSlotUpdate(table_.block(slot), slot));
  }
  map_.apply(updates);
}

MeshUpdate CudaMap::finishMeshUpdate() {
  MeshUpdate update = mesher_.finish();
  releaseVacant(vacant_);
  vacant_.clear();
  if (clock_.profile() != nullptr) {
    stream_.synchronize();
    clock_.collect();
  }
  return update;
}

void CudaMap::countWork(const FrameView& frame, const Admission& admission) {
  if (clock_.profile() == nullptr) return;
  WorkCounts& work = clock_.profile()->work;
  work.pixels += static_cast<uint64_t>(frame.width) * frame.height;
  work.raw_bytes += raw_image_.bytes();
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
  raw_image_.addMemory(parts);
  sensor_.addMemory(parts);
  surfel_maker_.addMemory(parts);
  block_finder_.addMemory(parts);
  fusion_.addMemory(parts);
  painter_.addMemory(parts);
  parts.push_back({"block table (host)", MemoryKind::kStaging, table_.memoryBytes(),
                   table_.memoryBytes()});
  return parts;
}

MapStats CudaMap::stats() {
  recycleEmpty();
  return {table_.blocksInUse(), table_.arraysInUse(), table_.bytesInUse(), refused_,
          table_.coloursInUse() * BlockTable::kColourBytes};
}

std::vector<BlockSnapshot> CudaMap::snapshot() {
  recycleEmpty();
  const HostCopy<Voxel> voxels(map_.voxels(), stream_);
  const HostCopy<VoxelColour> colours(map_.colours(), stream_);
  std::vector<BlockSnapshot> blocks;
  for (const int32_t slot : table_.sortedSlots()) {
    const BlockEntry& entry = table_.block(slot);
    BlockSnapshot copy;
    copy.key = entry.key;
    bool holds_voxels = false;
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = entry.array[d];
      if (array == kNoArray) continue;
      copy.voxels[d].assign(voxels.record(array), voxels.record(array) + kVoxelsPerBlock);
      copy.colours[d] =
          gatherColours(table_, array, [&](int32_t brick) { return colours.record(brick); });
      holds_voxels = true;
    }
    if (holds_voxels) blocks.push_back(std::move(copy));
  }
  return blocks;
}

}  // namespace gpu
}  // namespace dtsdf
