#include "cpu/block_mesher.h"

#include <algorithm>
#include <array>
#include <utility>

#include "backend/gaps.h"
#include "cpu/block_indexer.h"
#include "cpu/block_surface.h"
#include "kernels/meshing/regularisation.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

/// The slots of a block and its neighbours, in the order of aroundOffset(); -1: no block.
using SlotsAround = std::array<int32_t, kBlocksAround>;

SlotsAround slotsAround(const BlockTable& table, const BlockKey& key) {
  SlotsAround slots;
  for (int n = 0; n < kBlocksAround; ++n) slots[n] = table.find(packKey(key + aroundOffset(n)));
  return slots;
}

/// The voxel arrays of the blocks in `slots`. Voxels with less than `min_evidence` count as
/// unknown.
ArraysAround arraysAround(const CpuMap& map, const SlotsAround& slots, int32_t min_evidence) {
  ArraysAround around;
  around.min_evidence = min_evidence;
  for (int n = 0; n < kBlocksAround; ++n) {
    const BlockEntry* const block = slots[n] < 0 ? nullptr : &map.table.block(slots[n]);
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = block == nullptr ? kNoArray : block->array[d];
      around.array[n][d] = array == kNoArray ? nullptr : map.voxels.array(array);
    }
  }
  return around;
}

/// Returns the slots of a list that are still marked, without duplicates. Clears the marks and the
/// list.
template <class State>
std::vector<int32_t> takeMarked(std::vector<int32_t>& list, std::vector<State>& states,
                                bool State::*mark) {
  std::vector<int32_t> marked;
  for (const int32_t slot : list) {
    if (states[slot].*mark) marked.push_back(slot);
    states[slot].*mark = false;
  }
  list.clear();
  return marked;
}

}  // namespace

BlockMesher::BlockMesher(const CpuMap& map, const MeshSettings& rules, bool directional,
                         int threads, bool refined)
    : map_(map),
      table_(map.table),
      rules_(rules),
      directional_(directional),
      threads_(threads),
      refined_(refined) {}

void BlockMesher::markAllDirty() {
  for (size_t i = 0; i < table_.slotCount(); ++i) {
    const auto slot = static_cast<int32_t>(i);
    if (table_.block(slot).in_use) markDirty(slot);
  }
}

void BlockMesher::keepColours() {
  if (has_colours_) return;
  has_colours_ = true;
  for (size_t slot = 0; slot < state_.size(); ++slot) {
    if (state_[slot].has_mesh) markPainted(static_cast<int32_t>(slot));
  }
}

std::vector<int32_t> BlockMesher::marked() const {
  std::vector<int32_t> slots;
  for (const std::vector<int32_t>* list : {&dirty_, &painted_}) {
    for (const int32_t slot : *list) {
      if (state_[slot].dirty || state_[slot].painted) slots.push_back(slot);
    }
  }
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
  return slots;
}

MeshMarks BlockMesher::takeMarks(int32_t slot) {
  const MeshMarks marks = marksOf(slot);
  state_[slot].dirty = state_[slot].painted = false;
  return marks;
}

void BlockMesher::setMarks(int32_t slot, const MeshMarks& marks) {
  if (marks.dirty) markDirty(slot);
  if (marks.painted) markPainted(slot);
}

MeshStates BlockMesher::takeStates(const std::vector<int32_t>& slots) {
  MeshStates taken;
  size_t labelled = 0;
  for (const int32_t slot : slots) labelled += state_[slot].labels.empty() ? 0 : 1;
  taken.labels = PlainArray<UnitLabels>(labelled * kVoxelsPerBlock);
  taken.states.reserve(slots.size());
  UnitLabels* to = taken.labels.data();
  for (const int32_t slot : slots) {
    const std::vector<UnitLabels>& labels = state_[slot].labels;
    to = std::copy(labels.begin(), labels.end(), to);
    const bool has_labels = !labels.empty();
    taken.states.push_back({takeMarks(slot), state_[slot].has_mesh, has_labels});
    forget(slot);
  }
  return taken;
}

void BlockMesher::restoreStates(const std::vector<int32_t>& slots, const MeshStates& states) {
  const UnitLabels* labels = states.labels.data();
  for (size_t i = 0; i < slots.size(); ++i) {
    const MeshState& state = states.states[i];
    forget(slots[i]);
    state_[slots[i]].has_mesh = state.has_mesh;
    if (state.has_labels) {
      state_[slots[i]].labels.assign(labels, labels + kVoxelsPerBlock);
      labels += kVoxelsPerBlock;
    }
    held_bytes_ += bytesOf(state_[slots[i]].labels);
    setMarks(slots[i], state.marks);
  }
  if (dirty_.size() > 2 * state_.size()) dropClearedMarks(dirty_, &SlotState::dirty);
  if (painted_.size() > 2 * state_.size()) dropClearedMarks(painted_, &SlotState::painted);
}

