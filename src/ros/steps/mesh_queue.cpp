#include "ros/steps/mesh_queue.h"

#include <cstring>
#include <memory>
#include <unordered_set>
#include <utility>

#include "kernels/core/grid.h"

namespace dtsdf {

MeshQueue::MeshQueue(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

template <class Change>
void MeshQueue::change(const Change& change) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    change();
  }
  on_change_();
}

void MeshQueue::add(MeshUpdate update, const ros::Time& stamp) {
  if (update.blocks.empty()) return;
  change([&] {
    for (BlockMesh& block : update.blocks) {
      const PackedKey key = packKey(block.key);
      blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
    }
    changes_.stamp = stamp;
  });
}

void MeshQueue::replaceAll(const std::map<PackedKey, SharedBlockMesh>& mesh,
                           const ros::Time& stamp) {
  change([&] {
    changes_.is_whole = true;
    blocks_ = {mesh.begin(), mesh.end()};
    changes_.stamp = stamp;
  });
}

void MeshQueue::clear(std::optional<float> voxel_size_m) {
  change([&] {
    changes_ = {true, false, voxel_size_m ? voxel_size_m : changes_.voxel_size_m, {}, {}};
    blocks_.clear();
  });
}

MeshChanges MeshQueue::take() {
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
    auto empty = std::make_shared<BlockMesh>();
    empty->key = block->key;
    differing.push_back(std::move(empty));
  }
  return differing;
}

}  // namespace dtsdf
