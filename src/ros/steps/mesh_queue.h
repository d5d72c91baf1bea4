/// The queue of mesh changes from the map thread to the output thread.
#pragma once

#include <ros/time.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"
#include "page/paged_meshes.h"

namespace dtsdf {

/// Changes to the mesh since the last take(), to be applied in the order of the members.
struct MeshChanges {
  bool cleared = false;   ///< Whether all blocks were removed first.
  bool is_whole = false;  ///< Whether `blocks` is the whole mesh; all other blocks were removed.
  float voxel_size_m = 0.0f;            ///< Voxel size of the map, if `cleared`.
  std::vector<SharedBlockMesh> blocks;  ///< Replaced blocks, in any order.
  ros::Time stamp;                      ///< Stamp of the newest frame in the mesh; zero if none.
};

/// Thread-safe. Keeps only the newest change of each block, so that no block is queued twice.
class MeshQueue {
 public:
  /// `on_change` is called after each change, by the thread that made it.
  explicit MeshQueue(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

  void add(MeshUpdate update, const ros::Time& stamp) {
    if (update.blocks.empty()) return;
    change([&] {
      for (BlockMesh& block : update.blocks) {
        const PackedKey key = packKey(block.key);
        blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
      }
      changes_.stamp = stamp;
    });
  }

  /// Replaces the whole mesh. The reader finds the changed blocks with differences().
  void replaceAll(const std::map<PackedKey, SharedBlockMesh>& mesh, const ros::Time& stamp) {
    change([&] {
      changes_.is_whole = true;
      blocks_ = {mesh.begin(), mesh.end()};
      changes_.stamp = stamp;
    });
  }

  /// Removes the whole mesh. A map with this voxel size begins.
  void clear(float voxel_size_m) {
    change([&] {
      changes_ = {true, false, voxel_size_m, {}, {}};
      blocks_.clear();
    });
  }

  MeshChanges take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    MeshChanges changes = std::exchange(changes_, {});
    changes.blocks.reserve(blocks_.size());
    for (auto& [key, block] : blocks_) changes.blocks.push_back(std::move(block));
    blocks_.clear();
    return changes;
  }

 private:
  template <class Change>
  void change(const Change& change) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      change();
    }
    on_change_();
  }

  std::function<void()> on_change_;
  std::mutex mutex_;
  MeshChanges changes_;  ///< All but `blocks`, which blocks_ holds until take().
  std::unordered_map<PackedKey, SharedBlockMesh> blocks_;
};

/// Returns the blocks of `mesh` that `store` lacks or contains in a different version, and an empty
/// block for each block that is only in `store`.
inline std::vector<SharedBlockMesh> differences(const MeshStore& store,
                                                std::vector<SharedBlockMesh> mesh) {
  std::vector<SharedBlockMesh> differing;
  std::unordered_set<PackedKey> kept;
  for (SharedBlockMesh& block : mesh) {
    const PackedKey key = packedKeyOf(block->key);
    kept.insert(key);
    const auto before = store.blocks().find(key);
    const bool is_same = before == store.blocks().end() ? block->triangles.empty()
                                                        : areSame(*before->second, *block);
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
