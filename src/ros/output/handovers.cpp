#include "ros/output/handovers.h"

#include <cstring>
#include <limits>
#include <memory>
#include <unordered_set>
#include <utility>

#include "kernels/core/grid.h"

namespace dtsdf {

MeshHandover::MeshHandover(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

void MeshHandover::add(MeshUpdate update, const ros::Time& stamp) {
  if (update.blocks.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (BlockMesh& block : update.blocks) {
      const PackedKey key = packKey(block.key);
      blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
    }
    changes_.stamp = stamp;
  }
  on_change_();
}

void MeshHandover::replaceAll(std::map<PackedKey, BlockMesh> mesh, const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    changes_.is_whole = true;
    blocks_.clear();
    for (auto& entry : mesh) {
      blocks_[entry.first] = std::make_shared<const BlockMesh>(std::move(entry.second));
    }
    changes_.stamp = stamp;
  }
  on_change_();
}

void MeshHandover::clear(std::optional<float> voxel_size_m) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!voxel_size_m) voxel_size_m = changes_.voxel_size_m;
    changes_ = {true, false, voxel_size_m, {}, {}};
    blocks_.clear();
  }
  on_change_();
}

MeshChanges MeshHandover::take() {
  decltype(blocks_) blocks;
  MeshChanges changes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(changes, changes_);
    blocks.swap(blocks_);
  }
  changes.blocks.reserve(blocks.size());
  for (auto& [key, block] : blocks) changes.blocks.push_back(std::move(block));
  return changes;
}

namespace {

template <class T>
bool isSame(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::has_unique_object_representations_v<T> || sizeof(T) == 16, "no padding");
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool isSame(const BlockMesh& a, const BlockMesh& b) {
  return isSame(a.vertices, b.vertices) && isSame(a.triangles, b.triangles) &&
         isSame(a.colours, b.colours);
}

}  // namespace

std::vector<SharedBlockMesh> differences(const MeshStore& store,
                                         std::vector<SharedBlockMesh> mesh) {
  std::vector<SharedBlockMesh> differing;
  std::unordered_set<PackedKey> kept;
  for (SharedBlockMesh& block : mesh) {
    const PackedKey key = packedKeyOf(block->key);
    kept.insert(key);
    const auto before = store.blocks().find(key);
    const bool is_shown = before != store.blocks().end();
    const bool is_same = is_shown ? isSame(*before->second, *block) : block->triangles.empty();
    if (!is_same) differing.push_back(std::move(block));
  }
  for (const auto& [key, block] : store.blocks()) {
    if (kept.count(key) > 0) continue;
    auto gone = std::make_shared<BlockMesh>();
    gone->key = block->key;
    differing.push_back(std::move(gone));
  }
  return differing;
}

SpaceChanges changesBetween(const KnownSpace& before, const std::vector<SpaceCube>& now) {
  std::unordered_map<PackedKey, SpaceCube> gone;
  constexpr int32_t kLowest = std::numeric_limits<int32_t>::min(),
                    kHighest = std::numeric_limits<int32_t>::max();
  for (const SpaceCube& cube : before.cubes(kLowest, kHighest)) {
    gone.emplace(packKey(SpaceCube::cubeOf(cube.first)), cube);
  }
  SpaceChanges changes;
  for (const SpaceCube& cube : now) {
    const auto same = gone.find(packKey(SpaceCube::cubeOf(cube.first)));
    const bool is_known = same != gone.end();
    if (!is_known || same->second.free != cube.free || same->second.surface != cube.surface) {
      changes.cubes.push_back(cube);
    }
    if (is_known) gone.erase(same);
  }
  for (const auto& [key, cube] : gone) changes.cubes.push_back({cube.first, {}, {}});
  return changes;
}

void SpaceHandover::add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (changes.begins_anew) {
      begins_anew_ = true;
      cubes_.clear();
    }
    for (const SpaceCube& cube : changes.cubes) {
      cubes_[packKey(SpaceCube::cubeOf(cube.first))] = cube;
    }
    has_changes_ = true;
    cell_size_m_ = cell_size_m;
    stamp_ = stamp;
  }
  on_change_();
}

bool SpaceHandover::isFull() const {
  constexpr size_t kMostWaiting = size_t{1} << 15;  // cubes: some megabytes
  const std::lock_guard<std::mutex> lock(mutex_);
  return cubes_.size() >= kMostWaiting;
}

void SpaceHandover::clear() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (cell_size_m_ == 0.0) return;  // nothing was ever known
    cubes_.clear();
    has_changes_ = begins_anew_ = true;
    stamp_ = ros::Time();
  }
  on_change_();
}

std::optional<SpaceDelivery> SpaceHandover::take() {
  SpaceDelivery delivery;
  decltype(cubes_) cubes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!std::exchange(has_changes_, false)) return std::nullopt;
    delivery.changes.begins_anew = std::exchange(begins_anew_, false);
    delivery.cell_size_m = cell_size_m_;
    delivery.stamp = stamp_;
    cubes.swap(cubes_);
  }
  delivery.changes.cubes.reserve(cubes.size());
  for (const auto& [key, cube] : cubes) delivery.changes.cubes.push_back(cube);
  return delivery;
}

}  // namespace dtsdf
