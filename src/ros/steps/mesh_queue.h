/// The queue from the map's thread to the output's: what changed in the mesh.
#pragma once

#include <ros/time.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"

namespace dtsdf {

/// What has happened to the mesh since it was last asked for, in the order of its members.
struct MeshChanges {
  bool cleared = false;                 ///< First, the whole mesh was forgotten.
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

  /// @param is_another Whether the update is of another map, whose mesh is nothing but that.
  void add(MeshUpdate update, const ros::Time& stamp, bool is_another = false) {
    if (update.blocks.empty() && !is_another) return;
    change([&] {
      if (is_another) forget();
      for (BlockMesh& block : update.blocks) {
        const PackedKey key = packKey(block.key);
        blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
      }
      changes_.stamp = stamp;
    });
  }

  /// A new map that takes the place of the old one may have voxels of another size.
  void clear(std::optional<float> voxel_size_m = std::nullopt) {
    change([&] {
      forget();
      if (voxel_size_m) changes_.voxel_size_m = voxel_size_m;
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
  void forget() {
    changes_ = {true, changes_.voxel_size_m, {}, {}};
    blocks_.clear();
  }

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

}  // namespace dtsdf
