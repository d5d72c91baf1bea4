#include "engine/engine.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "backend/pose_solver.h"
#include "backend/rule_settings.h"
#include "engine/mesh_parts.h"
#include "kernels/core/direction.h"
#include "kernels/fusion/free_space.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

IntegrationResult refuseForMemory(const BackendError& error) {
  return refuse({FrameStatus::kNoMemory,
                 std::string("the GPU has too little memory for this frame, which was not fused; "
                             "lower map/max_memory_mb or use larger voxels. ") +
                     error.what()});
}

}  // namespace

Engine::Engine(const MapperParams& params, const Rules& rules, int threads,
               BackendMaker make_backend)
    : params_(params),
      rules_(rules),
      paint_settings_(makePaintSettings(params, rules)),
      make_backend_(std::move(make_backend)),
      table_(budgetOf(params).map_bytes) {
  if (params.space.enabled) {
    space_ = std::make_unique<SpaceMap>(params, threads);
    space_->bringUpToDateBy([this] {
      if (has_free_) takeFree();
    });
  }
  name_ = ready().name();  // what a device lacks shows at the start
  if (space_ && backend_->makesDistances()) {
    space_->workOutDistancesBy(
        [this](const DistanceTask& task, auto& squares) { return makeDistances(task, squares); });
  }
  if (params.map.page_folder.empty()) return;
  if (backend_->mover() == nullptr) {
    throw std::runtime_error("this backend cannot work with map/page_folder; leave it empty");
  }
  pager_ = std::make_unique<Pager>(params.map, table_, [this] { finishMeshing(); });
}

/// The backend, for the calling thread, once no other works on the map.
MapBackend& Engine::ready() {
  helper_.wait();
  return made();
}

/// clear() leaves none, so that a device never holds two maps.
MapBackend& Engine::made() {
  if (backend_ == nullptr) {
    backend_ = make_backend_(table_);
    backend_->profileTo(profile_);
  }
  backend_->enter();
  return *backend_;
}

