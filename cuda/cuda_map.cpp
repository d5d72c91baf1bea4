#include "cuda_map.h"

#include <algorithm>
#include <utility>

#include "backend/frame_check.h"
#include "backend/map_copy.h"
#include "backend/pose_solver.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/evidence.h"
#include "map/memory_budget.h"
#include "pool_transfer.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;

}  // namespace

CudaMap::CudaMap(const MapperParams& params, const Rules& rules, SpaceMap* space)
    : params_(params),
      rules_(rules),
      table_(budgetOf(params).map_bytes),
      map_(stream_),
      aligner_(rules.poses, params.map.directional, stream_),
      sensor_(params, rules, stream_),
      surfel_maker_(params, rules.surfels, stream_),
      block_finder_(makeFusionSettings(params, rules.fusion), stream_),
      fusion_(params, rules, stream_),
      painter_(makePaintSettings(params, rules.colour), stream_),
      mesher_(rules.mesh, params.map.directional, params.mesh.refine != 0),
      renderer_(rules.mesh, params.map.directional, stream_),
      region_clearer_(stream_),
      free_seer_(cellGridOf(params), params.space.max_range_m, stream_),
      space_(space) {
  stream_.setClock(&clock_);
  mesher_.setClock(&clock_);
}

/// As CpuMapper::align(), in the map that the frame before leaves.
Alignment CudaMap::align(const DepthFrame& frame, const PosePrior& prior) {
  recycleEmpty();
  raw_image_.upload(rowsOf(frame), stream_);
  const StageTimer timer(clock_.profile(), Stage::kAlign);
  const float voxel_size_m = params_.map.voxel_size_m;
  aligner_.takePoints(makeFrameView(frame, voxel_size_m), rawDepthOf(frame));
  return findPose(frame, prior, rules_.poses, voxel_size_m,
                  [&](const FrameView& view, float cutoff) {
                    return aligner_.sumsAt(view, cutoff, map_.view());
                  });
}

