#include "cpu/cpu_mapper.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "backend/frame_check.h"
#include "backend/map_copy.h"
#include "backend/pose_solver.h"
#include "backend/rule_settings.h"
#include "cpu/block_times.h"
#include "cpu/fold.h"
#include "threads/parallel_for.h"
#include "kernels/fusion/free_space.h"
#include "kernels/fusion/voxel_update.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;

/// Calls body(i) for each i below `count`; a thread takes many of them at a time, which are small.
template <class Body>
void inBatches(size_t count, int threads, const Body& body) {
  constexpr size_t kBatch = 64;
  struct NoScratch {};
  parallelFor<NoScratch>((count + kBatch - 1) / kBatch, threads, [&](size_t batch, NoScratch&) {
    const size_t end = std::min(count, (batch + 1) * kBatch);
    for (size_t i = batch * kBatch; i < end; ++i) body(i);
  });
}

}  // namespace

CpuMapper::CpuMapper(const MapperParams& params, const Rules& rules)
    : params_(params),
      rules_(rules),
      fusion_(makeFusionSettings(params, rules.fusion)),
      threads_(params.threads > 0 ? params.threads : omp_get_num_procs()),
      table_(budgetOf(params).map_bytes),
      aligner_(rules.poses, params.map.directional, threads_),
      sensor_(params, rules, threads_),
      surfel_maker_(params, rules.surfels, threads_),
      block_finder_(fusion_, threads_),
      painter_(makePaintSettings(params, rules.colour), threads_),
      mesher_({table_, voxels_, colours_}, rules.mesh, params.map.directional, threads_,
              params.mesh.refine != 0),
      renderer_({table_, voxels_, colours_}, rules.mesh, params.map.directional, threads_),
      free_seer_(params, threads_) {
  if (params.space.enabled) space_ = std::make_unique<SpaceMap>(params, threads_);
}

IntegrationResult CpuMapper::integrate(const DepthFrame& frame) {
  const Clock::time_point start = Clock::now();
  if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
  IntegrationResult result = fuse(frame);
  result.duration_ms = millisecondsSince(start);
  return result;
}

Alignment CpuMapper::align(const DepthFrame& frame, const PosePrior& prior) {
  Alignment unaligned;
  unaligned.T_W_C = frame.T_W_C;
  if (findProblem(frame, params_)) return unaligned;
  const StageTimer timer(profile_, Stage::kAlign);
  const float voxel_size_m = params_.map.voxel_size_m;
  aligner_.takePoints(frame, makeFrameView(frame, voxel_size_m), depthRangeOf(frame, params_));
  return findPose(frame, prior, rules_.poses, voxel_size_m,
                  [&](const FrameView& view, float cutoff) {
                    return aligner_.sumsAt(view, cutoff, table_, voxels_);
                  });
}