/// Drops slots whose marks were cleared. Otherwise, the list would grow whenever blocks are evicted
/// and loaded again.
void BlockMesher::dropClearedMarks(std::vector<int32_t>& list, bool SlotState::*mark) {
  list = takeMarked(list, state_, mark);
  for (const int32_t slot : list) state_[slot].*mark = true;
}

void BlockMesher::select(const BlockKey& key, std::vector<int32_t>& slots) {
  const int32_t slot = table_.find(packKey(key));
  if (slot < 0 || state_[slot].update == update_) return;
  state_[slot].update = update_;
  slots.push_back(slot);
}

/// Voxels are read for vertices that the index stage has not placed, and for colours.
bool BlockMesher::willReadVoxels(int32_t slot) const {
  const SlotState& state = state_[slot];
  return !state.labels.empty() && (has_colours_ || state.vertices.empty());
}

bool BlockMesher::areLabelsOutdated(int32_t slot) const {
  const SlotState& state = state_[slot];
  if (state.min_evidence != min_evidence_) return true;
  for (int n = 0; n < kCornerBlocks; ++n) {
    const int32_t beside = table_.find(packKey(table_.block(slot).key + cornerBlockOffset(n)));
    if (beside >= 0 && state_[beside].changed >= state.indexed) return true;
  }
  return false;
}

void BlockMesher::indexBlocks(std::vector<int32_t> slots, bool with_vertices) {
  const StageTimer timer(profile_, Stage::kIndex);
  slots.erase(std::remove_if(slots.begin(), slots.end(),
                             [this](int32_t slot) { return !areLabelsOutdated(slot); }),
              slots.end());
  ++indexings_;
  parallelFor<BlockIndexer>(slots.size(), threads_, [&](size_t i, BlockIndexer& indexer) {
    if (i + 1 < slots.size()) prefetchBlock(table_.block(slots[i + 1]), map_);
    SlotState& state = state_[slots[i]];
    const ArraysAround arrays =
        arraysAround(map_, slotsAround(table_, table_.block(slots[i]).key), min_evidence_);
    const size_t before = bytesOf(state.labels);
    indexer.index(rules_, arrays, directional_, state.labels, state.vertices);
    if (!with_vertices) state.vertices.clear();
    if (refined_) state.normals = vertexNormals(arrays, state.vertices, directional_);
    held_bytes_ += bytesOf(state.labels) - before;  // correct even if the difference wraps around
    state.indexed = indexings_;
    state.min_evidence = min_evidence_;
  });
}

bool BlockMesher::makeSurface(int32_t slot, BlockSurface& surface, bool refined,
                              BlockMesh& mesh) const {
  mesh.key = table_.block(slot).key;
  mesh.vertices.clear();
  const SlotState& state = state_[slot];
  if (state.labels.empty()) return false;
  const SlotsAround around = slotsAround(table_, mesh.key);
  LabelNeighbourhood labels;
  for (int n = 0; n < kBlocksAround; ++n) {
    const bool empty = around[n] < 0 || state_[around[n]].labels.empty();
    labels[n] = empty ? nullptr : state_[around[n]].labels.data();
  }
  const ArraysAround arrays = arraysAround(map_, around, min_evidence_);
  surface.regularise(labels);
  surface.emit(rules_, arrays, state.vertices, directional_, mesh);
  if (refined) surface.refine(rules_, arrays, state.vertices, state.normals, directional_, mesh);
  return true;
}

void BlockMesher::labelBlocks(std::vector<int32_t> slots, int32_t min_evidence) {
  renders_views_ = true;
  min_evidence_ = min_evidence;
  sortByKey(slots);
  indexBlocks(std::move(slots), false);
}

size_t BlockMesher::bytesOf(const BlockMesh* mesh) {
  if (mesh == nullptr) return 0;
  return sizeof(BlockMesh) + mesh->vertices.capacity() * sizeof(BlockVertex) +
         mesh->triangles.capacity() * sizeof(uint16_t) +
         mesh->colours.capacity() * sizeof(VertexColour);
}

bool BlockMesher::isShownMeshOutdated(int32_t slot) const {
  const SlotState& state = state_[slot];
  if (has_colours_ && state.shown != nullptr && state.shown->colours.empty()) return true;
  for (int n = 0; n < kBlocksAround; ++n) {
    const int32_t beside = table_.find(packKey(table_.block(slot).key + aroundOffset(n)));
    if (beside < 0) continue;
    const SlotState& other = state_[beside];
    if (other.changed >= state.made || other.repainted >= state.made) return true;
    if (other.indexed > state.made) return true;
  }
  return false;
}

