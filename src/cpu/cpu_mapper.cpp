#include "cpu/cpu_mapper.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "backend/frame_check.h"
#include "backend/fusion_view.h"
#include "cpu/block_times.h"
#include "cpu/parallel_for.h"

namespace dtsdf {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;

/// The sums of one block over one frame; one per thread.
struct BlockSums {
  VoxelSums voxel[kDirectionCount][kVoxelsPerBlock];
};

void castSurfels(const TouchedBlock& block, const BlockBins& bins, const FusionView& fusion,
                 BlockSums& sums) {
  auto add = [&](int direction, int index, int32_t weight, int32_t sdf) {
    addToSums(sums.voxel[direction][index], weight, sdf);
  };
  for (const SurfelRange& range : block.surfels) {
    for (const uint32_t* i = range.begin; i != range.end; ++i) {
      castIntoBlock<kPlanesAtOnce>(bins.line(*i), fusion, block.block_L, add);
    }
  }
}

void projectVoxels(const TouchedBlock& block, const std::vector<Surfel>& surfels,
                   const FrameView& view, const FusionView& fusion, BlockSums& sums) {
  for (int index = 0; index < kVoxelsPerBlock; ++index) {
    auto add = [&](int direction, int32_t weight, int32_t sdf) {
      addToSums(sums.voxel[direction][index], weight, sdf);
    };
    projectVoxel(view, fusion, surfels.data(), firstVoxelOfBlock(block.block_L) + voxelOffset(index),
                 add);
  }
}

/// Folds the sums of one array. @return whether the array holds anything.
bool foldArray(const VoxelSums* sums, const FusionView& fusion, Voxel* voxels) {
  bool observed = false;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    voxels[i] = foldSums(voxels[i], sums[i], fusion.truncation_voxels, fusion.max_weight);
    observed |= voxels[i].weight != 0.0f;
  }
  return observed;
}

/// Takes weight from those voxels of a block that the frame saw as free.
void clearFreeSpace(const TouchedBlock& block, const BlockEntry& entry, const FrameView& view,
                    const float* free_depth, VoxelStore& voxels) {
  const Vec3i first = firstVoxelOfBlock(block.block_L);
  for (int row = 0; row < kVoxelsPerBlock; row += kBlockSide) {
    float depth_m[kBlockSide], u[kBlockSide], v[kBlockSide];  // apart, for the vector units
    for (int x = 0; x < kBlockSide; ++x) {
      const VoxelInImage at = projectToImage(view, first + voxelOffset(row) + Vec3i{x, 0, 0});
      depth_m[x] = at.depth_m;
      u[x] = at.u;
      v[x] = at.v;
    }
    for (int x = 0; x < kBlockSide; ++x) {
      const float evidence = freeEvidence(view, free_depth, {depth_m[x], u[x], v[x]});
      if (!(evidence > 0.0f)) continue;
      for (const int32_t array : entry.array) {
        if (array == kNoArray) continue;
        Voxel& voxel = voxels.array(array)[row + x];
        voxel = clearedVoxel(voxel, evidence);
      }
    }
  }
}

}  // namespace

CpuMapper::CpuMapper(const MapperParams& params, const Rules& rules)
    : params_(params),
      rules_(rules),
      fusion_(makeFusionView(params)),
      threads_(params.threads > 0 ? params.threads : omp_get_num_procs()),
      table_(static_cast<size_t>(params.map.max_memory_mb) << 20),
      mesher_(table_, voxels_, rules.mesh, params.map.directional, threads_) {}

IntegrationResult CpuMapper::integrate(const DepthFrame& frame) {
  const Clock::time_point start = Clock::now();
  IntegrationResult result;
  if (const auto problem = findProblem(frame, params_)) {
    result.status = problem->status;
    result.message = problem->message;
    return result;
  }
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  if (computeSurfels(frame, view) == 0) {
    result.status = FrameStatus::kNoMeasurement;
    result.message = noMeasurementMessage(params_);
    return result;
  }
  fusion_.noise = surfels_.noise();
  const std::vector<TouchedBlock>& touched = findTouchedBlocks(view);
  admit(touched, result);
  fuse(touched, view);
  result.duration_ms = millisecondsSince(start);
  return result;
}

size_t CpuMapper::computeSurfels(const DepthFrame& frame, const FrameView& view) {
  const StageTimer timer(profile_, Stage::kSurfels);
  const bool project = params_.fusion.mode == FusionMode::kVoxelProjection;
  const size_t count = project ? surfels_.computePixels(frame, view, params_, threads_)
                               : surfels_.computeGroups(frame, view, params_, threads_);
  if (profile_ != nullptr) {
    profile_->work.pixels += static_cast<uint64_t>(frame.width) * frame.height;
    profile_->work.raw_bytes += static_cast<uint64_t>(frame.row_bytes) * frame.height;
    profile_->work.surfels += count;
  }
  return count;
}

const std::vector<TouchedBlock>& CpuMapper::findTouchedBlocks(const FrameView& view) {
  const StageTimer timer(profile_, Stage::kTouch);
  return bins_.sort(surfels_.surfels(), view, fusion_, threads_);
}