/// The way of a frame; CudaMap::fuse() is the same on the device.
IntegrationResult CpuMapper::fuse(const DepthFrame& frame) {
  outside_.clear();
  const FrameSensing sensing = sense(frame);
  const std::vector<Surfel>& surfels = makeSurfels(sensing);
  const std::vector<TouchedBlock>& blocks = findBlocks(surfels, sensing);
  if (blocks.empty() && !clearsFromAfar(frame, params_)) return noMeasurement(params_);
  const Admission admission = admit(blocks);
  castFoldAndClear(blocks, surfels, sensing);
  if (params_.map.keep_radius_m > 0.0f) dropBeyond(frame);
  releaseVacant(table_.takeUnseen());
  if (space_ != nullptr) seeFree(frame, sensing);
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

/// Notes what the frame sees through.
void CpuMapper::seeFree(const DepthFrame& frame, const FrameSensing& sensing) {
  const StageTimer timer(profile_, Stage::kSeeFree);
  const std::vector<Vec3i> cubes = space_->cubesInView(sensing.image.frame);
  if (profile_ != nullptr) profile_->work.seen_cubes += cubes.size();
  space_->addFree(free_seer_.see(sensing, cubes));
  if (params_.map.keep_radius_m > 0.0f) space_->dropBeyond(keptBallOf(frame, params_.map));
}

FrameSensing CpuMapper::sense(const DepthFrame& frame) {
  const StageTimer timer(profile_, Stage::kSense);
  if (profile_ != nullptr) {
    profile_->work.pixels += static_cast<uint64_t>(frame.width) * frame.height;
    profile_->work.raw_bytes += static_cast<uint64_t>(frame.row_bytes) * frame.height;
  }
  return sensor_.sense(frame);
}

const std::vector<Surfel>& CpuMapper::makeSurfels(const FrameSensing& sensing) {
  const StageTimer timer(profile_, Stage::kMakeSurfels);
  const std::vector<Surfel>& surfels = surfel_maker_.makeSurfels(sensing);
  if (profile_ != nullptr) profile_->work.surfels += surfel_maker_.count();
  return surfels;
}

const std::vector<TouchedBlock>& CpuMapper::findBlocks(const std::vector<Surfel>& surfels,
                                                       const FrameSensing& sensing) {
  const StageTimer timer(profile_, Stage::kFindBlocks);
  return block_finder_.findBlocks(surfels, sensing);
}

Admission CpuMapper::admit(const std::vector<TouchedBlock>& blocks) {
  const StageTimer timer(profile_, Stage::kAdmit);
  std::vector<BlockRequest> requests;
  requests.reserve(blocks.size());
  for (const TouchedBlock& block : blocks) requests.push_back({block.key, block.directions});
  // All memory is taken before the table changes: without it, the map stays as it was.
  const PoolSizes added = table_.countNew(requests);
  const PoolSizes sizes = table_.sizesAfter(added.slots, added.arrays);
  voxels_.resize(sizes.arrays);
  mesher_.resize(sizes.slots);
  Admission admission = table_.admit(std::move(requests));
  for (const int32_t array : admission.new_arrays) {
    std::memset(voxels_.array(array), 0, BlockTable::kArrayBytes);
  }
  if (profile_ != nullptr) {
    profile_->work.touched_blocks += blocks.size();
    profile_->work.new_blocks += admission.changed_slots.size();
    profile_->work.new_arrays += admission.new_arrays.size();
  }
  refused_ += admission.refused;
  outside_ = std::move(admission.outside);
  return admission;
}

/// Three stages in one loop over the blocks: the sums of a block stay in a thread's cache.
void CpuMapper::castFoldAndClear(const std::vector<TouchedBlock>& blocks,
                                 const std::vector<Surfel>& surfels,
                                 const FrameSensing& sensing) {
  std::vector<uint32_t> empty_directions(blocks.size(), 0);
  const bool casts = castsSurfels(params_);
  const bool clears = clearsFreeSpace(params_);
  const FrameView& frame = sensing.image.frame;
  ++frames_;
  if (!blocks.empty()) ++supporting_frames_;
  last_touched_.resize(table_.slotCount(), 0);
  BlockTimes times(profile_);
  parallelFor<BlockSums>(blocks.size(), threads_, [&](size_t i, BlockSums& sums) {
    const TouchedBlock& block = blocks[i];
    const int32_t slot = table_.find(block.key);
    if (slot < 0) return;
    const BlockEntry& entry = table_.block(slot);
    BlockTimes::Lap lap(times);
    // A voxel is projected to whichever surfel it falls on, also to one that touches other blocks.
    const uint32_t directions = casts ? block.directions : kAllDirections;
    clearSums(sums, directions);
    if (casts) {
      cast(block, block_finder_, fusion_, sums);
    } else {
      project(block, surfels, frame, fusion_, sums);
    }
    lap.end(Stage::kCast);
    empty_directions[i] = fold(sums, directions, entry,
                               blockDepthWeight(frame, block.block_L, rules_.fusion), fusion_,
                               voxels_);
    lap.end(Stage::kFold);
    if (clears) {
      const BlockLook look{block.block_L, isInTurn(block.key, frames_, rules_.fusion), &sums,
                           directions, params_.map.directional};
      empty_directions[i] |= clear(look, entry, sensing).empty_directions;
    }
    last_touched_[slot] = frames_;
    mesher_.markDirty(slot);
    lap.end(Stage::kClear);
    lap.countArrays(entry, directions);
  });
  times.addTo(profile_);
  const StageTimer timer(profile_, Stage::kClear);
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (empty_directions[i] == 0) continue;
    table_.vacate(table_.find(blocks[i].key), empty_directions[i]);
  }
  if (clears) lookAround(sensing);
}

