// The map as a whole: its meshes, its sizes, copies of it, and what is taken out of it.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/partly_cleared.h"
#include "engine/engine.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// Whether a voxel of a cell's blocks may lie in a region in units of voxels.
bool mayReachInto(const RegionView& region, const BlockCells::Cell& cell) {
  constexpr int kVoxels = BlockCells::kSide * kBlockSide;
  constexpr double kMiddle = 0.5 * (kVoxels - 1), kReach = 1.7321 * kMiddle + 0.1;
  const Vec3i& key = cell.key;
  return isInside(region,
                  Vec3d{static_cast<double>(key.x) * kVoxels + kMiddle,
                        static_cast<double>(key.y) * kVoxels + kMiddle,
                        static_cast<double>(key.z) * kVoxels + kMiddle},
                  kReach);
}

}  // namespace

void Engine::render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                    RenderedView& view) {
  const FrameView frame = checkedFrameView(camera, T_W_C, params_);
  ready();
  settle();
  if (!unfinished_.empty()) finishMeshing();  // which marks what it has left undone
  was_viewed_ = true;
  if (pager_) bringInForView(frame);
  backend_->render({frame, leastEvidenceNow(), has_colours_}, view);
}

void Engine::beginMeshUpdate() {
  ready();
  if (is_meshing_) finishMeshing();
  made_ = MeshUpdate();  // nobody asked for its changes: they are lost
  // Where the table has nothing to say that meshes depend on, it follows while a device is busy.
  const bool settles_behind = backend_->hasMirror() && !pager_ && !kept_ && !was_viewed_;
  if (!settles_behind) settleForMesh();
  const int32_t least = leastEvidenceNow();
  if (least != least_evidence_) markAllDirty();
  least_evidence_ = least;
  if (pager_) meshInParts();  // all but the last of them, which is this:
  backend_->beginMesh(least);
  is_meshing_ = true;
  if (settles_behind) settleForMesh();
  if (pager_) startViews();
  table_.prepare(requests_before_);  // while a device is busy
}

void Engine::markAllDirty() {
  forgetWhatIsMarked();
  backend_->markAllDirty();
  if (pager_) pager_->markAllDirty();
}

MeshUpdate Engine::finishMeshUpdate() {
  ready();
  finishMeshing();
  MeshUpdate made = std::move(made_);
  made_ = MeshUpdate();
  if (space_ != nullptr) {
    const StageTimer timer(profile_, Stage::kFindCells);
    space_->addSurfaces(made.blocks);
  }
  if (pager_) moveBeside();
  return made;
}

/// Blocks without arrays go once all parts are made: what shows their mesh has learnt by then that
/// they have none.
void Engine::finishMeshing() {
  if (!is_meshing_) return;
  addMeshes(backend_->finishMesh(), made_);
  is_meshing_ = false;
  if (!made_.is_part) {
    backend_->follow({table_.releaseVacant(vacant_), false});
    vacant_.clear();
  }
  if (pager_) pager_->setMarks(*backend_, unfinished_);
  unfinished_.clear();
}

ClearedRegion Engine::clearRegion(const Region& region) {
  const RegionView view = checkedRegionView(region, params_.map);
  ready().waitForMeshes();
  settle();
  ClearedRegion result;
  clearSlots(table_.slotsIn(view), view, result);
  const size_t left = pager_ ? clearPaged(view, result) : 0;
  if (space_ != nullptr) space_->clearRegion(view);
  if (left == 0) return result;
  throw PartlyCleared("the region was cleared in part: " + std::to_string(left) +
                      " blocks cannot come back from map/page_folder; " + pager_->stats().problem +
                      "; then clear the region again");
}

void Engine::clearSlots(const std::vector<int32_t>& slots, const RegionView& view,
                        ClearedRegion& result) {
  forgetWhatIsMarked();
  backend_->reserveChanges(slots.size());
  const std::vector<EmptiedBlock> emptied = backend_->emptyRegion(slots, view);
  std::vector<int32_t> changed;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (emptied[i].voxels == 0) continue;
    result.voxels += emptied[i].voxels;
    if (table_.vacate(slots[i], emptied[i].empty_directions)) ++result.blocks;
    changed.push_back(slots[i]);
  }
  releaseUnseen();
  backend_->follow({changed, true});
}

