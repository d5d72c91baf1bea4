// Extractions of a map that is on disk in part: what they depend on comes to memory, part by part
// where it is too much at once.
#include <algorithm>
#include <iterator>
#include <unordered_set>
#include <utility>

#include "engine/engine.h"

namespace dtsdf {

namespace {

/// Of two lists by key.
bool haveCommon(const std::vector<PackedKey>& some, const std::vector<PackedKey>& others) {
  return std::any_of(others.begin(), others.end(), [&](PackedKey key) {
    return std::binary_search(some.begin(), some.end(), key);
  });
}

}  // namespace

/// Blocks on disk that meshes around these may depend on, and some others.
std::vector<PackedKey> Engine::pagedAround(const std::vector<MarkedKey>& marked) const {
  return pager_->keysInCells(cellsAround(marked));
}

/// An extraction begins, of all that was marked, but for what is left to the next one.
void Engine::startViews() {
  views_.clear();
  lost_before_ = pager_->lost();
  marks_are_in_views_ = unfinished_.empty() && !made_.is_part && !pager_->hasMarks();
}

/// Whether blocks on disk may matter to the next extraction, by coarse cells.
bool Engine::dependsOnDisk() const {
  if (pager_->isEmpty()) return false;
  if (!marks_are_in_views_ || pager_->lost() != lost_before_) return true;
  return std::any_of(views_.begin(), views_.end(), [this](const FrameView& view) {
    return pager_->mayShow(view, kMeshedRadius);
  });
}

/// Where all fit into memory that the extraction depends on, they come there and it goes on as
/// ever. Else it is done in parts but for the last.
void Engine::meshInParts() {
  if (!dependsOnDisk()) return;
  BlockMover& mover = *backend_->mover();
  const std::vector<int32_t> slots = mover.markedSlots();
  std::vector<MarkedKey> marked;
  marked.reserve(slots.size());
  for (const int32_t slot : slots) marked.push_back({packKey(table_.block(slot).key), {}});
  for (const PackedKey key : pager_->markedKeys()) marked.push_back({key, {}});
  const std::vector<PackedKey> on_disk = pagedAround(marked);
  if (on_disk.empty()) return;
  const std::vector<PackedKey> around = blocksAround(marked);
  if (!haveCommon(around, on_disk)) return;
  if (fits(around)) {
    keepMarks(pager_->bringIn(*backend_, around, 0), Want::kWaits);
    return;
  }
  const std::vector<MeshMarks> marks = mover.takeMarks(slots);
  for (size_t i = 0; i < marked.size(); ++i) {
    marked[i].marks = i < slots.size() ? marks[i] : pager_->takeMarks(marked[i].key);
  }
  meshThoseThatWaitFirst(marked);
}

/// So that all get their turn, whatever a camera changes meanwhile.
void Engine::meshThoseThatWaitFirst(const std::vector<MarkedKey>& marked) {
  const std::unordered_set<PackedKey> waiting = std::exchange(postponed_, {});
  const auto waits = [&](const MarkedKey& one) { return waiting.count(one.key) > 0; };
  std::vector<MarkedKey> first, rest;
  std::partition_copy(marked.begin(), marked.end(), std::back_inserter(first),
                      std::back_inserter(rest), waits);
  if (!first.empty()) meshParts(std::move(first), rest.empty());
  const bool all_had_their_turn = !made_.is_part;
  if (!rest.empty()) meshParts(std::move(rest), true);
  if (!made_.is_part) return;
  for (const MarkedKey& one : unfinished_) {
    if (all_had_their_turn || waits(one)) postponed_.insert(one.key);
  }
}

/// Before an extraction that goes without blocks that stay on disk: what it does is to be done
/// again when they can come back.
/// @param want Of the blocks that stay: whether the budget is too small for a single mesh.
void Engine::keepMarks(size_t left, Want want) {
  if (left == 0) return;
  if (want == Want::kRefused || pager_->stats().failures > 0) counters_.refused += left;
  BlockMover& mover = *backend_->mover();
  const std::vector<int32_t> slots = mover.markedSlots();
  const std::vector<MeshMarks> marks = mover.takeMarks(slots);
  mover.setMarks(slots, marks);
  for (size_t i = 0; i < slots.size(); ++i) {
    unfinished_.push_back({packKey(table_.block(slots[i]).key), marks[i]});
  }
}

/// Of the blocks that meshes around these depend on, those that there are.
std::vector<PackedKey> Engine::neededFor(const std::vector<MarkedKey>& marked) const {
  std::vector<PackedKey> keys = blocksAround(marked);
  const auto is_none = [this](PackedKey key) { return pager_->bytesOf(key) == 0; };
  keys.erase(std::remove_if(keys.begin(), keys.end(), is_none), keys.end());
  return keys;
}

/// Beside those that wait for the extraction to go, as nothing is left of them.
bool Engine::fits(const std::vector<PackedKey>& keys) const {
  size_t bytes = vacant_.size() * BlockTable::kBlockBytes;
  if (bytes + mostBytes(keys.size()) <= table_.budgetBytes()) return true;
  for (const PackedKey key : keys) bytes += pager_->bytesOf(key);
  return bytes <= table_.budgetBytes();
}

/// Where so much was made that the rest is left to the next extraction: it would do the same again
/// where blocks have to be done again.
bool Engine::isEnough() const {
  constexpr size_t kMadeShare = 8;
  return made_.is_part ||
         (unfinished_.empty() && bytesOf(made_) > table_.budgetBytes() / kMadeShare);
}

/// @param is_last The last part of all is left to the caller.
void Engine::meshParts(std::vector<MarkedKey> marked, bool is_last) {
  if (isEnough()) {
    made_.is_part = true;
    unfinished_.insert(unfinished_.end(), marked.begin(), marked.end());
    return;
  }
  const std::vector<PackedKey> around = neededFor(marked);
  if (marked.size() > 1 && !fits(around)) {
    std::vector<MarkedKey> half = takeHalf(marked);
    meshParts(std::move(marked), false);
    meshParts(std::move(half), is_last);
    return;
  }
  const size_t left = pager_->bringIn(*backend_, around, 0);
  pager_->setMarks(*backend_, marked);
  keepMarks(left, fits(around) ? Want::kWaits : Want::kRefused);
  if (is_last) return;
  backend_->beginMesh(least_evidence_);
  addMeshes(backend_->finishMesh(), made_);
}

}  // namespace dtsdf