/// Forgets what lies beyond the radius that is kept.
void CpuMapper::dropBeyond(const DepthFrame& frame) {
  const StageTimer timer(profile_, Stage::kClear);
  for (const int32_t slot :
       table_.slotsBeyond(keptBallOf(frame, params_.map), kMostDroppedBlocks)) {
    mesher_.markDirty(slot);
    table_.vacate(slot, kAllDirections);
    ++dropped_;
  }
}

ClearedRegion CpuMapper::clearRegion(const Region& region) {
  const RegionView view = checkedRegionView(region, params_.map);
  const std::vector<int32_t> slots = table_.slotsIn(view);
  std::vector<EmptiedBlock> emptied(slots.size());
  struct NoScratch {};
  parallelFor<NoScratch>(slots.size(), threads_, [&](size_t i, NoScratch&) {
    const BlockEntry& entry = table_.block(slots[i]);
    emptied[i] = emptyRegion(entry, view, voxels_);
    if (emptied[i].voxels > 0 && table_.coloursInUse() > 0) {
      forgetColours(entry, {table_, voxels_, colours_});
    }
  });
  ClearedRegion result;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (emptied[i].voxels == 0) continue;
    result.voxels += emptied[i].voxels;
    mesher_.markDirty(slots[i]);
    if (table_.vacate(slots[i], emptied[i].empty_directions)) ++result.blocks;
  }
  releaseVacant(table_.takeUnseen());
  if (space_ != nullptr) space_->clearRegion(view);
  return result;
}

/// Safe to call for different blocks from different threads.
ClearedBlock CpuMapper::clear(const BlockLook& look, const BlockEntry& entry,
                              const FrameSensing& sensing) {
  const ClearedBlock cleared = clearBlock(look, entry, sensing, rules_.fusion, voxels_);
  if (cleared.changed && table_.coloursInUse() > 0) {
    forgetColours(entry, {table_, voxels_, colours_});
  }
  return cleared;
}

/// Blocks without arrays go when what shows their mesh has learnt that they have none; at once, if
/// no mesh has met them.
void CpuMapper::releaseVacant(const std::vector<int32_t>& slots) {
  for (const int32_t slot : table_.releaseVacant(slots)) mesher_.forget(slot);
}

/// Clears blocks that the frame does not touch, those whose turn it is.
void CpuMapper::lookAround(const FrameSensing& sensing) {
  const std::vector<int32_t> slots = blocksInTurn(sensing.image.frame);
  std::vector<ClearedBlock> cleared(slots.size());
  const BlockKey origin = blockOfVoxel(sensing.image.frame.origin_voxel);
  struct NoScratch {};
  parallelFor<NoScratch>(slots.size(), threads_, [&](size_t i, NoScratch&) {
    const BlockEntry& entry = table_.block(slots[i]);
    const BlockLook look{entry.key - origin, true, nullptr, 0, params_.map.directional};
    cleared[i] = clear(look, entry, sensing);
  });
  for (size_t i = 0; i < slots.size(); ++i) {
    if (cleared[i].changed) mesher_.markDirty(slots[i]);
    if (cleared[i].empty_directions != 0) table_.vacate(slots[i], cleared[i].empty_directions);
  }
}

std::vector<int32_t> CpuMapper::blocksInTurn(const FrameView& frame) const {
  const BlockKey origin = blockOfVoxel(frame.origin_voxel);
  std::vector<int32_t> slots;
  for (size_t slot = 0; slot < table_.slotCount(); ++slot) {
    if (last_touched_[slot] == frames_) continue;
    const BlockEntry& entry = table_.block(static_cast<int32_t>(slot));
    if (!entry.in_use || !isInTurn(packKey(entry.key), frames_, rules_.fusion)) continue;
    if (mayBeInView(frame, entry.key - origin)) slots.push_back(static_cast<int32_t>(slot));
  }
  return slots;
}