/// Takes an image, and the time of it. Without memory for it the image is refused.
IntegrationResult Engine::timed(const std::function<IntegrationResult()>& take) {
  const auto start = std::chrono::steady_clock::now();
  IntegrationResult result;
  try {
    result = take();
  } catch (const BackendError& error) {
    table_.listNew();
    if (!error.lacksMemory()) throw;
    result = refuseForMemory(error);
  }
  result.duration_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

/// Where a device lacks memory the host's threads do it.
bool Engine::makeDistances(const DistanceTask& task, std::vector<SectorSquares>& squares) {
  try {
    return made().makeDistances(task, squares);
  } catch (const BackendError& error) {
    if (!error.lacksMemory()) throw;
    return false;
  }
}

IntegrationResult Engine::integrate(const DepthFrame& frame) {
  if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
  return timed([&] { return fuse(frame); });
}

/// The way of a depth image, stage by stage, as the table in docs/method.md has it.
IntegrationResult Engine::fuse(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  sense(frame, view);
  backend_->makeSurfels();
  backend_->findBlocks();
  std::vector<int32_t> in_view = settleBefore(view);
  backend_->lookUpBlocks();
  seeFree(view);
  const TouchedCounts touched = backend_->touched();
  if (touched.blocks == 0 && !clearsFromAfar(frame, params_)) return noMeasurement(params_);
  const size_t left_on_disk = pager_ ? bringInForFrame(view, touched, in_view) : 0;
  const FrameTurn turn{counters_.frames + 1, in_view, part_.empty() ? nullptr : &part_};
  IntegrationResult result;
  result.refused_blocks = left_on_disk + admit(touched, turn);
  castFoldAndClear(touched, turn);
  keep(frame, view);
  return result;
}

void Engine::sense(const DepthFrame& frame, const FrameView& view) {
  outside_.clear();
  made().sense(frame, view);  // what is sensed has no part in the map
  if (profile_ == nullptr) return;
  profile_->work.pixels += static_cast<uint64_t>(frame.width) * frame.height;
}

/// Ends what the frame before left, whose last work may have run until now.
/// @return what blocksInView() does of the map that the frame meets.
std::vector<int32_t> Engine::settleBefore(const FrameView& view) {
  helper_.wait();
  std::vector<int32_t> in_view = blocksInView(view);
  settle();
  if (pager_ == nullptr || std::exchange(moved_ahead_, false)) return in_view;
  moveAhead();
  return blocksInView(view);
}

/// Blocks that the frame may see, where it clears those too that it does not touch. Found before
/// settle(): a device works meanwhile.
std::vector<int32_t> Engine::blocksInView(const FrameView& view) const {
  if (!clearsFreeSpace(params_)) return {};
  const StageTimer timer(profile_, Stage::kClear);
  return table_.slotsInView(view, kFootRadius);
}

/// As blocksInView(), of the part that is in memory.
std::vector<int32_t> Engine::blocksOfPart(const FrameView& view) const {
  std::vector<int32_t> slots = blocksInView(view);
  const auto is_of_another = [&](int32_t slot) {
    const PackedKey key = packKey(table_.block(slot).key);
    return !std::binary_search(part_.begin(), part_.end(), key);
  };
  if (!part_.empty()) {
    slots.erase(std::remove_if(slots.begin(), slots.end(), is_of_another), slots.end());
  }
  return slots;
}

/// Which cubes are in view is found while a device is busy with the stages before.
void Engine::seeFree(const FrameView& view) {
  if (space_ == nullptr) return;
  std::vector<Vec3i> cubes;
  {
    const StageTimer timer(profile_, Stage::kSeeFree);
    cubes = space_->cubesInView(view);
  }
  backend_->seeFree(std::move(cubes));
}

/// All memory is taken before the table changes: without it, the map stays as it was.
/// @return the number of blocks refused.
size_t Engine::admit(const TouchedCounts& touched, const FrameTurn& turn) {
  backend_->waitForMeshes();
  const StageTimer timer(profile_, Stage::kAdmit);
  backend_->reserveFrame(turn);
  if (touched.requests == 0) return 0;
  std::vector<BlockRequest> requests = pager_ ? requestsOfPart() : backend_->requests();
  const size_t blocks = requests.size();
  requests_before_ = blocks;
  const size_t arrays = moves_blocks_ ? table_.countNew(requests).arrays : touched.new_arrays;
  Admission admission;
  if (hasRoomFor({blocks, arrays, table_.sizesAfter(blocks, arrays)})) {
    admission = table_.handOut(std::move(requests));
    if (pager_ || !backend_->hasMirror()) table_.listNew();
    backend_->enterBlocks(admission.changed_slots, admission.new_arrays);
    if (pager_) pager_->noteNew(admission.changed_slots);
  } else {
    admission.refused = blocks;
  }
  counters_.refused += admission.refused;
  outside_.insert(outside_.end(), admission.outside.begin(), admission.outside.end());
  return admission.refused;
}

/// Without a device's memory for new blocks they are refused, as those beyond the budget are, and
/// the frame goes into what is there.
bool Engine::hasRoomFor(const MapDemand& demand) {
  try {
    backend_->reserve(demand);
    return true;
  } catch (const BackendError& error) {
    if (!error.lacksMemory()) throw;
    return false;
  }
}

void Engine::castFoldAndClear(const TouchedCounts& touched, const FrameTurn& turn) {
  backend_->castFoldAndClear(turn);
  table_.listNew();  // a device is busy
  ++counters_.frames;
  if (touched.blocks > 0) ++counters_.supporting_frames;
  if (profile_ != nullptr) profile_->work.surfels += touched.surfels;
}

/// The frame is part of the map. What follows from it waits until the map is looked at again, so
/// that nothing waits for the frame.
void Engine::keep(const DepthFrame& frame, const FrameView& view) {
  if (params_.map.keep_radius_m > 0.0f) kept_ = keptBallOf(frame, params_.map);
  has_free_ = space_ != nullptr;
  if (pager_) noteForReading(frame, view);
}

/// Takes the last frame's outcome: what it saw as free, left empty, or beyond what is kept.
void Engine::settle() {
  table_.listNew();           // what a failure has left
  if (has_free_) takeFree();  // while it is known what the frame keeps
  std::vector<int32_t> changed = vacateEmpty();
  if (pager_ && kept_) {  // what comes may lack memory
    keepEachOnce(changed);
    backend_->follow({changed, false});
  }
  const std::vector<int32_t> dropped = dropBeyond();
  changed.insert(changed.end(), dropped.begin(), dropped.end());
  const std::vector<int32_t> released = releaseUnseen();
  changed.insert(changed.end(), released.begin(), released.end());
  keepEachOnce(changed);
  backend_->follow({changed, !dropped.empty()});
}

/// Ends what belongs to the extraction that begins, or has begun.
void Engine::settleForMesh() {
  settle();
  table_.noteExtraction();
  was_viewed_ = false;
  const std::vector<int32_t> vacant = table_.takeVacant();
  vacant_.insert(vacant_.end(), vacant.begin(), vacant.end());
}

/// Blocks that went before an extraction met them. Views may have made labels around from them.
/// @return the slots.
std::vector<int32_t> Engine::releaseUnseen() {
  const std::vector<int32_t> unseen = table_.takeUnseen();
  if (was_viewed_ && !unseen.empty()) {
    std::vector<MarkedKey> gone;
    gone.reserve(unseen.size());
    for (const int32_t slot : unseen) gone.push_back({packKey(table_.block(slot).key), {}});
    std::vector<int32_t> around;
    for (const PackedKey key : blocksAround(gone)) {
      if (const int32_t slot = table_.find(key); slot >= 0) around.push_back(slot);
    }
    backend_->follow({around, true});
  }
  return table_.releaseVacant(unseen);
}

/// What the last frame left empty. @return the slots.
std::vector<int32_t> Engine::vacateEmpty() {
  std::vector<int32_t> slots;
  for (const EmptyBlock& empty : backend_->takeEmpty()) {
    table_.vacate(empty.slot, empty.directions);
    slots.push_back(empty.slot);
  }
  return slots;
}

void Engine::takeFree() {
  const std::vector<FreeCube> seen = ready().takeFree();
  has_free_ = false;
  const StageTimer timer(profile_, Stage::kSeeFree);
  space_->addFree(seen);
  if (kept_) space_->dropBeyond(*kept_);
}

/// Forgets what lies beyond the radius that is kept. @return slots of what is gone.
std::vector<int32_t> Engine::dropBeyond() {
  if (!kept_) return {};
  const StageTimer timer(profile_, Stage::kClear);
  std::vector<int32_t> slots = table_.slotsBeyond(*kept_, kMostDroppedBlocks);
  std::vector<PackedKey> on_disk = pager_ ? takeFarthest(*kept_, slots) : std::vector<PackedKey>();
  kept_.reset();
  if (slots.empty() && on_disk.empty()) return {};
  forgetWhatIsMarked();
  backend_->waitForMeshes();
  backend_->reserveChanges(slots.size());
  for (const int32_t slot : slots) table_.vacate(slot, kAllDirections);
  counters_.dropped += slots.size();
  if (on_disk.empty()) return slots;
  backend_->follow({slots, true});                      // what comes may lack memory
  on_disk.resize(pager_->canDrop(*backend_, on_disk));  // the rest after a later frame
  for (const int32_t slot : pager_->drop(*backend_, on_disk)) {
    table_.vacate(slot, kAllDirections);
    slots.push_back(slot);
  }
  counters_.dropped += on_disk.size();
  return slots;
}

Alignment Engine::align(const DepthFrame& frame, const PosePrior& prior) {
  const float voxel_size_m = params_.map.voxel_size_m;
  Alignment unaligned = unalignedPose(frame, prior, rules_.poses, voxel_size_m);
  if (findProblem(frame, params_)) return unaligned;
  try {
    ready();
    settle();
    const StageTimer timer(profile_, Stage::kAlign);
    backend_->takePoints(frame, makeFrameView(frame, voxel_size_m));
    return findPose(frame, prior, rules_.poses, voxel_size_m,
                    [&](const FrameView& view, float cutoff) { return sumsAt(view, cutoff); });
  } catch (const BackendError& error) {
    if (!error.lacksMemory()) throw;
    return unaligned;
  }
}

int32_t Engine::leastEvidenceNow() const {
  return leastEvidence(params_.mesh.min_support, counters_.supporting_frames, rules_.fusion);
}

}  // namespace dtsdf
