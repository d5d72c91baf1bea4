#include "engine/engine.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "backend/pose_solver.h"
#include "backend/rule_settings.h"
#include "kernels/colour/surface_point.h"
#include "kernels/core/direction.h"
#include "kernels/render/drawn_triangle.h"
#include "map/memory_budget.h"
#include "params/intrinsics_check.h"

namespace dtsdf {
namespace {

IntegrationResult outOfMemoryResult(const BackendError& error) {
  return refuse(FrameStatus::kNoMemory,
                std::string("the frame was not fused, as the GPU has too little memory for it; "
                            "lower map/max_memory_mb or use larger voxels. ") +
                    error.what());
}

/// Maximum number of views in State::changed_in.
constexpr size_t kMaxViews = 8;

}  // namespace

Engine::Engine(const MapperParams& params, const Rules& rules, int threads,
               BackendMaker make_backend)
    : params_(params),
      rules_(rules),
      paint_settings_(makePaintSettings(params, rules)),
      make_backend_(std::move(make_backend)),
      table_(mapBudgetOf(params)) {
  if (params.space.enabled) space_ = std::make_unique<SpaceMap>(params, threads);
  ready();  // throws now if the device cannot be used
  if (!params.map.page_folder.empty()) {
    pager_ = std::make_unique<Pager>(params, rules, threads, table_);
  }
  noteStats();
}

/// Waits for the helper thread, and prepares the backend for the calling thread.
MapBackend& Engine::ready() {
  helper_.wait();
  return made();
}

MapBackend& Engine::made() {
  if (backend_ == nullptr) {
    backend_ = make_backend_(table_);
    backend_->profileTo(profile_);
    traits_ = backend_->traits();
    if (space_) space_->setDistanceBackend(traits_.distance_work);
  }
  backend_->enter();
  return *backend_;
}

/// Runs `take` and measures its time. If the device runs out of memory, the result says so.
IntegrationResult Engine::timed(const std::function<IntegrationResult()>& take) {
  const auto start = std::chrono::steady_clock::now();
  IntegrationResult result;
  try {
    result = take();
  } catch (const BackendError& error) {
    table_.publish();
    if (!error.isOutOfMemory()) throw;
    result = outOfMemoryResult(error);
  }
  noteStats();
  result.duration_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

IntegrationResult Engine::integrate(const DepthFrame& frame) {
  if (const auto problem = findProblem(frame, params_)) return *problem;
  return timed([&] { return fuse(frame); });
}

/// Processes a depth image in the stages listed in docs/method.md.
IntegrationResult Engine::fuse(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  made().sense(frame, view);
  backend_->makeSurfels();
  backend_->findBlocks();
  std::vector<int32_t> in_view = prepareForFrame(view);
  const auto cubes = space_ ? space_->cubesInView(view) : std::vector<Vec3i>();
  TouchedBlocks touched = backend_->lookUpBlocks();
  if (touched.blocks == 0 && !clearsBeyondRange(frame, params_))
    return noMeasurement(frame, params_);
  if (space_) backend_->seeFree(cubes);
  IntegrationResult result;
  convention_.add(frame);
  result.message = convention_.doubt().empty()
                       ? doubtAbout(frame.intrinsics, frame.width, frame.height)
                       : convention_.doubt();
  const uint64_t refused_before = state_.refused;
  if (pager_) loadForFrame(view, touched, in_view);
  admit(touched, in_view);
  backend_->castFoldAndClear(state_.frames + 1, in_view);
  table_.publish();  // while a GPU, if used, is busy
  ++state_.frames;
  if (touched.blocks > 0) ++state_.supporting_frames;
  keep(frame, view);
  result.refused_blocks = state_.refused - refused_before;
  return result;
}

/// Completes the previous frame. Moves blocks between memory and disk, unless the helper has
/// already done so or an extraction is in progress.
/// @return the result of blocksInView().
std::vector<int32_t> Engine::prepareForFrame(const FrameView& view) {
  helper_.wait();
  std::vector<int32_t> in_view = blocksInView(view);
  applyPendingWork();
  const bool has_moved = std::exchange(state_.has_moved_in_background, false);
  if (!pager_ || has_moved || state_.is_meshing) return in_view;
  pager_->moveBetweenFrames(*backend_);
  return blocksInView(view);
}

/// Blocks in view, which a frame may clear without touching them; none if there is no clearing
/// stage. The first call for a frame precedes applyPendingWork(), so that it overlaps with work on
/// the device.
std::vector<int32_t> Engine::blocksInView(const FrameView& view) const {
  if (!clearsFreeSpace(params_)) return {};
  const StageTimer timer(profile_, Stage::kClear);
  return table_.slotsInView(view, kFootRadius);
}

/// Loads the blocks that an image needs, and makes room for new blocks. Blocks that stay on disk
/// count as refused.
void Engine::loadForFrame(const FrameView& view, TouchedBlocks& touched,
                          std::vector<int32_t>& in_view) {
  const std::vector<PackedKey> keys =
      pager_->neededKeys(*backend_, view, touched, in_view, state_.frames + 1);
  if (keys.empty()) return;
  const StageTimer timer(profile_, Stage::kAdmit);
  state_.refused += require(keys);
  // Blocks that stayed on disk must not be created again.
  std::vector<BlockRequest>& requests = touched.requests;
  const auto is_paged = [this](const BlockRequest& one) { return pager_->isPaged(one.key); };
  requests.erase(std::remove_if(requests.begin(), requests.end(), is_paged), requests.end());
  const PoolSizes lack = table_.countNew(requests);
  touched.new_arrays = lack.arrays;
  makeRoom(MapSize{lack.slots, lack.arrays}.bytes());
  in_view = blocksInView(view);
}

/// All memory is reserved before the table changes, so a failure leaves the map unchanged. If the
/// device lacks memory for new blocks, these are refused (as if the budget were full), and the
/// frame is only fused into existing blocks.
void Engine::admit(TouchedBlocks& touched, const std::vector<int32_t>& in_view) {
  backend_->waitForMeshes();
  const StageTimer timer(profile_, Stage::kAdmit);
  backend_->reserveFrame(in_view);
  const size_t blocks = touched.requests.size();
  if (blocks == 0) return;
  try {
    backend_->reserve({blocks, touched.new_arrays});
  } catch (const BackendError& error) {
    if (!error.isOutOfMemory()) throw;
    state_.refused += blocks;
    return;
  }
  const Admission admission = table_.allocate(std::move(touched.requests));
  if (pager_ || !traits_.indexes_blocks_itself) table_.publish();
  backend_->follow({admission.changed_slots, false, &admission.new_arrays});
  for (const int32_t slot : admission.changed_slots) {
    if (pager_) pager_->touch(slot);
  }
  state_.refused += admission.refused;
}

/// Notes what dropping, paging and meshing need to know about the frame. With a GPU, the frame's
/// pending work is left until the map is next used, so that this call does not wait for the GPU.
void Engine::keep(const DepthFrame& frame, const FrameView& view) {
  if (params_.map.keep_radius_m > 0.0f) state_.kept = keptBallOf(frame, params_.map);
  if (pager_) {
    pager_->noteFrame(frame, view);
    auto& views = state_.changed_in;
    if (views && views->size() == kMaxViews) views.reset();
    if (views) views->push_back(view);
  }
  if (!traits_.indexes_blocks_itself) applyPendingWork();
}

Space* Engine::space() {
  if (space_ != nullptr) {
    ready();
    applyPendingWork();
    noteStats();
  }
  return space_.get();
}

/// Applies the last frame's outcome: free cells, empty blocks, and blocks beyond the kept radius.
void Engine::applyPendingWork() {
  std::vector<int32_t> changed = takeOutcome();
  const std::vector<int32_t> dropped = dropBeyond();
  changed.insert(changed.end(), dropped.begin(), dropped.end());
  const std::vector<int32_t> released = releaseUnseen();
  changed.insert(changed.end(), released.begin(), released.end());
  sortUnique(changed);
  backend_->follow({changed, !dropped.empty()});
}

/// Takes the last frame's outcome. @return slots of the blocks with arrays that the frame left
/// empty.
std::vector<int32_t> Engine::takeOutcome() {
  const FrameOutcome outcome = backend_->takeOutcome();
  if (space_ != nullptr) {
    const StageTimer timer(profile_, Stage::kSeeFree);
    space_->addFree(outcome.free);
    if (state_.kept) space_->dropBeyond(*state_.kept);
  }
  std::vector<int32_t> slots;
  for (const EmptyBlock& empty : outcome.empty) {
    table_.vacate(empty.slot, empty.directions);
    slots.push_back(empty.slot);
  }
  return slots;
}

/// Releases blocks that became empty before they were ever meshed. If render() has run, labels may
/// depend on these blocks, so the blocks around them are marked for meshing.
/// @return the released slots.
std::vector<int32_t> Engine::releaseUnseen() {
  const std::vector<int32_t> unseen = table_.takeUnmeshed();
  if (state_.was_viewed && !unseen.empty()) {
    std::vector<PackedKey> keys;
    for (const int32_t slot : unseen) keys.push_back(packKey(table_.block(slot).key));
    keys = blocksAround(std::move(keys));
    std::vector<int32_t> around;
    for (const PackedKey key : keys) {
      if (const int32_t slot = table_.find(key); slot >= 0) around.push_back(slot);
    }
    backend_->follow({around, true});
  }
  return table_.releaseVacant(unseen);
}

/// Drops the blocks beyond the kept radius, in memory or on disk.
/// @return slots of the dropped blocks in memory.
std::vector<int32_t> Engine::dropBeyond() {
  if (!state_.kept) return {};
  const StageTimer timer(profile_, Stage::kClear);
  const RegionView kept = *std::exchange(state_.kept, std::nullopt);
  std::vector<int32_t> slots = table_.slotsBeyond(kept);
  const auto on_disk = pager_ ? pager_->keysBeyond(kept) : std::vector<PackedKey>();
  if (slots.empty() && on_disk.empty()) return {};
  if (!on_disk.empty()) finishMeshing();
  state_.changed_in.reset();
  backend_->waitForMeshes();
  backend_->reserve({0, 0, 0, false, slots.size()});
  if (!on_disk.empty()) pager_->drop(*backend_, on_disk);  // first, as a GPU may lack memory for it
  for (const int32_t slot : slots) table_.vacate(slot, kAllDirections);
  state_.dropped += slots.size() + on_disk.size();
  return slots;
}

Alignment Engine::align(const DepthFrame& frame, const PosePrior& prior) {
  const float voxel_size_m = params_.map.voxel_size_m;
  Alignment unaligned = unalignedPose(frame, prior, rules_.poses, voxel_size_m);
  if (findProblem(frame, params_)) return unaligned;
  try {
    ready();
    applyPendingWork();
    const StageTimer timer(profile_, Stage::kAlign);
    backend_->takePoints(frame, makeFrameView(frame, voxel_size_m));
    size_t left = 0;  // largest number of blocks left on disk, over all poses
    const auto sums_at = [&](const FrameView& view, float cutoff) {
      if (pager_ && !pager_->isEmpty()) {
        left = std::max(left, require(backend_->alignedKeys(view, cutoff)));
      }
      return backend_->sumsAt(view, cutoff);
    };
    Alignment alignment = findPose(frame, prior, rules_.poses, voxel_size_m, sums_at);
    state_.refused += left;
    return alignment;
  } catch (const BackendError& error) {
    if (!error.isOutOfMemory()) throw;
    return unaligned;
  }
}

IntegrationResult Engine::paint(const ColourFrame& frame) {
  if (const auto problem = findProblem(frame, params_)) return *problem;
  return timed([&] { return paintSurfaces(frame); });
}

IntegrationResult Engine::paintSurfaces(const ColourFrame& frame) {
  ready();
  state_.changed_in.reset();
  backend_->takeColours(frame);
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  const float radius = pointRadius(rules_.colour);
  std::vector<int32_t> in_view = table_.slotsInView(view, radius);
  applyPendingWork();
  const uint64_t refused_before = state_.refused;
  if (pager_) {  // loads blocks that may be visible in the image, and blocks that may hide them
    const StageTimer timer(profile_, Stage::kPaint);
    std::vector<PackedKey> keys = pager_->keysInView(view, radius, paint_settings_.max_depth_m);
    state_.refused += pager_->trim(keys);
    state_.refused += require(keys);
    in_view = table_.slotsInView(view, radius);
  }
  SeenColours seen = backend_->findColours(view, minEvidenceNow(), in_view);
  state_.exposure = exposureOf(seen.sums, state_.exposure, paint_settings_);
  if (!seen.any) return nothingToPaint();
  admitColours(std::move(seen.requests));
  if (state_.has_colours) backend_->paint(state_.exposure);
  IntegrationResult result;
  result.refused_blocks = state_.refused - refused_before;
  return result;
}

/// Admits colour bricks.
void Engine::admitColours(std::vector<ColourRequest> requests) {
  backend_->waitForMeshes();
  const size_t new_bricks = table_.countNewColours(requests);
  const size_t bytes = new_bricks * BlockTable::kColourBytes;
  if (pager_) makeRoom(bytes);
  backend_->reserve({0, 0, new_bricks, true});
  const Admission admission = table_.admitColours(std::move(requests));
  if (!admission.bricks.empty()) {
    keepColours();
    backend_->follow({{}, false, nullptr, &admission.bricks});
  }
  state_.refused += admission.refused;
}

/// Turns on colours, also for blocks that are already meshed.
void Engine::keepColours() {
  if (state_.has_colours) return;
  backend_->reserve({0, 0, 0, true});
  state_.has_colours = true;
  const MeshMarks painted{false, true};
  backend_->markAll(painted);
  if (pager_) pager_->markAll(painted);
}

void Engine::render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                    RenderedView& view) {
  constexpr float kViewRadius = kLabelledReach + 13.9f;  // includes all blocks a view depends on
  constexpr float kAnyDepth_m = 1e30f;
  const FrameView frame = checkedFrameView(camera, T_W_C, params_);
  ready();
  applyPendingWork();
  state_.was_viewed = true;
  if (pager_) {
    if (!state_.waiting.empty()) finishMeshing();  // which marks the waiting blocks
    pager_->setMarks(*backend_, std::exchange(state_.undone, {}));
    std::vector<PackedKey> keys = pager_->keysInView(frame, kViewRadius, kAnyDepth_m);
    if (pager_->isAnyPaged(keys) && (pager_->trim(keys) > 0 || require(keys) > 0)) {
      throw std::runtime_error(
          "the view contains more of the map than fits into memory; raise map/max_memory_mb, or "
          "render the saved map");
    }
  }
  backend_->render({frame, minEvidenceNow(), state_.has_colours}, view);
  noteStats();
}

/// Loads blocks from disk, after fetching an extraction in progress, if any.
/// @return the number of blocks that stay on disk.
size_t Engine::require(const std::vector<PackedKey>& keys) {
  if (pager_->isAnyPaged(keys)) finishMeshing();
  return pager_->require(*backend_, keys);
}

/// Evicts blocks, except those requested by the last require().
/// @return whether there is room for `bytes` now.
bool Engine::makeRoom(size_t bytes) {
  if (pager_->hasRoom(bytes)) return true;
  finishMeshing();
  return pager_->makeRoom(*backend_, bytes);
}

int32_t Engine::minEvidenceNow() const {
  return minEvidence(params_.mesh.min_support, state_.supporting_frames, rules_.fusion);
}

}  // namespace dtsdf
