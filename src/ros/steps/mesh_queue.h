/// The queue from the map's thread to the output's: what changed in the mesh.
#pragma once

#include <ros/time.h>

#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"

namespace dtsdf {

/// What has happened to the mesh since it was last asked for, in the order of its members.
struct MeshChanges {
  bool cleared = false;                 ///< First, the whole mesh was forgotten.
  bool is_whole = false;                ///< Or all of it but `blocks` was forgotten.
  std::optional<float> voxel_size_m;    ///< Size from there on, if the map is a new one.
  std::vector<SharedBlockMesh> blocks;  ///< Then these were replaced, in no order.
  ros::Time stamp;                      ///< Stamp of the newest frame in them; zero if none.
};

/// Thread safe. Changes of one block become one, so that an output that stands still costs one mesh
/// of the map and no more; handing over costs what changed, not what there is.
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

  /// The whole mesh, by packed key, of a map that is another one in part. Whoever follows compares
  /// it with what there was, and takes what differs.
  void replaceAll(const std::map<PackedKey, SharedBlockMesh>& mesh, const ros::Time& stamp) {
    change([&] {
      changes_.is_whole = true;
      blocks_ = {mesh.begin(), mesh.end()};
      changes_.stamp = stamp;
    });
  }

  /// A new map that takes the place of the old one may have voxels of another size.
  void clear(std::optional<float> voxel_size_m = std::nullopt) {
    change([&] {
      changes_ = {true, false, voxel_size_m ? voxel_size_m : changes_.voxel_size_m, {}, {}};
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
  MeshChanges changes_;  ///< Without its blocks.
  std::unordered_map<PackedKey, SharedBlockMesh> blocks_;
};

/// The blocks of a mesh that a store does not have, or has in other bytes; and those that only the
/// store has, without triangles.
inline std::vector<SharedBlockMesh> differences(const MeshStore& store,
                                                std::vector<SharedBlockMesh> mesh) {
  const auto isSame = [](const auto& a, const auto& b) {  // none of them has padding
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
  };
  std::vector<SharedBlockMesh> differing;
  std::unordered_set<PackedKey> kept;
  for (SharedBlockMesh& block : mesh) {
    const PackedKey key = packedKeyOf(block->key);
    kept.insert(key);
    const auto before = store.blocks().find(key);
    const bool is_same = before == store.blocks().end()
                             ? block->triangles.empty()
                             : isSame(before->second->vertices, block->vertices) &&
                                   isSame(before->second->triangles, block->triangles) &&
                                   isSame(before->second->colours, block->colours);
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