/// Blocks come back to be emptied, some at a time.
/// @return how many cannot, and stay as they were.
size_t Engine::clearPaged(const RegionView& view, ClearedRegion& result) {
  constexpr size_t kAtOnce = 256;
  const std::vector<PackedKey> keys =
      pager_->keysWhere([&](const BlockCells::Cell& cell) { return mayReachInto(view, cell); },
                        [&](const BlockKey& block) { return mayBeInside(view, block); });
  size_t left = 0;
  for (size_t first = 0; first < keys.size(); first += kAtOnce) {
    const size_t end = std::min(keys.size(), first + kAtOnce);
    std::vector<PackedKey> some(keys.begin() + static_cast<std::ptrdiff_t>(first),
                                keys.begin() + static_cast<std::ptrdiff_t>(end));
    // Where memory is scarce, those that are emptied make room for the rest.
    while (!some.empty() && clearSome(some, view, result)) {
    }
    left += some.size();
  }
  return left;
}

/// @param keys Those that stay on disk are left. @return whether any came back.
bool Engine::clearSome(std::vector<PackedKey>& keys, const RegionView& view,
                       ClearedRegion& result) {
  pager_->bringIn(*backend_, keys, 0);
  std::vector<int32_t> slots;
  for (const PackedKey key : keys) {
    if (const int32_t slot = table_.find(key); slot >= 0) slots.push_back(slot);
  }
  keys.erase(std::remove_if(keys.begin(), keys.end(),
                            [this](PackedKey key) { return !pager_->isPaged(key); }),
             keys.end());
  clearSlots(slots, view, result);
  return !slots.empty();
}

void Engine::clear() {
  helper_.finish();
  if (backend_ != nullptr) backend_->enter();
  backend_.reset();
  table_.clear();
  if (pager_) pager_->clear();
  made_ = MeshUpdate();
  unfinished_.clear();
  postponed_.clear();
  if (space_ != nullptr) space_->clear();
  counters_ = Counters();
  exposure_ = sameExposure();
  has_colours_ = has_free_ = is_meshing_ = false;
  outside_.clear();
  T_W_C_before_.reset();
  ahead_of_.reset();
  views_.clear();
  marks_are_in_views_ = true;
  lost_before_ = 0;
  kept_.reset();
  least_evidence_ = 0;
  vacant_.clear();
}

MapContents Engine::outline() {
  settled();
  MapContents contents = contentsOf(params_, rules_);
  contents.frames = counters_.frames;
  contents.supporting_frames = counters_.supporting_frames;
  contents.painted = has_colours_;
  std::copy_n(exposure_.gain, 3, contents.exposure.begin());
  if (space_ != nullptr) space_->copyTo(contents);
  contents.blocks = mapBlocks(table_, table_.sortedSlots());
  if (pager_) pager_->addBlocksTo(contents);
  return contents;
}

MapContents Engine::contents() {
  MapContents contents = outline();
  makeRoomForWords(contents);
  if (pager_ == nullptr || pager_->isEmpty()) {
    backend_->copyOut(orderOf(table_, table_.sortedSlots()), contents);
    return contents;
  }
  const uint64_t lost = pager_->stats().lost;
  pager_->copyAll(*backend_, contents);
  // Blocks that turn out to be damaged have gone from the map: it is copied without them.
  return pager_->stats().lost == lost ? std::move(contents) : this->contents();
}

MapContents Engine::part(const std::vector<MapBlock>& blocks) {
  settled();
  MapContents part;
  part.blocks = blocks;
  if (pager_) {
    pager_->copyWords(*backend_, part);
    return part;
  }
  std::vector<int32_t> slots;
  slots.reserve(blocks.size());
  for (const MapBlock& block : blocks) slots.push_back(table_.find(packKey(block.key)));
  makeRoomForWords(part);
  backend_->copyOut(orderOf(table_, slots), part);
  return part;
}

void Engine::restore(const MapContents& contents) {
  enterInParts(contents);
  goOnFrom(contents);
}

void Engine::restore(const MapParts& parts) {
  parts.visit([this](const MapContents& part) { enterInParts(part); });
  goOnFrom(*parts.head);
}

