/// The queue of mesh changes from the map thread to the output thread.
#pragma once

#include <ros/time.h>

#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
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
  float voxel_size_m = 0.0f;                              ///< Voxel size of the map, if `cleared`.
  std::unordered_map<PackedKey, SharedBlockMesh> blocks;  ///< Replaced blocks.
  ros::Time stamp;  ///< Stamp of the newest frame in the mesh; zero if none.
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
        changes_.blocks[key] = std::make_shared<const BlockMesh>(std::move(block));
      }
      changes_.stamp = stamp;
    });
  }

  /// Replaces the whole mesh.
  void replaceAll(const std::map<PackedKey, SharedBlockMesh>& mesh, const ros::Time& stamp) {
    change([&] {
      changes_.is_whole = true;
      changes_.blocks = {mesh.begin(), mesh.end()};
      changes_.stamp = stamp;
    });
  }

  /// Removes the whole mesh. A map with this voxel size begins.
  void clear(float voxel_size_m) {
    change([&] { changes_ = {true, false, voxel_size_m, {}, {}}; });
  }

  MeshChanges take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(changes_, {});
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
  MeshChanges changes_;
};

/// Applies changes to `meshes`. Afterwards, `changes` contains only blocks that differ from before,
/// with an empty block for each removed one.
inline void apply(MeshChanges& changes, PagedMeshes& meshes) {
  auto& blocks = changes.blocks;
  if (changes.cleared) meshes.clear(changes.voxel_size_m);
  const auto before = changes.is_whole ? meshes.keys() : std::vector<PackedKey>();
  for (const PackedKey key : before) {
    blocks.try_emplace(key, std::make_shared<BlockMesh>(BlockMesh{unpackKey(key), {}, {}, {}}));
  }
  for (auto it = blocks.begin(); it != blocks.end();) {
    it = meshes.put(it->second) ? std::next(it) : blocks.erase(it);
  }
}

}  // namespace dtsdf