IntegrationResult CpuMapper::paint(const ColourFrame& frame) {
  const Clock::time_point start = Clock::now();
  if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
  IntegrationResult result = paintSurfaces(frame);
  result.duration_ms = millisecondsSince(start);
  return result;
}

/// The way of a colour image; CudaMap::paint() is the same on the device.
IntegrationResult CpuMapper::paintSurfaces(const ColourFrame& frame) {
  const StageTimer timer(profile_, Stage::kPaint);
  const PaintedMap map{table_, voxels_, colours_};
  std::vector<ColourRequest> requests = painter_.look(
      frame, makeFrameView(frame, params_.map.voxel_size_m), leastEvidenceNow(), map);
  if (requests.empty()) return nothingToPaint();
  const ColourAdmission admission = admitColours(std::move(requests));
  for (const int32_t slot : painter_.paint(map)) mesher_.markPainted(slot);
  if (profile_ != nullptr) {
    profile_->work.colour_pixels += static_cast<uint64_t>(frame.width) * frame.height;
    profile_->work.painted_voxels += painter_.sampleCount();
  }
  IntegrationResult result;
  result.refused_blocks = admission.refused;
  return result;
}

ColourAdmission CpuMapper::admitColours(std::vector<ColourRequest> requests) {
  // As for voxels: all memory is taken before the table changes.
  colours_.resize(table_.colourCount() + table_.countNewColours(requests));
  ColourAdmission admission = table_.admitColours(std::move(requests));
  for (const NewBrick& brick : admission.bricks) {
    std::memset(colours_.array(brick.colours), 0, BlockTable::kColourBytes);
  }
  if (!admission.bricks.empty()) mesher_.keepColours();
  refused_ += admission.refused;
  return admission;
}

int32_t CpuMapper::leastEvidenceNow() const {
  return leastEvidence(params_.mesh.min_support, supporting_frames_, rules_.fusion);
}

void CpuMapper::render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                       RenderedView& view) {
  const FrameView frame = checkedFrameView(camera, T_W_C, params_);
  const StageTimer timer(profile_, Stage::kRender);
  renderer_.render(frame, leastEvidenceNow(), mesher_.hasColours(), view);
}

void CpuMapper::beginMeshUpdate() {
  const Clock::time_point start = Clock::now();
  table_.noteExtraction();
  const std::vector<int32_t> vacant = table_.takeVacant();
  vacant_.insert(vacant_.end(), vacant.begin(), vacant.end());
  mesh_update_.blocks = mesher_.update(leastEvidenceNow());
  mesh_update_.duration_ms = millisecondsSince(start);
}

MeshUpdate CpuMapper::finishMeshUpdate() {
  MeshUpdate update = std::move(mesh_update_);
  mesh_update_ = MeshUpdate();
  releaseVacant(vacant_);
  vacant_.clear();
  if (space_ != nullptr) {
    const StageTimer timer(profile_, Stage::kFindCells);
    space_->addSurfaces(update.blocks);
  }
  return update;
}

void CpuMapper::profileTo(Profile* profile) {
  profile_ = profile;
  mesher_.profileTo(profile);
}

std::vector<MemoryPart> CpuMapper::memoryParts() const {
  constexpr auto kMap = MemoryKind::kMap, kIndices = MemoryKind::kIndices,
                 kScratch = MemoryKind::kScratch;
  const size_t books = table_.memoryBytes() + last_touched_.capacity() * sizeof(last_touched_[0]);
  std::vector<MemoryPart> parts = {
      {"voxels", kMap, table_.arraysInUse() * BlockTable::kArrayBytes, voxels_.bytes()},
      {"colours", kMap, table_.coloursInUse() * BlockTable::kColourBytes, colours_.bytes()},
      {"block table", kIndices, books, books},
      {"unit indices", kIndices, mesher_.bytes(), mesher_.bytes()},
      {"images", kScratch, sensor_.bytes(), sensor_.bytes()},
      {"surfels", kScratch, surfel_maker_.bytes(), surfel_maker_.bytes()},
      {"surfels by block", kScratch, block_finder_.bytes(), block_finder_.bytes()},
      {"colour image", kScratch, painter_.bytes(), painter_.bytes()},
      {"depth ranges", kScratch, renderer_.bytes(), renderer_.bytes()}};
  if (space_ != nullptr) {
    parts.push_back({"space", MemoryKind::kSpace, space_->bytes(), space_->bytes()});
    parts.push_back({"free depths", kScratch, free_seer_.bytes(), free_seer_.bytes()});
  }
  return parts;
}