/// With map/page_folder they may be more than fits.
void Engine::enterInParts(const MapContents& contents) {
  ready();
  if (pager_ == nullptr) return enterContents(contents);
  pager_->visitParts(contents, [this](const MapContents& part) {
    const size_t bytes = sizeOf(part.blocks).bytes();
    pager_->bringIn(*backend_, {}, bytes);
    if (!pager_->hasRoom(bytes)) {
      throw std::runtime_error(
          "the map is larger than map/max_memory_mb, and the rest of it cannot be written: " +
          pager_->stats().problem);
    }
    enterContents(part);
  });
}

/// What a map is besides its blocks.
void Engine::goOnFrom(const MapContents& head) {
  if (head.painted && !has_colours_) {
    ready().reserveColours(0);
    keepColours();
    has_colours_ = true;
  }
  ready();
  markAllDirty();
  counters_.frames = head.frames;
  counters_.supporting_frames = head.supporting_frames;
  std::copy_n(head.exposure.begin(), 3, exposure_.gain);
  if (space_ != nullptr) space_->restore(head);
}

/// As frames do: memory first, then the table, then what the backend knows of it.
void Engine::enterContents(const MapContents& contents) try {
  forgetWhatIsMarked();
  const MapSize size = sizeOf(contents.blocks);
  backend_->reserve(
      {size.blocks, size.voxel_arrays, table_.sizesAfter(size.blocks, size.voxel_arrays)});
  const EnteredBlocks entered = enterBlocks(contents.blocks, table_);
  std::vector<int32_t> had_others;  // arrays that other blocks may have had before
  if (pager_) had_others = entered.blocks.new_arrays;
  backend_->enterBlocks(entered.blocks.changed_slots, had_others);
  if (contents.painted) {
    backend_->reserveColours(0);  // beyond what the table has by now
    if (!has_colours_) keepColours();
    has_colours_ = true;
  }
  enterColours(entered.colours.bricks);
  backend_->copyIn(entered.order(), contents);
} catch (const BackendError& error) {
  if (!error.lacksMemory()) throw;
  throw std::runtime_error(std::string("the GPU has too little memory for this map, which was not "
                                       "loaded; clear_map frees that of the old one. ") +
                           error.what());
}

/// The engine with all that the last frame left: what the map holds stays the same by that, so that
/// it may be asked of a const one.
const Engine& Engine::settled() const {
  Engine& self = const_cast<Engine&>(*this);
  self.ready();
  self.settle();
  return self;
}

MapStats Engine::stats() const {
  settled();
  PageStats pages = pager_ == nullptr ? PageStats() : pager_->stats();
  if (space_ != nullptr) space_->addTo(pages);
  return {table_.blocksInUse(),
          table_.arraysInUse(),
          table_.bytesInUse(),
          counters_.refused,
          table_.coloursInUse() * BlockTable::kColourBytes,
          counters_.dropped,
          space_ == nullptr ? 0 : std::min(space_->freeBytes(), budgetOf(params_).free_bytes),
          space_ == nullptr ? 0 : space_->refusedCubes(),
          budgetOf(params_).map_bytes,
          table_.bytesPeak(),
          pages};
}

std::vector<MemoryPart> Engine::memoryParts() const {
  settled();
  std::vector<MemoryPart> parts;
  backend_->addMemory(parts);
  if (space_ != nullptr) {
    parts.push_back({"space", MemoryKind::kSpace, space_->bytes(), space_->bytes()});
  }
  if (pager_) {
    const bool is_on_gpu = std::any_of(parts.begin(), parts.end(), [](const MemoryPart& part) {
      return part.kind == MemoryKind::kStaging;
    });
    const size_t bytes = pager_->queueBytes();
    parts.push_back({"blocks on their way to and from the disk",
                     is_on_gpu ? MemoryKind::kStaging : MemoryKind::kScratch, bytes, bytes});
  }
  return parts;
}

void Engine::profileTo(Profile* profile) {
  profile_ = profile;
  ready().profileTo(profile);
}

void Engine::restrictTo(const MapExtent& extent) {
  helper_.wait();
  table_.restrictTo(extent);
  if (space_ != nullptr) space_->restrictTo(extent.cubes);
}

void Engine::passOver(const PassedFrames& passed) {
  counters_.frames += passed.frames;
  counters_.supporting_frames += passed.supporting_frames;
}

}  // namespace dtsdf