void BlockMesher::show(int32_t slot, std::unique_ptr<const BlockMesh> mesh) {
  SlotState& state = state_[slot];
  held_bytes_ += bytesOf(mesh.get()) - bytesOf(state.shown.get());  // correct even if it wraps
  state.shown = std::move(mesh);
  state.made = indexings_;
}

const BlockMesh* BlockMesher::viewMesh(int32_t slot, BlockSurface& surface) {
  if (isShownMeshOutdated(slot)) {
    auto mesh = std::make_unique<BlockMesh>();
    const bool has_surface = makeSurface(slot, surface, false, *mesh);
    dropGaps(*mesh);
    mesh->colours = coloursOf(*mesh);
    if (!has_surface) mesh.reset();
    show(slot, std::move(mesh));
  }
  return state_[slot].shown.get();
}

std::vector<BlockMesh> BlockMesher::makeMeshes(const std::vector<int32_t>& slots) {
  const StageTimer timer(profile_, Stage::kMake);
  std::vector<BlockMesh> meshes(slots.size());
  parallelFor<BlockSurface>(slots.size(), threads_, [&](size_t i, BlockSurface& surface) {
    if (i + 1 < slots.size() && willReadVoxels(slots[i + 1])) {
      prefetchBlock(table_.block(slots[i + 1]), map_);
      if (has_colours_) prefetchColours(table_.block(slots[i + 1]), map_);
    }
    BlockMesh& mesh = meshes[i];
    if (renders_views_) show(slots[i], nullptr);
    if (refined_) state_[slots[i]].made = 0;  // views need the unrefined mesh
    if (!makeSurface(slots[i], surface, refined_, mesh)) return;
    dropGaps(mesh);
    mesh.colours = coloursOf(mesh);
    if (renders_views_ && !refined_) show(slots[i], std::make_unique<BlockMesh>(mesh));
  });
  // The loop above must not free vertices: willReadVoxels() may still read them in another thread.
  constexpr size_t kBlocksAtATime = 64;
  parallelFor<kBlocksAtATime>(slots.size(), threads_, [&](size_t i) {
    state_[slots[i]].vertices = std::vector<BlockVertex>();
    state_[slots[i]].normals = std::vector<Vec3f>();
  });
  return meshes;
}

void BlockMesher::sortByKey(std::vector<int32_t>& slots) const {
  std::vector<std::pair<PackedKey, int32_t>> by_key;
  by_key.reserve(slots.size());
  for (const int32_t slot : slots) by_key.push_back({packKey(table_.block(slot).key), slot});
  std::sort(by_key.begin(), by_key.end());
  for (size_t i = 0; i < slots.size(); ++i) slots[i] = by_key[i].second;
}

void BlockMesher::selectAround(const std::vector<int32_t>& changed, int count, Vec3i (*offset)(int),
                               std::vector<int32_t>& slots) {
  const StageTimer timer(profile_, Stage::kIndex);
  for (const int32_t slot : changed) {
    for (int n = 0; n < count; ++n) select(table_.block(slot).key + offset(n), slots);
  }
  sortByKey(slots);  // so that data shared by neighbours is likely to be cached
}

size_t BlockMesher::bytes() const {
  return state_.capacity() * sizeof(SlotState) + held_bytes_ +
         (dirty_.capacity() + painted_.capacity()) * sizeof(int32_t);
}

std::vector<BlockMesh> BlockMesher::takeChanges(const std::vector<int32_t>& slots,
                                                std::vector<BlockMesh>& meshes) {
  const StageTimer timer(profile_, Stage::kReturn);
  std::vector<BlockMesh> changes;
  changes.reserve(slots.size());
  for (size_t i = 0; i < slots.size(); ++i) {
    SlotState& state = state_[slots[i]];
    const bool has_mesh = !meshes[i].triangles.empty();
    if (has_mesh || state.has_mesh) changes.push_back(std::move(meshes[i]));
    state.has_mesh = has_mesh;
  }
  return changes;
}

MeshUpdate BlockMesher::update(int32_t min_evidence) {
  ++update_;
  min_evidence_ = min_evidence;
  const std::vector<int32_t> dirty = takeMarked(dirty_, state_, &SlotState::dirty);
  std::vector<int32_t> slots;  // at first, blocks whose units have a corner in a changed block
  selectAround(dirty, kUnitReach, unitReachOffset, slots);
  indexBlocks(slots, true);
  // Adds all neighbours of changed blocks, as their meshes depend on nearby voxels and labels. Then
  // adds blocks with vertices on edges that end at painted voxels.
  selectAround(dirty, kBlocksAround, aroundOffset, slots);
  if (has_colours_) {
    selectAround(takeMarked(painted_, state_, &SlotState::painted), kUnitReach, unitReachOffset,
                 slots);
  }
  std::vector<BlockMesh> meshes = makeMeshes(slots);
  return {takeChanges(slots, meshes)};
}

}  // namespace dtsdf