void CpuMapper::admit(const std::vector<TouchedBlock>& touched, IntegrationResult& result) {
  const StageTimer timer(profile_, Stage::kAdmit);
  std::vector<BlockRequest> requests;
  for (const TouchedBlock& block : touched) requests.push_back({block.key, block.directions});
  const Admission admission = table_.admit(std::move(requests));
  voxels_.resize(table_.arrayCount());
  for (const int32_t array : admission.new_arrays) {
    std::memset(voxels_.array(array), 0, BlockTable::kArrayBytes);
  }
  mesher_.resize();
  if (profile_ != nullptr) {
    profile_->work.touched_blocks += touched.size();
    profile_->work.new_blocks += admission.changed_slots.size();
    profile_->work.new_arrays += admission.new_arrays.size();
  }
  result.refused_blocks = admission.refused;
  refused_ += admission.refused;
}

void CpuMapper::fuse(const std::vector<TouchedBlock>& touched, const FrameView& view) {
  std::vector<uint32_t> empty_directions(touched.size(), 0);
  const bool project = params_.fusion.mode == FusionMode::kVoxelProjection;
  BlockTimes times(profile_);
  parallelFor<BlockSums>(touched.size(), threads_, [&](size_t i, BlockSums& sums) {
    const TouchedBlock& block = touched[i];
    const int32_t slot = table_.find(block.key);
    if (slot < 0) return;
    BlockTimes::Lap lap(times);
    // A voxel is projected to whichever surfel it falls on, also to one that touches other blocks.
    const uint32_t directions = project ? kAllDirections : block.directions;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (directions >> d & 1) std::memset(sums.voxel[d], 0, sizeof(sums.voxel[d]));
    }
    if (project) {
      projectVoxels(block, surfels_.surfels(), view, fusion_, sums);
    } else {
      castSurfels(block, bins_, fusion_, sums);
    }
    lap.endCast();
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = table_.block(slot).array[d];
      if (array == kNoArray || !(directions >> d & 1)) continue;
      if (!foldArray(sums.voxel[d], fusion_, voxels_.array(array))) empty_directions[i] |= 1u << d;
    }
    if (!project) {
      clearFreeSpace(block, table_.block(slot), view, surfels_.freeDepth(), voxels_);
    }
    mesher_.markDirty(slot);
    lap.endFold(table_.block(slot), directions);
  });
  times.addTo(profile_);
  const StageTimer timer(profile_, Stage::kFinish);
  recycleEmpty(touched, empty_directions);
}

void CpuMapper::recycleEmpty(const std::vector<TouchedBlock>& touched,
                             const std::vector<uint32_t>& empty_directions) {
  for (size_t i = 0; i < touched.size(); ++i) {
    if (empty_directions[i] == 0) continue;
    const int32_t slot = table_.find(touched[i].key);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (empty_directions[i] >> d & 1) table_.releaseArray(slot, d);
    }
    const auto& arrays = table_.block(slot).array;
    if (std::all_of(arrays, arrays + kDirectionCount, [](int32_t a) { return a == kNoArray; })) {
      mesher_.forget(slot);
      table_.releaseBlock(slot);
    }
  }
}

void CpuMapper::beginMeshUpdate() {
  const Clock::time_point start = Clock::now();
  mesh_update_.blocks = mesher_.update();
  mesh_update_.duration_ms = millisecondsSince(start);
}

MeshUpdate CpuMapper::finishMeshUpdate() {
  MeshUpdate update = std::move(mesh_update_);
  mesh_update_ = MeshUpdate();
  return update;
}

void CpuMapper::profileTo(Profile* profile) {
  profile_ = profile;
  mesher_.profileTo(profile);
}

std::vector<MemoryPart> CpuMapper::memory() const {
  constexpr auto kMap = MemoryKind::kMap, kScratch = MemoryKind::kScratch;
  std::vector<MemoryPart> parts = {
      {"voxels", kMap, table_.arraysInUse() * BlockTable::kArrayBytes, voxels_.bytes()},
      {"block table", kMap, table_.memoryBytes(), table_.memoryBytes()},
      {"surfels", kScratch, surfels_.bytes(), surfels_.bytes()},
      {"bins", kScratch, bins_.bytes(), bins_.bytes()}};
  parts.push_back({"unit indices", kMap, mesher_.bytes(), mesher_.bytes()});
  return parts;
}

void CpuMapper::clear() {
  table_.clear();
  voxels_.clear();
  mesher_.clear();
  mesh_update_ = MeshUpdate();
  refused_ = 0;
}

MapStats CpuMapper::stats() const {
  return {table_.blocksInUse(), table_.arraysInUse(), table_.bytesInUse(), refused_};
}

std::vector<BlockSnapshot> CpuMapper::snapshot() {
  std::vector<BlockSnapshot> blocks;
  for (const int32_t slot : table_.sortedSlots()) {
    const BlockEntry& entry = table_.block(slot);
    BlockSnapshot copy;
    copy.key = entry.key;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      const Voxel* voxels = voxels_.array(entry.array[d]);
      copy.voxels[d].assign(voxels, voxels + kVoxelsPerBlock);
    }
    blocks.push_back(std::move(copy));
  }
  return blocks;
}

std::string CpuMapper::backendName() const {
  return "cpu (" + std::to_string(threads_) + (threads_ == 1 ? " thread)" : " threads)");
}

}  // namespace dtsdf