/// The way of a frame; CpuMapper::fuse() is the same on the CPU.
IntegrationResult CudaMap::fuse(const DepthFrame& frame) {
  outside_.clear();
  upload(frame);
  const DeviceSensing sensing = sense(frame);
  DeviceSurfels surfels = makeSurfels(sensing);
  findBlocks(sensing, surfels);
  if (counters_.touched == 0 && !clearsFromAfar(frame, params_)) return noMeasurement(params_);
  const Admission admission = admit();
  countWork(sensing.frame(), admission);
  castAndFold(sensing, surfels);
  clear(sensing);
  if (params_.map.keep_radius_m > 0.0f) kept_ = keptBallOf(frame, params_.map);
  if (space_ != nullptr) free_seer_.keep();
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

void CudaMap::upload(const DepthFrame& frame) {
  block_finder_.begin();  // before the upload, which it runs beside
  raw_image_.upload(rowsOf(frame), stream_);
}

DeviceSensing CudaMap::sense(const DepthFrame& frame) {
  return sensor_.sense(makeFrameView(frame, params_.map.voxel_size_m), rawDepthOf(frame));
}

RawDepth CudaMap::rawDepthOf(const DepthFrame& frame) const {
  return {raw_image_.data(), frame.encoding == DepthEncoding::kUint16,
          depthRangeOf(frame, params_)};
}

DeviceSurfels CudaMap::makeSurfels(const DeviceSensing& sensing) {
  return surfel_maker_.makeSurfels(sensing, block_finder_.usableSurfels());
}

/// Once more with larger buffers, if there were more surfels or blocks than expected.
void CudaMap::findBlocks(const DeviceSensing& sensing, DeviceSurfels& surfels) {
  block_finder_.mark(sensing, surfels);
  recycleEmpty();  // of the frame before, whose last kernels may have run until now
  block_finder_.compare(sensing, map_.view());
  if (space_ != nullptr) seeFree(sensing);
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

/// Which cubes are in view is found, and what the image sees through in them enqueued, while the
/// device is busy with the stages before; it works that off while the host admits blocks.
void CudaMap::seeFree(const DeviceSensing& sensing) {
  std::vector<Vec3i> cubes;
  {
    const StageTimer timer(clock_.profile(), Stage::kSeeFree);
    cubes = space_->cubesInView(sensing.frame());
  }
  if (clock_.profile() != nullptr) clock_.profile()->work.seen_cubes += cubes.size();
  free_seer_.see(sensing.frame(), sensor_.freeDepth(), std::move(cubes));
}

void CudaMap::bringSpaceUpToDate() {
  if (space_ == nullptr || !free_seer_.isKept()) return;
  const std::vector<FreeCube> seen = free_seer_.take();
  const StageTimer timer(clock_.profile(), Stage::kSeeFree);
  space_->addFree(seen);
  if (kept_) space_->dropBeyond(*kept_);
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
  if (!hasRoomFor({counters_.requests, counters_.requested_arrays, after})) {
    Admission none;
    none.refused = counters_.requests;
    refused_ += none.refused;
    return none;
  }
  Admission admission = table_.admit(block_finder_.fetchRequests());
  map_.apply(table_, admission);
  if (!admission.changed_slots.empty()) block_finder_.refresh(map_.view());
  refused_ += admission.refused;
  outside_ = std::move(admission.outside);
  return admission;
}

/// Without device memory for new blocks they are refused, as those beyond the budget are, and the
/// frame goes into what is there.
bool CudaMap::hasRoomFor(const MapDemand& demand) {
  try {
    map_.reserve(table_, demand);
    return true;
  } catch (const CudaError& error) {
    if (error.code() != cudaErrorMemoryAllocation) throw;
    return false;
  }
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
  painted_bound_ += std::min(seen.seen, seen.blocks);
  if (clock_.profile() != nullptr) {
    clock_.profile()->work.colour_pixels += static_cast<uint64_t>(frame.width) * frame.height;
    clock_.profile()->work.painted_voxels += seen.samples;
  }
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

/// As CpuMapper::render(), of the map that the frame before leaves.
void CudaMap::render(const FrameView& frame, RenderedView& view) {
  recycleEmpty();
  renderer_.render(frame, leastEvidenceNow(), map_.view(), view);
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

/// Puts off the release of what the last frame left empty, or beyond what is kept, until the map is
/// looked at again, so that integrate() need not wait for the frame.
void CudaMap::recycleEmpty() {
  bringSpaceUpToDate();  // while it is known what the frame keeps
  std::vector<int32_t> changed;
  for (const EmptyBlock& empty : fusion_.takeEmptyBlocks()) {
    table_.vacate(empty.slot, empty.directions);
    changed.push_back(empty.slot);
  }
  const std::vector<int32_t> dropped = dropBeyond();
  changed.insert(changed.end(), dropped.begin(), dropped.end());
  mirror(std::move(changed), !dropped.empty());
}

/// As CpuMapper::dropBeyond(), with the blocks that the frame left empty gone before.
std::vector<int32_t> CudaMap::dropBeyond() {
  if (!kept_) return {};
  std::vector<int32_t> slots = table_.slotsBeyond(*kept_, kMostDroppedBlocks);
  kept_.reset();
  if (slots.empty()) return slots;
  mesher_.complete();
  map_.reserveUpdates(slots.size());
  for (const int32_t slot : slots) table_.vacate(slot, kAllDirections);
  dropped_ += slots.size();
  dirty_bound_ += slots.size();
  return slots;
}

/// Brings what the host's table knows of blocks to the device: in one update for all, since the
/// buffer that they are sent from is not free before the next frame.
void CudaMap::mirror(std::vector<int32_t> changed, bool dirty) {
  table_.releaseVacant(table_.takeUnseen());
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  std::vector<SlotUpdate> updates;
  for (const int32_t slot : changed) {
    updates.push_back(makeSlotUpdate(table_.block(slot), slot));
    updates.back().dirty = dirty;
  }
  map_.apply(updates);
}

ClearedRegion CudaMap::clearRegion(const Region& region) {
  const RegionView view = checkedRegionView(region, params_.map);
  mesher_.complete();
  recycleEmpty();
  const std::vector<int32_t> slots = table_.slotsIn(view);
  map_.reserveUpdates(slots.size());
  const std::vector<EmptiedBlock> emptied = region_clearer_.clear(slots, view, map_.view());
  ClearedRegion result;
  std::vector<int32_t> changed;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (emptied[i].voxels == 0) continue;
    result.voxels += emptied[i].voxels;
    if (table_.vacate(slots[i], emptied[i].empty_directions)) ++result.blocks;
    changed.push_back(slots[i]);
  }
  dirty_bound_ += changed.size();
  mirror(std::move(changed), true);
  if (space_ != nullptr) space_->clearRegion(view);
  return result;
}

void CudaMap::beginMeshUpdate() {
  if (mesher_.isUnderWay()) mesher_.finish();  // as on the CPU, its changes are lost
  recycleEmpty();
  table_.noteExtraction();
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
  if (space_ != nullptr) {
    const StageTimer timer(clock_.profile(), Stage::kFindCells);
    space_->addSurfaces(update.blocks);
  }
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

void CudaMap::restrictTo(const MapExtent& extent) {
  table_.restrictTo(extent);
  painter_.restrictTo(extent.painted);
  if (space_ != nullptr) space_->restrictTo(extent.cubes);
}

void CudaMap::passOver(const PassedFrames& passed) {
  frames_ += passed.frames;
  supporting_frames_ += passed.supporting_frames;
}

void CudaMap::profileTo(Profile* profile) {
  stream_.synchronize();
  mesher_.complete();
  clock_.profileTo(profile);
}

std::vector<MemoryPart> CudaMap::memoryParts() {
  recycleEmpty();
  std::vector<MemoryPart> parts;
  map_.addMemory(table_, parts);
  mesher_.addMemory(parts);
  raw_image_.addMemory("raw image", parts);
  aligner_.addMemory(parts);
  sensor_.addMemory(parts);
  surfel_maker_.addMemory(parts);
  block_finder_.addMemory(parts);
  fusion_.addMemory(parts);
  painter_.addMemory(parts);
  renderer_.addMemory(parts);
  region_clearer_.addMemory(parts);
  if (space_ != nullptr) {
    free_seer_.addMemory(parts);
    parts.push_back({"space", MemoryKind::kSpace, space_->bytes(), space_->bytes()});
  }
  parts.push_back({"block table (host)", MemoryKind::kStaging, table_.memoryBytes(),
                   table_.memoryBytes()});
  return parts;
}

MapStats CudaMap::stats() {
  recycleEmpty();
  return {table_.blocksInUse(), table_.arraysInUse(), table_.bytesInUse(), refused_,
          table_.coloursInUse() * BlockTable::kColourBytes, dropped_,
          space_ == nullptr ? 0 : space_->freeBytes(),
          space_ == nullptr ? 0 : space_->refusedCubes(), budgetOf(params_).map_bytes};
}

MapContents CudaMap::contents() {
  recycleEmpty();
  MapContents contents = contentsOf(params_, rules_);
  contents.frames = frames_;
  contents.supporting_frames = supporting_frames_;
  contents.painted = map_.hasColours();
  std::copy_n(painter_.exposure().gain, 3, contents.exposure.begin());
  if (space_ != nullptr) space_->copyTo(contents);
  const ContentsOrder order = listBlocks(table_, contents);
  PoolTransfer(map_.voxels(), order.arrays, stream_).download(contents.voxels.data());
  PoolTransfer(map_.colours(), order.bricks, stream_).download(contents.colours.data());
  return contents;
}

/// As frames do: memory first, then the table, then what the device knows of it.
void CudaMap::restore(const MapContents& contents) {
  const MapSize size = sizeOf(contents.blocks);
  map_.reserve(table_, {size.blocks, size.voxel_arrays,
                        table_.sizesAfter(size.blocks, size.voxel_arrays)});
  const EnteredBlocks entered = enterBlocks(contents, table_);
  const ContentsOrder order = entered.order();
  map_.apply(table_, entered.blocks);
  PoolTransfer(map_.voxels(), order.arrays, stream_).upload(contents.voxels.data());
  if (contents.painted) {
    map_.reserveColours(table_, size.bricks);
    map_.keepColours();
    map_.apply(entered.colours);
    PoolTransfer(map_.colours(), order.bricks, stream_).upload(contents.colours.data());
  }
  frames_ = contents.frames;
  supporting_frames_ = contents.supporting_frames;
  Exposure exposure;
  std::copy_n(contents.exposure.begin(), 3, exposure.gain);
  painter_.setExposure(exposure);
  if (space_ != nullptr) space_->restore(contents);
  stream_.synchronize();
}

}  // namespace gpu
}  // namespace dtsdf