void CpuMapper::restrictTo(const MapExtent& extent) {
  table_.restrictTo(extent);
  if (space_ != nullptr) space_->restrictTo(extent.cubes);
}

void CpuMapper::passOver(const PassedFrames& passed) {
  frames_ += passed.frames;
  supporting_frames_ += passed.supporting_frames;
}

void CpuMapper::clear() {
  table_.clear();
  voxels_.clear();
  colours_.clear();
  painter_.clear();
  mesher_.clear();
  mesh_update_ = MeshUpdate();
  if (space_ != nullptr) space_->clear();
  refused_ = dropped_ = frames_ = supporting_frames_ = 0;
  last_touched_.clear();
  vacant_.clear();
}

MapStats CpuMapper::stats() const {
  return {table_.blocksInUse(), table_.arraysInUse(), table_.bytesInUse(), refused_,
          table_.coloursInUse() * BlockTable::kColourBytes, dropped_,
          space_ == nullptr ? 0 : space_->freeBytes(),
          space_ == nullptr ? 0 : space_->refusedCubes(), budgetOf(params_).map_bytes};
}

MapContents CpuMapper::contents() {
  MapContents contents = contentsOf(params_, rules_);
  contents.frames = frames_;
  contents.supporting_frames = supporting_frames_;
  contents.painted = mesher_.hasColours();
  std::copy_n(painter_.exposure().gain, 3, contents.exposure.begin());
  if (space_ != nullptr) space_->copyTo(contents);
  const ContentsOrder order = listBlocks(table_, contents);
  inBatches(order.arrays.size(), threads_, [&](size_t i) {
    std::memcpy(contents.voxels.data() + i * kVoxelsPerBlock, voxels_.array(order.arrays[i]),
                BlockTable::kArrayBytes);
  });
  inBatches(order.bricks.size(), threads_, [&](size_t i) {
    std::memcpy(contents.colours.data() + i * kVoxelsPerBrick, colours_.array(order.bricks[i]),
                BlockTable::kColourBytes);
  });
  return contents;
}

void CpuMapper::restore(const MapContents& contents) {
  const MapSize size = sizeOf(contents.blocks);
  voxels_.resize(size.voxel_arrays);
  colours_.resize(size.bricks);
  mesher_.resize(size.blocks);
  const EnteredBlocks entered = enterBlocks(contents, table_);
  const ContentsOrder order = entered.order();
  inBatches(order.arrays.size(), threads_, [&](size_t i) {
    std::memcpy(voxels_.array(order.arrays[i]), contents.voxels.data() + i * kVoxelsPerBlock,
                BlockTable::kArrayBytes);
  });
  inBatches(order.bricks.size(), threads_, [&](size_t i) {
    std::memcpy(colours_.array(order.bricks[i]), contents.colours.data() + i * kVoxelsPerBrick,
                BlockTable::kColourBytes);
  });
  frames_ = contents.frames;
  supporting_frames_ = contents.supporting_frames;
  Exposure exposure;
  std::copy_n(contents.exposure.begin(), 3, exposure.gain);
  painter_.setExposure(exposure);
  for (const int32_t slot : entered.blocks.changed_slots) mesher_.markDirty(slot);
  if (contents.painted) mesher_.keepColours();
  if (space_ != nullptr) space_->restore(contents);
}

std::string CpuMapper::backendName() const {
  return "cpu (" + std::to_string(threads_) + (threads_ == 1 ? " thread)" : " threads)");
}

}  // namespace dtsdf
