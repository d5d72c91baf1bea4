// The part of Engine that works on the whole map: meshing, statistics, copying and clearing.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/partly_cleared.h"
#include "engine/engine.h"
#include "map/memory_budget.h"

namespace dtsdf {
void Engine::beginMeshUpdate() {
  ready();
  finishMeshing();
  // Pending work is done while the GPU extracts the meshes, unless the meshes depend on that work.
  const bool prepares_concurrently =
      traits_.indexes_blocks_itself && !pager_ && !state_.kept && !state_.was_viewed;
  if (!prepares_concurrently) prepareForMesh();
  state_.made = MeshUpdate();  // an earlier extraction that was not fetched is discarded
  const int32_t least = minEvidenceNow();
  if (least != state_.min_evidence) markAllDirty();
  state_.min_evidence = least;
  if (pager_) loadForMesh();
  backend_->beginMesh(least);
  state_.is_meshing = true;
  if (prepares_concurrently) prepareForMesh();
  noteStats();
}

/// Does pending work, and takes the blocks without arrays, which the extraction reports as empty.
void Engine::prepareForMesh() {
  applyPendingWork();
  table_.noteExtraction();
  state_.was_viewed = false;
  const std::vector<int32_t> vacant = table_.takeVacant();
  state_.vacant.insert(state_.vacant.end(), vacant.begin(), vacant.end());
}

void Engine::markAllDirty() {
  const MeshMarks dirty{true, false};
  state_.changed_in.reset();
  backend_->markAll(dirty);
  if (pager_) pager_->markAll(dirty);
}

/// Loads the blocks on which an extraction depends. If they do not all fit into memory, only some
/// of the marked blocks are meshed, and the rest are left for the next extraction.
void Engine::loadForMesh() {
  const auto may_show = [this](const FrameView& view) {
    return pager_->mayShow(view, kMeshedRadius);
  };
  state_.made = pager_->takeDropped();
  const auto views = std::exchange(state_.changed_in, std::vector<FrameView>());
  const bool depends_on_disk = pager_->hasMarks() || !views || !state_.made.blocks.empty() ||
                               std::any_of(views->begin(), views->end(), may_show);
  if (pager_->isEmpty() || !depends_on_disk) return;
  std::vector<MarkedKey> marked = pager_->marked(*backend_, false);
  std::vector<PackedKey> around = blocksAround(keysOf(marked));
  if (!pager_->isAnyPaged(around)) return;
  const bool in_parts = !pager_->fits(around);
  if (in_parts) {
    marked = pager_->marked(*backend_, true);
    sortForTurns(marked, state_.next_turn);
    while (marked.size() > 1 && !pager_->fits(around)) {
      const auto rest = marked.begin() + static_cast<std::ptrdiff_t>((marked.size() + 1) / 2);
      state_.waiting.insert(state_.waiting.begin(), rest, marked.end());
      marked.erase(rest, marked.end());
      around = blocksAround(keysOf(marked));
    }
    state_.made.is_part = !state_.waiting.empty();
    if (state_.made.is_part) state_.next_turn = state_.waiting.front().first;
  }
  if (const size_t left = require(around); left > 0) {
    state_.refused += left;
    state_.undone.insert(state_.undone.end(), marked.begin(), marked.end());
    // Blocks that stay on disk are marked again only after the last part, like all undone blocks.
    // Otherwise there would never be a last part.
    const auto stays = [this](const MarkedKey& one) { return pager_->isPaged(one.first); };
    marked.erase(std::remove_if(marked.begin(), marked.end(), stays), marked.end());
    state_.changed_in.reset();
  }
  if (in_parts) pager_->setMarks(*backend_, marked);
  if (state_.made.is_part) state_.changed_in.reset();
}

MeshUpdate Engine::finishMeshUpdate() {
  ready();
  finishMeshing();
  MeshUpdate made = std::exchange(state_.made, MeshUpdate());
  if (space_ != nullptr) {
    const StageTimer timer(profile_, Stage::kFindCells);
    space_->addSurfaces(made.blocks);
  }
  noteStats();
  if (pager_) moveInBackground();
  return made;
}

/// Fetches an extraction, and marks waiting blocks again. After the last part, marks undone blocks
/// instead, and releases blocks without arrays, as their empty meshes have been delivered.
void Engine::finishMeshing() {
  if (!state_.is_meshing) return;
  addMeshes(backend_->finishMesh(), state_.made);  // can be repeated if a GPU runs out of memory
  state_.is_meshing = false;
  auto& to_mark = state_.made.is_part ? state_.waiting : state_.undone;
  if (!state_.made.is_part) {
    backend_->follow({table_.releaseVacant(std::exchange(state_.vacant, {}))});
  }
  if (pager_) pager_->setMarks(*backend_, std::exchange(to_mark, {}));
}

/// Moves blocks in the background before the next frame. If a GPU lacks the memory to do so, blocks
/// are only moved when frames need them.
void Engine::moveInBackground() {
  state_.has_moved_in_background = true;
  helper_.start([this] {
    try {
      made();
      pager_->moveBetweenFrames(*backend_);
    } catch (const BackendError& error) {
      if (!error.isOutOfMemory()) throw;
    }
  });
}

/// Blocks on disk are loaded in batches to be emptied.
ClearedRegion Engine::clearRegion(const Region& region) {
  constexpr size_t kAtOnce = 256;
  const RegionView view = checkedRegionView(region, params_.map);
  ready().waitForMeshes();
  applyPendingWork();
  ClearedRegion result;
  clearSlots(table_.slotsIn(view), view, result);
  size_t left = 0;
  std::vector<PackedKey> keys = pager_ ? pager_->keysIn(view) : std::vector<PackedKey>();
  while (!keys.empty()) {
    const auto first = keys.end() - static_cast<std::ptrdiff_t>(std::min(keys.size(), kAtOnce));
    const std::vector<PackedKey> some(first, keys.end());
    keys.erase(first, keys.end());
    left += require(some);
    std::vector<int32_t> slots;
    for (const PackedKey key : some) {
      if (const int32_t slot = table_.find(key); slot >= 0) slots.push_back(slot);
    }
    clearSlots(slots, view, result);
  }
  if (space_ != nullptr) space_->clearRegion(view);
  noteStats();
  if (left == 0) return result;
  throw PartlyCleared("the region was only partly cleared: " + std::to_string(left) +
                      " blocks cannot be read from map/page_folder (" + stats_.pages.problem +
                      "); fix this, then clear the region again");
}

void Engine::clearSlots(const std::vector<int32_t>& slots, const RegionView& view,
                        ClearedRegion& result) {
  state_.changed_in.reset();
  backend_->reserve({0, 0, 0, false, slots.size()});
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

void Engine::clear() {
  helper_.finish();
  if (backend_ != nullptr) backend_->enter();
  backend_.reset();
  table_.clear();
  if (pager_) pager_->clear();
  if (space_ != nullptr) space_->clear();
  state_ = State();
  convention_ = PoseConvention();
  noteStats();
}

MapContents Engine::outline() {
  ready();
  applyPendingWork();
  MapContents contents = contentsOf(params_, rules_);
  contents.frames = state_.frames;
  contents.supporting_frames = state_.supporting_frames;
  contents.painted = state_.has_colours;
  std::copy_n(state_.exposure.gain, 3, contents.exposure.begin());
  if (space_ != nullptr) space_->copyTo(contents);
  contents.blocks = mapBlocks(table_, table_.sortedSlots());
  if (pager_) pager_->addBlocksTo(contents);
  noteStats();
  return contents;
}

/// Copying drops damaged blocks from the map. The map is then copied again without them.
MapContents Engine::contents() {
  for (uint64_t lost = stats_.pages.lost;;) {
    MapContents contents = outline();
    MapContents words = part(contents.blocks);
    contents.voxels = std::move(words.voxels);
    contents.colours = std::move(words.colours);
    if (std::exchange(lost, stats_.pages.lost) == stats_.pages.lost) return contents;
  }
}

MapContents Engine::part(const std::vector<MapBlock>& blocks) {
  ready();
  applyPendingWork();
  MapContents part;
  part.blocks = blocks;
  allocateWords(part);
  if (pager_) {
    pager_->copyWords(*backend_, part);
    noteStats();
    return part;
  }
  std::vector<int32_t> slots;
  slots.reserve(blocks.size());
  for (const MapBlock& block : blocks) slots.push_back(table_.find(packKey(block.key)));
  backend_->copyOut(orderOf(table_, slots), part);
  return part;
}

void Engine::restore(const MapParts& parts) {
  parts.visit([this](const MapContents& part) { addPart(part); });
  ready();
  const MapContents& head = *parts.head;
  if (head.painted) keepColours();  // even if the map has no blocks
  markAllDirty();
  state_.frames = head.frames;
  state_.supporting_frames = head.supporting_frames;
  std::copy_n(head.exposure.begin(), 3, state_.exposure.gain);
  if (space_ != nullptr) space_->restore(head);
  noteStats();
}

/// Adds a part of a map. With map/page_folder, blocks that do not fit into memory are written to
/// disk.
void Engine::addPart(const MapContents& part) try {
  ready();
  state_.changed_in.reset();
  if (part.painted) keepColours();
  const auto take = [this](size_t bytes) {
    if (pager_ == nullptr || makeRoom(bytes)) return;
    throw std::runtime_error(
        "the map is larger than map/max_memory_mb, and the rest cannot be written to disk: " +
        pager_->stats().problem);
  };
  take(sizeOf(part.blocks).bytes());
  addContents(part, nullptr, table_, *backend_);
  take(0);
} catch (const BackendError& error) {
  if (!error.isOutOfMemory()) throw;
  throw std::runtime_error(std::string("the map was not loaded, as the GPU has too little memory "
                                       "for it; clear_map frees the memory of the old map. ") +
                           error.what());
}

void Engine::noteStats() {
  PageStats pages = pager_ == nullptr ? PageStats() : pager_->stats();
  if (space_ != nullptr) space_->addTo(pages);
  stats_ = {table_.blocksInUse(),
            table_.arraysInUse(),
            table_.bytesInUse(),
            state_.refused,
            table_.coloursInUse() * BlockTable::kColourBytes,
            state_.dropped,
            space_ == nullptr ? 0 : std::min(space_->freeBytes(), freeBudgetOf(params_)),
            space_ == nullptr ? 0 : space_->refusedCubes(),
            mapBudgetOf(params_),
            table_.bytesPeak(),
            std::move(pages)};
}

MapperMemory Engine::memory() const {
  helper_.wait();
  MapperMemory memory;
  if (backend_ != nullptr) backend_->addMemory(memory);
  if (space_ != nullptr) memory.space = space_->bytes();
  const size_t counted_bytes = table_.blocksInUse() * BlockTable::kBlockBytes;  // in map_bytes
  memory.indices -= std::min(memory.indices, counted_bytes);
  return memory;
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

}  // namespace dtsdf
